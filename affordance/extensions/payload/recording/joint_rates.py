"""Finds jumps of recorded joint angles that no joint can follow, and explains their likely cause.

Filters would turn such jumps into motion that never happened.
"""

from typing import NamedTuple

import numpy as np

from affordance.arrays import Array

# Largest rate of a joint of any arm, four turns per second, [rad/s].
FASTEST = 8.0 * np.pi
# Longest time step of a recording, [s], and amount by which some controllers exceed a joint's angle limits, [rad].
LONGEST_STEP, ANGLE_SLACK = 0.5, 0.5
# Hints about units that are probably wrong.
DEGREES = "are these degrees? then its description must have 'units: {q: deg}'"
LONGER_UNIT = "is the unit of time a thousand times longer? then set it in the description: 'units: {time: s}'"
# Factor by which rates may exceed the limits in the file, because some controllers allow more.
_RATE_SLACK = 1.5
# Angle that exceeds any noise and rounding, [rad].
_NOISE = 0.05
# Time over which the rate of a smooth motion is measured, [s].
_WINDOW = 0.1
# In a smooth motion, neighbouring changes of an angle have the same sign and at least this share of its size.
_SMOOTH = 0.5
# Factor between units of time, and time step below which no controller samples joints, [s].
_NEXT_UNIT, _SHORTEST = 1000.0, 5e-4
_TURN = 2.0 * np.pi
# Largest ratio between a measured rate and the derivative of its quantity; degrees instead of radians give 57.
_RATE_FACTOR = 5.0
# Largest relative difference between a quantity and its integrated rate; noise causes less.
_RATE_APART = 0.3
_LEAST_MOTION = 0.05  # range below which a joint's changes may be noise, [rad, rad/s]
# Largest delay of a rate that is considered, [s].
_LONGEST_LAG = 0.5


class Jump(NamedTuple):
    """Change of a joint angle that is too large for the time between two samples."""

    row: int  # number of the later sample, from 0
    joint: int  # number of the joint, from 0
    change: float  # change of the angle, [rad]
    step: float  # time between the samples, [s]
    limit: float  # largest rate of the joint according to its file, or of any arm, [rad/s]

    @property
    def rate(self) -> float:
        """Rate of the angle, [rad/s]."""
        return abs(self.change) / self.step


def find_jumps(times: Array, q: Array, limits: Array) -> tuple[Jump, ...]:
    """Finds changes of joint angles between neighbouring samples that exceed the velocity limits.

    A change is a jump if it exceeds one and a half times the limit by 0.05 rad. The assumed time is the sample
    interval, but at least the median time step, because single time stamps are unreliable: in a Panda's recording at
    1 kHz they imply rates up to 3.4 times the limit. A table of held postures has jumps unless the postures are close
    together.

    Args:
        times: Times of the samples, shape (N,), increasing, [s].
        q: Joint angles, shape (N, n), [rad].
        limits: Velocity limits from the robot's file, shape (n,), [rad/s]; infinite without a limit. The largest
            assumed limit is four turns per second.

    Returns: The jumps, ordered by sample and joint.
    """
    steps, changes = np.diff(times), np.diff(q, axis=0)
    lasting = np.maximum(steps, np.median(steps))[:, None]
    found = np.abs(changes) > np.minimum(_RATE_SLACK * limits, FASTEST) * lasting + _NOISE
    highest = np.minimum(limits, FASTEST)
    return tuple(
        Jump(int(row) + 1, int(joint), float(changes[row, joint]), float(steps[row]), float(highest[joint]))
        for row, joint in np.argwhere(found)
    )


class Fault(NamedTuple):
    """Impossible joint rate in a recording."""

    row: int  # number of the sample, from 0
    joint: int  # number of the joint, from 0
    problem: str  # rate, bound, and the likely cause


def find_fault(
    times: Array,
    q: Array,
    *,
    limits: Array | None = None,
    ranges: Array | None = None,
    source: str = "",
) -> Fault | None:
    """Finds the joint that exceeds its velocity limit most, and explains the likely cause.

    Args:
        times: Times of the samples, shape (N,), increasing, [s].
        q: Joint angles, shape (N, n), [rad].
        limits: Velocity limits from the robot's file, shape (n,), [rad/s]; None if the robot is not known.
        ranges: Lower and upper angle limits from the file, shape (2, n), [rad]; None if not known.
        source: Name of the robot's file.

    Returns: The fault; None if no joint is too fast.
    """
    n = q.shape[1]
    limits = np.full(n, np.inf) if limits is None else limits
    jumps = find_jumps(times, q, limits)
    is_smooth = not jumps or np.mean([_is_smooth(q[:, jump.joint], jump.row) for jump in jumps]) > 0.5
    typical = float(np.median(np.diff(times)))
    if not jumps:  # a smooth motion is too fast only over several samples
        every = int(np.clip(_WINDOW / typical, 1, len(times) // 3))
        thin = find_jumps(times[::every], q[::every], limits)
        jumps = tuple(jump._replace(row=every * jump.row) for jump in thin)
    if not jumps:
        return None
    worst = max(jumps, key=lambda jump: jump.rate / jump.limit)
    if is_smooth:
        looks = _explain_units(q, typical, worst, _TURN * np.array([[-1.0], [1.0]]) if ranges is None else ranges)
    else:
        looks = _explain_jumps(q, jumps)
    by = f"according to {source}" if worst.limit < FASTEST else "for any arm"
    rate = f"{worst.rate:.3g} rad/s, must be at most {worst.limit:.3g} {by}"
    change = f"changes by {abs(worst.change):.3g} rad in {worst.step:.3g} s"
    since = f"{times[worst.row] - times[0]:.4g} s after the start"
    return Fault(worst.row, worst.joint, f"{change}, {since}: {rate}; {looks}")


def _is_smooth(q: Array, row: int) -> bool:
    """Returns True if the change before a sample is similar to its neighbouring changes, for angles (N,)."""
    changes = np.diff(q[max(row - 2, 0) : row + 2])
    return bool((changes * np.sign(q[row] - q[row - 1]) >= _SMOOTH * abs(q[row] - q[row - 1])).all())


def _explain_units(q: Array, step: float, worst: Jump, ranges: Array) -> str:
    """Explains which unit is probably wrong in a smooth but too fast motion. ``step`` is the time step, [s]."""
    if step <= _SHORTEST and worst.rate <= _NEXT_UNIT * _RATE_SLACK * worst.limit:
        return f"{1e6 * step:.3g} us between samples is improbable: {LONGER_UNIT}"
    low, high = ranges
    if ((q < low - ANGLE_SLACK) | (q > high + ANGLE_SLACK)).any():
        return DEGREES
    return "are the units of time and angles as described, and is the robot's file the one of this arm?"


def _explain_jumps(q: Array, jumps: tuple[Jump, ...]) -> str:
    """Explains the likely cause of jumps."""
    changes = np.abs([jump.change for jump in jumps])
    off_turns = np.abs(changes - _TURN * np.maximum(np.rint(changes / _TURN), 1.0))
    allowed = np.array([_RATE_SLACK * jump.limit * jump.step + _NOISE for jump in jumps])
    if np.mean(off_turns <= allowed) > 0.5:
        return "the angle jumps by a turn (2 pi), like an encoder that wraps around: unwrap it, as numpy.unwrap does"
    pieces = np.split(q, np.unique([jump.row for jump in jumps]))
    at_rest = sum(len(piece) for piece in pieces if np.ptp(piece, axis=0).max() <= _NOISE)
    if at_rest > 0.5 * len(q):
        return (
            f"these look like {len(pieces)} postures, held one after the other: record the motion between them too, "
            "or set 'postures: true' in the description if each row is a posture"
        )
    return "rows are missing or wrong, or these are several recordings in one table: pass one complete motion"


def find_lag(times: Array, values: Array, rate: Array) -> float:
    """Estimates the delay of a recorded rate, [s].

    Args:
        times: Times of the samples, shape (N,), increasing, [s].
        values: Quantity, shape (N,).
        rate: Recorded rate of the quantity, shape (N,).

    Returns: The delay at which the rate fits best, up to half a second, interpolated with a parabola. It is negative
        if the rate is early.
    """
    step = float(np.median(np.diff(times)))
    even = np.arange(times[0], times[-1], step)
    reference = np.gradient(np.interp(even, times, values), step)
    late = np.interp(even, times, rate)
    reference, late = reference - reference.mean(), late - late.mean()
    most = min(round(_LONGEST_LAG / step), len(even) // 4)

    def misfit(rows: int) -> float:
        inside = slice(most, len(even) - most)
        shifted = late[inside.start + rows : inside.stop + rows]
        return float(np.mean((shifted - reference[inside]) ** 2))

    misfits = np.array([misfit(rows) for rows in range(-most, most + 1)])
    best = int(np.argmin(misfits))
    if 0 < best < 2 * most:
        before, at, after = misfits[best - 1 : best + 2]
        bend = before - 2.0 * at + after
        return step * (best - most + (0.5 * (before - after) / bend if bend > 0.0 else 0.0))
    return step * (best - most)


class RateFault(NamedTuple):
    """Fault of a recorded rate that is not the derivative of its quantity."""

    joint: int  # number of the joint, from 0
    problem: str  # the fault and its bound, with {} in place of the quantity's name
    is_larger: bool  # True if the rate is too large


def compare_rate(times: Array, of: Array, rate: Array, q: Array) -> RateFault | None:
    """Compares the recorded rate of each moving joint with the derivative of its quantity.

    The joint with the largest motion is tested first. Rates in other units, of another joint or at another time are
    faults. All tables have shape (N, n).
    """
    for joint in np.argsort(-np.ptp(q, axis=0), kind="stable"):
        # Subtracting lines removes the effect of a constant offset of the rate.
        values = _remove_line(of[:, joint], times)
        steps = 0.5 * (rate[1:, joint] + rate[:-1, joint]) * np.diff(times)
        summed = _remove_line(np.append(0.0, np.cumsum(steps)), times)
        if np.ptp(values) < _LEAST_MOTION:
            continue
        ratio = float(np.ptp(summed) / np.ptp(values))
        if not 1.0 / _RATE_FACTOR <= ratio <= _RATE_FACTOR:
            bounds = f"from {1.0 / _RATE_FACTOR:g} to {_RATE_FACTOR:g} times"
            return RateFault(int(joint), f"is {ratio:.3g} times the rate of {{}}, must be {bounds}", ratio > 1.0)
        apart = float(np.std(summed - values) / np.std(values))
        if apart > _RATE_APART:
            problem = f"differs by {100.0 * apart:.0f} % from the rate of {{}}, must differ by at most"
            return RateFault(
                int(joint),
                f"{problem} {100.0 * _RATE_APART:g} %; are columns mixed up, or is one of them late?",
                False,
            )
    return None


def _remove_line(values: Array, times: Array) -> Array:
    """Subtracts the line through the first and last values."""
    line: Array = np.interp(times, times[[0, -1]], values[[0, -1]])
    return values - line
