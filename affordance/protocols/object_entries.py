"""Objects of a protocol, in named groups: shapes, materials and looks, or the file that defines them."""

import difflib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, NamedTuple, Self

import numpy as np
from pydantic import Field, model_validator

from affordance.exceptions import BadValueError, describe_choice
from affordance.files.constraints import Name, OneOf, Text, Whole, Within, complain
from affordance.files.data_model import DataModel, join_key
from affordance.objects.inertia import DENSITY_MAX, DENSITY_MIN
from affordance.objects.load import build_tools, check_parts, load_tools
from affordance.objects.materials import ColourText, Material, MaterialEntry, load_materials
from affordance.objects.primitives import Cylinder
from affordance.objects.tool import Component, Tool
from affordance.objects.tool_entries import ToolEntry
from affordance.protocols import ALL
from affordance.protocols.requirements import Requirement, check_requirements


class CylinderEntry(DataModel):
    """A cylinder along the hand's z, held at its middle."""

    name: Annotated[Name, Field(description="Name of the cylinder, unlike all others of the file.")]
    radius: Annotated[float, Within(1e-3, 0.5), Field(description="Radius, [m].")]
    height: Annotated[float, Within(1e-3, 1.0), Field(description="Height, [m].")]
    mass: Annotated[float, Within(1e-3, 100.0), Field(description="Mass, [kg].")]
    colour: Annotated[ColourText, Field(description="Colour of the cylinder, as '#8c8c8c'.")]

    def build(self) -> Tool:
        """Builds the object from its entry."""
        solid = Cylinder(self.radius, self.height)
        density = self.mass / solid.volume
        if not DENSITY_MIN <= density <= DENSITY_MAX:
            problem = f"makes a density of {density:.3g} kg/m^3, must be from {DENSITY_MIN:g} to {DENSITY_MAX:g}"
            raise complain(problem, "mass")
        material = MaterialEntry(colour=self.colour, density=density, density_sd=0.0, source="protocol")
        made_of: Material = material.build(self.name)
        return Tool(self.name, (Component(solid, np.eye(4), made_of, made_of),))

    @model_validator(mode="after")
    def check_density(self) -> Self:
        """Refuses cylinders of impossible density."""
        self.build()
        return self


class GroupEntry(DataModel):
    """Group of objects by their names, or by places, which count from 1 or, backwards from the last, from -1."""

    names: Annotated[list[str] | None, Field(description="Names of objects.", min_length=1)] = None
    first: Annotated[
        Annotated[int, Whole(-1000, 1000)] | None, Field(alias="from", description="Place of the first.")
    ] = None
    last: Annotated[
        Annotated[int, Whole(-1000, 1000)] | None, Field(alias="to", description="Place of the last.")
    ] = None

    @model_validator(mode="after")
    def check_ways(self) -> Self:
        """Refuses groups that are given in both ways or in neither."""
        by_place = self.first is not None and self.last is not None
        if by_place == (self.names is not None):
            raise complain("must have either 'names' or both 'from' and 'to'")
        return self

    def select(self, tools: Sequence[Tool]) -> list[int]:
        """Returns the indices of the group's objects; an unknown name or place, or none, raises a LookupError."""
        known = [tool.name for tool in tools]
        if self.names is not None:
            unknown = [name for name in self.names if name not in known]
            if unknown:
                raise LookupError(describe_choice(unknown[0], known))
            return [known.index(name) for name in self.names]
        assert self.first is not None
        assert self.last is not None
        for place in (self.first, self.last):
            if not 1 <= abs(place) <= len(tools):
                raise LookupError(f"has the place {place}, must be from 1 to {len(tools)}, or from -1 backwards")
        start, end = (place - 1 if place > 0 else len(tools) + place for place in (self.first, self.last))
        if start > end:
            raise LookupError(f"is empty: from {self.first} to {self.last} of {len(tools)} objects there is none")
        return list(range(start, end + 1))


class ObjectsEntry(DataModel):
    """Objects of a protocol."""

    file: Annotated[
        Annotated[str, Text()] | None,
        Field(description="Tools file, in the folder of the protocol or of the models."),
    ] = None
    materials_file: Annotated[str, Text(), Field(description="File of the objects' materials.")] = "materials.yaml"
    materials: Annotated[
        Annotated[dict[Name, MaterialEntry], Field(min_length=1)] | None,
        Field(description="Materials of this protocol, in addition to those of the file."),
    ] = None
    tools: Annotated[
        Annotated[list[ToolEntry], Field(min_length=1)] | None, Field(description="Objects, as in a tools file.")
    ] = None
    cylinders: Annotated[list[CylinderEntry] | None, Field(min_length=1, description="Objects of one part.")] = None
    groups: Annotated[
        dict[Name, GroupEntry], Field(description="Names for some of the objects; 'all' stands for all.")
    ] = Field(default_factory=dict)
    require: Annotated[
        list[Annotated[Requirement, OneOf(Requirement)]],
        Field(description="Requirements on the objects for the protocol to make sense."),
    ] = Field(default_factory=list)

    @model_validator(mode="after")
    def check_given(self) -> Self:
        """Refuses protocols without objects, and groups with the reserved name."""
        if self.file is None and self.tools is None and self.cylinders is None:
            raise complain("has no objects, must have 'file', 'tools' or 'cylinders'")
        if ALL in self.groups:
            raise complain("is the name of the group of all objects, must be another", f"groups.{ALL}")
        return self


class ProtocolObjects(NamedTuple):
    """Objects of a protocol in the order of their file, whose path errors name, and indices of objects by group."""

    tools: tuple[Tool, ...]
    groups: Mapping[str, Sequence[int]]
    path: Path

    def select(self, group: str) -> list[Tool]:
        """Returns the objects of a group."""
        return [self.tools[index] for index in self.groups[group]]


def build_objects(entry: ObjectsEntry, path: Path, models: Path, key: str = "objects") -> ProtocolObjects:
    """Builds the objects of the entry at a key; names used twice or unmet requirements raise a BadValueError."""
    tools: tuple[Tool, ...] = ()
    source = path
    materials: dict[str, Material] = {}
    if entry.file is not None or entry.tools is not None:
        materials = load_materials(find_file(entry.materials_file, f"{key}.materials_file", path, models))
        materials |= {name: each.build(name) for name, each in (entry.materials or {}).items()}
    if entry.file is not None:
        source = find_file(entry.file, f"{key}.file", path, models)
        tools = load_tools(source, materials)
    tools += build_tools(path, f"{key}.tools", entry.tools or [], materials, path.parent)
    tools += tuple(each.build() for each in entry.cylinders or [])
    check_parts(path, key, tools)
    names = [tool.name for tool in tools]
    if twice := {name for name in names if names.count(name) > 1}:
        raise BadValueError(path, key, f"has two objects called {min(twice)!r}, each must have its own name")
    check_requirements(entry.require, source, tools)
    groups: dict[str, list[int]] = {ALL: list(range(len(tools)))}
    for name, group in entry.groups.items():
        try:
            groups[name] = group.select(tools)
        except LookupError as error:
            raise BadValueError(path, join_key([key, "groups", name]), str(error.args[0])) from error
    return ProtocolObjects(tools, groups, source)


def find_file(name: str, key: str, path: Path, models: Path) -> Path:
    """Finds a file that a protocol names at a key, in its own folder or that of models; else a BadValueError."""
    for folder in (path.parent, models):
        if (folder / name).exists():  # a folder is refused when it is read
            return folder / name
    problem = f"is {name!r}, which is neither in the protocol's folder nor in {models}"
    there = {each.stem: each.name for each in path.parent.iterdir() if each != path}
    near = difflib.get_close_matches(Path(name).stem, there, n=1)
    hint = f"; did you mean {there[near[0]]!r}?" if near else ""
    raise BadValueError(path, key, problem + hint)
