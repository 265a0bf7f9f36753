"""Counts volume that solids share only once.

Frames: T the tool, E a solid. Curved surfaces are approximated by facets, but only the shared volume depends on them.
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

# Fraction of shared volume up to which it is ignored: assemblies with overlapping threads, splines and press fits
# have up to 1.1 %.
LARGE_OVERLAP = 0.02
# Fraction of its volume above which a solid lies wholly within another one.
_WITHIN = 0.999
# Metres to millimetres, the unit that manifold3d's tolerances are suited to.
_SCALE = 1e3
# Facets around a curved solid: their volume is right to 0.2 %.
_FACETS = 96


def is_sound(solid: TriangleMesh) -> bool:
    """Returns True if a surface does not intersect itself. Only then can shared volumes be computed."""
    return _is_sound(_build_mesh(solid))


def unite(solids: Sequence[TriangleMesh]) -> TriangleMesh | None:
    """Unites solids without self-intersections in the same frame.

    Returns None if they share too little volume to matter.
    """
    united = _unite([_build_mesh(solid) for solid in solids])
    is_small = united.volume() >= (1.0 - LARGE_OVERLAP) * _SCALE**3 * sum(solid.volume for solid in solids)
    return None if is_small else TriangleMesh(*_get_triangles(united))


class Counted(NamedTuple):
    """Parts of a tool with shared volume counted once."""

    parts: tuple[Component, ...]
    kept: tuple[int, ...]  # for each part, its former index
    shared: float  # fraction of the volume that was shared; 0 if nothing has changed

    def describe(self) -> str:
        """Describes the changes."""
        share = f"its parts share {100.0 * self.shared:.1f} % of their volume"
        return f"{share}, which is counted once: as the part that is listed first, or that lies within the other"

    def renumber(self, weighings: Sequence[Weighing]) -> tuple[Weighing, ...]:
        """Renumbers the parts of weighings. A weighing of nothing but left-out parts is left out."""
        new = {former: index for index, former in enumerate(self.kept)}
        found = [(each, tuple(new[part] for part in each.parts if part in new)) for each in weighings]
        return tuple(each._replace(parts=parts) for each, parts in found if parts or not each.parts)


def count_once(parts: Sequence[Component]) -> Counted:
    """Counts shared volume once, as part of the component that is listed first.

    A part within a larger one, such as a core, keeps its volume even if it is listed later. Any other part that lies
    wholly within earlier ones is left out. Visible shapes stay. Nothing changes if the shared fraction is small.
    Parts whose surface intersects itself are not compared.
    """
    unchanged = Counted(tuple(parts), tuple(range(len(parts))), 0.0)
    boxes = [find_box([part]) for part in parts]
    most = {(i, k): _measure_common(boxes[i], boxes[k]) for k in range(len(parts)) for i in range(k)}
    volume = sum(part.shape.volume for part in parts)
    if sum(most.values()) <= LARGE_OVERLAP * volume:  # the usual case, in which no solid needs to be built
        return unchanged
    touching = [pair for pair, common in most.items() if common > 0.0]
    bodies = {k: _build_manifold(parts[k]) for k in sorted({k for pair in touching for k in pair})}
    sound = {k for k, body in bodies.items() if _is_sound(body)}
    keepers: dict[int, list[int]] = {}  # for each part, the parts that keep the volume it shares with them
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
    """Removes a volume from the inertia of a part. The volume is in the tool's frame, in millimetres."""
    if common is None or common.is_empty():
        return part
    X_ET = np.linalg.inv(part.X_TE)
    J = part.shape.unit_pseudo_inertia() - X_ET @ integrate_faces(*_get_triangles(common)) @ X_ET.T
    return replace(part, shape=LoadedShape(part.shape, J))


def _measure_common(one: tuple[Array, Array], other: tuple[Array, Array]) -> float:
    """Computes the volume that two boxes share, [m^3]. Boxes are given by their least and largest coordinates."""
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
    """Returns True if a solid lies wholly within another one."""
    return bool((inner ^ outer).volume() > _WITHIN * inner.volume())


def _is_sound(body: manifold3d.Manifold) -> bool:
    return bool(body.status() == manifold3d.Error.NoError)


def _unite(bodies: Sequence[manifold3d.Manifold]) -> manifold3d.Manifold:
    return manifold3d.Manifold.batch_boolean(list(bodies), manifold3d.OpType.Add)


def _get_triangles(body: manifold3d.Manifold) -> tuple[Array, Faces]:
    """Returns vertices, (n, 3), [m], and faces, (m, 3)."""
    mesh = body.to_mesh64()
    return np.array(mesh.vert_properties[:, :3]) / _SCALE, np.array(mesh.tri_verts, dtype=np.intp)
