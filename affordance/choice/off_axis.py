"""Computes the sensitivity of a task's work to the positions of tool parts.

If the sensitivity is large, for example near a singularity, choices depend more on positions than on materials.
"""

import contextlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from affordance.exceptions import AffordanceError
from affordance.objects.tool import Grip, Tool
from affordance.runs.repeats import run_tasks

# Displacement of the parts, [m].
SHIFT = 2e-3


def list_shifted(tool: Tool) -> Iterator[Tool]:
    """Yields copies of a tool in which one part is moved by SHIFT in either direction along an axis of T."""
    for index, part in enumerate(tool.components):
        for axis in range(3):
            for sign in (1.0, -1.0):
                X_TE = np.array(part.X_TE)
                X_TE[axis, 3] += sign * SHIFT
                parts = list(tool.components)
                parts[index] = replace(part, X_TE=X_TE)
                yield replace(tool, components=tuple(parts))


def measure_change(compute_work: Callable[[Tool], float], tool: Tool, grip: Grip) -> float:
    """Computes the largest relative change of work over shifted copies of a tool (``list_shifted``).

    Copies with which the task is impossible, for example because of a joint limit, are ignored.

    Args:
        compute_work: Function that computes the work with a gripped tool, [J].
        tool: Tool.
        grip: Grip of the tool.

    Raises:
        AffordanceError: The task is impossible with the unshifted tool.
    """
    work = compute_work(tool.gripped_by(grip))
    changes = [0.0]
    for shifted in list_shifted(tool):
        with contextlib.suppress(AffordanceError):
            changes.append(abs(compute_work(shifted.gripped_by(grip)) / work - 1.0))
    return max(changes)


def measure_changes(
    compute_work: Callable[[Tool], float], tools: Sequence[Tool], *, jobs: int, description: str
) -> dict[str, float]:
    """Computes the largest change of work (``measure_change``) over the grips of each tool, in parallel."""
    tasks = [partial(measure_change, compute_work, tool, grip) for tool in tools for grip in tool.grips]
    done = iter(run_tasks(tasks, jobs=jobs, description=description))
    return {tool.name: max(next(done) for _ in tool.grips) for tool in tools}
