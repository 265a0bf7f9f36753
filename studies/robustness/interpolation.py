"""Motions of many observers from those of a few: interpolated over what they believe, to a measured error.

How an object moves that is held depends on the believed densities alone, and smoothly so, through the true densities
too: what has a kink there is the lowest and the highest point of a motion, which are read from it afterwards. So
motions are interpolated as a whole, by polynomials through observers of whom they are simulated (discrete Leja
points: Bos, De Marchi, Sommariva and Vianello 2010, SIAM J. Numer. Anal. 48:1984-1999). Before a motion becomes a
node it is compared with what the nodes so far say of it, until no new one is missed by more than a tolerance. Limits
of the arm, where motions are less than smooth, are met by those first whose beliefs are extreme: these are simulated
too and compared. Where the tolerance is not kept, all motions are simulated.
"""

import itertools
import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray
from scipy.linalg import lu_factor

from affordance.arrays import Array

# What a motion that becomes a node may be missed by before, [m]: a hundredth of the smallest drop that counts. What
# is missed after it has become one is less by what a degree brings, mostly a factor of ten.
TOLERANCE = 5e-5
# So many new motions in succession must be met: a single one may be by accident, as of an odd function.
_NUM_MET = 2
# Number of observers with the most extreme beliefs whose motions are compared before polynomials are accepted.
_NUM_EXTREME = 6
# A share of the spread along the widest direction, below which a direction has none.
_NO_SPREAD = 1e-9
# With more nodes polynomials are given up: degree 9 of two densities, as much as pays of one.
_MAX_NODES = 60


class Motions(NamedTuple):
    """Motions of R observers.

    Attributes:
        heights: A height over time, (R, N), [m].
        error: Largest error met in those that became nodes last, [m]; zero if all were simulated.
        num_simulated: How many of those that differ were simulated.
        num_distinct: How many differ.
    """

    heights: Array
    error: float
    num_simulated: int
    num_distinct: int


def interpolate_motions(
    simulate: Callable[[Array], Array], believed: Array, true: Array | None = None, tolerance: float = TOLERANCE
) -> Motions:
    """Finds the motions of all who believe some densities.

    Args:
        simulate: Function that simulates the motion of one who believes densities, (M,) to (N,), [m].
        believed: Densities that observers believe, (R, M), [kg/m^3].
        true: The true densities, (M,), which are the first node; None where no belief makes the object rest.
        tolerance: Largest error of a motion that is compared, [m].
    """
    distinct, owners = np.unique(believed, axis=0, return_inverse=True)
    owners = owners.ravel()
    candidates = distinct if true is None else np.vstack([true, distinct])
    offset = len(candidates) - len(distinct)
    basis, sizes = _build_basis(candidates)
    order = _order_nodes(basis)
    found: dict[int, Array] = {}

    def hold(index: int) -> Array:
        if index not in found:
            found[index] = simulate(candidates[index])
        return found[index]

    extremes = [offset + int(index) for index in _find_extremes(distinct)]
    said: Array | None = None  # of all candidates, by the nodes so far
    met: list[float] = []  # errors of new motions since the last that was missed
    for before, size in zip([0, *sizes], sizes, strict=False):
        if size >= len(distinct):
            break
        nodes = order[:size]
        motions = np.array([hold(int(node)) for node in nodes])
        if said is not None:
            errors = np.abs(said[nodes[before:]] - motions[before:]).max(axis=1)
            met = [*met, *errors] if errors.max() <= tolerance else []
        said = basis[:, :size] @ np.linalg.solve(basis[nodes, :size], motions)
        if len(met) >= _NUM_MET:
            missed = max(float(np.abs(said[index] - hold(index)).max()) for index in extremes)
            if missed <= tolerance:
                error = max(*met, missed)
                return Motions(said[offset:][owners], error, sum(index >= offset for index in found), len(distinct))
            met = []
    motions = np.array([hold(offset + index) for index in range(len(distinct))])
    return Motions(motions[owners], 0.0, len(distinct), len(distinct))


def _build_basis(points: Array) -> tuple[Array, list[int]]:
    """Chebyshev polynomials of all points, (P, B), by rising total degree, and their number up to each degree."""
    centred = points - points.mean(axis=0)
    _, spreads, directions = np.linalg.svd(centred, full_matrices=False)
    kept = spreads > _NO_SPREAD * max(float(spreads[0]), float(np.abs(points).max()))
    along = centred @ directions[kept].T
    num_axes = along.shape[1]
    if not num_axes:
        return np.ones((len(points), 1)), [1]
    low, high = along.min(axis=0), along.max(axis=0)
    each = chebyshev.chebvander((2.0 * along - low - high) / (high - low), _MAX_NODES)  # (P, axes, _MAX_NODES + 1)
    columns: list[Array] = []
    sizes: list[int] = []
    while math.comb(len(sizes) + num_axes, num_axes) <= _MAX_NODES:
        degree = len(sizes)
        for powers in itertools.product(range(degree + 1), repeat=num_axes):
            if sum(powers) == degree:
                columns.append(np.prod([each[:, axis, power] for axis, power in enumerate(powers)], axis=0))
        sizes.append(len(columns))
    return np.stack(columns, axis=1), sizes


def _order_nodes(basis: Array) -> NDArray[np.intp]:
    """Points in the order in which they become nodes, the first of them first: that of the pivots of elimination."""
    order = np.arange(len(basis))
    for row, pivot in enumerate(lu_factor(basis, check_finite=False)[1]):
        order[[row, pivot]] = order[[pivot, row]]
    return order


def _find_extremes(points: Array) -> NDArray[np.intp]:
    """Finds the points furthest from the mean, distances counted in standard deviations along each direction."""
    centred = points - points.mean(axis=0)
    outer, spreads, _ = np.linalg.svd(centred, full_matrices=False)
    kept = spreads > _NO_SPREAD * max(float(spreads[0]), float(np.abs(points).max()))
    return np.argsort(-np.square(outer[:, kept]).sum(axis=1), kind="stable")[:_NUM_EXTREME]
