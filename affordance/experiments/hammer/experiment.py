"""Simulation IV (paper, IV-D): choosing a grip for hammering.

Observers hold the objects of Simulation II, and after every trial choose the end by which to hold a novel tool so
that driving a nail with a demanded peak force takes the least absolute work. They never hold that tool. The grip that
is truly cheaper is found by simulating both blows with the true densities, contact included.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

from affordance.choice.hammer import Hammer
from affordance.experiments.definition import Arrays, Outputs
from affordance.experiments.hammer.drawings import (
    draw_start_and_strike,
    draw_work_map,
    label_blows,
    write_slow_replay,
)
from affordance.experiments.hammer.measures import (
    OF_BLOWS,
    count_light_ends,
    measure_blows,
    measure_crossovers,
    measure_demand,
    measure_swings,
    measure_yielding,
)
from affordance.experiments.hammer.plan import HammerPlan, plan_hammer
from affordance.experiments.hammer.study import HammerStudy, study_blows
from affordance.experiments.shared.choosing import ChoiceExperiment
from affordance.experiments.shared.correct_grip import find_grip_of_densest, remove_errors
from affordance.experiments.shared.decisions import label_choices
from affordance.experiments.shared.experience import Experience
from affordance.experiments.shared.proportions import describe_tools, draw_proportions
from affordance.experiments.shared.trajectories import label_motions
from affordance.files.netcdf import Trajectories
from affordance.reporting.blow_figures import draw_blow
from affordance.simulation.trial import get_runner


class PlanAndStudy(NamedTuple):
    """Plan that all observers share, and the study of the first tool."""

    blows: HammerPlan
    study: HammerStudy


@dataclass(frozen=True)
class HammerExperiment(ChoiceExperiment):
    """Experiment of Simulation IV.

    Attributes:
        task: Task of the blow.
    """

    task: Hammer

    names_of_task = (
        *OF_BLOWS,
        *("force_ratios", "force_demanded_N", "tip_speed", "energy_planned", "energy_at_equal_tip_speed"),
        *("tip_energy", "tip_energy_from_surface", "force_crossover_N", "force_crossover_reason"),
        *("force_crossovers_N", "force_crossover_checked", "swings", "yielding_nail", "p_light_end_held"),
        *("grip_of_densest_far", "nail_stiffness", "depth_set"),
    )
    names_of_second_tool = tuple(f"{name}_headed_tool" for name in OF_BLOWS)

    def plan(self, jobs: int) -> "PlanAndStudy":
        """Plans and simulates the blows; see ``plan_hammer``."""
        plan = plan_hammer(
            self.novel, self.task, self.settings, self.seed, self.task_file, self.novel_file, jobs=jobs
        )
        first, exact = self.novel[0], remove_errors(self.settings)
        costs, simulated = plan.costs[first.name], plan.simulated[first.name]
        return PlanAndStudy(plan, study_blows(first, self.task, exact, costs, simulated, jobs=jobs))

    def get_planned(self, plan: PlanAndStudy) -> HammerPlan:
        """Returns the choices and blows."""
        return plan.blows

    def compute_metrics(self, plan: PlanAndStudy, experience: Experience | None, arrays: Arrays) -> dict[str, Any]:
        """Computes the numbers of metrics.json."""
        first, *others = self.novel
        simulated = plan.blows.simulated[first.name]
        of_headed = measure_blows(plan.blows.simulated[others[0].name], "_headed_tool") if others else {}
        return {
            **self.compute_choice_metrics(plan, arrays),
            "force_ratios": [
                blow.force / self.task.force for blows in plan.blows.simulated.values() for blow in blows.values()
            ],
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
        """Returns the names of tools and grips, and the properties of the nail."""
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
        """Returns figures 9 and 10, the blow, the map, trajectories, Diagram and replay."""
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
            writers=self.list_writers(plan, experience, arrays, numbers),
        )
