"""Time alignment of two runs of one motion, one with an empty hand and one with a load.

The lag is found to a fraction of a sample by matching joint angles.
"""

from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.signal import correlate

from affordance.arrays import Array
from affordance.exceptions import BadValueError
from affordance.identification.recording.run import Run

# Share of the loaded run's moving time that the common part must span.
_SHARE = 0.5
_MOVING = 0.01  # joint speed below which the arm is at rest, [rad/s]


class Alignment(NamedTuple):
    """Alignment of two runs in time.

    Attributes:
        lag: Lag of the loaded run behind the empty one, by their own clocks, [s].
        start: Start of the common part by the empty run's clock, [s].
        end: End of the common part by the empty run's clock, [s].
        difference: Largest difference of a joint angle over the common part, [rad].
    """

    lag: float
    start: float
    end: float
    difference: float


def align(empty: Run, loaded: Run, tolerance: float) -> Alignment:
    """Finds the lag between two runs of one motion.

    Args:
        empty: Reference run, with an empty hand.
        loaded: Run with the load, of the same joints.
        tolerance: Largest permitted difference of a joint angle, [rad].

    Raises:
        BadValueError: A run has no motion, or the loaded run does not repeat the empty one; the message names the row
            and joint that differ most.
    """
    step = max(1.0 / empty.rate, 1.0 / loaded.rate)
    reference, moved = (_sample_velocity(run, step) for run in (empty, loaded))
    if not reference.any() or not moved.any():
        still = empty if not reference.any() else loaded
        raise BadValueError(still.source, "q", f"has no joint that moves faster than {_MOVING:g} rad/s")
    score = sum(correlate(b, a, mode="full", method="fft") for a, b in zip(reference.T, moved.T, strict=True))
    rough = (int(np.argmax(score)) - (len(reference) - 1)) * step + loaded.times[0] - empty.times[0]
    start, end = _overlap(empty, loaded, rough, step)

    def measure(lag: float) -> float:
        return float(np.mean((_sample(loaded, times + lag) - _sample(empty, times)) ** 2))

    times = np.arange(start, end, step)
    least = _SHARE * _measure_motion(loaded)
    if len(times) < 3 or end - start < least:
        problem = f"repeats {max(end - start, 0.0):.2f} s of {empty.source}, must repeat at least {least:.2f} s of it"
        raise BadValueError(loaded.source, "time", f"{problem} (--unpaired for other motions)")
    lag = float(
        minimize_scalar(
            measure, bounds=(rough - 2.0 * step, rough + 2.0 * step), method="bounded", options={"xatol": 1e-3 * step}
        ).x
    )
    difference = np.abs(_sample(loaded, times + lag) - _sample(empty, times))
    row, joint = np.unravel_index(int(np.argmax(difference)), difference.shape)
    largest = float(difference[row, joint])
    if largest > tolerance:
        at = int(np.searchsorted(loaded.times, times[row] + lag))
        name = f"q_{joint + 1} ({loaded.description.joint_names[joint]})"
        problem = f"is {largest:.4f} rad away from the same moment of {empty.source}, must be at most {tolerance:g}"
        raise loaded.error_at(at, name, f"{problem} (--unpaired for runs that do not repeat each other)")
    return Alignment(lag, start, end, largest)


def _overlap(empty: Run, loaded: Run, lag: float, step: float) -> tuple[float, float]:
    margin = 3.0 * step  # the lag may still move by two
    start = max(empty.times[0], loaded.times[0] - lag + margin)
    return float(start), float(min(empty.times[-1], loaded.times[-1] - lag - margin))


def _measure_motion(run: Run) -> float:
    """Returns the time between the first and last motion, [s]."""
    moving = np.flatnonzero(np.abs(np.gradient(run.q, run.times, axis=0)).max(axis=1) > _MOVING)
    return float(run.times[moving[-1]] - run.times[moving[0]]) if moving.size else 0.0


def _sample_velocity(run: Run, step: float) -> Array:
    """Computes velocities at even times from angles, zero at rest, so that motion is matched, not poses or noise."""
    times = np.arange(run.times[0], run.times[-1], step)
    v = np.gradient(_sample(run, times), step, axis=0)
    return np.where(np.abs(v) > _MOVING, v, 0.0)


def _sample(run: Run, times: Array) -> Array:
    return np.column_stack([np.interp(times, run.times, column) for column in run.q.T])
