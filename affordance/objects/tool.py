"""What is held: materials, and tools made of solid components.

Frames: T the tool, which coincides with the hand's frame H while held; E a component. A component has the colour of
its material unless ``looks_like`` names another: that is how a decoy is made.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated, Protocol

import numpy as np

from affordance.arguments import check_colour, check_kind, check_pose
from affordance.arrays import Array
from affordance.checked_fields import Checked, check_fields
from affordance.exceptions import BadArgumentError
from affordance.files.data_model import Within
from affordance.objects.colour import Colour
from affordance.objects.inertia import Shape, build_inertia_map
from affordance.objects.striking_face import StrikingFace

# From aerogel to beyond osmium, [kg/m^3].
DENSITY_MIN, DENSITY_MAX = 0.1, 25_000.0
# Densities that may be simulated or believed in, wider than those that there are, [kg/m^3].
DENSITIES = Within(1e-3, 1e6)
# Heavier than anything that an arm is given: more is a slip of units, and simulating it may not end, [kg].
MASS_MAX = 1e4


@dataclass(frozen=True)
class Material:
    """What a component is made of.

    Attributes:
        name: Its key in the materials file.
        colour: Red, green and blue in [0, 1].
        density: Mean density of objects made of it, [kg/m^3].
        density_sd: Standard deviation between such objects, [kg/m^3].
        source: Where the density comes from.
    """

    name: str
    colour: Annotated[Colour, Checked(check_colour)]
    density: Annotated[float, DENSITIES]
    density_sd: Annotated[float, Within(0.0, DENSITY_MAX)] = 0.0
    source: str = ""

    def __post_init__(self) -> None:
        """Checks colour and densities.

        Raises:
            BadArgumentError: One is not as it must be.
        """
        check_fields(self)


@dataclass(frozen=True, eq=False)  # an array has no one truth value to compare by
class Component:
    """One solid part of a tool.

    Attributes:
        shape: The solid, in its own frame E.
        X_TE: Its pose in the tool, shape (4, 4), read-only.
        material: What it is made of.
        looks_like: The material whose colour it shows.
        strikes: Its faces that are made to strike.
    """

    shape: Shape
    X_TE: Array
    material: Material
    looks_like: Material
    strikes: tuple[StrikingFace, ...] = ()

    def __post_init__(self) -> None:
        """Checks the parts, and keeps a read-only copy of the pose.

        Raises:
            BadArgumentError: Shape or materials are none, or the pose scales or mirrors.
        """
        check_kind("shape", self.shape, Shape)
        check_kind("material", self.material, Material)
        check_kind("looks_like", self.looks_like, Material)
        object.__setattr__(self, "X_TE", check_pose("X_TE", self.X_TE))

    def with_strike(self, face: StrikingFace) -> "Component":
        """Returns the part with one more striking face."""
        return replace(self, strikes=(*self.strikes, face))


@dataclass(frozen=True, eq=False)
class Grip:
    """One way of holding a tool.

    Attributes:
        name: Its name in the tools file.
        X_TG: Pose of the grip in the tool as its components are written, shape (4, 4), read-only.
    """

    name: str
    X_TG: Array

    def __post_init__(self) -> None:
        """Checks the pose, and keeps a read-only copy of it.

        Raises:
            BadArgumentError: The pose scales or mirrors.
        """
        object.__setattr__(self, "X_TG", check_pose("X_TG", self.X_TG))


@dataclass(frozen=True)
class Tool:
    """A rigid object to be held.

    Attributes:
        name: Its name in the tools file.
        components: Its parts, at least one; poses are relative to where the hand grips.
        grips: Ways of holding it; empty if as it is written is the only one.
        grip: Name of the grip that is in the hand; empty if it is held as it is written.
    """

    name: str
    components: tuple[Component, ...]
    grips: tuple[Grip, ...] = ()
    grip: str = ""

    def __post_init__(self) -> None:
        """Checks parts, grips and mass.

        Raises:
            BadArgumentError: There are no parts, two grips have one name, or the whole is heavier than MASS_MAX.
        """
        parts = tuple(check_kind(f"components[{i}]", part, Component) for i, part in enumerate(self.components))
        if not parts:
            raise BadArgumentError("components", "", "is empty, must hold at least one Component")
        object.__setattr__(self, "components", parts)
        object.__setattr__(self, "grips", tuple(self.grips))
        names = [check_kind(f"grips[{i}]", grip, Grip).name for i, grip in enumerate(self.grips)]
        if len(set(names)) < len(names):
            raise BadArgumentError("grips", "", f"are called {', '.join(names)}, each must have a name of its own")
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
        """Returns the same tool with one of its grips in the hand, and no choice of grip any more."""
        X_GT = np.linalg.inv(grip.X_TG)
        components = tuple(replace(part, X_TE=X_GT @ part.X_TE) for part in self.components)
        return Tool(self.name, components, (), grip.name)

    def list_gripped(self) -> "dict[str, Tool]":
        """The tool in each of its grips, by their names."""
        return {grip.name: self.gripped_by(grip) for grip in self.grips}

    def with_densities(self, densities: Mapping[Colour, float]) -> "Tool":
        """Returns a tool of the same look whose parts have other densities, by the colour they show, [kg/m^3]."""
        return replace(
            self,
            components=tuple(
                replace(part, material=replace(part.material, density=densities[part.looks_like.colour]))
                for part in self.components
            ),
        )

    @cached_property
    def parameters(self) -> Array:
        """The true ten inertial parameters about To, expressed in T, shape (10,)."""
        densities = [component.material.density for component in self.components]
        Phi = build_inertia_map(
            [component.shape for component in self.components],
            [component.X_TE for component in self.components],
            range(len(densities)),
            len(densities),
        )
        return Phi @ densities

    @property
    def appearance(self) -> tuple[object, ...]:
        """Everything of it that can be seen, hashable; tools of one appearance can share a Diagram."""
        return tuple((part.shape, part.X_TE.tobytes(), part.looks_like.colour) for part in self.components)

    @property
    def mass(self) -> float:
        """The true mass, [kg]."""
        return float(self.parameters[0])

    @property
    def p_TTcm(self) -> Array:
        """The true centre of mass, shape (3,), [m]."""
        return self.parameters[1:4] / self.mass

    @property
    def p_TTfree(self) -> Array:
        """The free end, shape (3,), [m]."""
        return find_free_end(self.components)

    @property
    def p_TTcentre(self) -> Array:
        """The geometric centre (centroid of the volume, whatever it weighs), shape (3,), [m]."""
        volumes = [component.shape.volume for component in self.components]
        return np.average([component.X_TE[:3, 3] for component in self.components], axis=0, weights=volumes)


def list_densities(tools: Iterable[Tool]) -> dict[Colour, float]:
    """True densities of what tools show, by colour, in the order of their components, [kg/m^3]; of honest tools."""
    return {part.looks_like.colour: part.material.density for tool in tools for part in tool.components}


class PosedShape(Protocol):
    """A solid at its place in a tool, whether it is known (Component) or observed (ComponentFeatures)."""

    @property
    def shape(self) -> Shape:
        """The solid."""

    @property
    def X_TE(self) -> Array:
        """Its pose in the tool, shape (4, 4)."""

    @property
    def strikes(self) -> tuple[StrikingFace, ...]:
        """Its faces that are made to strike."""


def find_free_end(parts: Sequence[PosedShape]) -> Array:
    """The point of a tool that lies farthest from the hand along Tx, p_TTfree, shape (3,), [m]."""
    points = [part.X_TE[:3, 3] + part.X_TE[:3, :3] @ part.shape.find_support(part.X_TE[0, :3]) for part in parts]
    return max(points, key=lambda point: float(point[0]))
