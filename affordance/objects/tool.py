"""Tools composed of solid components, which an arm can hold.

Frames: T the tool, which coincides with the hand's frame H while the tool is held; E a component. A component shows
the colour of its material, or of the material ``looks_like`` if the object is a decoy.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np

from affordance.arguments import check_kind, check_pose
from affordance.arrays import Array
from affordance.exceptions import BadArgumentError
from affordance.objects.colour import Colour
from affordance.objects.inertia import DENSITY_MAX, Shape, build_inertia_map, parameters_from_pseudo_inertia
from affordance.objects.materials import Material
from affordance.objects.striking_face import StrikingFace

# Standard deviations of the errors of a CAD drawing: relative for volume, [m] for position. For all twenty tools,
# masses agree within 0.3 % and centres of mass within 0.15 mm (docs/tools.md lists the blind comparisons).
CAD_VOLUME_SD, CAD_PLACE_SD = 4e-3, 2e-4
# Largest mass, [kg]. A larger mass is a mistake in units, and its simulation may not terminate.
MASS_MAX = 1e4
# Largest difference between equal moments per unit volume, [1, m, m^2].
_EQUAL = 1e-9


class Weighing(NamedTuple):
    """Measured mass of a tool, or of some of its parts."""

    parts: tuple[int, ...]  # indices of the parts on the scale; empty for the whole tool
    mass: float  # measured mass, [kg]
    sd: float  # standard deviation of its error, [kg]


@dataclass(frozen=True, eq=False)  # because comparing arrays does not give a single truth value
class Component:
    """Solid part of a tool."""

    shape: Shape  # solid in its own frame E
    X_TE: Array  # pose of E in the tool, (4, 4), read-only
    material: Material  # material that determines the density
    looks_like: Material  # material whose colour is visible
    strikes: tuple[StrikingFace, ...] = ()  # faces that are designed to strike
    volume_sd: float = CAD_VOLUME_SD  # standard deviation of the volume, as a fraction of it
    place_sd: float = CAD_PLACE_SD  # standard deviation of each coordinate of the centroid, [m]

    def __post_init__(self) -> None:
        """Checks types and pose, and copies the pose.

        Raises:
            BadArgumentError: A type is wrong, or the pose scales or mirrors.
        """
        check_kind("shape", self.shape, Shape)
        check_kind("material", self.material, Material)
        check_kind("looks_like", self.looks_like, Material)
        object.__setattr__(self, "X_TE", check_pose("X_TE", self.X_TE))


@dataclass(frozen=True, eq=False)
class Grip:
    """Way of holding a tool.

    Attributes:
        name: Name of the grip.
        X_TG: Pose of the hand in the frame of the tools file, (4, 4), read-only.
    """

    name: str
    X_TG: Array

    def __post_init__(self) -> None:
        """Stores a read-only copy of the pose.

        Raises:
            BadArgumentError: The pose scales or mirrors.
        """
        object.__setattr__(self, "X_TG", check_pose("X_TG", self.X_TG))


@dataclass(frozen=True)
class Tool:
    """Rigid tool that can be held in one or more grips.

    Attributes:
        name: Name in the tools file.
        components: Solid parts, at least one. Their poses are relative to the hand.
        grips: Available grips; empty if the tool can only be held as written in the file.
        grip: Name of the grip in use; empty if the tool is held as written in the file.
        weighings: Measured masses of the tool, or of some of its parts.

    Example:
        >>> from affordance import MODELS, load_tools
        >>> rod, *_ = load_tools(MODELS / "tools" / "weight.yaml")
        >>> rod.name, round(rod.mass, 2)
        ('rod_10cm', 0.4)
    """

    name: str
    components: tuple[Component, ...]
    grips: tuple[Grip, ...] = ()
    grip: str = ""
    weighings: tuple[Weighing, ...] = ()

    def __post_init__(self) -> None:
        """Checks components, grips and mass.

        Raises:
            BadArgumentError: There is no component, a grip's name is repeated, or the mass exceeds MASS_MAX.
        """
        check_kind("name", self.name, str)
        for field in ("components", "grips"):
            check_kind(field, getattr(self, field), Sequence, "a tuple")
        parts = tuple(check_kind(f"components[{i}]", part, Component) for i, part in enumerate(self.components))
        if not parts:
            raise BadArgumentError("components", "", "is empty, must hold at least one Component")
        object.__setattr__(self, "components", parts)
        object.__setattr__(self, "grips", tuple(self.grips))
        names = [check_kind(f"grips[{i}]", grip, Grip).name for i, grip in enumerate(self.grips)]
        if len(set(names)) < len(names):
            raise BadArgumentError("grips", "", f"are called {', '.join(names)}, must have different names")
        mass = sum(part.shape.volume * part.material.density for part in parts)
        if not mass <= MASS_MAX:
            problem = f"weigh {mass:.3g} kg, must weigh at most {MASS_MAX:g} kg; lengths are in metres"
            raise BadArgumentError("components", "", problem)

    def __repr__(self) -> str:
        held = f", held by {self.grip}" if self.grip else ""
        grips = f", grips {', '.join(grip.name for grip in self.grips)}" if self.grips else ""
        materials = ", ".join(dict.fromkeys(part.material.name for part in self.components))
        return f"Tool({self.name}: {self.mass:.3g} kg of {materials}{held}{grips})"

    def gripped_by(self, grip: Grip) -> "Tool":
        """Returns the tool as held in one of its grips, without the other grips."""
        X_GT = np.linalg.inv(grip.X_TG)
        components = tuple(replace(part, X_TE=X_GT @ part.X_TE) for part in self.components)
        return Tool(self.name, components, (), grip.name, self.weighings)

    def list_gripped(self) -> "dict[str, Tool]":
        """Returns the tool as held in each of its grips, by the grip's name."""
        return {grip.name: self.gripped_by(grip) for grip in self.grips}

    def with_densities(self, densities: Mapping[Colour, float]) -> "Tool":
        """Replaces densities, [kg/m^3], by visible colour. The appearance does not change."""
        parts = (
            replace(part, material=replace(part.material, density=densities[part.looks_like.colour]))
            for part in self.components
        )
        return replace(self, components=tuple(parts))

    def scaled(self, density: float, size: float) -> "Tool":
        """Multiplies all densities and all lengths by two factors.

        Densities are limited to DENSITY_MAX, and the resulting tool has no grips.
        """
        parts = []
        for part in self.components:
            X_TE = np.array(part.X_TE)
            X_TE[:3, 3] *= size
            material = replace(part.material, density=min(density * part.material.density, DENSITY_MAX))
            shape = part.shape.with_sizes(size * part.shape.sizes)
            parts.append(replace(part, shape=shape, X_TE=X_TE, material=material, strikes=()))
        return Tool(self.name, tuple(parts))

    @cached_property
    def parameters(self) -> Array:
        """True inertial parameters about To, expressed in T, shape (10,)."""
        shapes, poses = [part.shape for part in self.components], [part.X_TE for part in self.components]
        densities = [part.material.density for part in self.components]
        return build_inertia_map(shapes, poses, range(len(densities)), len(densities)) @ densities

    @property
    def appearance(self) -> tuple[object, ...]:
        """Hashable visible properties. Tools of equal appearance can share a Diagram."""
        return tuple((part.shape, part.X_TE.tobytes(), part.looks_like.colour) for part in self.components)

    @property
    def mass(self) -> float:
        """True mass, [kg]."""
        return float(self.parameters[0])

    @property
    def p_TTcm(self) -> Array:
        """True centre of mass, shape (3,), [m]."""
        return self.parameters[1:4] / self.mass

    @property
    def p_TTfree(self) -> Array:
        """Position of the free end, shape (3,), [m]."""
        return find_free_end(self.components)

    @property
    def p_TTcentre(self) -> Array:
        """Centroid of the volume, independent of density, shape (3,), [m]."""
        volumes = [component.shape.volume for component in self.components]
        return np.average([component.X_TE[:3, 3] for component in self.components], axis=0, weights=volumes)


def list_densities(tools: Iterable[Tool]) -> dict[Colour, float]:
    """Lists true densities by visible colour, [kg/m^3], in the order of components. Decoys are not distinguished."""
    return {part.looks_like.colour: part.material.density for tool in tools for part in tool.components}


def list_colours(tools: Iterable[Tool]) -> tuple[Colour, ...]:
    """Lists the visible colours of tools without duplicates, in the order of components."""
    return tuple(list_densities(tools))


def is_symmetric(tool: Tool) -> bool:
    """Returns True if a tool has exactly two grips, and the same shape in both.

    Shape alone then favours neither grip. If all materials have the same prior, the chance level before any
    experience is one half in every task.
    """
    if len(tool.grips) != 2:
        return False
    shapes = []
    for held in tool.list_gripped().values():
        Js = [part.X_TE @ part.shape.unit_pseudo_inertia() @ part.X_TE.T for part in held.components]
        rows = np.array([parameters_from_pseudo_inertia(J) for J in Js])
        rows /= rows[:, 0].sum()
        shapes.append(rows[np.lexsort(np.round(rows, 9).T[::-1])])
    return np.allclose(shapes[0], shapes[1], rtol=0.0, atol=_EQUAL)


class PosedShape(Protocol):
    """Solid with a pose in a tool, either known (Component) or measured (ComponentFeatures)."""

    @property
    def shape(self) -> Shape:
        """Solid in its own frame E."""

    @property
    def X_TE(self) -> Array:
        """Pose of E in the tool, shape (4, 4)."""

    @property
    def strikes(self) -> tuple[StrikingFace, ...]:
        """Faces that are designed to strike."""


def find_free_end(parts: Sequence[PosedShape]) -> Array:
    """Finds the point of a tool that is farthest from the hand along Tx, p_TTfree, (3,), [m]."""
    points = [part.X_TE[:3, 3] + part.X_TE[:3, :3] @ part.shape.find_support(part.X_TE[0, :3]) for part in parts]
    return max(points, key=lambda point: float(point[0]))


def find_box(parts: Sequence[PosedShape]) -> tuple[Array, Array]:
    """Computes the bounding box of parts along the axes of T.

    Returns:
        Least and largest coordinates, (3,) each, [m].
    """
    corners = []
    for part in parts:
        R, p = part.X_TE[:3, :3], part.X_TE[:3, 3]
        corners += [p + R @ part.shape.find_support(R.T @ axis) for axis in np.vstack([np.eye(3), -np.eye(3)])]
    return np.min(corners, axis=0), np.max(corners, axis=0)


# Default standard deviation of a weighing, relative to the mass. It corresponds to 100 g on a kitchen scale with
# steps of 1 g, and includes masses that a drawing omits, such as paint and glue.
WEIGHING_SD = 0.01
