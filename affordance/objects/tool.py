"""What is held: materials, and tools made of solid components.

Frames: T the tool, which coincides with the hand's frame H while held; E a component. A component has the colour of
its material unless ``looks_like`` names another: that is how a decoy is made.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np

from affordance.arrays import Array
from affordance.objects.colour import Colour
from affordance.objects.inertia import Shape, build_inertia_map

# From aerogel to beyond osmium, [kg/m^3].
DENSITY_MIN, DENSITY_MAX = 0.1, 25_000.0


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
    colour: Colour
    density: float
    density_sd: float
    source: str


@dataclass(frozen=True, eq=False)  # an array has no one truth value to compare by
class Component:
    """One solid part of a tool.

    Attributes:
        shape: The solid, in its own frame E.
        X_TE: Its pose in the tool, shape (4, 4), read-only.
        material: What it is made of.
        looks_like: The material whose colour it shows.
    """

    shape: Shape
    X_TE: Array
    material: Material
    looks_like: Material

    def __post_init__(self) -> None:
        """Keeps a read-only copy of the pose."""
        object.__setattr__(self, "X_TE", _copy_read_only(self.X_TE))


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
        """Keeps a read-only copy of the pose."""
        object.__setattr__(self, "X_TG", _copy_read_only(self.X_TG))


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
        return tuple(
            (type(part.shape), tuple(part.shape.sizes), part.X_TE.tobytes(), part.looks_like.colour)
            for part in self.components
        )

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


def _copy_read_only(X: Array) -> Array:
    copy = np.array(X, dtype=float)
    copy.setflags(write=False)
    return copy


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


def find_free_end(parts: Sequence[PosedShape]) -> Array:
    """The point of a tool that lies farthest from the hand along Tx, p_TTfree, shape (3,), [m]."""
    points = [part.X_TE[:3, 3] + part.X_TE[:3, :3] @ part.shape.find_support(part.X_TE[0, :3]) for part in parts]
    return max(points, key=lambda point: float(point[0]))
