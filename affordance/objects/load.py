"""Reading materials and tools from the YAML files of the models."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import AfterValidator, Field, RootModel
from scipy.spatial.transform import Rotation

from affordance.arrays import Array
from affordance.exceptions import BadValueError, describe_choice
from affordance.files.data_model import DataModel, Text, Vector, Within, complain, load_model
from affordance.objects.inertia import Ellipsoid
from affordance.objects.tool import DENSITY_MAX, DENSITY_MIN, Component, Grip, Material, Tool

# What a hand can hold: semi-axes from a tenth of a millimetre, nothing larger or further than a metre. Beyond that a
# value is a slip of units rather than an object, [m].
_SIZE_MIN, _SIZE_MAX = 1e-4, 1.0


def _check_colour(text: str) -> str:
    if not re.fullmatch("#[0-9a-fA-F]{6}", text):
        raise complain(f"is {text!r}, must be red, green and blue in hexadecimal, as '#b5a642'")
    return text


type ColourText = Annotated[str, Text(), AfterValidator(_check_colour)]
type Position = Annotated[tuple[float, float, float], Vector(3, Within(-_SIZE_MAX, _SIZE_MAX))]
type Rotations = Annotated[tuple[float, float, float], Vector(3, Within(-360.0, 360.0))]


class MaterialEntry(DataModel):
    """A material as a file has it."""

    colour: Annotated[ColourText, Field(description="Red, green and blue in hexadecimal, as '#b5a642'.")]
    density: Annotated[float, Within(DENSITY_MIN, DENSITY_MAX), Field(description="[kg/m^3]")]
    density_sd: Annotated[
        float, Within(0.0, DENSITY_MAX), Field(description="Between things that are made of it, [kg/m^3].")
    ]
    source: Annotated[str, Text(), Field(description="Where the density comes from.")]

    def build(self, name: str) -> Material:
        """Builds the material."""
        red, green, blue = (int(self.colour[i : i + 2], 16) / 255 for i in (1, 3, 5))
        return Material(name, (red, green, blue), self.density, self.density_sd, self.source)


class _MaterialsFile(RootModel[Annotated[dict[str, MaterialEntry], Field(min_length=1)]]):
    """A materials file."""


class PoseEntry(DataModel):
    """Where something is in the tool's frame T, and how it is turned."""

    position: Annotated[Position, Field(description="[m]")]
    rpy_deg: Annotated[Rotations | None, Field(description="Roll, pitch and yaw, [deg].")] = None

    def build_pose(self) -> Array:
        """Builds the pose, (4, 4)."""
        X = np.eye(4)
        X[:3, 3] = self.position
        if self.rpy_deg is not None:
            X[:3, :3] = Rotation.from_euler("xyz", self.rpy_deg, degrees=True).as_matrix()
        return X


class ComponentEntry(PoseEntry):
    """A solid ellipsoid of a tool as a file has it."""

    semi_axes: Annotated[
        Annotated[tuple[float, float, float], Vector(3, Within(_SIZE_MIN, _SIZE_MAX))],
        Field(description="Half the lengths along the ellipsoid's own axes, [m]."),
    ]
    material: Annotated[str, Text(), Field(description="What it is made of.")]
    looks_like: Annotated[
        Annotated[str, Text()] | None, Field(description="The material whose colour it shows; its own if left out.")
    ] = None


class ToolEntry(DataModel):
    """A tool as a file has it."""

    name: Annotated[str, Text()]
    components: Annotated[list[ComponentEntry], Field(min_length=1, description="Its solid parts.")]
    grips: Annotated[
        Annotated[dict[str, PoseEntry], Field(min_length=1)] | None,
        Field(description="Ways of holding it, by name; Tx points out of the hand."),
    ] = None


class _ToolsFile(DataModel):
    """A tools file."""

    tools: Annotated[list[ToolEntry], Field(min_length=1)]


def load_materials(path: Path) -> dict[str, Material]:
    """Reads a materials file: a mapping from names to colour, density, density_sd and source.

    Raises:
        BadValueError: The file or one of its values is wrong; the message says which and how.
    """
    return {name: entry.build(name) for name, entry in load_model(path, _MaterialsFile).root.items()}


def load_tools(path: Path, materials: Mapping[str, Material]) -> tuple[Tool, ...]:
    """Reads a tools file: ``tools``, a list of a name, a list of components and, if need be, named grips each.

    Raises:
        BadValueError: The file or one of its values is wrong; the message says which and how.
    """
    return build_tools(path, "tools", load_model(path, _ToolsFile).tools, materials)


def build_tools(
    path: Path, key: str, entries: Sequence[ToolEntry], materials: Mapping[str, Material]
) -> tuple[Tool, ...]:
    """Builds the tools that stand at a key of a file.

    Raises:
        BadValueError: Two have one name, or a material is none of those that are known.
    """
    tools: dict[str, Tool] = {}
    for index, entry in enumerate(entries):
        place = f"{key}[{index}]"
        if entry.name in tools:
            problem = f"is {entry.name!r}, which an earlier tool of the file is called already"
            raise BadValueError(path, f"{place}.name", problem)
        components = tuple(
            _build_component(path, f"{place}.components[{part}]", each, materials)
            for part, each in enumerate(entry.components)
        )
        grips = tuple(Grip(name, grip.build_pose()) for name, grip in (entry.grips or {}).items())
        tools[entry.name] = Tool(entry.name, components, grips)
    return tuple(tools.values())


def _build_component(path: Path, key: str, entry: ComponentEntry, materials: Mapping[str, Material]) -> Component:
    for name in ("material", "looks_like"):
        named: Any = getattr(entry, name)
        if named is not None and named not in materials:
            raise BadValueError(path, f"{key}.{name}", describe_choice(named, materials))
    material = materials[entry.material]
    looks_like = material if entry.looks_like is None else materials[entry.looks_like]
    return Component(Ellipsoid(entry.semi_axes), entry.build_pose(), material, looks_like)
