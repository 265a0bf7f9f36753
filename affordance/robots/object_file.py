"""Tool from a URDF of an object, as simulators have it: its shapes, its grips, and its mass as a weighing.

A link without shape and mass that is fixed to another is a grip. Materials are those whose name the file uses and the
program knows; any other is known by its colour alone. Moments of inertia follow from shapes and densities, so that
those of the file are compared with them, and named if they cannot be meant.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.exceptions import BadArgumentError, BadValueError
from affordance.objects.colour import Colour, show_colour
from affordance.objects.inertia import Ellipsoid, build_inertia_map
from affordance.objects.materials import Material
from affordance.objects.mesh_bodies import UNITS, load_bodies
from affordance.objects.primitives import Box, Cylinder
from affordance.objects.tool import Component, Grip, Tool
from affordance.objects.weighing import WEIGHING_SD, Weighing
from affordance.robots.description import Description, Visual, build_pose
from affordance.robots.reader import read_robot

SUFFIX = ".urdf"
# Name of the grip at the origin of an object that has no other.
_ORIGIN = "origin"
# Factor between moments of a file and those of its shapes and mass from which they are placeholders: hollow and solid
# bodies of one shape differ by less than two.
_OFF = 3.0
# Colour of a shape of which the file gives none: the middle grey of viewers.
_GREY = (0.7, 0.7, 0.7)
# Density of what has shapes and no mass, used where a true one is needed: that of water, [kg/m^3].
_WATER = 1000.0


class ReadObject(NamedTuple):
    """Tool of an object's file, and what is to be said of it."""

    tool: Tool
    remarks: tuple[str, ...]


def read_object(path: Path, materials: Mapping[str, Material]) -> ReadObject:
    """Reads the tool of an object's URDF.

    A file with a joint that moves, without a shape, or with a shape that no tool has, raises a BadValueError.
    """
    description = read_robot(path)
    poses = _find_poses(description)
    components: list[Component] = []
    weighings: list[Weighing] = []
    remarks: list[str] = []
    grips = []
    for link, X_TL in poses.items():
        inertial, shapes = description.inertials.get(link), description.visuals[link]
        parts = [part for shape in shapes for part in _build_parts(path, link, shape, X_TL, materials)]
        mass = 0.0 if inertial is None else inertial.mass
        if not parts and not mass:
            grips.append(Grip(link, X_TL))
        if mass and not parts:
            raise BadValueError(
                path, f"link {link}", f"has {mass:g} kg and no shape that is read, must have a visual"
            )
        if mass:
            places = tuple(range(len(components), len(components) + len(parts)))
            weighings.append(Weighing(places, mass, WEIGHING_SD * mass))
            remarks += _compare_moments(description, link, parts, X_TL)
        components += parts
    named = [grip for grip in grips if grip.name != next(iter(poses))] or [Grip(_ORIGIN, np.eye(4))]
    try:
        tool = Tool(path.stem, tuple(components), tuple(named), weighings=tuple(weighings))
    except BadArgumentError as error:
        raise BadValueError(path, "", f"{error.source} {error.problem}") from error
    return ReadObject(tool, tuple(f"{path.name}: {each}" for each in (*description.remarks, *remarks)))


def _find_poses(description: Description) -> dict[str, Array]:
    """Finds the poses of all links in the first one without a parent; a joint that moves raises a BadValueError."""
    if description.kind != "urdf":
        raise BadValueError(description.path, "", "is no URDF, must be one for an object; others are robots' files")
    fixed = description.fixed
    for name in description.joints:
        if name not in {joint for joint, _, _ in fixed.values()}:
            problem = "moves, so the file is of a robot (import-arm); an object is one body"
            raise BadValueError(description.path, f"joint {name}", problem)
    roots = [link for link in description.visuals if link not in fixed]
    poses = {roots[0]: np.eye(4)} if roots else {}
    while len(poses) < len(description.visuals):
        found = {
            link: poses[parent] @ X_PC
            for link, (_, parent, X_PC) in fixed.items()
            if parent in poses and link not in poses
        }
        if not found:
            left = next(link for link in description.visuals if link not in poses)
            raise BadValueError(description.path, f"link {left}", "is not fixed to the others, must be: one body")
        poses |= found
    return poses


def _build_parts(
    path: Path, link: str, shape: Visual, X_TL: Array, materials: Mapping[str, Material]
) -> list[Component]:
    X_TE = X_TL @ build_pose(shape.place, shape.rpy)
    own = _find_material(shape, materials)
    if shape.shape == "box":
        return [Component(Box((shape.sizes[0], shape.sizes[1], shape.sizes[2])), X_TE, own, own)]
    if shape.shape == "cylinder":
        return [Component(Cylinder(shape.sizes[0], shape.sizes[1]), X_TE, own, own)]
    if shape.shape == "sphere":
        return [Component(Ellipsoid((shape.sizes[0],) * 3), X_TE, own, own)]
    unit = next((name for name, metres in UNITS.items() if np.allclose(shape.sizes, metres, rtol=1e-6)), None)
    if shape.shape != "mesh" or unit is None:
        what = f"a {shape.shape} of scale {' '.join(f'{each:g}' for each in shape.sizes)}"
        problem = f"has {what}, must be a box, cylinder, sphere or mesh in m, cm, mm or in"
        raise BadValueError(path, f"link {link}", problem)
    if "://" in shape.mesh:
        problem = f"names the mesh {shape.mesh!r}, must be a path from the file's own folder"
        raise BadValueError(path, f"link {link}", problem)
    return [
        Component(body.solid, X_TE @ build_pose(tuple(body.p_FEo), (0.0,) * 3), own, own)
        for body in load_bodies(path.parent / shape.mesh, unit)
    ]


def _find_material(shape: Visual, materials: Mapping[str, Material]) -> Material:
    """Finds the material that a shape is named after, or one of its colour alone."""
    if shape.material in materials:
        return materials[shape.material]
    r, g, b = (shape.colour or (*_GREY, 1.0))[:3]
    colour: Colour = (r, g, b)
    return Material(show_colour(colour), colour, _WATER, source="the colour of the part")


def _compare_moments(description: Description, link: str, parts: list[Component], X_TL: Array) -> list[str]:
    """Names moments of inertia that a body of these shapes and mass cannot have, unless it is odd inside."""
    fault = description.mended.get(link, ("",))[0]
    if fault:
        return [f"link {link} {fault}: those of its shape are used"]
    inertial = description.inertials[link]
    Phi = build_inertia_map([part.shape for part in parts], [part.X_TE for part in parts], [0] * len(parts), 1)[:, 0]
    pi = inertial.mass * Phi / Phi[0]
    p = pi[1:4] / inertial.mass
    about = pi[4:7] - inertial.mass * (p @ p - p**2)
    written = np.linalg.eigvalsh(_make_symmetric(inertial.moments))
    products = pi[7:] - -inertial.mass * p[[0, 0, 1]] * p[[1, 2, 2]]
    shaped = np.linalg.eigvalsh(_make_symmetric((*about, *products)))
    if (written > _OFF * shaped).any() or (shaped > _OFF * written).any():
        was, now = (" ".join(f"{each:.2g}" for each in values) for values in (written, shaped))
        return [
            f"link {link} has principal moments of {was} kg m^2, and its shape and mass {now}: the latter are used"
        ]
    return []


def _make_symmetric(moments: tuple[float, ...]) -> Array:
    a, b, c, d, e, f = moments
    return np.array([[a, d, e], [d, b, f], [e, f, c]])
