"""Reads triangles and their colours from OBJ, PLY and STL files, in the file's units and order.

Files are parsed with trimesh, after checks of their size and of the number of entries that they declare. Collada's
XML must not define entities. Referenced files must be in the mesh's folder or below.
"""

import re
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.exceptions import BadValueError
from affordance.files.bounded import MESH, check_size, read_bytes
from affordance.files.xml_file import parse_xml

# Formats that contain only triangles, without motion, scaling or smoothing.
FORMATS = (".obj", ".ply", ".stl")
# Additional format for robots' visual meshes.
COLLADA = ".dae"
_STL_HEAD, _STL_TRIANGLE = 84, 50  # bytes of a binary STL file
_PLY_COUNT = re.compile(rb"^element[ \t]+\S+[ \t]+(\d+)", re.MULTILINE)


class Triangles(NamedTuple):
    """Triangles of a mesh file.

    Attributes:
        vertices: Vertices in the file's units, (n, 3).
        faces: Indices of three vertices per face, (m, 3).
        colours: Red, green and blue of each face in [0, 1], (m, 3); NaN if the file has no colours or uses an image
            texture, because textures are not read.
    """

    vertices: Array
    faces: NDArray[np.intp]
    colours: Array


def read_triangles(path: Path) -> Triangles:
    """Reads an OBJ, PLY or STL file.

    Raises:
        BadValueError: The file cannot be read, or contains no finite triangles.
    """
    if path.suffix.lower() not in FORMATS:
        problem = f"is a {path.suffix or 'file without suffix'}, must be one of {', '.join(FORMATS)}"
        hint = "; export it as OBJ, PLY or STL" if path.suffix else ""
        raise BadValueError(path, "", problem + hint)
    if not path.is_file():
        raise BadValueError(path, "", "cannot be read: no such file")
    try:
        with np.errstate(all="ignore"):
            loaded = load_scene(path, process=False, maintain_order=True, group_material=False)
        geometries = [each for each in loaded.geometry.values() if hasattr(each, "faces")]
        if path.suffix.lower() == ".obj":
            geometries.reverse()  # trimesh 5.2 lists the last piece first
        parts = [_take(geometry) for geometry in geometries]
    except (BadValueError, MemoryError):
        raise
    except Exception as error:  # for corrupt files, parsers can raise any error
        raise BadValueError(path, "", f"is no readable {path.suffix[1:].upper()} file: {error}") from error
    parts = [part for part in parts if len(part.faces)]
    if not parts:
        raise BadValueError(path, "", "contains no triangles, must contain a closed surface")
    starts = np.cumsum([0, *(len(part.vertices) for part in parts)])
    vertices = np.concatenate([part.vertices for part in parts])
    faces = np.concatenate([part.faces + start for part, start in zip(parts, starts, strict=False)])
    if not np.isfinite(vertices[np.unique(faces)]).all():
        raise BadValueError(path, "", "has vertices that are not finite")
    colours = np.concatenate([part.colours for part in parts])
    return Triangles(vertices, faces, colours)


def load_scene(path: Path, **options: Any) -> Any:
    """Loads a mesh file in one of FORMATS or COLLADA as a trimesh Scene.

    For a corrupt file, trimesh can raise any error.

    Args:
        path: Path of the file.
        **options: Options of trimesh.load_scene.

    Raises:
        BadValueError: The file cannot be read, is too large, or declares more entries than its size allows.
    """
    content = read_bytes(path, MESH)
    suffix = path.suffix.lower()
    _check_promises(path, content, suffix)
    import trimesh  # imported here because it takes most of a second, and few runs need it
    from trimesh.resolvers import FilePathResolver

    class SameFolder(FilePathResolver):
        """Resolver that only finds referenced files in the mesh's folder and below. The files' size is limited."""

        def get(self, name: str) -> Any:
            try:
                check_size(Path(self.parent) / name.strip(), MESH)
            except BadValueError as error:
                raise FileNotFoundError(name) from error
            return super().get(name)

    return trimesh.load_scene(BytesIO(content), file_type=suffix[1:], resolver=SameFolder(str(path)), **options)


def _check_promises(path: Path, content: bytes, suffix: str) -> None:
    """Checks that a mesh file declares no more entries than its size allows, and that Collada's XML is valid.

    Raises:
        BadValueError: The file fails one of these checks.
    """
    if suffix == ".ply":
        head = content.partition(b"end_header")[0]
        promised = max((int(count[:20]) for count in _PLY_COUNT.findall(head)), default=0)
        if promised > len(content):
            raise BadValueError(path, "", f"promises {promised} entries, has {len(content)} bytes")
    elif suffix == ".stl" and b"\0" in content[:_STL_HEAD]:
        promised = int.from_bytes(content[_STL_HEAD - 4 : _STL_HEAD], "little")
        if _STL_HEAD + _STL_TRIANGLE * promised > len(content):
            raise BadValueError(path, "", f"promises {promised} triangles, has {len(content)} bytes")
    elif suffix == COLLADA:
        parse_xml(path, content)


def _take(mesh: Any) -> Triangles:
    vertices, faces = np.array(mesh.vertices, dtype=float), np.array(mesh.faces, dtype=np.intp)
    colours = np.full((len(faces), 3), np.nan)
    visual = mesh.visual
    if visual.kind in ("face", "vertex"):
        colours = np.array(visual.face_colors, dtype=float)[:, :3] / 255.0
    elif visual.kind == "texture" and getattr(visual.material, "image", None) is None:
        colours[:] = np.array(visual.material.main_color, dtype=float)[:3] / 255.0
    return Triangles(vertices, faces, colours)
