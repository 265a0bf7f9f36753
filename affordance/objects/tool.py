"""Held objects: tools composed of solid components.

Frames: T the tool, which coincides with the hand's frame H while the tool is held; E a component. A component has the
colour of its material unless ``looks_like`` names another, as for decoys.
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

# Standard deviations of the errors of a drawing: relative for volume, [m] for position. On all twenty tools masses
# agree within 0.3 % and centres of mass within 0.15 mm (docs/tools.md says which of these comparisons were blind).
CAD_VOLUME_SD, CAD_PLACE_SD = 4e-3, 2e-4
# Largest mass: a larger one is a mistake in units, and its simulation may not terminate, [kg].
MASS_MAX = 1e4
# Moments per unit volume that differ by at most this are equal, [1, m, m^2].
_EQUAL = 1e-9


class Weighing(NamedTuple):
    """Measured mass of a tool, or of some of its parts."""

    parts: tuple[int, ...]  # indices of the parts that were weighed together; empty for the whole tool
    mass: float  # measured mass, [kg]
    sd: float  # standard deviation of its error, [kg]


@dataclass(frozen=True, eq=False)  # arrays cannot be compared with a single truth value
class Component:
    """Solid part of a tool."""

    shape: Shape  # solid in its own frame E
    X_TE: Array  # pose of E in the tool, (4, 4), read-only
    material: Material  # material that determines the density
    looks_like: Material  # material whose colour the part shows
    strikes: tuple[StrikingFace, ...] = ()  # faces that are designed to strike
    volume_sd: float = CAD_VOLUME_SD  # standard deviation of the volume, as a fraction of it
    place_sd: float = CAD_PLACE_SD  # standard deviation of each coordinate of the centroid, [m]

    def __post_init__(self) -> None:
        """Checks types and pose, and copies the pose.

        A wrong type, or a pose that scales or mirrors, raises a BadArgumentError.
        """
        check_kind("shape", self.shape, Shape)
        check_kind("material", self.material, Material)
        check_kind("looks_like", self.looks_like, Material)
        object.__setattr__(self, "X_TE", check_pose("X_TE", self.X_TE))


@dataclass(frozen=True, eq=False)
class Grip:
    """Way of holding a tool. The hand's pose in the frame of the tools file is (4, 4), read-only."""

    name: str
    X_TG: Array

    def __post_init__(self) -> None:
        """Stores a read-only copy of the pose. A pose that scales or mirrors raises a BadArgumentError."""
        object.__setattr__(self, "X_TG", check_pose("X_TG", self.X_TG))


@dataclass(frozen=True)
class Tool:
    """Rigid object to be held.

    Attributes:
        name: Name in the tools file.
        components: Solid parts, at least one; poses are relative to the hand's grip.
        grips: Ways of holding the tool; empty if it can only be held as written.
        grip: Name of the grip in use; empty if the tool is held as written.
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
        """Checks parts, grips and mass.

        No parts, a repeated grip name, or a mass of more than MASS_MAX raises a BadArgumentError.
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
        """Returns the tool in one of its grips, without the other grips."""
        X_GT = np.linalg.inv(grip.X_TG)
        components = tuple(replace(part, X_TE=X_GT @ part.X_TE) for part in self.components)
        return Tool(self.name, components, (), grip.name, self.weighings)

    def list_gripped(self) -> "dict[str, Tool]":
        """Returns the tool in each of its grips, by name."""
        return {grip.name: self.gripped_by(grip) for grip in self.grips}

    def with_densities(self, densities: Mapping[Colour, float]) -> "Tool":
        """Returns a tool of equal appearance with other densities, [kg/m^3], by visible colour."""
        parts = (
            replace(part, material=replace(part.material, density=densities[part.looks_like.colour]))
            for part in self.components
        )
        return replace(self, components=tuple(parts))

    def scaled(self, density: float, size: float) -> "Tool":
        """Scales densities (at most DENSITY_MAX) and lengths of the tool by two factors. The result has no grips."""
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
        """True ten inertial parameters about To, expressed in T, shape (10,)."""
        shapes, poses = [part.shape for part in self.components], [part.X_TE for part in self.components]
        densities = [part.material.density for part in self.components]
        return build_inertia_map(shapes, poses, range(len(densities)), len(densities)) @ densities

    @property
    def appearance(self) -> tuple[object, ...]:
        """Visible properties, hashable. Tools of equal appearance can share a Diagram."""
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
        """Centroid of the volume, regardless of mass, shape (3,), [m]."""
        volumes = [component.shape.volume for component in self.components]
        return np.average([component.X_TE[:3, 3] for component in self.components], axis=0, weights=volumes)


def list_densities(tools: Iterable[Tool]) -> dict[Colour, float]:
    """Lists true densities by visible colour, [kg/m^3].

    Densities are in the order of components; decoys are ignored.
    """
    return {part.looks_like.colour: part.material.density for tool in tools for part in tool.components}


def list_colours(tools: Iterable[Tool]) -> tuple[Colour, ...]:
    """Lists visible colours of tools without duplicates, in the order of components."""
    return tuple(list_densities(tools))


def is_symmetric(tool: Tool) -> bool:
    """Returns True if a tool has the same shape in both grips.

    Shape alone then favours neither grip. With the same prior for all materials, the chance level before any
    experience is one half in any task.
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
    """Solid with a pose in a tool, known (Component) or observed (ComponentFeatures)."""

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
    """Finds the point of a tool farthest from the hand along Tx, p_TTfree, (3,), [m]."""
    points = [part.X_TE[:3, 3] + part.X_TE[:3, :3] @ part.shape.find_support(part.X_TE[0, :3]) for part in parts]
    return max(points, key=lambda point: float(point[0]))


def find_box(parts: Sequence[PosedShape]) -> tuple[Array, Array]:
    """Computes the bounding box of parts along the axes of T.

    Returns least and largest coordinates, (3,) each, [m].
    """
    corners = []
    for part in parts:
        R, p = part.X_TE[:3, :3], part.X_TE[:3, 3]
        corners += [p + R @ part.shape.find_support(R.T @ axis) for axis in np.vstack([np.eye(3), -np.eye(3)])]
    return np.min(corners, axis=0), np.max(corners, axis=0)


# Default standard deviation of a weighing, relative to the mass: 100 g on a kitchen scale with steps of 1 g, and
# things that a drawing omits, such as paint and glue.
WEIGHING_SD = 0.01
