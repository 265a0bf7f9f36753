"""Chooses visual shapes of an arm: simple shapes, meshes as OBJ, or capsules.

Meshes are converted to OBJ, one per colour, because Meshcat draws OBJ and DAE, and Drake's renderer OBJ and glTF. The
number of triangles is limited to keep HTML pages with the arm small.
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix

from affordance.arrays import Array
from affordance.exceptions import BadValueError
from affordance.extensions.robots.arm_file import BASE, name_links
from affordance.extensions.robots.description import Visual
from affordance.extensions.robots.reduced_arm import ReducedArm, describe_pose
from affordance.files.mesh_reader import COLLADA, FORMATS, load_scene
from affordance.objects.drake_geometry import write_obj

# Largest number of triangles per link; nine links then add about a megabyte to a page.
_TRIANGLES = 4000
# Least number of triangles per colour of a link with several colours.
_FEWEST = 12
# Colour difference, in every channel, below which two colours are drawn as one.
_COLOUR_STEP = 0.1
_GREY = (0.70, 0.74, 0.78, 1.0)
# Radius of capsules as a fraction of their length, and its bounds, [m].
_THICKNESS, _THINNEST, _THICKEST = 0.12, 0.012, 0.045
# Significant digits of positions: 0.01 mm on a link of 1 m.
_DIGITS = 5
_FOLDER = "meshes"

# Bounds of the cell width, as fractions of the mesh's diagonal, and number of bisections, which determine it to 1 %.
# The coarsest grid has a single cell and no triangle.
_FINEST, _COARSEST, _HALVINGS = 1.0 / 5000.0, 1.01, 11
# Singular values below this fraction of the largest are ignored, and the vertex is at the mean in their directions.
_LEAST_SINGULAR = 1e-2
# Largest number of cells along an axis that fits a 64-bit key.
_MOST_CELLS = 1 << 20

type _Part = tuple[Any, tuple[float, ...]]  # mesh and its colour
type _Indices = NDArray[np.intp]


@dataclass
class Appearance:
    """Shapes for each link of the written arm, OBJ texts for each file, and remarks on differences from the file."""

    visuals: dict[str, list[Visual]] = field(default_factory=dict)
    meshes: dict[str, str] = field(default_factory=dict)
    remarks: list[str] = field(default_factory=list)


def draw_arm(arm: ReducedArm, *, with_meshes: bool) -> Appearance:
    """Chooses the shapes of each link: shapes of the file if possible, otherwise capsules."""
    description = arm.tree.description
    appearance, path, shapes = Appearance(), description.path, description.visuals
    replaced: list[str] = []
    ends = [*(link.X_PL for link in arm.links), arm.X_LH]
    groups = [(BASE, arm.base_bodies), *zip(name_links(arm), (link.bodies for link in arm.links), strict=True)]
    for (name, bodies), X_next in zip(groups, ends, strict=True):
        drawn: list[Visual] = []
        meshed: list[_Part] = []
        for body, X_LB in bodies:
            for shape in shapes.get(body, ()):
                X_LV = X_LB @ RigidTransform(RollPitchYaw(np.array(shape.rpy)), np.array(shape.place))
                if shape.shape != "mesh":
                    place, rpy = (shape.place, shape.rpy) if X_LB.IsExactlyIdentity() else describe_pose(X_LV)
                    drawn.append(shape._replace(place=place, rpy=rpy))
                elif with_meshes:
                    meshed += _load_mesh(shape, X_LV, path, appearance)
        drawn += _write_meshes(name, meshed, appearance)
        if any(body in description.undrawn for body, _ in bodies):
            replaced.append(name)
        if not drawn and name != BASE:
            drawn = _draw_capsule(X_next.translation())
        appearance.visuals[name] = drawn
    if replaced:
        remark = f"some shapes of {', '.join(replaced)} are not imported"
        appearance.remarks.append(f"{remark}: simple shapes or capsules are drawn instead")
    return appearance


def find_mesh_file(name: str, path: Path) -> Path | None:
    """Finds the file of a mesh that a robot's file names. Returns None if it is missing.

    Names with ``package://`` and ``model://`` are searched in every folder above the robot's file, with and without
    the package's name. Other names are searched only in the file's folder.
    """
    candidates = [path.parent / name]
    scheme, separator, inside = name.partition("://")
    if separator and scheme in ("package", "model", "file"):
        tails = [tail for tail in (inside, inside.partition("/")[2]) if tail]
        candidates = [Path(inside), *(folder / tail for folder in path.absolute().parents for tail in tails)]
    return next((candidate for candidate in candidates if candidate.is_file()), None)


def _load_mesh(shape: Visual, X_LV: RigidTransform, path: Path, appearance: Appearance) -> list[_Part]:
    """Loads the parts of a mesh with their colours, in the link's frame. Failures are added to the remarks."""
    file = find_mesh_file(shape.mesh, path)
    if file is None:
        appearance.remarks.append(f"the mesh {shape.mesh} was not found")
        return []
    if file.suffix.lower() not in (*FORMATS, COLLADA):
        known = ", ".join((*FORMATS, COLLADA))
        appearance.remarks.append(f"the mesh {file.name} is not drawn (only {known} meshes are)")
        return []
    try:
        scene = load_scene(file)
        parts = [part for part in scene.dump() if len(getattr(part, "faces", ()))]
    except BadValueError as error:
        appearance.remarks.append(f"the mesh {file.name} cannot be read (it {error.problem})")
        return []
    except MemoryError:
        raise
    except Exception as error:  # loaders raise any exception on a damaged file
        appearance.remarks.append(f"the mesh {file.name} cannot be read ({type(error).__name__})")
        return []
    if not parts:
        appearance.remarks.append(f"the mesh {file.name} cannot be read (it contains no triangles)")
    X = X_LV.GetAsMatrix4() @ np.diag([*shape.sizes, 1.0])
    return [(part.apply_transform(X), shape.colour or _find_colour(part)) for part in parts]


def _find_colour(part: Any) -> tuple[float, ...]:
    """Returns the main colour of a mesh, or grey."""
    try:
        coloured = part.visual if hasattr(part.visual, "main_color") else part.visual.material
        rgba = np.asarray(coloured.main_color)
    except (AttributeError, TypeError, ValueError):
        return _GREY
    if rgba.shape != (4,) or tuple(rgba[:3]) == (102, 102, 102):  # trimesh's default colour
        return _GREY
    red, green, blue = (float(value) / 255.0 for value in rgba[:3])
    return red, green, blue, 1.0


def _write_meshes(link: str, parts: list[_Part], appearance: Appearance) -> list[Visual]:
    """Formats the meshes of a link as OBJ texts, one per colour, and adds them to the appearance."""
    import trimesh

    groups: dict[tuple[int, ...], list[_Part]] = {}
    for part, colour in parts:
        key = tuple(int(value / _COLOUR_STEP) for value in colour)
        groups.setdefault(key, []).append((part, colour))
    total = sum(len(part.faces) for part, _ in parts)
    visuals = []
    for number, key in enumerate(sorted(groups)):
        mesh: Any = trimesh.util.concatenate([trimesh.Trimesh(part.vertices, part.faces) for part, _ in groups[key]])
        mesh.merge_vertices()
        vertices, faces = np.asarray(mesh.vertices, dtype=float), np.asarray(mesh.faces, dtype=np.intp)
        share = (_TRIANGLES - _FEWEST * len(groups)) * len(faces) / total
        vertices, faces = simplify(vertices, faces, _FEWEST + int(share))
        name = f"{''.join(c if c.isascii() and c.isalnum() else '_' for c in link[:60])}_{number}.obj"
        while name in appearance.meshes:  # link names may differ only in replaced characters
            name = f"_{name}"
        appearance.meshes[name] = write_obj(vertices, faces, _DIGITS)
        place = (0.0, 0.0, 0.0)
        colour = groups[key][0][1]
        uri = f"package://affordance_models/{_FOLDER}/{name}"
        visuals.append(Visual("mesh", (1.0, 1.0, 1.0), place, place, uri, colour))
    return visuals


def _draw_capsule(end: Array) -> list[Visual]:
    """Builds a capsule from a link's joint to the next joint."""
    length = float(np.linalg.norm(end))
    radius = float(np.clip(_THICKNESS * length, _THINNEST, _THICKEST))
    if length < 1e-6:
        return [Visual("sphere", (radius,), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))]
    R = RotationMatrix.MakeFromOneVector(end / length, 2)
    _, rpy = describe_pose(RigidTransform(R))
    return [Visual("capsule", (radius, length), tuple((0.5 * end).tolist()), rpy)]


def simplify(vertices: Array, faces: _Indices, most: int) -> tuple[Array, _Indices]:
    """Reduces a mesh to at most ``most`` triangles. A smaller mesh is returned unchanged.

    All vertices within a grid cell are merged into one, at the least-squares intersection of the planes of the
    adjacent triangles (Lindstrom 2000, Out-of-core simplification of large polygonal models, SIGGRAPH). The finest
    grid within the limit is used. Edge collapse would break the open or cracked meshes of CAD programs into pieces.

    Args:
        vertices: Positions, shape (N, 3), [m].
        faces: Indices of vertices, shape (M, 3).
        most: Largest number of triangles.
    """
    if len(faces) <= most:
        return vertices, faces
    diagonal = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    finest, coarsest = _FINEST * diagonal, _COARSEST * diagonal
    cells, triangles = _cluster(vertices, faces, coarsest)
    for _ in range(_HALVINGS):
        width = float(np.sqrt(finest * coarsest))
        tried = _cluster(vertices, faces, width)
        if len(tried[1]) > most:
            finest = width
        else:
            coarsest, (cells, triangles) = width, tried
    used, kept = np.unique(triangles, return_inverse=True)
    return _place(vertices, faces, cells, coarsest)[used], kept.reshape(-1, 3)


def _cluster(vertices: Array, faces: _Indices, width: float) -> tuple[_Indices, _Indices]:
    """Assigns vertices to grid cells with a given width, [m].

    Returns: Cell of each vertex, (N,), and the distinct triangles with corners in three cells, as cell indices, (K,
        3).
    """
    steps = np.minimum(((vertices - vertices.min(axis=0)) / width).astype(np.int64), _MOST_CELLS - 1)
    keys = (steps[:, 0] * _MOST_CELLS + steps[:, 1]) * _MOST_CELLS + steps[:, 2]
    cells = np.unique(keys, return_inverse=True)[1].ravel()
    between = cells[faces]
    apart = (between != np.roll(between, 1, axis=1)).all(axis=1)
    between = between[apart]
    ordered = np.sort(between, axis=1).astype(np.int64)
    count = int(cells.max()) + 1
    _, first = np.unique((ordered[:, 0] * count + ordered[:, 1]) * count + ordered[:, 2], return_index=True)
    return cells, between[np.sort(first)]


def _place(vertices: Array, faces: _Indices, cells: _Indices, width: float) -> Array:
    """Computes the vertex of each cell: the least-squares point of the planes of all adjacent triangles."""
    count = int(cells.max()) + 1
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1)
    normals = np.divide(normals, areas[:, None], out=np.zeros_like(normals), where=areas[:, None] > 0.0)
    weights = areas + 1e-12 * (areas.max() or 1.0)  # unweighted mean if all areas are zero
    owners, repeated = cells[faces].T.ravel(), np.tile(np.arange(len(faces)), 3)

    def add_up(values: Array) -> Array:
        """Sums values at triangle corners, (3 M, k), for each cell, (count, k)."""
        return np.stack([np.bincount(owners, column, count) for column in values.T], axis=1)

    places, weight = vertices[faces].transpose(1, 0, 2).reshape(-1, 3), weights[repeated][:, None]
    mean = add_up(weight * places) / np.maximum(add_up(weight), np.finfo(float).tiny)
    n = normals[repeated]
    heights = np.einsum("ij,ij->i", n, corners[repeated, 0] - mean[owners])[:, None]
    A = add_up(weight * (n[:, :, None] * n[:, None, :]).reshape(-1, 9)).reshape(-1, 3, 3)
    b = add_up(weight * heights * n)
    U, s, Vt = np.linalg.svd(A)
    inverse = np.divide(1.0, s, out=np.zeros_like(s), where=s > _LEAST_SINGULAR * s[:, :1])
    moved = np.einsum("nji,nj->ni", Vt, inverse * np.einsum("nji,nj->ni", U, b))
    placed: Array = mean + np.clip(moved, -width, width)
    return placed
