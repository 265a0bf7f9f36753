"""Reads an object's URDF as a tool with shapes, grips and mass.

A link that is fixed to another link and has neither shape nor mass is a grip. The material of a shape is identified
by its name, or by its colour if the program does not know the name. The mass of a link is distributed according to
its centre of mass and moments, with the errors of a drawing. If these are impossible for its shape, the mass is
distributed evenly over the shape, with a remark.
"""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.exceptions import BadArgumentError, BadValueError
from affordance.extensions.robots.description import Description, Visual, build_pose
from affordance.extensions.robots.reader import read_robot
from affordance.objects.colour import Colour, show_colour
from affordance.objects.inertia import (
    Ellipsoid,
    LoadedShape,
    build_inertia_map,
    find_visible,
    pseudo_inertia_from_parameters,
)
from affordance.objects.materials import Material
from affordance.objects.mesh_bodies import UNITS, load_bodies
from affordance.objects.overlap import count_once
from affordance.objects.primitives import Box, Cylinder
from affordance.objects.tool import WEIGHING_SD, Component, Grip, Tool, Weighing, find_box

# Name of the grip at the origin of an object without other grips.
_ORIGIN = "origin"
# Moments that differ by this factor from those of shape and mass are placeholders: hollow and solid bodies with the
# same shape differ by less than a factor of two.
_OFF = 3.0
# Rounding errors: distance by which a centre of mass may be outside the shape or differ from the shape's, [m], and
# relative difference of moments.
_EDGE, _SAME = 1e-3, 0.02
# Colour of a shape without a colour in the file: medium grey, as in viewers.
_GREY = (0.7, 0.7, 0.7)
# True density of shapes without a mass, if needed: water, [kg/m^3].
_WATER = 1000.0


class ReadObject(NamedTuple):
    """Tool from a file, with remarks for the user."""

    tool: Tool
    remarks: tuple[str, ...]


def read_object(path: Path, materials: Mapping[str, Material]) -> ReadObject:
    """Reads a tool from the URDF of an object.

    Raises:
        BadValueError: The file has a moving joint, no shape, or an unsupported shape.
    """
    description = read_robot(path)
    poses = _compute_poses(description)
    components: list[Component] = []
    links: list[str] = []  # links that have a mass
    weighings: list[Weighing] = []
    grips = []
    for link, X_TL in poses.items():
        parts = [
            part for shape in description.visuals[link] for part in _build_parts(path, link, shape, X_TL, materials)
        ]
        mass = description.inertials[link].mass if link in description.inertials else 0.0
        if not parts and not mass:
            grips.append(Grip(link, X_TL))
        if mass and not parts:
            raise BadValueError(path, f"link {link}", f"has {mass:g} kg and no supported shape, must have a visual")
        if mass:
            links.append(link)
            places = tuple(range(len(components), len(components) + len(parts)))
            weighings.append(Weighing(places, mass, WEIGHING_SD * mass))
        components += parts
    remarks = [*description.remarks]
    counted = count_once(components)
    if counted.shared:
        remarks.append(counted.describe())
    loaded = list(counted.parts)
    for link, weighing in zip(links, weighings, strict=True):
        left = counted.renumber([weighing])
        if not left:
            raise BadValueError(path, f"link {link}", "lies within other links, must have a shape of its own")
        places = left[0].parts
        own, remark = _distribute(description, link, [loaded[k] for k in places], poses[link])
        for k, part in zip(places, own, strict=True):
            loaded[k] = part
        remarks += [remark] if remark else []
    named = [grip for grip in grips if grip.name != next(iter(poses))] or [Grip(_ORIGIN, np.eye(4))]
    try:
        tool = Tool(path.stem, tuple(loaded), tuple(named), weighings=counted.renumber(weighings))
    except BadArgumentError as error:
        raise BadValueError(path, "", f"{error.source} {error.problem}") from error
    return ReadObject(tool, tuple(f"{path.name}: {each}" for each in remarks))


def _compute_poses(description: Description) -> dict[str, Array]:
    """Computes the poses of all links in the root link. A moving joint raises a BadValueError."""
    if description.kind != "urdf":
        raise BadValueError(description.path, "", "is not a URDF, as a file of an object must be")
    fixed = description.fixed
    for name in description.joints:
        if name not in {joint for joint, _, _ in fixed.values()}:
            problem = "moves, so this is the file of a robot (import-arm); an object must be a single body"
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
            raise BadValueError(
                description.path, f"link {left}", "is not fixed to the others; an object must be a single body"
            )
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
        problem = f"names the mesh {shape.mesh!r}, must be a path relative to the file's folder"
        raise BadValueError(path, f"link {link}", problem)
    return [
        Component(body.solid, X_TE @ build_pose(tuple(body.p_FEo), (0.0,) * 3), own, own)
        for body in load_bodies(path.parent / shape.mesh, unit)
    ]


def _find_material(shape: Visual, materials: Mapping[str, Material]) -> Material:
    """Returns the material that the shape names, otherwise a material with the shape's colour."""
    if shape.material in materials:
        return materials[shape.material]
    r, g, b = (shape.colour or (*_GREY, 1.0))[:3]
    colour: Colour = (r, g, b)
    return Material(show_colour(colour), colour, _WATER, source="the colour of the part")


def _distribute(
    description: Description, link: str, parts: list[Component], X_TL: Array
) -> tuple[list[Component], str]:
    """Distributes the mass of a link's parts to match the file's centre of mass and moments, if possible.

    Returns: The parts, and a remark; empty if the file agrees with the shape.
    """
    fault = description.mended.get(link, ("",))[0]
    if fault:
        return parts, f"link {link} {fault}: centre of mass and moments of its shape are used"
    pi_T = build_inertia_map([part.shape for part in parts], [part.X_TE for part in parts], [0] * len(parts), 1)[:, 0]
    shaped = pseudo_inertia_from_parameters(pi_T / pi_T[0])
    inertial = description.inertials[link]
    X_TI = X_TL @ build_pose(inertial.place, inertial.rpy)
    Ixx, Iyy, Izz, Ixy, Ixz, Iyz = np.array(inertial.moments) / inertial.mass
    pi_I = np.array([1.0, 0.0, 0.0, 0.0, Ixx, Iyy, Izz, Ixy, Ixz, Iyz])
    written = X_TI @ pseudo_inertia_from_parameters(pi_I) @ X_TI.T
    was, now = (inertial.mass * _compute_moments(J) for J in (written, shaped))
    if (was > _OFF * now).any() or (now > _OFF * was).any():
        moments = [" ".join(f"{each:.2g}" for each in values) for values in (was, now)]
        said = f"has principal moments of {moments[0]} kg m^2, and its shape and mass {moments[1]}"
        return parts, f"link {link} {said}: centre of mass and moments of its shape are used"
    low, high = find_box(parts)
    p = written[:3, 3]
    away = f"{1e3 * np.linalg.norm(p - shaped[:3, 3]):.3g} mm from that of its shape"
    if (p < low - _EDGE).any() or (p > high + _EDGE).any():
        said = f"has its centre of mass outside its shape, {away}"
        return parts, f"link {link} {said}: centre of mass and moments of its shape are used"
    loaded = []
    for part in parts:
        X_ET = np.linalg.inv(part.X_TE)
        J = part.shape.volume * X_ET @ written @ X_ET.T
        loaded.append(replace(part, shape=LoadedShape(find_visible(part.shape), J)))
    is_same = np.linalg.norm(p - shaped[:3, 3]) <= _EDGE and np.allclose(was, now, rtol=_SAME)
    return (
        loaded,
        "" if is_same else f"link {link} has its centre of mass {away}: the file's centre and moments are used",
    )


def _compute_moments(J: Array) -> Array:
    """Computes the principal moments about the centre of mass, (3,), from a pseudo-inertia with unit mass."""
    spread = np.linalg.eigvalsh(J[:3, :3] - np.outer(J[:3, 3], J[:3, 3]))
    return spread.sum() - spread[::-1]
