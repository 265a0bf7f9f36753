"""Searches for a motion that identifies a payload precisely.

The best of many random motions are improved by a random local search.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.exceptions import AffordanceError
from affordance.extensions.payload.excitation.expectation import Aim, Expectation, Spread
from affordance.extensions.payload.excitation.planned_motion import (
    MotionFamily,
    compute_lowest,
    list_times,
)
from affordance.extensions.payload.posterior.log_cholesky import parameters_from_theta
from affordance.extensions.payload.recording.preparation import PreparedRun

# Number of random motions, number of the best motions that are improved, and number of changes tried on each. The
# result of a single start is often a fifth worse than the best of three.
NUM_DRAWS, NUM_STARTS, NUM_CHANGES = 200, 3, 400
# Initial step size, its factors after success and failure, and the share of numbers that each change affects.
_STEP, _LONGER, _SHORTER, _CHANGED = 0.5, 1.6, 0.9, 0.2
_LEAST_STEP = 0.02
_USED = 0.97  # usable share of each limit, because motions are compared at few samples
_OUTPUT_RATE = 50.0  # [Hz]


class MotionDesign(NamedTuple):
    """Result of the search for a motion."""

    motion: PreparedRun  # motion at 50 Hz, without a signal
    score: float  # score of the motion
    typical: float  # median score of the random motions


class NoMotionError(AffordanceError):
    """No motion respects the limits."""


def design_motion(
    expectation: Expectation,
    family: MotionFamily,
    aim: Aim,
    *,
    home: Array | None = None,
    num_draws: int = NUM_DRAWS,
    num_changes: int = NUM_CHANGES,
    seed: int = 0,
) -> tuple[MotionDesign, Spread]:
    """Designs the motion with the smallest predicted standard deviation of a quantity.

    The paths from home to the start, and from the end to home, are straight in joint space. Along them, too, the tip
    stays above its least height, or above its height at home if that is lower.

    Args:
        expectation: Prior knowledge about the run.
        family: Family of motions within the limits.
        aim: Quantity whose standard deviation is minimised.
        home: Joint angles at which the arm begins and ends, shape (n,), [rad]; None to ignore paths from and to home.
        num_draws: Number of random motions.
        num_changes: Number of changes tried on each of the best motions.
        seed: Seed of the search.

    Returns: The motion, which respects the limits with every possible body, and the predicted standard deviations.

    Raises:
        NoMotionError: None of the random motions respects the limits.
    """
    bodies = parameters_from_theta(expectation.bodies)
    rng = np.random.default_rng(seed)
    times = list_times(family.duration)
    height = family.limits.height
    if home is not None:
        height = min(height, float(family.robot.compute_positions(home[None], np.zeros(3))[0, 2]))

    def judge(numbers: Array) -> float:
        motion = family.build(numbers, times)
        if motion is None:
            return np.inf
        if home is not None and compute_lowest(family.robot, home, motion.q[[0, -1]]) < height:
            return np.inf
        dynamics = family.robot.compute_dynamics(*motion.motion)
        if family.limits.compute_excess(family.robot, motion, bodies, dynamics) > _USED:
            return np.inf
        return expectation.predict(motion, dynamics).get(aim)

    drawn = [family.draw(rng) for _ in range(num_draws)]
    scores = np.array([judge(numbers) for numbers in drawn])
    kept = np.isfinite(scores)
    if not kept.any():
        limits = "the limits of angles, rates, torques and tip"
        raise NoMotionError(f"none of {num_draws} motions of {family.duration:g} s respects {limits}")
    starts = np.argsort(scores, kind="stable")[: min(NUM_STARTS, int(kept.sum()))]
    improved = [_improve(judge, drawn[start], float(scores[start]), num_changes, rng) for start in starts]
    best, least = min(improved, key=lambda each: each[1])
    motion = family.build(best, list_times(family.duration, _OUTPUT_RATE))
    assert motion is not None
    return MotionDesign(motion, least, float(np.median(scores[kept]))), expectation.predict(motion)


def _improve(
    judge: Callable[[Array], float], best: Array, least: float, num_changes: int, rng: np.random.Generator
) -> tuple[Array, float]:
    """Applies random changes that lower a motion's score. Returns the numbers and their score."""
    step = _STEP
    for _ in range(num_changes):
        changed = rng.uniform(size=best.shape) < _CHANGED
        other = best + step * changed * rng.standard_normal(best.shape)
        found = judge(other)
        if found < least:
            best, least, step = other, found, min(step * _LONGER, _STEP)
        else:
            step = max(step * _SHORTER, _LEAST_STEP)
    return best, least
