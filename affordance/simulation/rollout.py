"""The brute-force check of inner simulation: the arm really moved, under densities that it knows."""

import dataclasses
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.belief.material_memory import MaterialMemory
from affordance.choice.motion_cost import measure_cost
from affordance.choice.reach import Reach
from affordance.objects.colour import Colour
from affordance.objects.tool import Tool
from affordance.settings import Settings
from affordance.simulation.trial import finish, get_runner
from affordance.simulation.trial_record import TrialRecord


class Rollout(NamedTuple):
    """What a simulated motion cost.

    Attributes:
        work: Absolute work of the joints, [J].
        effort: Integral of |tau|^2 dt, [N^2 m^2 s].
        path: Where the free end went, p_WF at every control period, (N, 3), [m].
        reference: Where it was to go, (N, 3), [m].
        record: The motion, one row a control period.
    """

    work: float
    effort: float
    path: Array
    reference: Array
    record: TrialRecord

    @property
    def error(self) -> float:
        """Largest distance of the free end from where it was to be at that time, [m]."""
        return float(np.linalg.norm(self.path - self.reference, axis=1).max())


def roll_out(tool: Tool, task: Reach, densities: Mapping[Colour, float], settings: Settings) -> Rollout:
    """Simulates a task with a tool whose densities are known.

    Args:
        tool: The tool as it is gripped.
        task: What is to be done.
        densities: True density of what shows a colour, [kg/m^3].
        settings: Those of all simulations; only the log is kept at every control period.
    """
    every_tick = dataclasses.replace(settings, log_period=settings.control_period)
    tool = tool.with_densities(densities)
    runner = get_runner(every_tick)
    trial = runner.get_diagram(task.duration, tool)
    following = task.begin(trial.model, tool.p_TTfree)
    memory = MaterialMemory.from_densities(densities)
    record = finish(trial, runner.prepare(trial, tool, following, memory, seed=0), tool)
    p_WF = trial.chain.compute_positions(record.q, tool.p_TTfree)
    work, effort = measure_cost(record.tau, record.v, settings.control_period)
    return Rollout(work, effort, p_WF, following.list_places(record.times), record)
