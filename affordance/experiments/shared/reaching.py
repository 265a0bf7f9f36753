"""Presentation in which the free end of an object is moved along a path, under the current belief."""

from dataclasses import replace
from typing import Any

import numpy as np

from affordance.belief.object_belief import Memory
from affordance.choice.motion_cost import measure_cost
from affordance.choice.reach import Reach
from affordance.objects.tool import Tool
from affordance.simulation.trial import TrialRunner, get_runner
from affordance.simulation.trial_record import TrialRecord


def present_reach(
    runner: TrialRunner, tool: Tool, task: Reach, memory: Memory, seed: tuple[int, ...]
) -> tuple[TrialRecord, dict[str, Any]]:
    """Simulates a reach.

    Args:
        runner: Runner of the trial.
        tool: Object, as it is gripped.
        task: Path to follow.
        memory: Memory before the presentation.
        seed: Seed of every random draw.

    Returns: Record of the motion; and ``work``, [J], and ``path_error``, the largest distance of the free end from
        the path, [m].
    """
    settings = runner.settings
    runner = get_runner(replace(settings, log_period=settings.control_period))  # work is a sum over them
    trial = runner.get_diagram(task.duration, tool)
    following = task.begin(trial.model, tool.p_TTfree)
    record = runner.run(tool, following, memory, duration=task.duration, seed=seed)
    error = trial.chain.compute_positions(record.q, tool.p_TTfree) - following.list_places(record.times)
    work, _ = measure_cost(record.tau, record.v, settings.control_period)
    return record, {"work": work, "path_error": float(np.linalg.norm(error, axis=1).max())}
