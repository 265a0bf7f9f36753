"""Interpolation of trajectories of many observers from a few simulated observers, with error control.

The trajectory of a held object is a continuous function of the believed densities. Complete trajectories are
interpolated, because their extrema are not smooth functions of beliefs.

For one density, a cubic spline is used. Intervals between nodes are halved until the trajectory at the midpoint is
predicted within a tolerance, so that nodes concentrate where the arm reaches a limit. For several densities,
polynomials are used. Their nodes are discrete Leja points (Bos, De Marchi, Sommariva and Vianello 2010, SIAM J.
Numer. Anal. 48:1984-1999). Each new trajectory is compared with the prediction from previous nodes, until several in
succession are predicted within the tolerance. Observers with extreme beliefs or with beliefs far from all nodes are
most likely to reach limits of the arm, and are therefore simulated and compared, too. If the tolerance is not met,
all observers are simulated.
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

# Largest error of a predicted trajectory, [m], which is a hundredth of the smallest relevant drop. When this
# trajectory is added as a node, the error usually becomes ten times smaller.
TOLERANCE = 5e-5
# Number of initial nodes of a spline, and smallest number of nodes for interpolation.
_NUM_FIRST, _LEAST_FIRST = 7, 4
# Tolerance at midpoints as a fraction of the tolerance. Near a kink, errors elsewhere are up to twice as large.
_LINE_SHARE = 0.5
# Number of successive trajectories that polynomials must predict. A single one can agree by chance.
_NUM_MET = 2
# Numbers of additional observers for comparison: with the most extreme beliefs, and with beliefs that are farthest
# from all simulated observers.
_NUM_EXTREME = 6
_NUM_BETWEEN = 6
# Smallest spread of beliefs along a direction, as a fraction of the largest spread.
_NO_SPREAD = 1e-9
# Largest number of nodes of polynomials (degree 9 for two densities).
_MAX_NODES = 60


class Motions(NamedTuple):
    """Trajectories of R observers."""

    heights: Array  # height over time, (R, N), [m]
    # Largest error of predicted trajectories in the last comparison, [m]; zero if all were simulated. The compared
    # trajectories of splines are added as nodes afterwards.
    error: float
    num_simulated: int  # number of different trajectories that were simulated
    num_distinct: int  # number of different trajectories


class _Simulated:
    """Cache of trajectories that are simulated on demand."""

    def __init__(self, simulate: Callable[[Array], Array], candidates: Array) -> None:
        self._simulate = simulate
        self._candidates = candidates
        self.found: dict[int, Array] = {}

    def hold(self, index: int) -> Array:
        """Returns the trajectory of a candidate, (N,), [m]."""
        if index not in self.found:
            self.found[index] = self._simulate(self._candidates[index])
        return self.found[index]

    def hold_all(self, indices: Iterable[int]) -> Array:
        """Returns the trajectories of K candidates, (K, N), [m]."""
        return np.array([self.hold(int(index)) for index in indices])


def interpolate_motions(
    simulate: Callable[[Array], Array], believed: Array, true: Array | None = None, tolerance: float = TOLERANCE
) -> Motions:
    """Computes the trajectories of observers with given beliefs within a tolerance.

    Args:
        simulate: Function that simulates the trajectory, (N,), [m], for believed densities, (M,).
        believed: Believed densities of each observer, (R, M), [kg/m^3].
        true: True densities, (M,), which are used as a node; None if no believed densities can be true.
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
    """Interpolates trajectories along a line of beliefs with a cubic spline.

    Args:
        motions: Trajectories of the candidates.
        scaled: Positions of the candidates along the line, (P,), from -1 to 1.
        num_true: Number of true beliefs, which are the first candidates and always nodes.
        tolerance: Largest error, [m].

    Returns: Trajectories of all candidates, (P, N), [m], and largest error at midpoints; None if all must be
        simulated.
    """
    order = np.unique(scaled.round(9), return_index=True)[1]  # the true belief precedes equal positions
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
    """Interpolates trajectories over several directions of beliefs with polynomials.

    Args:
        motions: Trajectories of the candidates.
        scaled: Positions of the candidates, (P, axes), from -1 to 1.
        extremes: Candidates with extreme beliefs, for comparison.
        tolerance: Largest error, [m].

    Returns: Trajectories of all candidates, (P, N), [m], and largest error in the comparison; None if all must be
        simulated.
    """
    basis, sizes = _build_basis(scaled)
    order = _order_nodes(basis)
    said: Array | None = None  # trajectories of all candidates, predicted from the previous nodes
    met: list[float] = []  # errors of successive trajectories within the tolerance
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
    """Scales points to positions from -1 to 1 along their principal directions, (P, axes)."""
    centred = points - points.mean(axis=0)
    _, spreads, directions = np.linalg.svd(centred, full_matrices=False)
    along = centred @ directions[_is_spread(spreads, points)].T
    low, high = along.min(axis=0), along.max(axis=0)
    return (2.0 * along - low - high) / (high - low)


def _is_spread(spreads: Array, points: Array) -> NDArray[np.bool_]:
    """Returns True for each principal direction along which points are not constant."""
    return spreads > _NO_SPREAD * max(float(spreads[0]), float(np.abs(points).max()))


def _build_basis(scaled: Array) -> tuple[Array, list[int]]:
    """Evaluates Chebyshev polynomials at all points, by increasing total degree.

    Returns: Values, (P, B), and number of polynomials up to each degree.
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
    """Orders points as discrete Leja points, which are the pivots of an LU decomposition."""
    order = np.arange(len(basis))
    for row, pivot in enumerate(lu_factor(basis, check_finite=False)[1]):
        order[[row, pivot]] = order[[pivot, row]]
    return order


def _find_extremes(points: Array) -> NDArray[np.intp]:
    """Finds the points with the largest Mahalanobis distance from the mean."""
    centred = points - points.mean(axis=0)
    outer, spreads, _ = np.linalg.svd(centred, full_matrices=False)
    kept = _is_spread(spreads, points)
    return np.argsort(-np.square(outer[:, kept]).sum(axis=1), kind="stable")[:_NUM_EXTREME]


def _find_between(scaled: Array, simulated: Sequence[int]) -> list[int]:
    """Finds the points, (P, axes), that are farthest from simulated points and from each other."""
    distances = np.linalg.norm(scaled[:, np.newaxis] - scaled[simulated], axis=2).min(axis=1)
    found: list[int] = []
    for _ in range(_NUM_BETWEEN):
        found.append(int(distances.argmax()))
        distances = np.minimum(distances, np.linalg.norm(scaled - scaled[found[-1]], axis=1))
    return found
