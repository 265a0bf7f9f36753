"""Simulation III (paper, IV-C): choosing a grip for reaching with a tool.

Observers hold the objects of Simulation II, and after every trial choose the end by which to hold a novel tool so
that moving its free end along a path takes the least absolute work. They never hold that tool. The grip that is truly
cheaper is found by simulating both with the true densities.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from affordance.choice.inner_simulation import Choice
from affordance.choice.motion_cost import MotionCost
from affordance.choice.reach import Reach
from affordance.exceptions import AffordanceError, BadValueError, SeeingError, UnavailableError, name_object
from affordance.experiments.definition import Arrays, Outputs
from affordance.experiments.shared.choosing import ChoiceExperiment
from affordance.experiments.shared.correct_grip import (
    check_one_grip_is_cheaper,
    find_grip_of_densest,
    remove_errors,
)
from affordance.experiments.shared.decisions import label_choices
from affordance.experiments.shared.experience import Experience
from affordance.experiments.shared.grip_choices import plan_choices
from affordance.experiments.shared.off_axis import measure_changes
from affordance.experiments.shared.proportions import describe_tools, draw_proportions
from affordance.experiments.shared.trajectories import label_motions
from affordance.files.netcdf import LabelledArray, Trajectories
from affordance.objects.tool import Tool, find_free_end, list_densities
from affordance.plant.arm_model import ArmModel
from affordance.plant.load import load_arm
from affordance.reporting import figures
from affordance.reporting.object_drawings import Drawing, draw_objects
from affordance.reporting.replay import Scene, write_replay
from affordance.runs.repeats import run_tasks
from affordance.settings import Settings
from affordance.simulation.rollout import Rollout, roll_out
from affordance.simulation.trial import get_runner


class ReachPlan(NamedTuple):
    """Plan that all observers share.

    Attributes:
        choices: Choice of a grip, by tool.
        simulated: Simulations of the task under the true densities, by tool and grip.
        off_axis: Largest relative change of the work if a part is shifted by 2 mm, by tool.
    """

    choices: Mapping[str, Choice]
    simulated: Mapping[str, Mapping[str, Rollout]]
    off_axis: Mapping[str, float]


@dataclass(frozen=True)
class ReachExperiment(ChoiceExperiment):
    """Experiment of Simulation III.

    Attributes:
        task: Path to follow.
    """

    task: Reach

    names_of_task = ("path_error_m", "duration", "grip_of_densest")

    def plan(self, jobs: int) -> ReachPlan:
        """Plans the choices, and simulates the task with every grip.

        Raises:
            BadValueError: The path cannot be followed, or no grip is cheaper than the other.
            SeeingError: The features cannot be extracted from a picture of a tool.
        """
        path = self.task_file
        try:
            choices = plan_choices(
                self.novel, self.task, self.settings, self.seed, jobs=jobs, description="reach: plans"
            )
            simulated = self.simulate(jobs)
        except (SeeingError, UnavailableError):  # not caused by the path
            raise
        except AffordanceError as error:
            raise BadValueError(path, "points", f"cannot be followed: {error}") from error
        for choice in choices.values():
            for option, cost in zip(choice.options, choice.cost_models, strict=True):
                if cost.infeasible_reason:
                    problem = f"cannot be followed: {name_object(option.name)} {cost.infeasible_reason}"
                    raise BadValueError(path, "points", problem)
        for tool in self.novel:
            for grip, rollout in simulated[tool.name].items():
                if problem := self.task.path.describe_error(rollout.error):
                    raise BadValueError(
                        path, "points", f"cannot be followed: {name_object(tool.name)} by {grip} {problem}"
                    )
            works = [rollout.work for rollout in simulated[tool.name].values()]
            check_one_grip_is_cheaper(self.novel_file, tool, works)
        work = partial(compute_reach_work, self.task, remove_errors(self.settings))
        off_axis = measure_changes(work, self.novel, jobs=jobs, description="reach: parts moved")
        return ReachPlan(choices, simulated, off_axis)

    def simulate(self, jobs: int) -> dict[str, dict[str, Rollout]]:
        """Simulates the task under the true densities with every grip of every tool."""
        exact = remove_errors(self.settings)
        held = {tool.name: tool.list_gripped() for tool in self.novel}
        tasks = [
            partial(roll_out, gripped, self.task, list_densities([tool]), exact)
            for tool in self.novel
            for gripped in held[tool.name].values()
        ]
        done = iter(run_tasks(tasks, jobs=jobs, description="reach: simulations"))
        return {name: {grip: next(done) for grip in grips} for name, grips in held.items()}

    def compute_metrics(self, plan: ReachPlan, experience: Experience | None, arrays: Arrays) -> dict[str, Any]:
        """Computes the numbers of metrics.json."""
        simulated = plan.simulated[self.novel[0].name]
        return {
            **self.compute_choice_metrics(plan, arrays),
            "energy_true": {grip: rollout.work for grip, rollout in simulated.items()},
            "effort_true": {grip: rollout.effort for grip, rollout in simulated.items()},
            "periods_limited": {grip: rollout.record.counts.limited for grip, rollout in simulated.items()},
            "path_error_m": {grip: rollout.error for grip, rollout in simulated.items()},
        }

    def list_facts(self, plan: ReachPlan, numbers: Mapping[str, Any]) -> dict[str, Any]:
        """Returns the names of tools and grips."""
        return {
            **describe_tools(self.novel, numbers),
            "duration": self.task.duration,
            "grip_of_densest": find_grip_of_densest(self.novel[0], at_hand=True),
        }

    def show(
        self, plan: ReachPlan, experience: Experience | None, arrays: Arrays, numbers: Mapping[str, Any]
    ) -> Outputs:
        """Returns figures 7 and 8, the paths, trajectories, Diagram and replay."""
        first = self.novel[0]
        simulated, held = plan.simulated[first.name], first.list_gripped()
        correct = numbers["correct_grip"]
        trial = get_runner(self.settings).get_diagram(self.task.duration, held[correct])
        scenes = [
            Scene(
                held[grip],
                rollout.record.times,
                rollout.record.q,
                f"held by {grip}: absolute work {rollout.work:.1f} J",
            )
            for grip, rollout in simulated.items()
        ]
        path, title = simulated[correct].reference, f"Simulation III: {first.name}"
        return Outputs(
            figures={
                "figure7": self._draw_tools,
                "figure8": partial(
                    draw_proportions, self.novel, numbers, "Choosing a grip for reaching", len(arrays["bayes"])
                ),
                "path": partial(
                    figures.draw_paths,
                    next(iter(simulated.values())).reference,
                    {f"held by {grip}": rollout.path for grip, rollout in simulated.items()},
                ),
            },
            trajectories=Trajectories(
                {
                    **label_choices(arrays),
                    "p_WF": LabelledArray(
                        ("trial", "time", "axis"),
                        np.stack([done.path for done in simulated.values()]),
                        "m",
                        "where the free end went",
                    ),
                    "p_WF_reference": LabelledArray(("time", "axis"), path, "m", "the path"),
                    **label_motions([done.record for done in simulated.values()], "simulated, true densities"),
                },
                {
                    "trial": list(simulated),
                    "joint": trial.arm.joint_names,
                    "axis": ["x", "y", "z"],
                    "tool": [tool.name for tool in self.novel],
                },
            ),
            diagram=lambda: trial.diagram,
            replay=lambda file: write_replay(file, self.settings.arm, scenes, title=title, p_WG=path),
            writers=self.list_writers(plan, experience, arrays, numbers),
        )

    def _draw_tools(self) -> Figure:
        drawings = [
            Drawing(held, f"{tool.name}, held by {grip}")
            for tool in self.novel
            for grip, held in tool.list_gripped().items()
        ]
        return draw_objects(drawings, columns=2)


def compute_reach_work(task: Reach, settings: Settings, held: Tool) -> float:
    """Plans the task with a gripped tool, and returns its work, [J]."""
    cost = _plan_reach(task, settings, tuple(find_free_end(held.components).tolist()))
    return float(cost.compute(held.parameters[None]).work[0])


@lru_cache(maxsize=4)
def _plan_reach(task: Reach, settings: Settings, p_TF: tuple[float, float, float]) -> MotionCost:
    """Plans the motion of a free end, which all tools with that end share."""
    return task.build_cost_of_end(ArmModel(load_arm(settings.arm)), np.array(p_TF), settings)
