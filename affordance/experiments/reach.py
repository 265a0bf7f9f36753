"""Simulation III (paper, IV-C): choosing a grip for moving the free end of a tool along a path with least work."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from affordance.choice.motion_cost import MotionCost
from affordance.choice.reach import Reach
from affordance.experiments.definition import Outputs
from affordance.experiments.shared.choice_task import ChoicePlan, ChoiceTask
from affordance.experiments.shared.decisions import find_grip_of_densest
from affordance.experiments.shared.experience import ExperienceConfig
from affordance.files.netcdf import LabelledArray, Trajectories
from affordance.objects.colour import Colour
from affordance.objects.tool import Tool, find_free_end
from affordance.plant.arm_model import ArmModel
from affordance.plant.load import load_arm
from affordance.reporting import figures
from affordance.reporting.formatting import label
from affordance.reporting.object_drawings import Drawing, draw_objects
from affordance.reporting.replay import Scene, write_replay
from affordance.settings import Settings
from affordance.simulation.diagram import TrialDiagram
from affordance.simulation.rollout import Rollout, roll_out
from affordance.simulation.trial import get_runner


@dataclass(frozen=True)
class Reaching(ChoiceTask):
    """Choice of a grip for following a path."""

    task: Reach

    name = "reach"
    simulations = "simulations"
    key = "points"
    failure = "cannot be followed"
    figure = ("figure8", "Choosing a grip for reaching")
    names = ("path_error_m", "duration", "grip_of_densest")

    def simulate(self, held: Tool, cost: Any, densities: Mapping[Colour, float], settings: Settings) -> Rollout:
        """Simulates following the path."""
        return roll_out(held, self.task, densities, settings)

    def describe_error(self, simulated: Rollout, tool: str, grip: str, settings: Settings) -> str:
        """Describes by how much the free end leaves the path."""
        problem = self.task.path.describe_error(simulated.error)
        return problem and f"{self.failure}: {tool} by {grip} {problem}"

    def compute_work(self, settings: Settings, costs: Mapping[str, Mapping[str, Any]], held: Tool) -> float:
        """Plans the task with a gripped tool, and returns its work, [J]."""
        cost = _plan_reach(self.task, settings, tuple(find_free_end(held.components).tolist()))
        return float(cost.compute(held.parameters[None]).work[0])

    def measure(self, novel: Sequence[Tool], config: ExperienceConfig, plan: ChoicePlan) -> dict[str, Any]:
        """Computes cost and outcome of the task with the first tool, by grip."""
        simulated = plan.simulated[novel[0].name]
        return {
            "energy_true": {grip: rollout.work for grip, rollout in simulated.items()},
            "effort_true": {grip: rollout.effort for grip, rollout in simulated.items()},
            "periods_limited": {grip: rollout.record.counts.limited for grip, rollout in simulated.items()},
            "path_error_m": {grip: rollout.error for grip, rollout in simulated.items()},
        }

    def list_facts(self, tool: Tool) -> dict[str, Any]:
        """Returns the duration, and the grip with the densest material nearest to the hand."""
        return {"duration": self.task.duration, "grip_of_densest": find_grip_of_densest(tool, at_hand=True)}

    def get_trial(self, settings: Settings, held: Tool, simulated: Rollout) -> TrialDiagram:
        """Returns the Diagram of the task."""
        return get_runner(settings).get_diagram(self.task.duration, held)

    def show(self, novel: Sequence[Tool], arm: Path, plan: ChoicePlan, numbers: Mapping[str, Any]) -> Outputs:
        """Returns figure 7, the paths, and the replay."""
        first = novel[0]
        simulated, held = plan.simulated[first.name], first.list_gripped()
        scenes = [
            Scene(
                held[grip],
                rollout.record.times,
                rollout.record.q,
                f"held by {grip}: absolute work {rollout.work:.1f} J",
            )
            for grip, rollout in simulated.items()
        ]
        path, title = simulated[numbers["correct_grip"]].reference, f"Simulation III: {first.name}"
        paths = {f"held by {grip}": rollout.path for grip, rollout in simulated.items()}
        reference = next(iter(simulated.values())).reference
        stacked = np.stack([done.path for done in simulated.values()])
        return Outputs(
            figures={
                "figure7": partial(_draw_tools, novel),
                "path": partial(figures.draw_paths, reference, paths),
            },
            trajectories=Trajectories(
                {
                    "p_WF": LabelledArray(("trial", "time", "axis"), stacked, "m", "where the free end went"),
                    "p_WF_reference": LabelledArray(("time", "axis"), path, "m", "the path"),
                },
                {"axis": ["x", "y", "z"]},
            ),
            replay=lambda file: write_replay(file, arm, scenes, title=title, p_WG=path),
        )


def _draw_tools(tools: Sequence[Tool]) -> Figure:
    drawings = [
        Drawing(held, f"{label(tool.name)}, held by {label(grip)}")
        for tool in tools
        for grip, held in tool.list_gripped().items()
    ]
    return draw_objects(drawings, columns=2)


@lru_cache(maxsize=4)
def _plan_reach(task: Reach, settings: Settings, p_TF: tuple[float, float, float]) -> MotionCost:
    """Plans the motion of a free end, which all tools with that end share."""
    return task.build_cost_of_end(ArmModel(load_arm(settings.arm)), np.array(p_TF), settings)
