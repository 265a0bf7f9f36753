"""Ellipsoid fit to the visible surface of a part, with covariance.

An ellipsoid with centre c, semi-axes a and shape matrix S = R diag(a^2) R^T consists of the points p with
(p - c)^T A (p - c) = 1, A = S^-1. Along the ray d of a pixel, its depth t is the smaller root of

    alpha t^2 - 2 beta t + gamma = 0,    alpha = d^T A d,  beta = d^T A c,  gamma = c^T A c - 1

At the outline both roots coincide: d^T Q d = 0 with Q = A c c^T A - gamma A. Depth and outline are fitted. The nine
fitted parameters describe a small affine deformation of an initial ellipsoid, x -> x + d + E (x - c) with symmetric
E. These parameters are well-defined for all shapes, including a sphere, whose axes are arbitrary. All vectors are in
the camera frame C.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from affordance.arrays import Array, build_symmetric, list_entries
from affordance.extensions.pixels.rgbd import Camera
from affordance.extensions.pixels.sensor_noise import SensorNoise

NUM_NUMBERS = 9
# Largest surface angle of depth readings, [rad]. Noise and slope increase towards the outline, which is fitted
# instead.
_MAX_ANGLE = np.radians(65.0)
# Largest error of a depth reading in standard deviations. Readings with larger errors are outliers.
_MAX_DEVIATION = 4.0
# Log-normal prior of sizes of hand-held objects: median 5 cm, and within a factor of two with probability 0.68. It
# matters only if the image is uninformative.
_PRIOR_SIZE, _PRIOR_LOG_SD = 0.05, 0.7
_ROUNDS = 3
_FIRST_SD = 2e-3  # SD of a depth reading in the first round, before surface angles are known, [m]
_LEAST_SD = 1e-5  # smallest SD of a depth reading, due to rounding, [m]
_GRAZING = 0.05  # smallest cosine between ray and normal in derivatives
_SCALES = np.array([1e-2] * 3 + [0.1] * 6 + [1.0])  # scales of displacements, [m], strains, and shift of the outline
_NUM_PRIORS = 4  # number of residuals from priors: three sizes, and shift of the outline
# Prior SD of the shift of the outline due to sensor noise, [pixels]. For discs with radii of 10 to 70 pixels, the
# shift is 0.03 to 0.09, and the model predicts 0.07. Rods with a width of 20 pixels are then measured 0.1 pixel too
# wide (docs/decisions/0015-vision-from-pixels.md).
_SHIFT_SD = 0.05
# Row and column of xx, yy, zz, xy, xz, yz in a symmetric matrix.
INDICES = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
# Smallest ratio of the squared axes of the initial ellipsoid.
_LEAST_RATIO = 1e-6


class UndeterminedError(Exception):
    """Error for measurements that do not determine an ellipsoid. Callers convert it to a NoFitError."""


class SeenEllipsoid(NamedTuple):
    """Ellipsoid in the camera frame."""

    centre: Array  # p_CEo, (3,), [m]
    shape_matrix: Array  # S = R diag(a^2) R^T, (3, 3), [m^2]


class Fit(NamedTuple):
    """Fitted ellipsoid with its covariance."""

    ellipsoid: SeenEllipsoid  # most probable ellipsoid
    covariance: Array  # of the parameters of ``deform``, (9, 9)
    misfit: float  # mean square of the standardised residuals, about 1 if the part is an ellipsoid


class PartView(NamedTuple):
    """Measurements of a part in an image. Pixel coordinates are column and row."""

    pixels: Array  # (N, 2)
    depth: Array  # depth at these pixels, (N,), [m]
    outline: Array  # points of the outline, (K, 2), [pixels]


def deform(ellipsoid: SeenEllipsoid, numbers: Array) -> SeenEllipsoid:
    """Moves and deforms an ellipsoid.

    Args:
        ellipsoid: Ellipsoid.
        numbers: Displacement d, [m], and strain E as (xx, yy, zz, xy, xz, yz), together (9,).
    """
    stretch = np.eye(3) + build_symmetric(numbers[3:9])
    return SeenEllipsoid(ellipsoid.centre + numbers[:3], stretch @ ellipsoid.shape_matrix @ stretch)


def express_fit(fit: Fit, X_TC: Array) -> Fit:
    """Transforms a fit to another frame T, given the pose X_TC, (4, 4)."""
    R = X_TC[:3, :3]
    turn = np.zeros((NUM_NUMBERS, NUM_NUMBERS))
    turn[:3, :3] = R
    for column in range(6):
        E = R @ build_symmetric(np.eye(6)[column]) @ R.T
        turn[3:, 3 + column] = list_entries(E)
    ellipsoid = SeenEllipsoid(R @ fit.ellipsoid.centre + X_TC[:3, 3], R @ fit.ellipsoid.shape_matrix @ R.T)
    return fit._replace(ellipsoid=ellipsoid, covariance=turn @ fit.covariance @ turn.T)


class Sighting(NamedTuple):
    """Intersections of N rays with the near side of an ellipsoid.

    For rays outside the outline, results are for the point that is closest to the ellipsoid.
    """

    depth: Array  # (N,), [m]
    points: Array  # (N, 3), [m]
    normals: Array  # outward normals A (p - c), not normalised, (N, 3), [1/m]
    outline_distance: Array  # distance of each ray inside the outline, to first order, (N,), [pixels]


def trace_rays(ellipsoid: SeenEllipsoid, rays: Array, focal_length: float) -> Sighting:
    """Intersects rays, (N, 3) with z = 1, with an ellipsoid."""
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
    """Differentiates F = (p - c)^T A (p - c) - 1 with respect to the parameters of ``deform``, (N, 9).

    With S = (I + E) S_0 (I + E), the differential is dF = -2 g^T dc - g^T dS g.

    Args:
        start: Ellipsoid before deformation.
        numbers: Parameters of the deformation, (9,).
        g: Normals A (p - c) at N points, (N, 3), [1/m].
    """
    h = g @ (np.eye(3) + build_symmetric(numbers[3:9])) @ start.shape_matrix
    strains = [g[:, i] * h[:, j] + (g[:, j] * h[:, i] if i != j else 0.0) for i, j in INDICES]
    return np.column_stack([-2.0 * g, *(-2.0 * strain for strain in strains)])


def guess(view: PartView, camera: Camera) -> SeenEllipsoid:
    """Estimates an initial ellipsoid from moments of the depth readings, assuming parallel rays.

    The covariance of the points (x, y) of a disc is a quarter of the corresponding block of the shape matrix. The
    near side is a plane through the outline minus c sqrt(1 - r^2), which has mean 2 c / 3 and variance c^2 / 18 over
    the disc.

    Raises:
        UndeterminedError: The readings are collinear.
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
    # The variance includes sensor noise, so the thickness is limited to three times the width.
    depth = min(depth, 3.0 * np.sqrt(most))
    S[2, :2] = S[:2, 2] = S[:2, :2] @ slope
    S[2, 2] = depth**2 + slope @ S[:2, :2] @ slope
    return SeenEllipsoid(mean + np.array([0.0, 0.0, 2.0 / 3.0 * depth]), S)


def fit_ellipsoid(view: PartView, camera: Camera, noise: SensorNoise) -> Fit:
    """Fits an ellipsoid to measurements of a part, which need at least ``NUM_NUMBERS`` depth readings.

    Depth readings are weighted with the sensor noise at the surface angles of the previous fit, in several rounds.

    Raises:
        UndeterminedError: The measurements do not determine an ellipsoid.
    """
    try:
        fit = _fit_in_rounds(view, camera, noise)
    except np.linalg.LinAlgError as error:
        raise UndeterminedError(f"the visible surface of a part does not determine an ellipsoid: {error}") from error
    if not (np.isfinite(fit.misfit) and np.isfinite(fit.covariance).all()):
        raise UndeterminedError("the visible surface of a part does not determine an ellipsoid: infinite covariance")
    return fit


def _fit_in_rounds(view: PartView, camera: Camera, noise: SensorNoise) -> Fit:
    """Fits an ellipsoid like ``fit_ellipsoid``, but raises a LinAlgError for singular matrices."""
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
            method="lm",  # MINPACK does not start threads, which would slow down the fit
            x_scale=_SCALES,
            xtol=1e-6,
            ftol=1e-6,
        )
        if not found.success:
            raise UndeterminedError(f"the fit of an ellipsoid to a part does not converge: {found.message}")
        ellipsoid = deform(ellipsoid, found.x[:NUM_NUMBERS])
        seen = trace_rays(ellipsoid, rays, camera.focal_length)
        angle = np.arccos(np.clip(-seen.normals[:, 2] / np.linalg.norm(seen.normals, axis=1), 0.0, 1.0))
        bounded = np.minimum(angle, _MAX_ANGLE)
        slope = np.tan(bounded) * seen.depth / camera.focal_length  # [m] per pixel
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
    """Computes the bias of depth readings due to lateral noise on a curved surface, (N,), [m].

    The mean over a two-dimensional normal distribution is approximated by the mean over four points at sqrt(2) SD,
    which is exact to third order.
    """
    neighbours = [
        trace_rays(ellipsoid, camera.compute_rays(pixels + lateral_sd[:, None] * step), camera.focal_length).depth
        for step in np.sqrt(2.0) * np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])
    ]
    return np.mean(neighbours, axis=0) - depth


@dataclass
class _Problem:
    """Standardised residuals of depth, outline and priors for a deformed ellipsoid."""

    start: SeenEllipsoid
    rays: Array  # rays of depth readings, (N, 3)
    depth: Array
    sd: Array
    rim: Array  # rays to points of the outline, (K, 3)
    noise: SensorNoise
    focal_length: float

    def __post_init__(self) -> None:
        """Computes the constant derivatives of priors."""
        self.rim_shift, self.rim_sd = self.noise.outline_shift, self.noise.outline_sd
        squares, axes = np.linalg.eigh(self.start.shape_matrix)
        self.log_sizes = 0.5 * np.log(squares)
        # To first order, a size with axis direction u changes by the factor 1 + u^T E u.
        self.prior = np.zeros((_NUM_PRIORS, NUM_NUMBERS + 1))
        for column, (i, j) in enumerate(INDICES):
            self.prior[:3, 3 + column] = axes[i] * axes[j] * (1.0 if i == j else 2.0) / _PRIOR_LOG_SD
        self.prior[3, NUM_NUMBERS] = 1.0

    def compute_residuals(self, numbers: Array) -> Array:
        """Computes the residuals, (N + K + 4,).

        Args:
            numbers: Parameters of ``deform``, and shift of the outline divided by its SD, (10,).
        """
        ellipsoid = deform(self.start, numbers[:NUM_NUMBERS])
        seen = trace_rays(ellipsoid, self.rays, self.focal_length)
        rim = trace_rays(ellipsoid, self.rim, self.focal_length)
        shift = self.rim_shift + _SHIFT_SD * numbers[NUM_NUMBERS]
        in_outline = (rim.outline_distance - shift) / self.rim_sd
        prior = self.prior @ numbers
        prior[:3] += (self.log_sizes - np.log(_PRIOR_SIZE)) / _PRIOR_LOG_SD
        return np.concatenate([(seen.depth - self.depth) / self.sd, in_outline, prior])

    def compute_jacobian(self, numbers: Array) -> Array:
        """Computes the derivatives of the residuals, (N + K + 4, 10), to first order in distances to the outline."""
        ellipsoid = deform(self.start, numbers[:NUM_NUMBERS])
        seen = trace_rays(ellipsoid, self.rays, self.focal_length)
        facing = np.einsum("ni,ni->n", seen.normals, self.rays)
        # The derivative of depth is infinite at the outline, so the angle between ray and surface is limited.
        facing = np.minimum(facing, -_GRAZING * np.linalg.norm(seen.normals, axis=1))
        surface = differentiate_surface(self.start, numbers, seen.normals)
        J = np.zeros((len(self.rays) + len(self.rim) + _NUM_PRIORS, NUM_NUMBERS + 1))
        J[: len(surface), :NUM_NUMBERS] = surface / (-2.0 * facing * self.sd)[:, None]
        J[len(surface) : -_NUM_PRIORS, :NUM_NUMBERS] = self._differentiate_outline(ellipsoid, numbers)
        J[len(surface) : -_NUM_PRIORS, NUM_NUMBERS] = -_SHIFT_SD / self.rim_sd
        J[-_NUM_PRIORS:] = self.prior
        return J

    def _differentiate_outline(self, ellipsoid: SeenEllipsoid, numbers: Array) -> Array:
        """Differentiates the distances to the outline, using the minimum of F along a ray, -(d^T Q d) / alpha."""
        A, rays = np.linalg.inv(ellipsoid.shape_matrix), self.rim
        Ac, Ad = A @ ellipsoid.centre, rays @ A
        alpha, beta = np.einsum("ni,ni->n", Ad, rays), rays @ Ac
        normals = (rays * (beta / alpha)[:, None] - ellipsoid.centre) @ A
        gradient = beta[:, None] * Ac[:2] - (ellipsoid.centre @ Ac - 1.0) * Ad[:, :2]
        factor = -0.5 * self.focal_length * alpha / np.linalg.norm(gradient, axis=1) / self.rim_sd
        derivatives: Array = factor[:, None] * differentiate_surface(self.start, numbers, normals)
        return derivatives
