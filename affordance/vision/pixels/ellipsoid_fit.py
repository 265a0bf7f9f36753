"""Fit of an ellipsoid whose near half a camera sees, with its uncertainty.

An ellipsoid is given by its centre c and its shape matrix S = R diag(a^2) R^T, for semi-axes a: the points p with
(p - c)^T A (p - c) = 1, A = S^-1. The picture determines it in two ways. Along the ray d of a pixel its depth t is
the smaller root of

    alpha t^2 - 2 beta t + gamma = 0,    alpha = d^T A d,  beta = d^T A c,  gamma = c^T A c - 1

and its outline is where the roots coincide: d^T Q d = 0 with Q = A c c^T A - gamma A. The fitted quantity is a small
affine deformation of an ellipsoid, x -> x + d + E (x - c) with E symmetric: nine numbers that are meaningful for
every shape, even a ball, whose axes have no direction of their own. Frame C throughout.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from affordance.arrays import Array, build_symmetric, list_entries
from affordance.vision.pixels.rgbd import Camera
from affordance.vision.pixels.sensor_noise import SensorNoise

NUM_NUMBERS = 9
# Readings at larger surface angles are ignored in favour of the outline, because noise and slope grow there, [rad].
_MAX_ANGLE = np.radians(65.0)
# Readings whose error exceeds this number of standard deviations are rejected.
_MAX_DEVIATION = 4.0
# Log-normal prior of the sizes of hand-held objects: median 5 cm, within a factor of two with probability 0.68; it
# matters only where the picture is uninformative.
_PRIOR_SIZE, _PRIOR_LOG_SD = 0.05, 0.7
_ROUNDS = 3
_FIRST_SD = 2e-3  # SD of a reading before the angles are known, [m]
_LEAST_SD = 1e-5  # least SD of a reading, even of a perfect sensor: rounding, [m]
_GRAZING = 0.05  # least cosine between ray and normal in derivatives
_SCALES = np.array([1e-2] * 3 + [0.1] * 6 + [1.0])  # scales of displacements [m], strains and the outline's shift
_NUM_PRIORS = 4  # residuals of priors: three sizes, and the outline's shift
# The outline's shift by the sensor's noise is known up to this: over discs of 10 to 70 pixels' radius it was
# found to be 0.03 to 0.09 where the model predicts 0.07, and rods of 20 pixels' width come out 0.1 too wide with that
# (docs/decisions/0015-vision-from-pixels.md), [pixels].
_SHIFT_SD = 0.05
# Places of xx, yy, zz, xy, xz, yz in a symmetric matrix.
INDICES = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
# Least ratio of the squared axes of a first ellipsoid: the thickness is at least a thousandth of the length.
_LEAST_RATIO = 1e-6


class UndeterminedError(Exception):
    """Error of a fit to measurements that determine no ellipsoid; callers with the picture raise a NoFitError."""


class SeenEllipsoid(NamedTuple):
    """Ellipsoid in the camera's frame: centre p_CEo, (3,), [m], and S = R diag(a^2) R^T, (3, 3), [m^2]."""

    centre: Array
    shape_matrix: Array


class Fit(NamedTuple):
    """Most probable ellipsoid, covariance of its deformations as of ``deform``, (9, 9), [m and 1], and its misfit.

    The misfit is the mean square of the residuals in standard deviations, about 1 for an ellipsoid.
    """

    ellipsoid: SeenEllipsoid
    covariance: Array
    misfit: float


class PartView(NamedTuple):
    """Pixels of an ellipsoid's depth readings, (N, 2), those, (N,), [m], and points of its outline, (K, 2).

    Pixels and points are given by column and row.
    """

    pixels: Array
    depth: Array
    outline: Array


def deform(ellipsoid: SeenEllipsoid, numbers: Array) -> SeenEllipsoid:
    """Moves and deforms an ellipsoid by d, [m], and E (xx, yy, zz, xy, xz, yz), together (9,)."""
    stretch = np.eye(3) + build_symmetric(numbers[3:9])
    return SeenEllipsoid(ellipsoid.centre + numbers[:3], stretch @ ellipsoid.shape_matrix @ stretch)


def express_fit(fit: Fit, X_TC: Array) -> Fit:
    """Expresses a fit in another frame T, given the pose X_TC of its frame C, (4, 4)."""
    R = X_TC[:3, :3]
    turn = np.zeros((NUM_NUMBERS, NUM_NUMBERS))
    turn[:3, :3] = R
    for column in range(6):
        E = R @ build_symmetric(np.eye(6)[column]) @ R.T
        turn[3:, 3 + column] = list_entries(E)
    ellipsoid = SeenEllipsoid(R @ fit.ellipsoid.centre + X_TC[:3, 3], R @ fit.ellipsoid.shape_matrix @ R.T)
    return fit._replace(ellipsoid=ellipsoid, covariance=turn @ fit.covariance @ turn.T)


class Sighting(NamedTuple):
    """Intersections of N rays with an ellipsoid: depth of the near side, [m], points, (N, 3), [m], and normals.

    For a ray outside the outline, the point is the closest one. Normals A (p - c), (N, 3), [1/m], point outwards and
    are not normalised. The distance of each ray inside the outline, (N,), [pixels], is a first-order approximation.
    """

    depth: Array
    points: Array
    normals: Array
    outline_distance: Array


def trace_rays(ellipsoid: SeenEllipsoid, rays: Array, focal_length: float) -> Sighting:
    """Intersects rays, (N, 3), that have z = 1, with an ellipsoid."""
    A, c = np.linalg.inv(ellipsoid.shape_matrix), ellipsoid.centre
    Ac = A @ c
    Ad = rays @ A
    alpha, beta, gamma = np.einsum("ni,ni->n", Ad, rays), rays @ Ac, c @ Ac - 1.0
    inside = beta**2 - alpha * gamma  # d^T Q d
    depth = (beta - np.sqrt(np.maximum(0.0, inside))) / alpha
    points = rays * depth[:, None]
    gradient = beta[:, None] * Ac[:2] - gamma * Ad[:, :2]
    distance = focal_length * inside / (2.0 * np.linalg.norm(gradient, axis=1))
    return Sighting(depth, points, (points - c) @ A, distance)


def differentiate_surface(start: SeenEllipsoid, numbers: Array, g: Array) -> Array:
    """Differentiates F = (p - c)^T A (p - c) - 1 at points with normals g = A (p - c) by the numbers of ``deform``.

    With S = (I + E) S_0 (I + E):  dF = -2 g^T dc - g^T dS g, (N, 9).
    """
    h = g @ (np.eye(3) + build_symmetric(numbers[3:9])) @ start.shape_matrix
    strains = [g[:, i] * h[:, j] + (g[:, j] * h[:, i] if i != j else 0.0) for i, j in INDICES]
    return np.column_stack([-2.0 * g, *(-2.0 * strain for strain in strains)])


def guess(view: PartView, camera: Camera) -> SeenEllipsoid:
    """Estimates a first ellipsoid from moments of the readings, as if seen from far away.

    The covariance of a disc's points (x, y) is a quarter of the shape matrix's block; over the disc the near side is
    the plane through the rim, linear in x and y, less c sqrt(1 - r^2), with mean 2 c / 3 and variance c^2 / 18.
    Readings on a line raise an UndeterminedError.
    """
    points = camera.compute_rays(view.pixels) * view.depth[:, None]
    mean = points.mean(axis=0)
    xy, z = points[:, :2] - mean[:2], points[:, 2] - mean[2]
    S = np.zeros((3, 3))
    S[:2, :2] = 4.0 * xy.T @ xy / len(xy)
    least, most = np.linalg.eigvalsh(S[:2, :2])
    if least <= _LEAST_RATIO * most:
        raise UndeterminedError(f"{len(xy)} readings of a part lie on a line, must cover an area")
    slope = np.linalg.lstsq(xy, z)[0]
    depth = np.sqrt(18.0 * max((z - xy @ slope).var(), 1e-8))
    # The variance includes the readings' noise: the thickness is limited to three times the width.
    depth = min(depth, 3.0 * np.sqrt(most))
    S[2, :2] = S[:2, 2] = S[:2, :2] @ slope
    S[2, 2] = depth**2 + slope @ S[:2, :2] @ slope
    return SeenEllipsoid(mean + np.array([0.0, 0.0, 2.0 / 3.0 * depth]), S)


def fit_ellipsoid(view: PartView, camera: Camera, noise: SensorNoise) -> Fit:
    """Fits an ellipsoid to its measurements in a picture; needs at least as many readings as fitted numbers.

    Readings are weighted by the sensor's noise at the surface angles of the fit, in a few iterations. Measurements
    that do not determine an ellipsoid raise an UndeterminedError.
    """
    try:
        fit = _fit_in_rounds(view, camera, noise)
    except np.linalg.LinAlgError as error:
        raise UndeterminedError(f"what is visible of a part does not determine an ellipsoid: {error}") from error
    if not (np.isfinite(fit.misfit) and np.isfinite(fit.covariance).all()):
        raise UndeterminedError("what is visible of a part does not determine an ellipsoid: infinite covariance")
    return fit


def _fit_in_rounds(view: PartView, camera: Camera, noise: SensorNoise) -> Fit:
    """Fits an ellipsoid like ``fit_ellipsoid``, but a singular matrix raises a LinAlgError."""
    rays, rim = camera.compute_rays(view.pixels), camera.compute_rays(view.outline)
    ellipsoid = guess(view, camera)
    used, sd, bias = np.ones(len(rays), dtype=bool), np.full(len(rays), _FIRST_SD), np.zeros(len(rays))
    for _ in range(_ROUNDS):
        depth = (view.depth - bias)[used]
        problem = _Problem(ellipsoid, rays[used], depth, sd[used], rim, noise, camera.focal_length)
        found = least_squares(
            problem.compute_residuals,
            np.zeros(NUM_NUMBERS + 1),
            problem.compute_jacobian,
            method="lm",  # MINPACK, without threads, which would cost more time than they save
            x_scale=_SCALES,
            xtol=1e-6,
            ftol=1e-6,
        )
        if not found.success:
            raise UndeterminedError(f"no ellipsoid fits a part best: {found.message}")
        ellipsoid = deform(ellipsoid, found.x[:NUM_NUMBERS])
        seen = trace_rays(ellipsoid, rays, camera.focal_length)
        angle = np.arccos(np.clip(-seen.normals[:, 2] / np.linalg.norm(seen.normals, axis=1), 0.0, 1.0))
        bounded = np.minimum(angle, _MAX_ANGLE)
        slope = np.tan(bounded) * seen.depth / camera.focal_length  # [m] a pixel
        sd = np.hypot(noise.compute_axial_sd(seen.depth, bounded), noise.compute_lateral_sd(bounded) * slope)
        sd = np.maximum(sd, _LEAST_SD)
        bias = _compute_bias(ellipsoid, view.pixels, seen.depth, noise.compute_lateral_sd(bounded), camera)
        used = (angle < _MAX_ANGLE) & (np.abs(view.depth - bias - seen.depth) < _MAX_DEVIATION * sd)
        if used.sum() < NUM_NUMBERS:
            reason = f"{used.sum()} of {len(used)} readings of a part agree with one ellipsoid"
            raise UndeterminedError(f"{reason}, must be at least {NUM_NUMBERS}")
    J, residuals = np.asarray(found.jac), found.fun[:-_NUM_PRIORS]
    misfit = float(residuals @ residuals) / max(1, len(residuals) - NUM_NUMBERS)
    covariance = np.linalg.inv(J.T @ J)[:NUM_NUMBERS, :NUM_NUMBERS] * max(1.0, misfit)
    return Fit(ellipsoid, covariance, misfit)


def _compute_bias(ellipsoid: SeenEllipsoid, pixels: Array, depth: Array, lateral_sd: Array, camera: Camera) -> Array:
    """Computes the mean excess depth, (N,), [m], that lateral noise causes in readings of a curved surface.

    The mean over a two-dimensional normal distribution equals that over four points at sqrt(2) SD, to third order.
    """
    neighbours = [
        trace_rays(ellipsoid, camera.compute_rays(pixels + lateral_sd[:, None] * step), camera.focal_length).depth
        for step in np.sqrt(2.0) * np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])
    ]
    return np.mean(neighbours, axis=0) - depth


@dataclass
class _Problem:
    """Residuals of depth, outline and priors for a deformed ellipsoid, in standard deviations.

    Readings are along rays, and the rim are rays to points of the outline.
    """

    start: SeenEllipsoid
    rays: Array
    depth: Array
    sd: Array
    rim: Array
    noise: SensorNoise
    focal_length: float

    def __post_init__(self) -> None:
        """Computes the constant quantities."""
        self.rim_shift, self.rim_sd = self.noise.outline_shift, self.noise.outline_sd
        squares, axes = np.linalg.eigh(self.start.shape_matrix)
        self.log_sizes = 0.5 * np.log(squares)
        # To first order a size changes by u^T E u, for u along its axis.
        self.prior = np.zeros((_NUM_PRIORS, NUM_NUMBERS + 1))
        for column, (i, j) in enumerate(INDICES):
            self.prior[:3, 3 + column] = axes[i] * axes[j] * (1.0 if i == j else 2.0) / _PRIOR_LOG_SD
        self.prior[3, NUM_NUMBERS] = 1.0

    def compute_residuals(self, numbers: Array) -> Array:
        """Computes residuals (N + K + 4,) at the numbers of ``deform`` and the outline's shift in its SD, (10,)."""
        ellipsoid = deform(self.start, numbers[:NUM_NUMBERS])
        seen = trace_rays(ellipsoid, self.rays, self.focal_length)
        rim = trace_rays(ellipsoid, self.rim, self.focal_length)
        shift = self.rim_shift + _SHIFT_SD * numbers[NUM_NUMBERS]
        in_outline = (rim.outline_distance - shift) / self.rim_sd
        prior = self.prior @ numbers
        prior[:3] += (self.log_sizes - np.log(_PRIOR_SIZE)) / _PRIOR_LOG_SD
        return np.concatenate([(seen.depth - self.depth) / self.sd, in_outline, prior])

    def compute_jacobian(self, numbers: Array) -> Array:
        """Computes the residuals' derivatives, (N + K + 4, 10), to first order in the distance from the outline."""
        ellipsoid = deform(self.start, numbers[:NUM_NUMBERS])
        seen = trace_rays(ellipsoid, self.rays, self.focal_length)
        facing = np.einsum("ni,ni->n", seen.normals, self.rays)
        # On the outline depth has no derivative: a ray that just misses is treated as a grazing one.
        facing = np.minimum(facing, -_GRAZING * np.linalg.norm(seen.normals, axis=1))
        surface = differentiate_surface(self.start, numbers, seen.normals)
        J = np.zeros((len(self.rays) + len(self.rim) + _NUM_PRIORS, NUM_NUMBERS + 1))
        J[: len(surface), :NUM_NUMBERS] = surface / (-2.0 * facing * self.sd)[:, None]
        J[len(surface) : -_NUM_PRIORS, :NUM_NUMBERS] = self._differentiate_outline(ellipsoid, numbers)
        J[len(surface) : -_NUM_PRIORS, NUM_NUMBERS] = -_SHIFT_SD / self.rim_sd
        J[-_NUM_PRIORS:] = self.prior
        return J

    def _differentiate_outline(self, ellipsoid: SeenEllipsoid, numbers: Array) -> Array:
        """Differentiates the distances from the outline: the least F along a ray is -(d^T Q d) / alpha."""
        A, rays = np.linalg.inv(ellipsoid.shape_matrix), self.rim
        Ac, Ad = A @ ellipsoid.centre, rays @ A
        alpha, beta = np.einsum("ni,ni->n", Ad, rays), rays @ Ac
        normals = (rays * (beta / alpha)[:, None] - ellipsoid.centre) @ A
        gradient = beta[:, None] * Ac[:2] - (ellipsoid.centre @ Ac - 1.0) * Ad[:, :2]
        factor = -0.5 * self.focal_length * alpha / np.linalg.norm(gradient, axis=1) / self.rim_sd
        derivatives: Array = factor[:, None] * differentiate_surface(self.start, numbers, normals)
        return derivatives
