"""Detection and measurement of the parts of an object in an image."""

from typing import NamedTuple

import cv2
import numpy as np

from affordance.arrays import Array, Mask, build_symmetric
from affordance.exceptions import HiddenPartError, NoFitError, TooSmallError
from affordance.extensions.pixels.ellipsoid_fit import (
    NUM_NUMBERS,
    Fit,
    PartView,
    SeenEllipsoid,
    UndeterminedError,
    express_fit,
    fit_ellipsoid,
    trace_rays,
)
from affordance.extensions.pixels.rgbd import Camera, Picture
from affordance.extensions.pixels.rig import Rig, compute_shading
from affordance.extensions.pixels.segmentation import Segmentation, find_window, segment
from affordance.extensions.pixels.sensor_noise import SensorNoise
from affordance.objects.colour import Colour
from affordance.objects.inertia import Ellipsoid
from affordance.vision.features import ComponentFeatures

# Standard deviation of a measured colour in each direction of CIELAB. The median error of objects in
# `run_experiments.py vision` is 0.3 (colour_error_median), and 1.2 for slender parts, whose normals are less certain.
COLOUR_SD = 0.7
# Largest misfit of an ellipsoid. Typical values for thousands of readings are 1.0 to 1.2.
MAX_MISFIT = 1.5
# Smallest visible fraction of a part. With less than one half, the shape of the hidden end is unknown.
MIN_SHOWN = 0.5
# Every k-th depth reading is fitted if a part has at least k times this number, k = 2, 3, ... Beyond about a thousand
# readings, the outline determines the accuracy.
MAX_READINGS = 3000
# Points of an outline within this distance of another part can belong to that part, [pixels].
_BORDER = 3


class Detection(NamedTuple):
    """Detected parts in an image."""

    segmentation: Segmentation
    fits: tuple[Fit, ...]  # ellipsoid of each part in the camera frame
    colours: tuple[Colour, ...]  # colour of each part

    def compute_features(self, X_TC: Array) -> tuple[ComponentFeatures, ...]:
        """Computes the features in the object frame T, given the pose of the camera, X_TC, (4, 4)."""
        return tuple(describe_part(fit, colour, X_TC) for fit, colour in zip(self.fits, self.colours, strict=True))


def detect_parts(picture: Picture, rig: Rig, noise: SensorNoise) -> Detection:
    """Detects the parts of the object in an image, and fits an ellipsoid and colour to each part.

    Raises:
        SeeingError: Segmentation fails (see ``segment``), a part is occluded (HiddenPartError), or a visible surface
            is not an ellipsoid (NoFitError).
    """
    segmentation = segment(picture, rig.height, noise)
    fits, colours = [], []
    for number in range(segmentation.num_parts):
        view = collect_view(picture, segmentation, number)
        if len(view.depth) < NUM_NUMBERS or len(view.outline) < NUM_NUMBERS:
            reason = f"a part has {len(view.depth)} depth readings and {len(view.outline)} points of its outline"
            raise TooSmallError(f"{reason}, must have at least {NUM_NUMBERS} of each", *picture)
        try:
            fit = fit_ellipsoid(view, rig.camera, noise)
        except UndeterminedError as error:
            raise NoFitError(str(error), *picture) from error
        _check_fit(fit, segmentation, number, picture, rig.camera)
        fits.append(fit)
        colours.append(measure_colour(picture, segmentation.labels == number, fit.ellipsoid, rig.camera))
    return Detection(segmentation, tuple(fits), tuple(colours))


def collect_view(picture: Picture, segmentation: Segmentation, number: int) -> PartView:
    """Collects the depth readings of a part, and its outline except at borders with other parts."""
    mask = segmentation.labels == number
    window = find_window(mask, room=_BORDER + 1)
    mask, labels, depth = mask[window], segmentation.labels[window], picture.depth[window]
    inner = cv2.erode(mask.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(bool) & (depth > 0.0)
    side = 2 * _BORDER + 1
    others = cv2.dilate(((labels >= 0) & ~mask).astype(np.uint8), np.ones((side, side), np.uint8)).astype(bool)
    rows, columns = np.nonzero(inner)
    chosen = slice(None, None, max(1, len(rows) // MAX_READINGS))
    rows, columns = rows[chosen], columns[chosen]
    corner = np.array([window[1].start, window[0].start], dtype=float)
    pixels = np.column_stack([columns, rows]) + corner
    return PartView(pixels, depth[rows, columns], _find_outline(mask, others) + corner)


def measure_colour(picture: Picture, mask: Mask, ellipsoid: SeenEllipsoid, camera: Camera) -> Colour:
    """Measures the colour of a part under full illumination.

    The colour is the ratio of the summed radiance to the summed radiance of a white surface with the same normals.
    This estimate is efficient for photon noise, whose variance is proportional to the signal.
    """
    inner = cv2.erode(mask.astype(np.uint8), np.ones((5, 5), np.uint8)).astype(bool)
    inner = inner if inner.any() else mask
    rows, columns = np.nonzero(inner)
    rays = camera.compute_rays(np.column_stack([columns, rows]).astype(float))
    seen = trace_rays(ellipsoid, rays, camera.focal_length)
    white = compute_shading(seen.normals / np.linalg.norm(seen.normals, axis=1, keepdims=True))
    sums = picture.colour[inner].sum(axis=0) / 255.0
    red, green, blue = (float(value) for value in np.clip(sums / white.sum(), 0.0, 1.0))
    return red, green, blue


def describe_part(fit: Fit, colour: Colour, X_TC: Array) -> ComponentFeatures:
    """Converts a fitted part to features in T, with axes in descending order and independent deformation errors."""
    fit = express_fit(fit, X_TC)
    squares, axes = np.linalg.eigh(fit.ellipsoid.shape_matrix)
    X_TE = np.eye(4)
    X_TE[:3, :3] = axes[:, ::-1]
    X_TE[:3, 2] *= np.sign(np.linalg.det(X_TE[:3, :3]))
    X_TE[:3, 3] = fit.ellipsoid.centre
    a, b, c = (float(size) for size in np.sqrt(squares[::-1]))
    variances, directions = np.linalg.eigh(fit.covariance)
    deformations = np.zeros((NUM_NUMBERS, 4, 4))
    errors = (directions * np.sqrt(np.maximum(0.0, variances))).T
    for error, deformation in zip(errors, deformations, strict=True):
        E = build_symmetric(error[3:])
        deformation[:3, :3] = E
        deformation[:3, 3] = error[:3] - E @ X_TE[:3, 3]
    return ComponentFeatures(colour, Ellipsoid((a, b, c)), X_TE, colour_sd=COLOUR_SD, deformations=deformations)


def draw_outline(ellipsoid: SeenEllipsoid, camera: Camera) -> Array:
    """Computes outline points of an ellipsoid in the image, (90, 2), column and row.

    Rays are tangent at points p = c + S^(1/2) w with |w| = 1 and w . m = 1. Here m is the camera position in
    coordinates in which the ellipsoid is a unit sphere.
    """
    squares, axes = np.linalg.eigh(ellipsoid.shape_matrix)
    root = (axes * np.sqrt(squares)) @ axes.T
    m = -np.linalg.solve(root, ellipsoid.centre)
    distance = float(np.linalg.norm(m))
    across = np.linalg.svd(m[None])[2][1:]  # (2, 3)
    turn = np.linspace(0.0, 2.0 * np.pi, 90)
    circle = np.column_stack([np.cos(turn), np.sin(turn)]) @ across
    w = m / distance**2 + np.sqrt(max(0.0, 1.0 - distance**-2)) * circle
    return camera.project(ellipsoid.centre + w @ root)


def _check_fit(fit: Fit, segmentation: Segmentation, number: int, picture: Picture, camera: Camera) -> None:
    outline = draw_outline(fit.ellipsoid, camera)
    x, y = outline.T
    area = 0.5 * abs(float(x[:-1] @ y[1:] - x[1:] @ y[:-1]))
    shown = float((segmentation.labels == number).sum()) / max(area, 1.0)
    if shown < MIN_SHOWN:
        reason = f"{100 * shown:.0f} % of a part is visible behind other parts, must be at least"
        raise HiddenPartError(f"{reason} {100 * MIN_SHOWN:.0f} %", *picture)
    if fit.misfit > MAX_MISFIT:
        reason = f"one detected part is not an ellipsoid: its residuals have the mean square {fit.misfit:.2f}"
        raise NoFitError(f"{reason} in standard deviations, must be at most {MAX_MISFIT:g}", *picture)


def _find_outline(mask: Mask, excluded: Mask) -> Array:
    """Finds midpoints between neighbouring pixels across the edge of a mask, (K, 2), column and row."""
    border = (mask[:, 1:] != mask[:, :-1]) & ~(excluded[:, 1:] | excluded[:, :-1])
    below = (mask[1:] != mask[:-1]) & ~(excluded[1:] | excluded[:-1])
    row_border, column_border = np.nonzero(border)
    row_below, column_below = np.nonzero(below)
    return np.concatenate(
        [np.column_stack([column_border + 0.5, row_border]), np.column_stack([column_below, row_below + 0.5])]
    )
