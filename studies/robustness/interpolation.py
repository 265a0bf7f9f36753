"""Interpolates many observers' motions from the motions of a few, with a measured error.

Motions are functions of beliefs.

The motion of a held object depends continuously on the believed densities, and on nothing else. Only the lowest and
the highest point of a motion have kinks; they are computed afterwards, so motions are interpolated as a whole.

Over one density a cubic spline is used. Every gap between two nodes is halved until the motion in its middle is
predicted to a tolerance, so nodes gather where the arm meets a limit. Over several densities polynomials are used.
Their nodes are a sequence of simulated observers (discrete Leja points: Bos, De Marchi, Sommariva and Vianello 2010,
SIAM J. Numer. Anal. 48:1984-1999). Before a motion becomes a node, it is compared with the prediction from the nodes
so far; this ends when enough new motions in succession are predicted. Limits of the arm are first met by observers
whose beliefs are extreme or furthest from the nodes, so these are simulated and compared, too. If the tolerance is
not met, all motions are simulated.
"""

import itertools
import math
from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.linalg import lu_factor

from affordance.arrays import Array

# Largest error of a motion before it becomes a node, [m]: a hundredth of the smallest drop that counts. Once it is a
# node, the remaining error is usually ten times smaller.
TOLERANCE = 5e-5
# Number of a spline's nodes before gaps are halved, and number of distinct beliefs below which all are simulated.
_NUM_FIRST, _LEAST_FIRST = 7, 4
# Fraction of the tolerance that is required in the middle of a gap: near a kink a spline is wrong by up to twice as
# much elsewhere.
_LINE_SHARE = 0.5
# Number of new motions in succession that polynomials must predict; a single one may agree by chance.
_NUM_MET = 2
# Numbers of observers whose motions are compared with the polynomials: those with the most extreme beliefs, and those
# whose beliefs are furthest from all simulated ones.
_NUM_EXTREME = 6
_NUM_BETWEEN = 6
# Spread along a direction, as a fraction of the widest spread, below which the direction counts as having none.
_NO_SPREAD = 1e-9
# Number of nodes above which polynomials are given up: degree 9 in two densities.
_MAX_NODES = 60


class Motions(NamedTuple):
    """Motions of R observers."""

    heights: Array  # height over time, (R, N), [m]
    # Largest error of motions at the last comparison, [m]; zero if all were simulated. Along a line, the compared
    # motions become nodes afterwards.
    error: float
    num_simulated: int  # number of distinct motions that were simulated
    num_distinct: int  # number of distinct motions


class _Simulated:
    """Motions of candidates, each simulated when first needed and then stored."""

    def __init__(self, simulate: Callable[[Array], Array], candidates: Array) -> None:
        self._simulate = simulate
        self._candidates = candidates
        self.found: dict[int, Array] = {}

    def hold(self, index: int) -> Array:
        """Returns the motion of a candidate, (N,), [m]."""
        if index not in self.found:
            self.found[index] = self._simulate(self._candidates[index])
        return self.found[index]

    def hold_all(self, indices: Iterable[int]) -> Array:
        """Returns the motions of candidates, (K, N), [m]."""
        return np.array([self.hold(int(index)) for index in indices])


def interpolate_motions(
    simulate: Callable[[Array], Array], believed: Array, true: Array | None = None, tolerance: float = TOLERANCE
) -> Motions:
    """Computes the motions of observers with given beliefs, to a tolerance.

    Args:
        simulate: Function from an observer's densities, (M,), to the motion, (N,), [m].
        believed: Densities that each observer believes, (R, M), [kg/m^3].
        true: True densities, (M,), which are a node; None if no belief keeps the object at rest.
        tolerance: Largest error, [m].
    """
    distinct, owners = np.unique(believed, axis=0, return_inverse=True)
    candidates = distinct if true is None else np.vstack([true, distinct])
    offset = len(candidates) - len(distinct)
    motions = _Simulated(simulate, candidates)
    scaled = _scale(candidates)
    interpolated: tuple[Array, float] | None = None
    if scaled.shape[1] == 1:
        interpolated = _interpolate_line(motions, scaled[:, 0], offset, tolerance)
    elif scaled.shape[1] > 1:
        extremes = [offset + int(index) for index in _find_extremes(distinct)]
        interpolated = _interpolate_plane(motions, scaled, extremes, tolerance)
    if interpolated is None:
        heights, error = motions.hold_all(range(offset, len(candidates))), 0.0
    else:
        heights, error = interpolated[0][offset:], interpolated[1]
    num_simulated = sum(index >= offset for index in motions.found)
    return Motions(heights[owners.ravel()], error, num_simulated, len(distinct))


def _interpolate_line(
    motions: _Simulated, scaled: Array, num_true: int, tolerance: float
) -> tuple[Array, float] | None:
    """Interpolates motions along a line of beliefs with a cubic spline.

    Positions (P,) are from -1 to 1.

    The first candidates are true beliefs, which are always nodes.

    Returns:
        Motions of all candidates, (P, N), [m], and the largest error in the middle of gaps; None if all must be
        simulated.
    """
    order = np.unique(scaled.round(9), return_index=True)[1]  # among equal positions, the true belief is kept
    angles = np.arccos(-np.clip(scaled[order], -1.0, 1.0))
    evenly = np.linspace(0.0, np.pi, _NUM_FIRST)
    first = np.abs(angles[:, np.newaxis] - evenly).argmin(axis=0)
    nodes = sorted({*map(int, first), *(int(np.flatnonzero(order == index)[0]) for index in range(num_true))})
    gaps = list(itertools.pairwise(nodes))
    if len(nodes) < _LEAST_FIRST:
        return None
    worst = 0.0
    while gaps:
        spline = CubicSpline(scaled[order[nodes]], motions.hold_all(order[nodes]))
        halves: list[tuple[int, int]] = []
        for low, high in gaps:
            if high - low < 2:
                continue
            inside = angles[low + 1 : high]
            middle = low + 1 + int(np.abs(inside - (angles[low] + angles[high]) / 2.0).argmin())
            error = float(np.abs(spline(scaled[order[middle]]) - motions.hold(int(order[middle]))).max())
            nodes.append(middle)
            if error > _LINE_SHARE * tolerance:
                halves += [(low, middle), (middle, high)]
            else:
                worst = max(worst, error)
        nodes.sort()
        gaps = halves
    spline = CubicSpline(scaled[order[nodes]], motions.hold_all(order[nodes]))
    return spline(scaled), worst


def _interpolate_plane(
    motions: _Simulated, scaled: Array, extremes: Sequence[int], tolerance: float
) -> tuple[Array, float] | None:
    """Interpolates motions over several directions of beliefs with polynomials.

    Positions (P, axes) are from -1 to 1.

    Returns:
        Motions of all candidates, (P, N), [m], and the largest error of those compared, including extreme ones; None
        if all must be simulated.
    """
    basis, sizes = _build_basis(scaled)
    order = _order_nodes(basis)
    said: Array | None = None  # motions of all candidates predicted from the nodes so far
    met: list[float] = []  # errors of the new motions since the last one that was not predicted
    for before, size in zip([0, *sizes], sizes, strict=False):
        if size >= len(scaled):
            break
        nodes = order[:size]
        simulated = motions.hold_all(nodes)
        if said is not None:
            errors = np.abs(said[nodes[before:]] - simulated[before:]).max(axis=1)
            met = [*met, *errors] if errors.max() <= tolerance else []
        said = basis[:, :size] @ np.linalg.solve(basis[nodes, :size], simulated)
        if len(met) >= _NUM_MET:
            compared = [*extremes, *_find_between(scaled, [*motions.found, *extremes])]
            missed = float(np.abs(said[compared] - motions.hold_all(compared)).max())
            if missed <= tolerance:
                return said, max(*met, missed)
            met = []
    return None


def _scale(points: Array) -> Array:
    """Scales points to positions along their directions of spread, (P, axes), from -1 to 1."""
    centred = points - points.mean(axis=0)
    _, spreads, directions = np.linalg.svd(centred, full_matrices=False)
    along = centred @ directions[_is_spread(spreads, points)].T
    low, high = along.min(axis=0), along.max(axis=0)
    return (2.0 * along - low - high) / (high - low)


def _is_spread(spreads: Array, points: Array) -> NDArray[np.bool_]:
    """Returns True for each singular direction along which points are spread.

    Directions are from a singular value decomposition.
    """
    return spreads > _NO_SPREAD * max(float(spreads[0]), float(np.abs(points).max()))


def _build_basis(scaled: Array) -> tuple[Array, list[int]]:
    """Builds Chebyshev polynomials at all points, (P, B), by total degree.

    Also returns their number up to each degree.
    """
    num_axes = scaled.shape[1]
    each = chebyshev.chebvander(scaled, _MAX_NODES)  # (P, axes, _MAX_NODES + 1)
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
    """Orders the points as nodes, by the pivots of elimination."""
    order = np.arange(len(basis))
    for row, pivot in enumerate(lu_factor(basis, check_finite=False)[1]):
        order[[row, pivot]] = order[[pivot, row]]
    return order


def _find_extremes(points: Array) -> NDArray[np.intp]:
    """Finds the points farthest from the mean along each direction, in SDs."""
    centred = points - points.mean(axis=0)
    outer, spreads, _ = np.linalg.svd(centred, full_matrices=False)
    kept = _is_spread(spreads, points)
    return np.argsort(-np.square(outer[:, kept]).sum(axis=1), kind="stable")[:_NUM_EXTREME]


def _find_between(scaled: Array, simulated: Sequence[int]) -> list[int]:
    """Finds the points, (P, axes), farthest from the simulated ones and from each other."""
    distances = np.linalg.norm(scaled[:, np.newaxis] - scaled[simulated], axis=2).min(axis=1)
    found: list[int] = []
    for _ in range(_NUM_BETWEEN):
        found.append(int(distances.argmax()))
        distances = np.minimum(distances, np.linalg.norm(scaled - scaled[found[-1]], axis=1))
    return found
