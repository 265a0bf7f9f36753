"""Drake geometry for drawing solids.

A tool's contact geometry is not its solids but the striking face (plant/contact_face.py): Drake's point contact
replaces any mesh by its convex hull, which would fill the claw of a hammer.
"""

import functools
from typing import Any

import numpy as np
from pydrake.common import MemoryFile
from pydrake.geometry import Box as DrakeBox
from pydrake.geometry import Capsule as DrakeCapsule
from pydrake.geometry import Cylinder as DrakeCylinder
from pydrake.geometry import Ellipsoid as DrakeEllipsoid
from pydrake.geometry import InMemoryMesh, Mesh

from affordance.objects.inertia import Ellipsoid, Shape
from affordance.objects.primitives import Box, Capsule, Cylinder
from affordance.objects.triangle_mesh import TriangleMesh


def make_drawn_shape(shape: Shape) -> Any:
    """Builds the Drake shape that draws a solid, in its frame E.

    Raises:
        NotImplementedError: Drake has no geometry for such a solid.
    """
    match shape:
        case Ellipsoid():
            return DrakeEllipsoid(*shape.semi_axes)
        case Box():
            return DrakeBox(*shape.lengths)
        case Cylinder():
            return DrakeCylinder(shape.radius, shape.length)
        case Capsule():
            return DrakeCapsule(shape.radius, shape.length)
        case TriangleMesh():
            return Mesh(InMemoryMesh(mesh_file=MemoryFile(write_obj(shape), ".obj", "part")))
    raise NotImplementedError(f"no Drake geometry for {type(shape).__name__}")


@functools.lru_cache(maxsize=128)
def write_obj(mesh: TriangleMesh) -> bytes:
    """Writes a mesh as OBJ with per-face normals, which Drake's renderer requires."""
    corners = mesh.vertices[mesh.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.where(lengths > 0.0, normals / np.maximum(lengths, np.finfo(float).tiny), [0.0, 0.0, 1.0])
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}\n" for x, y, z in mesh.vertices]
    lines += [f"vn {x:.6g} {y:.6g} {z:.6g}\n" for x, y, z in normals]
    lines += [f"f {a}//{n} {b}//{n} {c}//{n}\n" for n, (a, b, c) in enumerate(mesh.faces + 1, start=1)]
    return "".join(lines).encode()
