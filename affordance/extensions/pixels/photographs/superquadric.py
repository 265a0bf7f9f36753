"""Superquadric fit to the evidence in an image about an object on a table.

A superquadric with semi-axes a, b, c and exponents e1 (along its axis) and e2 (around it) is the set n(p) <= 1 with

    n(p) = ((|x/a|^(2/e2) + |y/b|^(2/e2))^(e2/e1) + |z/c|^(2/e1))^(e1/2)

The solid is a box if both exponents are 0.1, a cylinder if they are (0.1, 1), and an ellipsoid if they are 1 (Barr
1981, IEEE Computer Graphics and Applications 1:11-23). The function n is convex and homogeneous of degree one, so the
distance from the surface is approximately (n - 1) / |grad n|.

S is the frame of the solid, along its axes. W is the frame of the table (see ``table``).
"""

from typing import NamedTuple

import numpy as np
from scipy.optimize import OptimizeResult, least_squares
from scipy.special import beta, expit

from affordance.arrays import Array

# Scale of distances beyond which readings are outliers, [m], and effective number of independent readings of each
# kind. Errors of neighbouring pixels are correlated, so SDs would be much too small if all pixels were independent.
_SCALE, _WORTH = 3e-3, 60.0
# Range of exponents, from a box to an ellipsoid.
_LEAST_EXPONENT, _LARGEST_EXPONENT = 0.1, 1.0
# Weak priors: SD of the logit of the exponents; SD of the logarithm of sizes, with a median of 5 cm; SD of the
# logarithm of the ratio of both axes around the solid; and SD of the height of the solid above the table, [m],
# because depth images are warped.
_EXPONENT_SD, _SIZE_SD, _RATIO_SD, _LIFT_SD = 2.0, 1.0, 0.7, 2e-3
_USUAL = np.log(0.025)
# Number of first steps for all hypotheses; largest difference to the lowest cost for which a hypothesis is fitted
# further; number of further steps; and largest difference for which it is kept (relative probability exp(-10)).
_FIRST_STEPS, _HOPELESS, _MOST_STEPS, _CLOSE = 12, 20.0, 40, 10.0
# Initial values for the exponents of a box, a cylinder and an ellipsoid, as logits.
_BOX, _CYLINDER, _ELLIPSOID = (-2.2, -2.2), (-2.2, 3.0), (2.0, 3.0)
# Axes of a horizontal solid in the table frame, before it is rotated: its x axis is along Wz (upwards), its z axis
# along Wx.
_LYING = np.array([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]])


class Superquadric(NamedTuple):
    """Superquadric on a table."""

    semi_axes: Array  # (3,), [m]
    exponents: Array  # (2,)
    X_WS: Array  # pose, (4, 4)

    @property
    def volume(self) -> float:
        """Volume, [m^3] (Jaklic, Leonardis and Solina 2000, Segmentation and Recovery of Superquadrics, ch. 2)."""
        e1, e2 = self.exponents
        factor = e1 * e2 * beta(0.5 * e1 + 1.0, e1) * beta(0.5 * e2, 0.5 * e2)
        return float(2.0 * np.prod(self.semi_axes) * factor)

    def compute_gauge(self, p_W: Array) -> Array:
        """Computes n at points in W, (..., 3)."""
        return self._scale(p_W)[2]

    def measure_distances(self, p_W: Array) -> Array:
        """Approximates the signed distance of points in W, (..., 3), from the surface, [m], negative inside."""
        p, across, n = self._scale(p_W)
        e1, e2 = self.exponents
        around = (across / n) ** (2.0 / e1 - 1.0)
        x, y = ((p[..., axis] / across) ** (2.0 / e2 - 1.0) * around for axis in (0, 1))
        z = (p[..., 2] / n) ** (2.0 / e1 - 1.0)
        a, b, c = self.semi_axes
        distances: Array = (n - 1.0) / np.sqrt((x / a) ** 2 + (y / b) ** 2 + (z / c) ** 2)
        return distances

    def measure_nearest(self, rays_W: Array) -> Array:
        """Approximates the smallest signed distance of each sampled ray, (K, S, 3), from the surface, (K,), [m].

        Distances are negative inside.
        """
        if not len(rays_W):
            return np.zeros(0)
        n = self.compute_gauge(rays_W)
        return self.measure_distances(rays_W[np.arange(len(n)), n.argmin(axis=1)])

    def _scale(self, p_W: Array) -> tuple[Array, Array, Array]:
        """Computes scaled coordinates, (..., 3), the norm of the first two coordinates, and n."""
        p = np.maximum(np.abs((p_W - self.X_WS[:3, 3]) @ self.X_WS[:3, :3]) / self.semi_axes, 1e-9)
        across = _add(p[..., 0], p[..., 1], self.exponents[1])
        return p, across, _add(across, p[..., 2], self.exponents[0])


def _add(x: Array, y: Array, exponent: float) -> Array:
    """Computes (x^(2/e) + y^(2/e))^(e/2) without overflow."""
    most = np.maximum(x, y)
    total: Array = most * (1.0 + (np.minimum(x, y) / most) ** (2.0 / exponent)) ** (0.5 * exponent)
    return total


class Evidence(NamedTuple):
    """Evidence in an image about a solid, in W, [m].

    Attributes:
        surface: Points on the surface, (N, 3).
        empty: Points on K rays outside the solid, (K, S, 3).
        met: Points on K' rays that hit the solid, (K', S, 3).
    """

    surface: Array
    empty: Array
    met: Array


class FittedSolid(NamedTuple):
    """Fitted superquadric with uncertainty.

    Attributes:
        solid: Most probable hypothesis.
        log_volume_sd: Standard deviation of the logarithm of the volume, excluding model errors.
        log_volume: Mean of the logarithm of the volume over hypotheses, [ln m^3].
        centre_covariance: Covariance of the centre in W, (3, 3), [m^2].
        misfit: Mean robust square of the distances between readings and surface, in units of 3 mm.
        cost: Negative log posterior at its maximum.
    """

    solid: Superquadric
    log_volume_sd: float
    log_volume: float
    centre_covariance: Array
    misfit: float
    cost: float


def fit_solid(evidence: Evidence, lift_sd: float = _LIFT_SD) -> FittedSolid:
    """Fits vertical and horizontal superquadrics, and weights them by posterior probability.

    Args:
        evidence: Evidence about the solid.
        lift_sd: Standard deviation of the height of the solid above the table, [m]; larger for a part that is held up
            by another part.
    """
    tried = [
        (is_lying, _climb(evidence, lift_sd, is_lying, start, _FIRST_STEPS))
        for is_lying, start in _list_starts(evidence.surface)
    ]
    least = min(each.cost for _, each in tried)
    found = [
        _describe(evidence, is_lying, _climb(evidence, lift_sd, is_lying, each.x, _MOST_STEPS))
        for is_lying, each in tried
        if each.cost < least + _HOPELESS
    ]
    best = min(found, key=lambda each: each.cost)
    # If no hypothesis fits well, readings are less informative about which one is better.
    temper = max(1.0, best.misfit)
    close = [each for each in found if each.cost - best.cost < _CLOSE * temper]
    weights = np.exp([(best.cost - each.cost) / temper for each in close])
    weights /= weights.sum()
    volumes = np.array([each.log_volume for each in close])
    mean = float(weights @ volumes)
    variance = float(weights @ (np.array([each.log_volume_sd for each in close]) ** 2 + (volumes - mean) ** 2))
    centres = np.array([each.solid.X_WS[:3, 3] for each in close])
    middle = weights @ centres
    covariance = np.einsum("k,kij->ij", weights, np.array([each.centre_covariance for each in close]))
    covariance += np.einsum("k,ki,kj->ij", weights, centres - middle, centres - middle)
    return FittedSolid(best.solid, float(np.sqrt(variance)), mean, covariance, best.misfit, best.cost)


def _list_starts(surface: Array) -> list[tuple[bool, Array]]:
    """Lists hypotheses: orientation (True for horizontal) and initial values from the extent of readings."""
    plan, top = surface[:, :2], float(np.percentile(surface[:, 2], 98.0))
    axes = np.linalg.svd(plan - plan.mean(axis=0), full_matrices=False)[2]
    yaw = float(np.arctan2(axes[0, 1], axes[0, 0]))
    low, high = np.percentile(plan @ axes.T, [1.0, 99.0], axis=0)
    x, y = 0.5 * (low + high) @ axes
    a, b = np.log(np.maximum(0.5 * (high - low), 3e-3))
    c = np.log(max(0.5 * top, 3e-3))
    upright = [(False, np.array([a, b, c, *shape, yaw, x, y, 0.0])) for shape in (_BOX, _CYLINDER, _ELLIPSOID)]
    lying = [
        (True, np.array([c, across, along, *shape, yaw + turn, x, y, 0.0]))
        for along, across, turn in ((a, b, 0.0), (b, a, 0.5 * np.pi))
        for shape in (_CYLINDER, _ELLIPSOID)
    ]
    return upright + lying


def _build(theta: Array, is_lying: bool) -> Superquadric:
    semi_axes = np.exp(np.clip(theta[:3], -7.0, 0.0))
    exponents = _LEAST_EXPONENT + (_LARGEST_EXPONENT - _LEAST_EXPONENT) * expit(theta[3:5])
    cos, sin = np.cos(theta[5]), np.sin(theta[5])
    X_WS = np.eye(4)
    turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    X_WS[:3, :3] = turn @ _LYING if is_lying else turn
    X_WS[:3, 3] = theta[6], theta[7], semi_axes[0 if is_lying else 2] + theta[8]
    return Superquadric(semi_axes, exponents, X_WS)


def _climb(evidence: Evidence, lift_sd: float, is_lying: bool, start: Array, steps: int) -> OptimizeResult:
    """Fits one hypothesis in at most the given number of steps."""
    ways = [evidence.surface, evidence.empty, evidence.met]
    weights = [np.sqrt(min(1.0, _WORTH / max(len(way), 1))) for way in ways]

    def compute_residuals(theta: Array) -> Array:
        solid = _build(theta, is_lying)
        # Residuals are the depth to which empty rays enter the solid, and the distance by which other rays miss it.
        entered = np.minimum(solid.measure_nearest(evidence.empty), 0.0)
        missed = np.maximum(solid.measure_nearest(evidence.met), 0.0)
        prior = [
            *(theta[:3] - _USUAL) / _SIZE_SD,
            (theta[0] - theta[1]) / _RATIO_SD,
            *theta[3:5] / _EXPONENT_SD,
            theta[8] / lift_sd,
        ]
        distances = (solid.measure_distances(evidence.surface), entered, missed)
        scaled = [w * _soften(d / _SCALE) for w, d in zip(weights, distances, strict=True)]
        return np.concatenate([*scaled, prior])

    return least_squares(compute_residuals, start, x_scale="jac", max_nfev=steps)


def _describe(evidence: Evidence, is_lying: bool, found: OptimizeResult) -> FittedSolid:
    """Estimates the uncertainty of a hypothesis with the Laplace approximation."""
    solid = _build(found.x, is_lying)
    covariance = np.linalg.inv(found.jac.T @ found.jac + 1e-6 * np.eye(len(found.x)))

    def measure(theta: Array) -> Array:
        each = _build(theta, is_lying)
        return np.array([np.log(each.volume), *each.X_WS[:3, 3]])

    step = 1e-4
    slopes = np.array(
        [(measure(found.x + d) - measure(found.x - d)) / (2.0 * step) for d in step * np.eye(len(found.x))]
    )
    errors = slopes.T @ covariance @ slopes
    misfit = float(np.mean(_soften(solid.measure_distances(evidence.surface) / _SCALE) ** 2))
    log_volume = float(np.log(solid.volume))
    return FittedSolid(solid, float(np.sqrt(errors[0, 0])), log_volume, errors[1:, 1:], misfit, float(found.cost))


def _soften(u: Array) -> Array:
    """Computes robust residuals, whose squares grow like |u| for large |u|."""
    softened: Array = np.sign(u) * np.sqrt(2.0 * (np.sqrt(1.0 + u * u) - 1.0))
    return softened


def build_mesh(solid: Superquadric, rows: int = 33, columns: int = 64) -> tuple[Array, Array]:
    """Builds a closed mesh with the exact volume of the solid.

    Returns: Vertices in S, (n, 3), [m], and faces, (m, 3).
    """
    e1, e2 = solid.exponents
    eta = np.linspace(-0.5 * np.pi, 0.5 * np.pi, rows)[1:-1]
    omega = np.linspace(-np.pi, np.pi, columns, endpoint=False)
    cos_eta, sin_eta = _raise(np.cos(eta), e1), _raise(np.sin(eta), e1)
    ring = np.column_stack([_raise(np.cos(omega), e2), _raise(np.sin(omega), e2)])
    points = np.concatenate(
        [np.column_stack([scale * ring, np.full(columns, z)]) for scale, z in zip(cos_eta, sin_eta, strict=True)]
    )
    vertices = np.concatenate([points, [[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]]]) * solid.semi_axes
    faces = []
    after = np.roll(np.arange(columns), -1)
    for row in range(rows - 3):
        lower, upper = row * columns + np.arange(columns), (row + 1) * columns + np.arange(columns)
        faces += [np.column_stack([lower, lower[after], upper[after]]), np.column_stack([lower, upper[after], upper])]
    south, last = len(points), (rows - 3) * columns + np.arange(columns)
    faces.append(np.column_stack([np.arange(columns)[after], np.arange(columns), np.full(columns, south)]))
    faces.append(np.column_stack([last, last[after], np.full(columns, south + 1)]))
    triangles = np.concatenate(faces)
    corners = vertices[triangles]
    volume = float(np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6.0)
    return vertices * np.cbrt(solid.volume / volume), triangles


def _raise(x: Array, exponent: float) -> Array:
    raised: Array = np.sign(x) * np.abs(x) ** exponent
    return raised
