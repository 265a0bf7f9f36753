"""What is held: materials, and tools made of solid components, read from the YAML files in models/.

Frames: T the tool, which coincides with the hand's frame H while held; E a component. A component has the colour of
its material unless ``looks_like`` names another: that is how a decoy is made.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from affordance.inertia import Ellipsoid, Shape, build_inertia_map
from affordance.yaml_records import Record, read_record

Array = NDArray[np.float64]

MODELS = Path(__file__).resolve().parents[1] / "models"

# What a hand can hold: semi-axes from a tenth of a millimetre, nothing larger or further than a metre, [m]; and
# densities from aerogel to beyond osmium, [kg/m^3]. Beyond them a value is a slip of units rather than an object.
_SIZE_MIN, _SIZE_MAX = 1e-4, 1.0
_DENSITY_MIN, DENSITY_MAX = 0.1, 25_000.0

type Colour = tuple[float, float, float]


@dataclass(frozen=True)
class Material:
    """What a component is made of.

    Attributes:
        name: Its key in the materials file.
        colour: What the eye sees, red, green and blue in [0, 1].
        density: Mean density of things made of it, [kg/m^3].
        density_sd: Standard deviation between such things, [kg/m^3].
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

    def hold_by(self, grip: Grip) -> "Tool":
        """Returns the same tool with one of its grips in the hand, and no choice of grip any more."""
        X_GT = np.linalg.inv(grip.X_TG)
        components = tuple(replace(part, X_TE=X_GT @ part.X_TE) for part in self.components)
        return Tool(self.name, components, (), grip.name)

    def make_of(self, densities: Mapping[Colour, float]) -> "Tool":
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


class Placed(Protocol):
    """A solid at its place in a tool, whether it is known (Component) or only seen (ComponentFeatures)."""

    @property
    def shape(self) -> Shape:
        """The solid."""

    @property
    def X_TE(self) -> Array:
        """Its pose in the tool, shape (4, 4)."""


def find_free_end(parts: Sequence[Placed]) -> Array:
    """The point of a tool that lies farthest from the hand along Tx, p_TTfree, shape (3,), [m]."""
    points = [part.X_TE[:3, 3] + part.X_TE[:3, :3] @ part.shape.find_support(part.X_TE[0, :3]) for part in parts]
    return max(points, key=lambda point: float(point[0]))


def load_materials(path: Path) -> dict[str, Material]:
    """Reads a materials file: a mapping from names to colour, density, density_sd and source.

    Raises:
        BadValueError: The file or one of its values is wrong; the message says which and how.
    """
    materials = {}
    for name, record in read_record(path).named_records():
        materials[name] = Material(
            name=name,
            colour=_read_colour(record),
            density=record.number("density", low=_DENSITY_MIN, high=DENSITY_MAX),
            density_sd=record.number("density_sd", low=0.0, high=DENSITY_MAX),
            source=record.text("source"),
        )
        record.finish()
    return materials


def load_tools(path: Path, materials: dict[str, Material]) -> tuple[Tool, ...]:
    """Reads a tools file: ``tools``, a list of a name, a list of components and, if need be, named grips each.

    Raises:
        BadValueError: The file or one of its values is wrong; the message says which and how.
    """
    document = read_record(path)
    tools: list[Tool] = []
    for record in document.records("tools"):
        name = record.text("name")
        if name in (tool.name for tool in tools):
            raise record.error("name", f"is {name!r}, which an earlier tool of the file is called already")
        components = tuple(_read_component(part, materials) for part in record.records("components"))
        grips: tuple[Grip, ...] = ()
        if record.has("grips"):
            grips = tuple(_read_grip(grip_name, grip) for grip_name, grip in record.record("grips").named_records())
        record.finish()
        tools.append(Tool(name, components, grips))
    document.finish()
    return tuple(tools)


def _read_component(record: Record, materials: dict[str, Material]) -> Component:
    a, b, c = (float(value) for value in record.vector("semi_axes", 3, low=_SIZE_MIN, high=_SIZE_MAX))
    X_TE = _read_pose(record)
    material = _read_material(record, "material", materials)
    looks_like = _read_material(record, "looks_like", materials) if record.has("looks_like") else material
    record.finish()
    return Component(Ellipsoid((a, b, c)), X_TE, material, looks_like)


def _read_grip(name: str, record: Record) -> Grip:
    grip = Grip(name, _read_pose(record))
    record.finish()
    return grip


def _read_pose(record: Record) -> Array:
    X = np.eye(4)
    X[:3, 3] = record.vector("position", 3, low=-_SIZE_MAX, high=_SIZE_MAX)
    if record.has("rpy_deg"):
        turn = record.vector("rpy_deg", 3, low=-360.0, high=360.0)
        X[:3, :3] = Rotation.from_euler("xyz", turn, degrees=True).as_matrix()
    return X


def _read_material(record: Record, key: str, materials: dict[str, Material]) -> Material:
    name = record.text(key)
    if name not in materials:
        raise record.error(key, f"is {name!r}, must be one of the known materials: {', '.join(materials)}")
    return materials[name]


def _read_colour(record: Record) -> Colour:
    text = record.text("colour")
    if not re.fullmatch("#[0-9a-fA-F]{6}", text):
        raise record.error("colour", f"is {text!r}, must be red, green and blue in hexadecimal, as '#b5a642'")
    red, green, blue = (int(text[i : i + 2], 16) / 255 for i in (1, 3, 5))
    return red, green, blue
