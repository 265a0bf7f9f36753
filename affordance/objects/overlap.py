"""Finds volume that several solids share, and counts it only once.

Frames: T the tool, E a solid. Curved surfaces are approximated by facets, but only to compute shared volumes.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import manifold3d
import numpy as np

from affordance.arrays import Array
from affordance.objects.array_solids import Faces, TriangleMesh, integrate_faces
from affordance.objects.inertia import LoadedShape, find_visible
from affordance.objects.primitives import Box, Capsule, Cylinder
from affordance.objects.tool import Component, Weighing, find_box

# Largest fraction of shared volume that is ignored. Overlapping threads, splines and press fits of assemblies share
# up to 1.1 %.
LARGE_OVERLAP = 0.02
# A solid counts as inside another solid if it shares more than this fraction of its volume.
_WITHIN = 0.999
# Conversion from metres to millimetres, for which manifold3d's tolerances are suitable.
_SCALE = 1e3
# Number of facets around a curved solid; its volume is then accurate to 0.2 %.
_FACETS = 96


def is_sound(solid: TriangleMesh) -> bool:
    """Returns True if a surface does not intersect itself, which is required to compute shared volumes."""
    return _is_sound(_build_mesh(solid))


def unite(solids: Sequence[TriangleMesh]) -> TriangleMesh | None:
    """Unites solids that are in the same frame and do not intersect themselves.

    Returns:
        The union, or None if the shared volume is small enough to ignore.
    """
    united = _unite([_build_mesh(solid) for solid in solids])
    is_small = united.volume() >= (1.0 - LARGE_OVERLAP) * _SCALE**3 * sum(solid.volume for solid in solids)
    return None if is_small else TriangleMesh(*_get_triangles(united))


class Counted(NamedTuple):
    """Parts of a tool after shared volume has been counted only once."""

    parts: tuple[Component, ...]
    kept: tuple[int, ...]  # original index of each part
    shared: float  # fraction of the volume that was shared; 0 if nothing was changed

    def describe(self) -> str:
        """Describes the changes."""
        share = f"its parts share {100.0 * self.shared:.1f} % of their volume"
        return f"{share}, which is counted once: as the part that is listed first, or that lies within the other"

    def renumber(self, weighings: Sequence[Weighing]) -> tuple[Weighing, ...]:
        """Updates the part indices of weighings. A weighing is dropped if all its parts were removed."""
        new = {former: index for index, former in enumerate(self.kept)}
        found = [(each, tuple(new[part] for part in each.parts if part in new)) for each in weighings]
        return tuple(each._replace(parts=parts) for each, parts in found if parts or not each.parts)


def count_once(parts: Sequence[Component]) -> Counted:
    """Assigns shared volume to a single part: the part that is listed first.

    A part inside a larger part, such as a core, keeps its volume even if it is listed later. Any other part that is
    wholly inside earlier parts is removed. Visible shapes do not change. Parts whose surface intersects itself are
    skipped, and nothing changes if the shared fraction is small.
    """
    unchanged = Counted(tuple(parts), tuple(range(len(parts))), 0.0)
    boxes = [find_box([part]) for part in parts]
    most = {(i, k): _measure_common(boxes[i], boxes[k]) for k in range(len(parts)) for i in range(k)}
    volume = sum(part.shape.volume for part in parts)
    if sum(most.values()) <= LARGE_OVERLAP * volume:  # usual case: the exact solids are not needed
        return unchanged
    touching = [pair for pair, common in most.items() if common > 0.0]
    bodies = {k: _build_manifold(parts[k]) for k in sorted({k for pair in touching for k in pair})}
    sound = {k for k, body in bodies.items() if _is_sound(body)}
    keepers: dict[int, list[int]] = {}  # for each part, the parts to which its shared volume is assigned
    for i, k in touching:
        if {i, k} <= sound:
            is_core = bodies[k].volume() < _WITHIN * bodies[i].volume() and _is_within(bodies[k], bodies[i])
            loser, keeper = (i, k) if is_core else (k, i)
            keepers.setdefault(loser, []).append(keeper)
    lost = {k: bodies[k] ^ _unite([bodies[i] for i in by]) for k, by in keepers.items()}
    shared = sum(each.volume() for each in lost.values()) / (_SCALE**3 * volume)
    if shared <= LARGE_OVERLAP:
        return unchanged
    left_out = {k for k in lost if lost[k].volume() > _WITHIN * bodies[k].volume()}
    kept = tuple(k for k in range(len(parts)) if k not in left_out)
    return Counted(tuple(_remove(parts[k], lost.get(k)) for k in kept), kept, shared)


def _remove(part: Component, common: manifold3d.Manifold | None) -> Component:
    """Subtracts a volume from the inertia of a part. The volume is in the tool's frame, in millimetres."""
    if common is None or common.is_empty():
        return part
    X_ET = np.linalg.inv(part.X_TE)
    J = part.shape.unit_pseudo_inertia() - X_ET @ integrate_faces(*_get_triangles(common)) @ X_ET.T
    return replace(part, shape=LoadedShape(part.shape, J))


def _measure_common(one: tuple[Array, Array], other: tuple[Array, Array]) -> float:
    """Computes the volume that two boxes share, [m^3], from their least and largest coordinates."""
    lengths = np.minimum(one[1], other[1]) - np.maximum(one[0], other[0])
    return float(np.prod(np.maximum(lengths, 0.0)))


def _build_manifold(part: Component) -> manifold3d.Manifold:
    """Builds a part in the tool's frame, in millimetres."""
    shape = find_visible(part.shape)
    match shape:
        case TriangleMesh():
            body = _build_mesh(shape)
        case Box():
            body = manifold3d.Manifold.cube(_SCALE * shape.sizes, center=True)
        case Cylinder():
            body = _build_cylinder(shape.radius, shape.length)
        case Capsule():
            ball = manifold3d.Manifold.sphere(_SCALE * shape.radius, _FACETS)
            half = (0.0, 0.0, 0.5 * _SCALE * shape.length)
            body = _unite([_build_cylinder(shape.radius, shape.length), ball.translate(half)])
            body += ball.translate((0.0, 0.0, -half[2]))
        case _:  # an ellipsoid
            body = manifold3d.Manifold.sphere(1.0, _FACETS).scale(_SCALE * shape.sizes)
    X = np.array(part.X_TE[:3])
    X[:, 3] *= _SCALE
    return body.transform(X)


def _build_mesh(solid: TriangleMesh) -> manifold3d.Manifold:
    return manifold3d.Manifold(manifold3d.Mesh64(_SCALE * solid.vertices, solid.faces.astype(np.uint64)))


def _build_cylinder(radius: float, length: float) -> manifold3d.Manifold:
    return manifold3d.Manifold.cylinder(_SCALE * length, _SCALE * radius, circular_segments=_FACETS, center=True)


def _is_within(inner: manifold3d.Manifold, outer: manifold3d.Manifold) -> bool:
    """Returns True if a solid is wholly inside another solid."""
    return bool((inner ^ outer).volume() > _WITHIN * inner.volume())


def _is_sound(body: manifold3d.Manifold) -> bool:
    return bool(body.status() == manifold3d.Error.NoError)


def _unite(bodies: Sequence[manifold3d.Manifold]) -> manifold3d.Manifold:
    return manifold3d.Manifold.batch_boolean(list(bodies), manifold3d.OpType.Add)


def _get_triangles(body: manifold3d.Manifold) -> tuple[Array, Faces]:
    """Returns vertices, (n, 3), [m], and faces, (m, 3)."""
    mesh = body.to_mesh64()
    return np.array(mesh.vert_properties[:, :3]) / _SCALE, np.array(mesh.tri_verts, dtype=np.intp)
