"""Simulates reaching with known densities in Drake, as a check of inner simulation."""

import dataclasses
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.belief.material_memory import MaterialMemory
from affordance.choice.motion_cost import measure_cost
from affordance.choice.reach import Reach
from affordance.control.timed_path import TimedPath
from affordance.exceptions import AffordanceError
from affordance.objects.colour import Colour
from affordance.objects.tool import Tool, list_densities
from affordance.settings import Settings
from affordance.simulation.trial import get_runner
from affordance.simulation.trial_record import TrialRecord


class Rollout(NamedTuple):
    """Simulated reaching motion and its cost."""

    work: float  # absolute work of the joints, [J]
    effort: float  # integral of |tau|^2 dt, [N^2 m^2 s]
    path: Array  # position of the free end in W for each control period, (N, 3), [m]
    reference: Array  # reference positions of the free end, (N, 3), [m]
    record: TrialRecord  # record of the motion, one row per control period

    @property
    def error(self) -> float:
        """Largest distance between the free end and its reference at the same time, [m]."""
        return float(np.linalg.norm(self.path - self.reference, axis=1).max())


def roll_out(tool: Tool, task: Reach, densities: Mapping[Colour, float], settings: Settings) -> Rollout:
    """Simulates reaching with a gripped tool of known densities, [kg/m^3]."""
    tool, memory = tool.with_densities(densities), MaterialMemory.from_densities(densities)
    runner = get_runner(dataclasses.replace(settings, log_period=settings.control_period))
    trial = runner.get_diagram(tool)
    following = task.begin(trial.model, tool.p_TTfree)
    record = runner.run(tool, following, memory, duration=task.duration, seed=0)
    p_WF = trial.chain.compute_positions(record.q, tool.p_TTfree)
    work, effort = measure_cost(record.tau, record.v, settings.control_period)
    return Rollout(work, effort, p_WF, following.list_places(record.times), record)


def describe_path_fault(tool: Tool, path: TimedPath, settings: Settings) -> str:
    """Describes why a tool with known densities does not follow a path in simulation; empty if it does."""
    try:
        rollout = roll_out(tool, Reach(path), list_densities([tool]), settings)
    except AffordanceError as error:
        return str(error)
    missed = path.describe_error(rollout.error)
    return f"{tool.name} by {tool.grip}, simulated, {missed}" if missed else ""
