"""Measurement of shape and position of an object on a table in one colour and depth image.

Frames are C of the camera, W on the table below the object, S of a fitted solid, and T of the object in the tools
file. The origin of T is in the middle of the object, Tx is along its longest axis, and Tz is as vertical as possible.
"""

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from affordance.arguments import check_array
from affordance.arrays import Array, Mask
from affordance.exceptions import BadArgumentError, NoDepthError
from affordance.extensions.pixels.photographs.camera import PinholeCamera
from affordance.extensions.pixels.photographs.evidence import collect_evidence
from affordance.extensions.pixels.photographs.object_mask import check_mask, find_object, reaches_edge
from affordance.extensions.pixels.photographs.superquadric import FittedSolid, Superquadric, build_mesh, fit_solid
from affordance.extensions.pixels.photographs.table import find_table, refit_table
from affordance.extensions.pixels.photographs.two_parts import find_two_parts
from affordance.files.atomic import write_atomic, write_text
from affordance.objects.colour import Colour, show_colour

# Model errors as standard deviations of the logarithm of the volume, for objects that a superquadric fits well and
# for others. They were chosen with the images of the study in docs/see.md.
_GOOD_FIT_SD, _BAD_FIT_SD = 0.25, 0.5
# Largest misfit of a good fit: mean robust square of distances in units of 3 mm. It is 0.1 to 0.9 for boxes, cans and
# a banana, and 1.4 to 4 for bottles with a neck, drills and touching objects (in the same images).
_WORST_FIT = 1.0
# SD of the height of the table, [m], which matters for flat objects, and SD of the centre as a fraction of the
# length.
_HEIGHT_SD, _CENTRE_SHARE = 3e-3, 0.03
_LARGEST_VOLUME_SD, _LARGEST_PLACE_SD = 0.6, 0.1  # limits in a tools file
_LEAST_READ = 500  # smallest number of pixels with depth


@dataclass(frozen=True, eq=False)
class SeenPart:
    """Solid part of a seen object.

    Attributes:
        solid: Fitted solid in W.
        colour: Median colour, in [0, 1].
        volume_sd: Standard deviation of the logarithm of the volume.
        place_sd: Standard deviation of each coordinate of the centre, [m].
    """

    solid: Superquadric
    colour: Colour
    volume_sd: float
    place_sd: float


@dataclass(frozen=True, eq=False)
class SeenObject:
    """Object measured in an image.

    Attributes:
        parts: One solid, or two solids along the longest axis, starting at the end ``end_a``.
        mask: Pixels of the object, (height, width).
        camera: Camera.
        X_CW: Pose of the table frame in the camera frame, (4, 4).
        X_WT: Pose of the object frame in the table frame, (4, 4).
        length: Length along Tx, [m].
        misfit: Mean robust square of the distances between depth readings and solid, in units of 3 mm.
        doubts: Reasons to doubt the measurement, one sentence each.
    """

    parts: tuple[SeenPart, ...]
    mask: Mask
    camera: PinholeCamera
    X_CW: Array
    X_WT: Array
    length: float
    misfit: float
    doubts: tuple[str, ...] = ()

    @property
    def volume(self) -> float:
        """Volume of all parts, [m^3]."""
        return sum(part.solid.volume for part in self.parts)

    @property
    def volume_sd(self) -> float:
        """Standard deviation of the logarithm of the volume."""
        squares = sum((part.volume_sd * part.solid.volume) ** 2 for part in self.parts)
        return float(np.sqrt(squares)) / self.volume

    @property
    def is_good_fit(self) -> bool:
        """True if one or two simple solids fit the object well."""
        return self.misfit <= _WORST_FIT

    def write(self, folder: Path, name: str, materials: tuple[str, ...]) -> Path:
        """Writes tools.yaml and its meshes to a folder, and returns the path of tools.yaml.

        Args:
            folder: Folder, which is created if necessary.
            name: Name of the object in the file, without parts of a path.
            materials: Material of each part, or one material for all parts.
        """
        import trimesh  # imported here because it takes almost a second

        components: list[dict[str, Any]] = []
        many = len(self.parts) > 1
        for number, part in enumerate(self.parts):
            file = f"part_{number + 1}.ply" if many else "solid.ply"
            vertices, faces = build_mesh(part.solid)
            X_TS = np.linalg.inv(self.X_WT) @ part.solid.X_WS
            mesh = trimesh.Trimesh(vertices @ X_TS[:3, :3].T + X_TS[:3, 3], faces, process=False)
            write_atomic(folder / file, partial(mesh.export, file_type="ply"))
            components.append(
                {
                    "mesh": file,
                    "unit": "m",
                    "material": materials[number % len(materials)],
                    "colour": show_colour(part.colour),
                    "volume_sd": round(min(part.volume_sd, _LARGEST_VOLUME_SD), 3),
                    "place_sd": round(min(part.place_sd, _LARGEST_PLACE_SD), 4),
                }
            )
        half = round(0.5 * self.length, 4)
        grips = {
            "end_a": {"position": [-half, 0.0, 0.0]},
            "end_b": {"position": [half, 0.0, 0.0], "rpy_deg": [0.0, 0.0, 180.0]},
        }
        tool = {"name": name, "components": components, "grips": grips}
        path = folder / "tools.yaml"
        text = yaml.safe_dump({"tools": [tool]}, sort_keys=False, allow_unicode=True, default_flow_style=None)
        write_text(path, f"# Written by affordance see. Weighed? Add mass: KG below the name.\n{text}")
        return path


def see(
    colour: NDArray[np.uint8],
    depth: Array,
    camera: PinholeCamera,
    *,
    at: tuple[float, float] | None = None,
    mask: Mask | None = None,
    seed: int = 0,
) -> SeenObject:
    """Measures an object on a table in registered colour and depth images.

    Args:
        colour: RGB image, (height, width, 3).
        depth: Depth along the optical axis, (height, width), [m]; 0 or NaN for missing readings.
        camera: Intrinsics, without distortion.
        at: Pixel of the object, column and row; None for the object that is nearest to the middle.
        mask: Pixels of the object, (height, width), instead of ``at``.
        seed: Seed for sampling depth readings.

    Raises:
        BadArgumentError: The shape of an array does not match the camera.
        SeeingError: There is no table or no object, or the object is too small.

    Example:
        >>> import numpy as np
        >>> from affordance.extensions.pixels.photographs.camera import PinholeCamera
        >>> from affordance.extensions.pixels.photographs.example import cast_example
        >>> from affordance.extensions.pixels.photographs.see import see
        >>> picture, camera = cast_example("can")
        >>> seen = see(picture.colour, picture.depth, camera)
        >>> print(f"{1e3 * seen.volume:.1f} litres, one in {seen.volume_sd:.1f}")
        0.4 litres, one in 0.3
    """
    shape = (camera.height, camera.width)
    depth = check_array("depth", np.where(np.isfinite(depth), depth, 0.0), shape)
    if colour.shape != (*shape, 3):
        raise BadArgumentError("colour", "", f"has the shape {colour.shape}, must have {(*shape, 3)}")
    depth = np.where(depth > 0.0, depth, np.nan)
    if np.isfinite(depth).sum() < _LEAST_READ:
        raise NoDepthError(f"the depth picture has fewer than {_LEAST_READ} readings", colour, depth)
    rng = np.random.default_rng(seed)
    order = rng.random(shape)
    columns, rows = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    points = depth[..., None] * camera.compute_rays(columns, rows)
    table = find_table(points, _find_place(points, at, mask), order, rng)
    mask = find_object(points, table, at) if mask is None else mask
    check_mask(mask, depth)
    table = refit_table(table, points, mask)
    X_CW = table.build_frame(np.nanmedian(points[mask], axis=0))
    evidence = collect_evidence(points, mask, table, camera, X_CW, order)
    whole = fit_solid(evidence)
    fits = find_two_parts(whole, evidence, colour, points, mask, X_CW) or [(whole, mask)]
    misfit = float(np.mean([fit.misfit for fit, _ in fits]))
    X_WT, length = _build_frame([fit.solid for fit, _ in fits], whole.solid)
    parts = tuple(
        _describe(fit, colour, pixels, misfit) for fit, pixels in sorted(fits, key=lambda each: _place(each, X_WT))
    )
    doubts = tuple(_list_doubts(mask, misfit))
    return SeenObject(parts, mask, camera, X_CW, X_WT, length, misfit, doubts)


def _find_place(points: Array, at: tuple[float, float] | None, mask: Mask | None) -> Array:
    """Finds a point on or near the object in C, (3,)."""
    if mask is not None:
        check_mask(mask, points[..., 2])
        return np.nanmedian(points[mask], axis=0)
    height, width = points.shape[:2]
    u, v = (0.5 * width, 0.5 * height) if at is None else at
    rows, columns = np.nonzero(np.isfinite(points[..., 2]))
    nearest = np.argsort(np.hypot(columns - u, rows - v))[:50]
    return np.median(points[rows[nearest], columns[nearest]], axis=0)


def _place(fit: tuple[FittedSolid, Mask], X_WT: Array) -> float:
    return float((fit[0].solid.X_WS[:3, 3] - X_WT[:3, 3]) @ X_WT[:3, 0])


def _build_frame(solids: list[Superquadric], whole: Superquadric) -> tuple[Array, float]:
    """Builds X_WT, (4, 4), and computes the length along Tx, [m]."""
    x = whole.X_WS[:3, int(np.argmax(whole.semi_axes))]
    x = x * np.sign(x[np.argmax(np.abs(x))])
    up = np.array([0.0, 0.0, 1.0]) if abs(x[2]) < 0.7 else np.array([1.0, 0.0, 0.0])
    z = up - (up @ x) * x
    z /= np.linalg.norm(z)
    corners = np.concatenate([build_mesh(each)[0] @ each.X_WS[:3, :3].T + each.X_WS[:3, 3] for each in solids])
    volumes = [each.volume for each in solids]
    middle = np.average([each.X_WS[:3, 3] for each in solids], axis=0, weights=volumes)
    along = corners @ x
    X_WT = np.eye(4)
    X_WT[:3, :3] = np.column_stack([x, np.cross(z, x), z])
    X_WT[:3, 3] = middle + (0.5 * (along.min() + along.max()) - middle @ x) * x
    return X_WT, float(along.max() - along.min())


def _describe(fit: FittedSolid, colour: NDArray[np.uint8], mask: Mask, misfit: float) -> SeenPart:
    model_sd = _GOOD_FIT_SD if misfit <= _WORST_FIT else _BAD_FIT_SD
    solid = fit.solid
    height = 2.0 * float(np.abs(solid.X_WS[2, :3]) @ solid.semi_axes)
    volume_sd = float(np.sqrt(fit.log_volume_sd**2 + model_sd**2 + (_HEIGHT_SD / height) ** 2))
    length = 2.0 * float(solid.semi_axes.max())
    place_sd = float(np.sqrt(np.trace(fit.centre_covariance) / 3.0 + (_CENTRE_SHARE * length) ** 2))
    red, green, blue = (float(each) / 255.0 for each in np.median(colour[mask], axis=0))
    scaled = np.exp((fit.log_volume - np.log(solid.volume)) / 3.0)  # to the mean volume over hypotheses
    return SeenPart(solid._replace(semi_axes=scaled * solid.semi_axes), (red, green, blue), volume_sd, place_sd)


def _list_doubts(mask: Mask, misfit: float) -> list[str]:
    doubts = []
    if misfit > _WORST_FIT:
        doubts.append(
            f"it is no simple solid (misfit {misfit:.1f}, at most {_WORST_FIT:g}): two things may touch, or half of "
            "one is measured; look at seen.png, or give its outline with --mask"
        )
    if reaches_edge(mask):
        doubts.append("it reaches the edge of the picture, and what is outside is not measured")
    return doubts
