"""Held postures: tables with one row per posture, or recordings of an arm held at rest in several postures."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array

FEWEST_POSTURES = 4
# Nominal time between postures, [s]; it only numbers them, as their times do not matter.
POSTURE_STEP = 0.5
# Largest change of a joint angle of an arm at rest, [rad]: droop under load, or encoder noise.
_STILL = 5e-3
# Number of rows in one posture from which a table counts as a recording over time, so that shorter stays are motion.
_STAY = 5
# Change of some joint angle from row to row that hardly occurs in a recording over time, [rad].
_APART = 0.05


class Postures(NamedTuple):
    """Means over the rows of each posture."""

    values: Array  # means of all columns, shape (P, columns)
    first: NDArray[np.intp]  # first row of each posture, from 0, shape (P,)
    num_moving: int  # number of rows left out because the arm was moving


def gather_postures(q: Array, values: Array) -> Postures:
    """Averages consecutive rows with the same joint angles.

    If the longest stay has at least five rows, stays of fewer rows count as motion and are left out.

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
    """Returns whether the rows of a table without times are separate postures, most of them far apart."""
    return len(q) >= FEWEST_POSTURES and bool(np.median(np.abs(np.diff(q, axis=0)).max(axis=1)) > _APART)
