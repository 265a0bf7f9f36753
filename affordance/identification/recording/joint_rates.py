"""Jumps of recorded joint angles: rates that no joint of the robot reaches, and what such a table looks like.

A table with jumps is no recording of a motion: a filter turns each jump into a motion that never happened.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array

# Largest rate of a joint of an arm of any size, four turns a second, [rad/s].
FASTEST = 8.0 * np.pi
# Longest step of a recording, [s]; and angles beyond a joint's limits that some controllers allow, [rad].
LONGEST_STEP, ANGLE_SLACK = 0.5, 0.5
# Units that are likely to be wrong, in words.
DEGREES = "are these degrees? then its description must have 'units: {q: deg}'"
LONGER_UNIT = "is the unit of time a thousand times as long? 'units: {time: s}' of the description names it"
# Factor by which rates may exceed limits: files of robots limit joints more narrowly than some controllers do.
_RATE_SLACK = 1.5
# Change of an angle that noise and rounding do not reach, however short the step, [rad].
_NOISE = 0.05
# Step over which the rate of a smooth motion is measured, [s].
_WINDOW = 0.1
# In a smooth motion the changes before and after one are in its direction, and at least this share of it.
_SMOOTH = 0.5
# Factor between units of time, and step below which no controller samples joints, [s].
_NEXT_UNIT, _SHORTEST = 1000.0, 5e-4
_TURN = 2.0 * np.pi
_LISTED = 5


class Jump(NamedTuple):
    """Change of one joint's angle between two samples that is too large for the time between them."""

    row: int  # number of the later sample, from 0
    joint: int  # number of the joint, from 0
    change: float  # change of the angle, [rad]
    step: float  # time between the samples, [s]
    limit: float  # largest rate of the joint by its file, or of any arm, [rad/s]

    @property
    def rate(self) -> float:
        """Rate of the angle, [rad/s]."""
        return abs(self.change) / self.step


def find_jumps(times: Array, q: Array, limits: Array) -> tuple[Jump, ...]:
    """Finds the changes of joint angles between neighbouring samples that velocity limits rule out.

    A table of postures that were held, one after the other, jumps from each to the next, unless they are close
    together. A jump exceeds, by 0.05 rad, what one and a half times the limit allows in the time between the samples,
    or in the median of these times if that is longer: by its stamps alone, a Panda's recording at 1 kHz has steps at
    3.4 times the limit.

    Args:
        times: Times of the samples, shape (N,), increasing, [s].
        q: Joint angles, shape (N, n), [rad].
        limits: Velocity limits by the robot's file, shape (n,), [rad/s]; infinite without one. No joint is taken to
            turn faster than four turns a second.

    Returns: The jumps, by sample and joint.
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
    """Rate that rules a table out."""

    row: int  # number of the sample, from 0
    joint: int  # number of the joint, from 0
    problem: str  # rate, bound, and what the table looks like


def find_fault(
    times: Array,
    q: Array,
    rows: NDArray[np.intp],
    *,
    limits: Array | None = None,
    ranges: Array | None = None,
    source: str = "",
) -> Fault | None:
    """Finds the joint that turns fastest beyond its velocity limit, and says what such a table looks like.

    Args:
        times: Times of the samples, shape (N,), increasing, [s].
        q: Joint angles, shape (N, n), [rad].
        rows: Row of the file that holds each sample, shape (N,).
        limits: Velocity limits by the robot's file, shape (n,), [rad/s]; None if the robot is not known.
        ranges: Least and largest angle of each joint by the file, shape (2, n), [rad]; None if not known.
        source: The robot's file.

    Returns: The fault; None if no joint turns too fast.
    """
    n = q.shape[1]
    limits = np.full(n, np.inf) if limits is None else limits
    jumps = find_jumps(times, q, limits)
    is_smooth = not jumps or np.mean([_is_smooth(q[:, jump.joint], jump.row) for jump in jumps]) > 0.5
    typical = float(np.median(np.diff(times)))
    if not jumps:  # a smooth motion shows its rate over several samples
        every = int(np.clip(_WINDOW / typical, 1, len(times) // 3))
        thin = find_jumps(times[::every], q[::every], limits)
        jumps = tuple(jump._replace(row=every * jump.row) for jump in thin)
    if not jumps:
        return None
    worst = max(jumps, key=lambda jump: jump.rate / jump.limit)
    if is_smooth:
        looks = _explain_units(q, typical, worst, _TURN * np.array([[-1.0], [1.0]]) if ranges is None else ranges)
    else:
        looks = _explain_jumps(q, rows, jumps)
    by = f"by {source}" if worst.limit < FASTEST else "as of any arm"
    rate = f"{worst.rate:.3g} rad/s, must be at most {worst.limit:.3g} {by}"
    change = f"changes by {abs(worst.change):.3g} rad within {worst.step:.3g} s"
    since = f"{times[worst.row] - times[0]:.4g} s after the start"
    return Fault(worst.row, worst.joint, f"{change}, {since}: {rate}; {looks}")


def _is_smooth(q: Array, row: int) -> bool:
    """Returns whether the change before a sample is much like those before and after it, angles of shape (N,)."""
    changes = np.diff(q[max(row - 2, 0) : row + 2])
    return bool((changes * np.sign(q[row] - q[row - 1]) >= _SMOOTH * abs(q[row] - q[row - 1])).all())


def _explain_units(q: Array, step: float, worst: Jump, ranges: Array) -> str:
    """Says which unit is likely to be wrong if a motion, sampled in steps, [s], is smooth and too fast."""
    if step <= _SHORTEST and worst.rate <= _NEXT_UNIT * _RATE_SLACK * worst.limit:
        return f"a sample every {1e6 * step:.3g} us is unlikely: {LONGER_UNIT}"
    low, high = ranges
    if ((q < low - ANGLE_SLACK) | (q > high + ANGLE_SLACK)).any():
        return DEGREES
    return "are time and angles in the units that its description says, and is the robot's file that of this arm?"


def _explain_jumps(q: Array, rows: NDArray[np.intp], jumps: tuple[Jump, ...]) -> str:
    """Says what a table with jumps looks like."""
    changes = np.abs([jump.change for jump in jumps])
    off_turns = np.abs(changes - _TURN * np.maximum(np.rint(changes / _TURN), 1.0))
    allowed = np.array([_RATE_SLACK * jump.limit * jump.step + _NOISE for jump in jumps])
    if np.mean(off_turns <= allowed) > 0.5:
        return "the angle jumps by a turn (2 pi), as of an encoder that starts again: unwrap it, as numpy.unwrap does"
    places = np.unique([jump.row for jump in jumps])
    alone = _find_alone(q, places, 2.0 * allowed.min())
    if 2 * len(alone) == len(places):
        more = " ..." if len(alone) > _LISTED else ""
        listed = ", ".join(map(str, rows[alone[:_LISTED]]))
        return f"row {listed}{more} differs from those before and after: leave it out"
    pieces = np.split(q, places)
    at_rest = sum(len(piece) for piece in pieces if np.ptp(piece, axis=0).max() <= _NOISE)
    if at_rest > 0.5 * len(q):
        return (
            f"these look like {len(pieces)} postures that were held, one after the other: the motion from each "
            "to the next must be recorded too"
        )
    return f"these look like {len(pieces)} recordings in one table, or rows are missing: give one whole motion"


def _find_alone(q: Array, places: NDArray[np.intp], allowed: float) -> NDArray[np.intp]:
    """Finds samples that jump away from the one before, and back to it with the next, among those that jump."""
    first = places[np.isin(places + 1, places)]
    returns = np.abs(q[first + 1] - q[first - 1]).max(axis=1, initial=0.0) <= allowed
    found: NDArray[np.intp] = first[returns]
    return found


def explain_long_steps(times: Array, q: Array, typical: float) -> str:
    """Says what a table may be whose typical step is too long, [s]."""
    units = {"ms": 1e-3, "us": 1e-6, "ns": 1e-9}
    unit = next((name for name, factor in units.items() if factor * typical <= LONGEST_STEP), "ns")
    jumps = find_jumps(units[unit] * times, q, np.full(q.shape[1], np.inf))
    if len({jump.row for jump in jumps}) > 0.5 * len(times):  # in that unit, too
        return "are these postures that were held? the motion from each to the next must be recorded too"
    return f"in other units the description must have 'units: {{time: {unit}}}'"
