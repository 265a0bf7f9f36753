"""Loads the bodies of a mesh file, converted to metres, each with its colour."""

import functools
import logging
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.exceptions import BadValueError
from affordance.files.mesh_reader import Triangles, read_triangles
from affordance.objects.array_solids import TriangleMesh
from affordance.objects.colour import Colour
from affordance.objects.overlap import is_sound, unite
from affordance.objects.shells import MeshError, Shell, find_shells

_LOG = logging.getLogger(__name__)

# Metres in each unit.
UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 0.0254}
# Bounds of the length of objects that a hand can hold and swing, from the thickness of a coin to a metre, [m].
LENGTH_MIN, LENGTH_MAX = 1e-3, 1.0
# Length from which a tool is plausible and not merely possible, [m].
_PLAUSIBLE = 0.02


class Body(NamedTuple):
    """Solid body of a mesh with its centroid at Eo. All surfaces are numbered in the file's order."""

    solid: TriangleMesh  # solid in E, which is parallel to the file's frame F
    p_FEo: Array  # position of the centroid in F, (3,), [m]
    number: int  # number of its outer surface
    cavities: tuple[int, ...]  # numbers of the surfaces of its cavities
    colour: Colour | None  # colour of most of its surface; None if the file has no colours


def count_shells(bodies: Sequence[Body]) -> int:
    """Counts the closed surfaces of bodies, including cavities."""
    return sum(1 + len(body.cavities) for body in bodies)


def load_bodies(path: Path, unit: str) -> tuple[Body, ...]:
    """Loads the bodies of an OBJ, PLY or STL file, in the file's order.

    The bodies are cached until the file changes.

    Args:
        path: Path of the file.
        unit: Unit of length, a key of UNITS.

    Raises:
        BadValueError: The file cannot be read, a surface is open or inconsistently wound, or the size is implausible.
    """
    try:
        changed = path.stat().st_mtime_ns
    except OSError:
        changed = 0  # the error is reported when the file is read
    return _load_bodies(path, unit, changed)


@functools.lru_cache(maxsize=64)
def _load_bodies(path: Path, unit: str, _changed: int) -> tuple[Body, ...]:
    triangles = read_triangles(path)
    _check_size(path, triangles, unit)
    vertices = UNITS[unit] * triangles.vertices
    try:
        found = find_shells(vertices, triangles.faces)
    except MeshError as error:
        raise BadValueError(path, "", str(error)) from error
    for repair in found.repairs:
        _LOG.warning("%s: %s", path, repair)
    if not all(is_sound(shell.solid) for shell in found.shells):
        _LOG.warning("%s: a surface intersects itself, so volume that bodies share is counted twice", path)
    return tuple(
        Body(*shell.solid.centre(), shell.number, shell.cavities, _find_colour(shell, vertices, triangles))
        for shell in found.shells
    )


def merge(bodies: Sequence[Body]) -> Body:
    """Merges all bodies of a mesh into one, and counts shared volume only once."""
    solids = [TriangleMesh(body.solid.vertices + body.p_FEo, body.solid.faces) for body in bodies]
    united = unite(solids) if all(map(is_sound, solids)) else None
    if united is None:
        starts = np.cumsum([0, *(len(solid.vertices) for solid in solids[:-1])])
        faces = [solid.faces + start for solid, start in zip(solids, starts, strict=True)]
        united = TriangleMesh(np.concatenate([solid.vertices for solid in solids]), np.concatenate(faces))
    solid, p_FEo = united.centre()
    colours = {body.colour for body in bodies}
    return Body(solid, p_FEo, 0, (), colours.pop() if len(colours) == 1 else None)


def _find_colour(shell: Shell, vertices: Array, triangles: Triangles) -> Colour | None:
    """Finds the colour that covers most of the surface; None if the file has no colours."""
    corners = vertices[triangles.faces[shell.faces]]
    areas = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    colours = triangles.colours[shell.faces]
    known = np.isfinite(colours).all(axis=1)
    if not known.any():
        return None
    shades, index = np.unique(np.round(255.0 * colours[known]), axis=0, return_inverse=True)
    most = shades[int(np.argmax(np.bincount(index.ravel(), weights=areas[known])))] / 255.0
    return float(most[0]), float(most[1]), float(most[2])


def _check_size(path: Path, triangles: Triangles, unit: str) -> None:
    used = triangles.vertices[np.unique(triangles.faces)]
    length = float((used.max(axis=0) - used.min(axis=0)).max())
    if LENGTH_MIN <= UNITS[unit] * length <= LENGTH_MAX:
        return
    lengths = {other: scale * length for other, scale in UNITS.items()}
    fitting = [f"{each:.3g} m in {other}" for other, each in lengths.items() if _PLAUSIBLE <= each <= LENGTH_MAX]
    hint = f"; it would be {', '.join(fitting)}" if fitting else ""
    bounds = f"must be from {LENGTH_MIN:g} to {LENGTH_MAX:g} m"
    raise BadValueError(path, "", f"is {UNITS[unit] * length:.3g} m long if its unit is {unit}, {bounds}{hint}")
