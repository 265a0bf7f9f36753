"""Reading materials and tools from the YAML files of the models."""

import re
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from affordance.arrays import Array
from affordance.exceptions import describe_choice
from affordance.files.yaml_reader import Record, read_record
from affordance.objects.colour import Colour
from affordance.objects.inertia import Ellipsoid
from affordance.objects.tool import DENSITY_MAX, DENSITY_MIN, Component, Grip, Material, Tool

# What a hand can hold: semi-axes from a tenth of a millimetre, nothing larger or further than a metre. Beyond that a
# value is a slip of units rather than an object, [m].
_SIZE_MIN, _SIZE_MAX = 1e-4, 1.0


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
            density=record.number("density", low=DENSITY_MIN, high=DENSITY_MAX),
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
        raise record.error(key, describe_choice(name, materials))
    return materials[name]


def _read_colour(record: Record) -> Colour:
    text = record.text("colour")
    if not re.fullmatch("#[0-9a-fA-F]{6}", text):
        raise record.error("colour", f"is {text!r}, must be red, green and blue in hexadecimal, as '#b5a642'")
    red, green, blue = (int(text[i : i + 2], 16) / 255 for i in (1, 3, 5))
    return red, green, blue
