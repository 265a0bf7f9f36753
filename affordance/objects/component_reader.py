"""Reading the solid parts of a tool from its file: ellipsoids, boxes, cylinders, capsules and meshes."""

import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from affordance.arrays import Array
from affordance.exceptions import describe_choice
from affordance.files.yaml_reader import Record
from affordance.objects.colour import Colour, find_nearest_colour, is_same_colour
from affordance.objects.inertia import Ellipsoid, Shape
from affordance.objects.mesh_bodies import UNITS, Bodies, Body, load_bodies, merge
from affordance.objects.primitives import Box, Capsule, Cylinder
from affordance.objects.tool import Component, Material

# What a hand can hold: lengths from a tenth of a millimetre, nothing larger or further than a metre. Beyond that a
# value is a slip of units rather than an object, [m].
SIZE_MIN, SIZE_MAX = 1e-4, 1.0
# In place of a colour: that which the mesh file shows.
_OF_FILE = "file"

# By the key that gives its lengths: how many there are, and what makes a solid of them.
_PRIMITIVES: Mapping[str, tuple[int, Callable[[Sequence[float]], Shape]]] = {
    "semi_axes": (3, lambda size: Ellipsoid((size[0], size[1], size[2]))),
    "box": (3, lambda size: Box((size[0], size[1], size[2]))),
    "cylinder": (2, lambda size: Cylinder(size[0], size[1])),
    "capsule": (2, lambda size: Capsule(size[0], size[1])),
}
_KINDS = (*_PRIMITIVES, "mesh")


def read_components(record: Record, materials: Mapping[str, Material], folder: Path) -> tuple[Component, ...]:
    """Reads one entry of a tool's components: one part, or one for each body of a mesh.

    Args:
        record: The entry.
        materials: By name.
        folder: Paths of mesh files are relative to it.

    Raises:
        BadValueError: A value is wrong, or the mesh file is; the message says which and how.
    """
    kinds = [kind for kind in _KINDS if record.has(kind)]
    if len(kinds) > 1:
        raise record.error(kinds[1], f"stands beside {kinds[0]}, one of {', '.join(_KINDS)} must be given")
    kind = kinds[0] if kinds else _KINDS[0]  # reading it says that it is missing
    if kind == "mesh":
        components = _read_mesh(record, materials, folder)
    else:
        count, make = _PRIMITIVES[kind]
        shape = make([float(value) for value in record.vector(kind, count, low=SIZE_MIN, high=SIZE_MAX)])
        X_TE = read_pose(record)
        material, looks_like = _read_materials(record, materials, [None])[0]
        components = (Component(shape, X_TE, material, looks_like),)
    record.finish()
    return components


def read_pose(record: Record) -> Array:
    """Reads ``position``, [m], and if given ``rpy_deg`` as a pose, shape (4, 4)."""
    X = np.eye(4)
    X[:3, 3] = record.vector("position", 3, low=-SIZE_MAX, high=SIZE_MAX)
    if record.has("rpy_deg"):
        turn = record.vector("rpy_deg", 3, low=-360.0, high=360.0)
        X[:3, :3] = Rotation.from_euler("xyz", turn, degrees=True).as_matrix()
    return X


def read_colour(record: Record) -> Colour:
    """Reads ``colour``, six hexadecimal digits."""
    text = record.text("colour")
    if not re.fullmatch("#[0-9a-fA-F]{6}", text):
        raise record.error("colour", f"is {text!r}, must be red, green and blue in hexadecimal, as '#b5a642'")
    red, green, blue = (int(text[i : i + 2], 16) / 255 for i in (1, 3, 5))
    return red, green, blue


def _read_mesh(record: Record, materials: Mapping[str, Material], folder: Path) -> tuple[Component, ...]:
    path = folder / record.text("mesh")
    unit = record.text("unit")
    if unit not in UNITS:
        raise record.error("unit", f"is {unit!r}, must be one of {', '.join(UNITS)}")
    found = load_bodies(path, unit)
    X_TF = read_pose(record) if record.has("position") else np.eye(4)
    bodies = _choose_bodies(record, found)
    colours = [body.colour for body in bodies]
    if record.has("materials"):
        pairs = _read_list(record, materials, found, colours)
    else:
        pairs = _read_materials(record, materials, colours)
    components = []
    for body, (material, looks_like) in zip(bodies, pairs, strict=True):
        X_FE = np.eye(4)
        X_FE[:3, 3] = body.p_FEo
        components.append(Component(body.solid, X_TF @ X_FE, material, looks_like))
    return tuple(components)


def _choose_bodies(record: Record, found: Bodies) -> tuple[Body, ...]:
    """All bodies if each has a material or colour of its own, the one that is asked for, or all as one."""
    if record.has("shell"):
        number = int(record.number("shell", low=0, high=found.num_shells - 1))
        for body in found.bodies:
            if body.number == number:
                return (body,)
        raise record.error("shell", f"is {number}, the wall of a cavity; the shell around it must be given")
    by_shell = record.has("materials") or not record.has("material")
    return found.bodies if by_shell or len(found.bodies) == 1 else (merge(found),)


def _read_list(
    record: Record, materials: Mapping[str, Material], found: Bodies, colours: Sequence[Colour | None]
) -> list[tuple[Material, Material]]:
    """Materials by shell, cavities included, and what each body looks like."""
    names = record.texts("materials")
    if len(names) != found.num_shells:
        problem = f"has {len(names)} entries, must have {found.num_shells}: one a shell, in the order of the file"
        raise record.error("materials", problem)
    pairs = []
    for body, colour in zip(found.bodies, colours, strict=True):
        key = f"materials[{body.number}]"
        material = _find_material(record, key, names[body.number], materials)
        for cavity in body.cavities:
            if names[cavity] != names[body.number]:
                problem = f"is {names[cavity]!r}, the wall of a cavity in shell {body.number}"
                raise record.error(f"materials[{cavity}]", f"{problem}, must be its {names[body.number]!r}")
        pairs.append((material, _read_look(record, material, materials, colour)))
    return pairs


def _read_materials(
    record: Record, materials: Mapping[str, Material], colours: Sequence[Colour | None]
) -> list[tuple[Material, Material]]:
    """What each body is made of and looks like, by ``material``, or by ``colour`` alone.

    Args:
        record: The entry.
        materials: By name.
        colours: What the file shows of each body; None where it says nothing.
    """
    if not record.has("material") and record.has("colour"):
        pairs = []
        for colour in _read_colours(record, colours):
            matching = [each for each in materials.values() if is_same_colour(each.colour, colour)]
            if len(matching) != 1:
                nearest = find_nearest_colour(colour, {each.name: each.colour for each in materials.values()})
                problem = f"{_show(colour)} is the colour of {len(matching)} materials, must be that of one"
                raise record.error("colour", f"{problem}; the nearest is {nearest}")
            pairs.append((matching[0], matching[0]))
        return pairs
    material = _find_material(record, "material", record.text("material"), materials)
    return [(material, _read_look(record, material, materials, colour)) for colour in colours]


def _read_look(
    record: Record, material: Material, materials: Mapping[str, Material], colour: Colour | None
) -> Material:
    """The material whose colour a part shows: its own, another's, or none's but a colour that is given."""
    if record.has("looks_like"):
        return _find_material(record, "looks_like", record.text("looks_like"), materials)
    if record.has("colour"):
        (shown,) = _read_colours(record, [colour])
        return Material(_show(shown), shown, material.density, material.density_sd, "the colour of the part")
    return material


def _read_colours(record: Record, colours: Sequence[Colour | None]) -> list[Colour]:
    if record.text("colour") != _OF_FILE:
        return [read_colour(record)] * len(colours)
    known = []
    for number, colour in enumerate(colours):
        if colour is None:
            problem = f"is {_OF_FILE}, and the file shows none of part {number} (images as textures are not read)"
            raise record.error("colour", f"{problem}; a colour or material must be given")
        known.append(colour)
    return known


def _find_material(record: Record, key: str, name: str, materials: Mapping[str, Material]) -> Material:
    if name not in materials:
        raise record.error(key, describe_choice(name, materials))
    return materials[name]


def _show(colour: Colour) -> str:
    return "#" + "".join(f"{round(255 * channel):02x}" for channel in colour)
