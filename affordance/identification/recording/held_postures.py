"""Held postures: tables with one row a posture, or recordings of an arm that is held at rest in one after another."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array

FEWEST_POSTURES = 4
# Time from one posture to the next in a run of postures, [s]: a number to count them by, as no time matters.
POSTURE_STEP = 0.5
# Change of a joint angle within which an arm is at rest, [rad]: a droop under load, or an encoder's noise.
_STILL = 5e-3
# Rows in one posture from which a table is a recording over time, in which shorter stays are passages.
_STAY = 5
# Change of some joint from row to row that a recording with a time hardly makes, [rad].
_APART = 0.05


class Postures(NamedTuple):
    """Means over the rows of each posture."""

    values: Array  # means of all columns, shape (P, columns)
    first: NDArray[np.intp]  # first row of each posture, from 0, shape (P,)
    num_moving: int  # rows that were left out, as the arm moved in them


def gather_postures(q: Array, values: Array) -> Postures:
    """Averages neighbouring rows of the same joint angles.

    Where the longest stay has five rows and more, stays of fewer rows are taken for motion and left out.

    Args:
        q: Joint angles, shape (N, n), [rad].
        values: All columns to average, shape (N, columns).
    """
    starts, reference = [0], q[0]
    for row in range(1, len(q)):
        if np.abs(q[row] - reference).max() > _STILL:
            starts.append(row)
            reference = q[row]
    first = np.array(starts)
    lengths = np.diff(np.append(first, len(q)))
    kept = lengths >= _STAY if lengths.max() >= _STAY else lengths > 0
    means = np.add.reduceat(values, first, axis=0) / lengths[:, None]
    return Postures(means[kept], first[kept], int(lengths[~kept].sum()))


def looks_held(q: Array) -> bool:
    """Returns whether rows without a time are single postures: most are far from the row before."""
    return len(q) >= FEWEST_POSTURES and bool(np.median(np.abs(np.diff(q, axis=0)).max(axis=1)) > _APART)
