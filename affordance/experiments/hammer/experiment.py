"""Simulation IV (paper, IV-D): choosing a grip for hammering.

Observers hold the objects of Simulation II, and after every trial choose which end of a novel tool to hold so that
driving a nail with a demanded peak force takes the least work. They never hold it. Which grip really is the cheaper
one is found by simulating both blows with the true densities, contact included.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from affordance.choice.hammer import Hammer, load_hammer
from affordance.choice.inner_simulation import Choice
from affordance.control.start_posture import check_start
from affordance.experiments.agreement import save_choices
from affordance.experiments.definition import Arrays, Outputs
from affordance.experiments.hammer.drawings import (
    draw_start_and_strike,
    draw_work_map,
    label_blows,
    write_slow_replay,
)
from affordance.experiments.hammer.measures import (
    count_light_ends,
    measure_blows,
    measure_crossovers,
    measure_demand,
    measure_swings,
    measure_yielding,
)
from affordance.experiments.hammer.plan import HammerPlan, plan_hammer
from affordance.experiments.hammer.study import HammerStudy, study_blows
from affordance.experiments.shared.correct_grip import find_cheaper_grip, find_grip_of_densest, remove_errors
from affordance.experiments.shared.decisions import label_choices, let_observer_choose
from affordance.experiments.shared.experience import Experience, ExperienceConfig
from affordance.experiments.shared.gain_experience import collect_experience
from affordance.experiments.shared.novel_tools import load_subjects
from affordance.experiments.shared.proportions import compute_proportions, describe_tools, draw_proportions
from affordance.experiments.shared.trajectories import label_motions
from affordance.files.model_folder import MODELS
from affordance.files.netcdf import Trajectories
from affordance.objects.tool import Tool
from affordance.plant.arm import load_arm
from affordance.reporting.blow_figures import draw_blow
from affordance.settings import DEFAULT_SETTINGS, Settings
from affordance.simulation.trial import get_runner


class PlanAndStudy(NamedTuple):
    """What all observers share, and what is studied of the first tool beside."""

    blows: HammerPlan
    study: HammerStudy


@dataclass(frozen=True)
class HammerExperiment:
    """Simulation IV.

    Attributes:
        experience: The objects that are held, and how they are learned.
        novel: The tools that are chosen about; the first is the paper's.
        task: The blow.
        models: The folder that they are from.
    """

    experience: ExperienceConfig
    novel: tuple[Tool, ...]
    task: Hammer
    models: Path

    name = "hammer"
    unit = "observer"
    section = Path(__file__).parents[1] / "sections" / "hammer.yaml"

    @property
    def tools_observed(self) -> tuple[Tool, ...]:
        """The novel tools."""
        return self.novel

    @property
    def seed(self) -> int:
        """Root of every random draw."""
        return self.experience.seed

    @property
    def settings(self) -> Settings:
        """What all simulations share."""
        return self.experience.settings

    def with_settings(self, settings: Settings) -> "HammerExperiment":
        """Returns the experiment with other settings."""
        return replace(self, experience=replace(self.experience, settings=settings))

    def count_repeats(self, observers: int) -> int:
        """One repeat an observer."""
        return observers

    def plan(self, jobs: int) -> "PlanAndStudy":
        """Plans and simulates the blows; see ``plan_hammer``."""
        plan = plan_hammer(self.novel, self.task, self.settings, self.seed, self.models, jobs=jobs)
        first, exact = self.novel[0], remove_errors(self.settings)
        costs, simulated = plan.costs[first.name], plan.simulated[first.name]
        return PlanAndStudy(plan, study_blows(first, self.task, exact, costs, simulated, jobs=jobs))

    def gain_experience(self, folder: Path, *, repeats: int, jobs: int) -> Experience:
        """Lets observers hold the objects of Simulation II."""
        return collect_experience(self.experience, folder, repeats=repeats, jobs=jobs)

    def select_shared(self, plan: PlanAndStudy) -> list[Choice]:
        """The choices."""
        return list(plan.blows.choices.values())

    def run_observer(self, shared: list[Choice], experience: Experience | None, repeat: int) -> Arrays:
        """Lets an observer choose before the first and after each trial; see ``let_observer_choose``."""
        assert experience is not None  # the experiment has one
        return let_observer_choose(shared, experience, self.seed, repeat)

    def compute_metrics(self, plan: PlanAndStudy, experience: Experience | None, arrays: Arrays) -> dict[str, Any]:
        """Computes the numbers of metrics.json."""
        first, *others = self.novel
        simulated = plan.blows.simulated[first.name]
        correct = {name: find_cheaper_grip(blows) for name, blows in plan.blows.simulated.items()}
        of_headed = measure_blows(plan.blows.simulated[others[0].name], "_headed_tool") if others else {}
        return {
            **compute_proportions(
                self.novel,
                plan.blows.choices,
                arrays,
                self.experience,
                correct=correct,
                simulated=plan.blows.simulated,
                off_axis=plan.blows.off_axis,
            ),
            "force_ratios": [
                blow.force / self.task.force for blows in plan.blows.simulated.values() for blow in blows.values()
            ],
            "density_true": {part.material.name: part.material.density for part in first.components},
            **measure_blows(simulated),
            **of_headed,
            **measure_demand(self.task, first, plan.blows.costs[first.name]),
            **measure_crossovers(plan.study.crossovers, plan.study.checked, plan.study.map.forces),
            "swings": measure_swings(plan.study.swings),
            "yielding_nail": measure_yielding(plan.study.yielding),
            "p_light_end_held": count_light_ends(
                first, plan.blows.costs[first.name], self.experience, remove_errors(self.settings)
            ),
        }

    def list_facts(self, plan: PlanAndStudy, numbers: Mapping[str, Any]) -> dict[str, Any]:
        """Names of tools and grips, and what the nail is."""
        nail = self.task.nail
        return {
            **describe_tools(self.novel, numbers),
            "grip_of_densest_far": find_grip_of_densest(self.novel[0], at_hand=False),
            "nail_stiffness": nail.stiffness,
            "depth_set": nail.depth_set,
        }

    def show(
        self, plan: PlanAndStudy, experience: Experience | None, arrays: Arrays, numbers: Mapping[str, Any]
    ) -> Outputs:
        """Figures 9 and 10, the blow, the map, trajectories, Diagram and replay."""
        first, arm = self.novel[0], self.settings.arm
        blows, correct = plan.blows.simulated[first.name], numbers["correct_grip"]
        strike = blows[correct].strike
        duration = strike.compute_duration(self.settings.mpc.horizon)
        trial = get_runner(self.settings).get_diagram(duration, first.list_gripped()[correct], strike.placement)
        records = {f"held by {grip}": blow.nail for grip, blow in blows.items()}
        title = "Choosing a grip for hammering"
        return Outputs(
            figures={
                "figure9": partial(draw_start_and_strike, arm, first, blows),
                "figure10": partial(draw_proportions, self.novel, numbers, title, len(arrays["bayes"])),
                "blow": partial(draw_blow, records, force_demanded=self.task.force),
                "map": partial(draw_work_map, plan.study.map, plan.study.densities, first, self.task.force),
            },
            trajectories=Trajectories(
                {
                    **label_choices(arrays),
                    **label_blows(list(blows.values()), plan.study.map, plan.study.densities),
                    **label_motions([blow.record for blow in blows.values()], "simulated, true densities"),
                },
                {
                    "trial": list(blows),
                    "joint": trial.arm.joint_names,
                    "tool": [tool.name for tool in self.novel],
                },
            ),
            diagram=lambda: trial.diagram,
            replay=lambda path: write_slow_replay(path, arm, first, blows),
            writers={
                "choices": partial(
                    save_choices,
                    novel=self.novel,
                    choices=plan.blows.choices,
                    chosen=arrays["paper"],
                    numbers=numbers,
                    settings=self.settings,
                    seed=self.seed,
                )
            },
        )


def load(models: Path = MODELS, seed: int = 0, settings: Settings = DEFAULT_SETTINGS) -> HammerExperiment:
    """Reads objects, tools and nail from a folder of models.

    Raises:
        BadValueError: A file is wrong, or the objects do not make this experiment.
        ModelFileError: The arm's file cannot be loaded or does not describe a fit arm.
    """
    file = models / "nail.yaml"
    task = load_hammer(file)
    check_start(file, "blow.start", task.start, load_arm(settings.arm))
    experience, novel = load_subjects(models, seed, settings, task.start)
    return HammerExperiment(experience, novel, task, models)
