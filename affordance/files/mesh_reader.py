"""Reading triangles and their colours from OBJ, PLY and STL files, in the units and the order of the file."""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.exceptions import BadValueError

# Formats that hold triangles and nothing that moves, scales or smooths them.
FORMATS = (".obj", ".ply", ".stl")


class Triangles(NamedTuple):
    """What a mesh file holds.

    Attributes:
        vertices: Shape (n, 3), in the units of the file.
        faces: Three corners a face, shape (m, 3).
        colours: Red, green and blue of each face in [0, 1], shape (m, 3); NaN where the file gives none, or an image
            (a texture), which is not read.
    """

    vertices: Array
    faces: NDArray[np.intp]
    colours: Array


def read_triangles(path: Path) -> Triangles:
    """Reads a mesh file.

    Raises:
        BadValueError: The file cannot be read, is of another format, or holds no triangle or no finite corner.
    """
    if path.suffix.lower() not in FORMATS:
        problem = f"is a {path.suffix or 'file without suffix'}, must be one of {', '.join(FORMATS)}"
        hint = "; export it as OBJ, PLY or STL" if path.suffix else ""
        raise BadValueError(path, "", problem + hint)
    if not path.is_file():
        raise BadValueError(path, "", "cannot be read: no such file")
    import trimesh  # here, because it takes most of a second and few runs read a mesh

    try:
        with np.errstate(all="ignore"):
            loaded: Any = trimesh.load_scene(path, process=False, maintain_order=True, group_material=False)
        geometries = [each for each in loaded.geometry.values() if isinstance(each, trimesh.Trimesh)]
        if path.suffix.lower() == ".obj":
            geometries.reverse()  # it reads the last piece of the file first (trimesh 5.2)
        parts = [_take(geometry) for geometry in geometries]
    except Exception as error:  # the library raises whatever a spoilt file makes its parsers stumble over
        raise BadValueError(path, "", f"is no readable {path.suffix[1:].upper()} file: {error}") from error
    parts = [part for part in parts if len(part.faces)]
    if not parts:
        raise BadValueError(path, "", "holds no triangles, must hold a closed surface")
    starts = np.cumsum([0, *(len(part.vertices) for part in parts)])
    vertices = np.concatenate([part.vertices for part in parts])
    faces = np.concatenate([part.faces + start for part, start in zip(parts, starts, strict=False)])
    if not np.isfinite(vertices[np.unique(faces)]).all():
        raise BadValueError(path, "", "has corners that are not finite")
    colours = np.concatenate([part.colours for part in parts])
    return Triangles(vertices, faces, colours)


def _take(mesh: Any) -> Triangles:
    vertices, faces = np.array(mesh.vertices, dtype=float), np.array(mesh.faces, dtype=np.intp)
    colours = np.full((len(faces), 3), np.nan)
    visual = mesh.visual
    if visual.kind in ("face", "vertex"):
        colours = np.array(visual.face_colors, dtype=float)[:, :3] / 255.0
    elif visual.kind == "texture" and getattr(visual.material, "image", None) is None:
        colours[:] = np.array(visual.material.main_color, dtype=float)[:3] / 255.0
    return Triangles(vertices, faces, colours)
