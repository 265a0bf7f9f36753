"""Fits an ellipsoid to its visible near half, with an estimate of uncertainty.

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
from affordance.extensions.pixels.rgbd import Camera
from affordance.extensions.pixels.sensor_noise import SensorNoise

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
_LEAST_SD = 1e-5  # least SD of a reading, even from a perfect sensor, because of rounding, [m]
_GRAZING = 0.05  # least cosine between ray and normal that derivatives use
_SCALES = np.array([1e-2] * 3 + [0.1] * 6 + [1.0])  # scales of displacements [m], strains and the outline's shift
_NUM_PRIORS = 4  # number of residuals from priors: three sizes, and the outline's shift
# Standard deviation of the shift of the outline by sensor noise, [pixels]. Over discs of 10 to 70 pixels' radius the
# shift is 0.03 to 0.09 where the model predicts 0.07, and rods 20 pixels wide are then measured 0.1 pixel too wide
# (docs/decisions/0015-vision-from-pixels.md).
_SHIFT_SD = 0.05
# Row and column of xx, yy, zz, xy, xz, yz in a symmetric matrix.
INDICES = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
# Least ratio of the squared axes of the initial ellipsoid: the thickness is at least a thousandth of the length.
_LEAST_RATIO = 1e-6


class UndeterminedError(Exception):
    """Error for measurements that determine no ellipsoid. Callers with the picture raise a NoFitError instead."""


class SeenEllipsoid(NamedTuple):
    """Ellipsoid in the camera's frame: centre p_CEo, (3,), [m], and S = R diag(a^2) R^T, (3, 3), [m^2]."""

    centre: Array
    shape_matrix: Array


class Fit(NamedTuple):
    """Most probable ellipsoid, covariance of ``deform``'s numbers, (9, 9), and misfit.

    The misfit is the mean square of the residuals in standard deviations, about 1 for an ellipsoid.
    """

    ellipsoid: SeenEllipsoid
    covariance: Array
    misfit: float


class PartView(NamedTuple):
    """Measurements of an ellipsoid in a picture: depths, (N,), [m], pixels, and outline.

    Pixels are (N, 2), the outline is (K, 2).

    Pixels and points of the outline are given as column and row.
    """

    pixels: Array
    depth: Array
    outline: Array


def deform(ellipsoid: SeenEllipsoid, numbers: Array) -> SeenEllipsoid:
    """Moves and deforms an ellipsoid by d, [m], and E, together (9,). E is (xx, yy, zz, xy, xz, yz)."""
    stretch = np.eye(3) + build_symmetric(numbers[3:9])
    return SeenEllipsoid(ellipsoid.centre + numbers[:3], stretch @ ellipsoid.shape_matrix @ stretch)


def express_fit(fit: Fit, X_TC: Array) -> Fit:
    """Expresses a fit in another frame T, given the pose X_TC, (4, 4)."""
    R = X_TC[:3, :3]
    turn = np.zeros((NUM_NUMBERS, NUM_NUMBERS))
    turn[:3, :3] = R
    for column in range(6):
        E = R @ build_symmetric(np.eye(6)[column]) @ R.T
        turn[3:, 3 + column] = list_entries(E)
    ellipsoid = SeenEllipsoid(R @ fit.ellipsoid.centre + X_TC[:3, 3], R @ fit.ellipsoid.shape_matrix @ R.T)
    return fit._replace(ellipsoid=ellipsoid, covariance=turn @ fit.covariance @ turn.T)


class Sighting(NamedTuple):
    """Intersections of N rays with an ellipsoid.

    Depth, (N,), [m], and points, (N, 3), [m], are on the near side. For a ray outside the outline, they belong to its
    point closest to the ellipsoid. Normals A (p - c), (N, 3), [1/m], point outwards and are not normalised. The
    outline distance, (N,), [pixels], is each ray's distance inside the outline, to first order.
    """

    depth: Array
    points: Array
    normals: Array
    outline_distance: Array


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
    """Differentiates F = (p - c)^T A (p - c) - 1 with respect to the numbers of ``deform``.

    Points p are given by their normals g = A (p - c).

    With S = (I + E) S_0 (I + E):  dF = -2 g^T dc - g^T dS g, (N, 9).
    """
    h = g @ (np.eye(3) + build_symmetric(numbers[3:9])) @ start.shape_matrix
    strains = [g[:, i] * h[:, j] + (g[:, j] * h[:, i] if i != j else 0.0) for i, j in INDICES]
    return np.column_stack([-2.0 * g, *(-2.0 * strain for strain in strains)])


def guess(view: PartView, camera: Camera) -> SeenEllipsoid:
    """Estimates an initial ellipsoid from moments of the readings. The ellipsoid is taken to be far away.

    The covariance of a disc's points (x, y) is a quarter of the shape matrix's block. Over the disc the near side is
    the plane through the rim, linear in x and y, minus c sqrt(1 - r^2), which has mean 2 c / 3 and variance c^2 / 18.

    Raises:
        UndeterminedError: The readings lie on a line.
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
    """Fits an ellipsoid to measurements from a picture. The fit needs at least as many readings as fitted numbers.

    Readings are weighted by the sensor's noise at the surface angles of the fit, which takes a few iterations.

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
    """Fits an ellipsoid like ``fit_ellipsoid``. A singular matrix raises a LinAlgError."""
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
            method="lm",  # MINPACK: it starts no threads, which would cost more time than they save
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
    """Computes the mean excess depth, (N,), [m], due to lateral noise on a curved surface.

    The mean over a two-dimensional normal distribution equals that over four points at sqrt(2) SD, to third order.
    """
    neighbours = [
        trace_rays(ellipsoid, camera.compute_rays(pixels + lateral_sd[:, None] * step), camera.focal_length).depth
        for step in np.sqrt(2.0) * np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])
    ]
    return np.mean(neighbours, axis=0) - depth


@dataclass
class _Problem:
    """Residuals of depth, outline and priors for a deformed ellipsoid. Residuals are in standard deviations.

    Depth readings are taken along ``rays``; ``rim`` has the rays to points of the outline.
    """

    start: SeenEllipsoid
    rays: Array
    depth: Array
    sd: Array
    rim: Array
    noise: SensorNoise
    focal_length: float

    def __post_init__(self) -> None:
        """Computes quantities that stay constant during the fit."""
        self.rim_shift, self.rim_sd = self.noise.outline_shift, self.noise.outline_sd
        squares, axes = np.linalg.eigh(self.start.shape_matrix)
        self.log_sizes = 0.5 * np.log(squares)
        # To first order a size changes by the factor 1 + u^T E u, where u is the direction of its axis.
        self.prior = np.zeros((_NUM_PRIORS, NUM_NUMBERS + 1))
        for column, (i, j) in enumerate(INDICES):
            self.prior[:3, 3 + column] = axes[i] * axes[j] * (1.0 if i == j else 2.0) / _PRIOR_LOG_SD
        self.prior[3, NUM_NUMBERS] = 1.0

    def compute_residuals(self, numbers: Array) -> Array:
        """Computes the residuals, (N + K + 4,).

        The numbers, (10,), are the numbers of ``deform``, and the outline's shift in units of its SD.
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
        """Computes the residuals' derivatives, (N + K + 4, 10).

        The derivatives are of first order in the distance to the outline.
        """
        ellipsoid = deform(self.start, numbers[:NUM_NUMBERS])
        seen = trace_rays(ellipsoid, self.rays, self.focal_length)
        facing = np.einsum("ni,ni->n", seen.normals, self.rays)
        # At the outline the derivative of depth is infinite, so a ray that just misses is treated as a grazing one.
        facing = np.minimum(facing, -_GRAZING * np.linalg.norm(seen.normals, axis=1))
        surface = differentiate_surface(self.start, numbers, seen.normals)
        J = np.zeros((len(self.rays) + len(self.rim) + _NUM_PRIORS, NUM_NUMBERS + 1))
        J[: len(surface), :NUM_NUMBERS] = surface / (-2.0 * facing * self.sd)[:, None]
        J[len(surface) : -_NUM_PRIORS, :NUM_NUMBERS] = self._differentiate_outline(ellipsoid, numbers)
        J[len(surface) : -_NUM_PRIORS, NUM_NUMBERS] = -_SHIFT_SD / self.rim_sd
        J[-_NUM_PRIORS:] = self.prior
        return J

    def _differentiate_outline(self, ellipsoid: SeenEllipsoid, numbers: Array) -> Array:
        """Differentiates the distances to the outline. The least F along a ray is -(d^T Q d) / alpha."""
        A, rays = np.linalg.inv(ellipsoid.shape_matrix), self.rim
        Ac, Ad = A @ ellipsoid.centre, rays @ A
        alpha, beta = np.einsum("ni,ni->n", Ad, rays), rays @ Ac
        normals = (rays * (beta / alpha)[:, None] - ellipsoid.centre) @ A
        gradient = beta[:, None] * Ac[:2] - (ellipsoid.centre @ Ac - 1.0) * Ad[:, :2]
        factor = -0.5 * self.focal_length * alpha / np.linalg.norm(gradient, axis=1) / self.rim_sd
        derivatives: Array = factor[:, None] * differentiate_surface(self.start, numbers, normals)
        return derivatives
