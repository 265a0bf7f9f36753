"""Two runs of one motion, once with an empty hand and once with a load: how much later is the second?

Found by matching joint angles, to a fraction of a sample.
"""

from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.signal import correlate

from affordance.arrays import Array
from affordance.exceptions import BadValueError
from affordance.identification.run import Run

# Of the loaded run's motion, this share must be repeated.
_SHARE = 0.5
_MOVING = 0.01  # slower than this is rest, [rad/s]


class Alignment(NamedTuple):
    """How two runs lie.

    Attributes:
        lag: By how much the loaded run is later than the empty one by their own clocks, [s].
        start: Of the common part, by the empty run's clock, [s].
        end: Of the same.
        difference: Largest difference of a joint angle there, [rad].
    """

    lag: float
    start: float
    end: float
    difference: float


def align(empty: Run, loaded: Run, tolerance: float) -> Alignment:
    """Finds the lag between two runs of one motion.

    Args:
        empty: The run that is taken for reference.
        loaded: The run with the load, of the same joints.
        tolerance: Largest difference of a joint angle, [rad].

    Raises:
        BadValueError: The loaded run is no repetition of the empty one; names the row and joint that differ most.
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
    """Time between the first and last motion, [s]."""
    moving = np.flatnonzero(np.abs(np.gradient(run.q, run.times, axis=0)).max(axis=1) > _MOVING)
    return float(run.times[moving[-1]] - run.times[moving[0]]) if moving.size else 0.0


def _sample_velocity(run: Run, step: float) -> Array:
    """Differences of angles at even times: what moves is matched, not where the arm rests; without rest's noise."""
    times = np.arange(run.times[0], run.times[-1], step)
    v = np.gradient(_sample(run, times), step, axis=0)
    return np.where(np.abs(v) > _MOVING, v, 0.0)


def _sample(run: Run, times: Array) -> Array:
    return np.column_stack([np.interp(times, run.times, column) for column in run.q.T])
