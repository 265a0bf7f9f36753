"""Drake geometry for drawing solids.

Contact uses only a tool's striking face (plant/contact.py), not its solids. Drake's point contact replaces each mesh
with its convex hull, which would fill the claw of a hammer.
"""

import functools
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake import geometry
from pydrake.common import MemoryFile

from affordance.arrays import Array
from affordance.objects.array_solids import TriangleMesh
from affordance.objects.inertia import Ellipsoid, Shape, find_visible
from affordance.objects.primitives import Box, Capsule, Cylinder


def make_drawn_shape(shape: Shape) -> Any:
    """Builds the Drake shape that draws a solid in its frame E.

    Raises:
        NotImplementedError: The type of solid is unknown.
    """
    shape = find_visible(shape)
    match shape:
        case Ellipsoid():
            return geometry.Ellipsoid(*shape.semi_axes)
        case Box():
            return geometry.Box(*shape.lengths)
        case Cylinder():
            return geometry.Cylinder(shape.radius, shape.length)
        case Capsule():
            return geometry.Capsule(shape.radius, shape.length)
        case TriangleMesh():
            return draw_mesh(shape)
    raise NotImplementedError(f"no Drake geometry for {type(shape).__name__}")


@functools.lru_cache(maxsize=128)
def draw_mesh(mesh: TriangleMesh) -> geometry.Mesh:
    """Builds the Drake shape that draws a mesh. Shapes are cached."""
    text = write_obj(mesh.vertices, mesh.faces)
    return geometry.Mesh(geometry.InMemoryMesh(mesh_file=MemoryFile(text.encode(), ".obj", "part")))


def write_obj(vertices: Array, faces: NDArray[np.intp], digits: int = 9) -> str:
    """Formats a triangle mesh as OBJ text.

    Drake's renderer needs normals, so each triangle has one. Degenerate triangles are omitted.

    Args:
        vertices: Vertices, (N, 3), [m].
        faces: Indices of three vertices per face, (M, 3).
        digits: Number of significant digits.
    """
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    shown = np.flatnonzero(lengths > 0.0)
    lines = [f"v {x:.{digits}g} {y:.{digits}g} {z:.{digits}g}" for x, y, z in vertices.tolist()]
    lines += [f"vn {x:.6g} {y:.6g} {z:.6g}" for x, y, z in (normals[shown] / lengths[shown, None]).tolist()]
    listed = (faces[shown] + 1).tolist()
    lines += [f"f {a}//{k} {b}//{k} {c}//{k}" for k, (a, b, c) in enumerate(listed, start=1)]
    return "\n".join(lines) + "\n"
