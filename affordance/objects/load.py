"""Loads tools and their parts (ellipsoids, boxes, cylinders, capsules, meshes) from YAML files."""

import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field

from affordance.exceptions import BadArgumentError, BadValueError, describe_choice, suggest
from affordance.files.constraints import StrPath, check_path
from affordance.files.data_model import DataModel, load_model
from affordance.files.model_folder import MODELS
from affordance.objects.colour import (
    COLOUR_FORM,
    Colour,
    find_nearest_colour,
    is_colour,
    is_same_colour,
    parse_colour,
    show_colour,
)
from affordance.objects.inertia import Ellipsoid, Primitive
from affordance.objects.materials import Material, check_materials, load_materials
from affordance.objects.mesh_bodies import UNITS, Body, count_shells, load_bodies, merge
from affordance.objects.overlap import count_once
from affordance.objects.primitives import Box, Capsule, Cylinder
from affordance.objects.striking_face import PLANE_TOLERANCE, StrikingFace, find_struck_part
from affordance.objects.tool import WEIGHING_SD, Component, Grip, Tool, Weighing
from affordance.objects.tool_entries import ComponentEntry, StrikeEntry, ToolEntry, build_pose

_LOG = logging.getLogger(__name__)

# Value of the key ``colour`` that selects the colours in the mesh file.
_OF_FILE = "file"

# Types of solids, by the key that contains their lengths.
_SOLIDS: dict[str, type[Primitive]] = {"semi_axes": Ellipsoid, "box": Box, "cylinder": Cylinder, "capsule": Capsule}
_KINDS = (*_SOLIDS, "mesh")
# Keys allowed for primitives, and keys allowed for meshes.
_OF_PRIMITIVES = (
    "position",
    "rpy_deg",
    "material",
    "colour",
    "looks_like",
    "mass",
    "mass_sd",
    "volume_sd",
    "place_sd",
)
_OF_MESHES = ("unit", "shell", "materials", *_OF_PRIMITIVES)
_ORIGIN = (0.0, 0.0, 0.0)
# Least length of a vector that defines a direction, [1].
_MIN_LENGTH = 0.01
# Largest number of parts of all tools together. The time to compute a joint belief grows with the cube of this
# number.
_MOST_PARTS = 200
# Files with tools and other held objects, in the models' folder workshop/.
_WORKSHOP = ("tools.yaml", "uncommon.yaml", "blanks.yaml", "hps.yaml")


@dataclass(frozen=True)
class Part:
    """Component in a tools file: its entry, its place in the file, and the known materials."""

    path: Path
    key: str
    entry: ComponentEntry
    materials: Mapping[str, Material]

    def error(self, name: str, problem: str) -> BadValueError:
        """Creates an error about one of the entry's keys."""
        return BadValueError(self.path, f"{self.key}.{name}", problem)

    def find_material(self, key: str, name: str | None) -> Material:
        """Returns the material that a key names.

        Raises:
            BadValueError: The name is missing or unknown.
        """
        if name is None:
            raise self.error(key, "is missing")
        if name not in self.materials:
            own = "others can be added in a materials.yaml, given by --materials FILE or --robot FOLDER"
            hint = "" if suggest(name, self.materials) else f"; {own}"
            raise self.error(key, f"{describe_choice(name, self.materials)}{hint}")
        return self.materials[name]


def read_components(part: Part, folder: Path) -> tuple[Component, ...]:
    """Builds one component from an entry, or several components from a mesh.

    Raises:
        BadValueError: A value or a mesh file is invalid.
    """
    entry = part.entry
    kinds = [kind for kind in _KINDS if getattr(entry, kind) is not None]
    if len(kinds) > 1:
        raise part.error(kinds[1], f"is given together with {kinds[0]}, must be the only one of {', '.join(_KINDS)}")
    if not kinds:
        raise part.error(_KINDS[0], f"is missing: one of {', '.join(_KINDS)} must be given")
    kind = kinds[0]
    known = _OF_MESHES if kind == "mesh" else _OF_PRIMITIVES
    for name in sorted(entry.model_fields_set - {kind, *known}):
        raise part.error(name, f"is not a key of a {kind} (known: {', '.join(sorted(known))})")
    if kind == "mesh":
        return _read_mesh(part, folder)
    X_TE = build_pose(entry.position or _ORIGIN, entry.rpy_deg)
    ((material, looks_like),) = _read_materials(part, [None])
    solid = _SOLIDS[kind].from_sizes(getattr(entry, kind))
    return (Component(solid, X_TE, material, looks_like, (), entry.volume_sd, entry.place_sd),)


def _read_mesh(part: Part, folder: Path) -> tuple[Component, ...]:
    entry = part.entry
    assert entry.mesh is not None
    if entry.unit is None:
        raise part.error("unit", "is missing")
    if entry.unit not in UNITS:
        raise part.error("unit", f"is {entry.unit!r}, must be one of {', '.join(UNITS)}")
    found = load_bodies(folder / entry.mesh, entry.unit)
    X_TF = build_pose(entry.position or _ORIGIN, entry.rpy_deg)
    bodies = _choose_bodies(part, found)
    colours = [body.colour for body in bodies]
    pairs = _read_list(part, found, colours) if entry.materials is not None else _read_materials(part, colours)
    return tuple(
        Component(
            body.solid, X_TF @ build_pose(body.p_FEo), material, looks_like, (), entry.volume_sd, entry.place_sd
        )
        for body, (material, looks_like) in zip(bodies, pairs, strict=True)
    )


def _choose_bodies(part: Part, found: tuple[Body, ...]) -> tuple[Body, ...]:
    """Selects the bodies of a mesh that become components.

    These are the requested body, or all bodies if each shell has its own material or colour. Otherwise all bodies are
    merged into one.
    """
    entry = part.entry
    if entry.shell is not None:
        if entry.shell >= count_shells(found):
            raise part.error("shell", f"is {entry.shell}, must be from 0 to {count_shells(found) - 1}")
        for body in found:
            if body.number == entry.shell:
                return (body,)
        raise part.error("shell", f"is {entry.shell}, the wall of a cavity, must be the shell around it")
    by_shell = entry.materials is not None or entry.material is None
    return found if by_shell or len(found) == 1 else (merge(found),)


def _read_list(
    part: Part, found: Sequence[Body], colours: Sequence[Colour | None]
) -> list[tuple[Material, Material]]:
    """Reads the material of each shell, including cavities, and the apparent material of each body."""
    names = part.entry.materials or []
    if len(names) != count_shells(found):
        problem = f"has {len(names)} entries, must have {count_shells(found)}: one per shell, in the file's order"
        raise part.error("materials", problem)
    pairs = []
    for body, colour in zip(found, colours, strict=True):
        material = part.find_material(f"materials[{body.number}]", names[body.number])
        for cavity in body.cavities:
            if names[cavity] != names[body.number]:
                problem = f"is {names[cavity]!r}, the wall of a cavity in shell {body.number}"
                raise part.error(f"materials[{cavity}]", f"{problem}, must be that shell's {names[body.number]!r}")
        pairs.append((material, _read_look(part, material, colour)))
    return pairs


def _read_materials(part: Part, colours: Sequence[Colour | None]) -> list[tuple[Material, Material]]:
    """Reads the true and the apparent material of each body from ``material``, or from ``colour`` alone."""
    entry = part.entry
    if entry.material is None and entry.colour is not None:
        pairs = []
        for colour in _read_colours(part, colours):
            matching = [each for each in part.materials.values() if is_same_colour(each.colour, colour)]
            if len(matching) != 1:
                nearest = find_nearest_colour(colour, {each.name: each.colour for each in part.materials.values()})
                problem = f"{show_colour(colour)} is the colour of {len(matching)} materials, must be of exactly one"
                raise part.error("colour", f"{problem}; the nearest is {nearest}")
            pairs.append((matching[0], matching[0]))
        return pairs
    material = part.find_material("material", entry.material)
    return [(material, _read_look(part, material, colour)) for colour in colours]


def _read_look(part: Part, material: Material, colour: Colour | None) -> Material:
    """Reads the apparent material of a part: its own material, another material, or a given colour."""
    if part.entry.looks_like is not None:
        return part.find_material("looks_like", part.entry.looks_like)
    if part.entry.colour is not None:
        (shown,) = _read_colours(part, [colour])
        return Material(show_colour(shown), shown, material.density, material.density_sd, "the colour of the part")
    return material


def _read_colours(part: Part, colours: Sequence[Colour | None]) -> list[Colour]:
    if part.entry.colour != _OF_FILE:
        text = part.entry.colour or ""
        if not is_colour(text):
            raise part.error("colour", f"is {text!r}, {COLOUR_FORM}")
        return [parse_colour(text)] * len(colours)
    known = []
    for number, colour in enumerate(colours):
        if colour is None:
            problem = f"is {_OF_FILE}, but the file has no colour for part {number} (image textures are not read)"
            raise part.error("colour", f"{problem}; a colour or material must be given")
        known.append(colour)
    return known


class _ToolsFile(DataModel):
    """Contents of a tools file."""

    tools: Annotated[list[ToolEntry], Field(min_length=1)]


def load_tools(
    path: StrPath,
    materials: Mapping[str, Material] | None = None,
    meshes: StrPath | None = None,
    chosen: Callable[[str], bool] = lambda name: True,
) -> tuple[Tool, ...]:
    """Loads the tools of a file.

    The file has a list ``tools``. Each tool has a name, components, and optionally grips and strikes.

    Args:
        path: Path of the file.
        materials: Available materials by name; None for the program's own.
        meshes: Folder of the mesh files; None for the folder of the tools file.
        chosen: Function that returns True for the name of each tool to load. Meshes of other tools are not opened.

    Raises:
        BadValueError: The file, one of its values or a mesh file is invalid; the message names file, key and value.
    """
    path = check_path("path", path)
    folder = path.parent if meshes is None else check_path("meshes", meshes)
    materials = load_materials() if materials is None else check_materials(materials)
    return _build_tools(path, load_model(path, _ToolsFile).tools, materials, folder, chosen)


def list_materials(path: StrPath) -> tuple[str, ...]:
    """Lists the materials that a tools file uses, without duplicates and without opening meshes."""
    named = [
        name
        for tool in load_model(check_path("path", path), _ToolsFile).tools
        for part in tool.components
        for name in (part.material, part.looks_like, *(part.materials or ()))
    ]
    return tuple(dict.fromkeys(name for name in named if name is not None))


def select_known(
    materials: Mapping[str, Material], tools: Sequence[Tool], models: Path = MODELS
) -> dict[str, Material]:
    """Selects the materials that are used in the workshop's files or in further tools.

    Args:
        materials: Materials by name; their order is preserved.
        tools: Further tools.
        models: Folder with the workshop's files.
    """
    names = {name for file in _WORKSHOP for name in list_materials(models / "workshop" / file)}
    names |= {each.name for tool in tools for part in tool.components for each in (part.material, part.looks_like)}
    return {name: material for name, material in materials.items() if name in names}


def _build_tools(
    path: Path,
    entries: Sequence[ToolEntry],
    materials: Mapping[str, Material],
    meshes: Path,
    chosen: Callable[[str], bool],
) -> tuple[Tool, ...]:
    """Builds the selected tools of a file.

    Raises:
        BadValueError: A value is invalid, or two tools have the same name.
    """
    tools: dict[str, Tool] = {}
    names: set[str] = set()
    num_parts = 0
    for index, entry in enumerate(entries):
        place = f"tools[{index}]"
        if entry.name in names:
            problem = f"is {entry.name!r}, the name of an earlier tool of the file"
            raise BadValueError(path, f"{place}.name", problem)
        names.add(entry.name)
        if not chosen(entry.name):
            continue
        components: tuple[Component, ...] = ()
        weighings = _list_weighing(path, place, entry, ())
        for number, each in enumerate(entry.components):
            part_key = f"{place}.components[{number}]"
            read = read_components(Part(path, part_key, each, materials), meshes)
            parts = tuple(range(len(components), len(components) + len(read)))
            weighings += _list_weighing(path, part_key, each, parts)
            components += read
        for name, face in (entry.strikes or {}).items():
            components = _add_strike(components, name, face, path, f"{place}.strikes.{name}")
        num_parts += len(components)
        if num_parts > _MOST_PARTS:
            raise BadValueError(path, "tools", f"have {num_parts} parts in all, must have at most {_MOST_PARTS}")
        counted = count_once(components)
        if counted.shared:
            _LOG.warning("%s: %s: %s", path, entry.name, counted.describe())
        grips = tuple(Grip(name, grip.build_pose()) for name, grip in (entry.grips or {}).items())
        try:
            tools[entry.name] = Tool(entry.name, counted.parts, grips, weighings=counted.renumber(weighings))
        except BadArgumentError as error:
            raise BadValueError(path, f"{place}.{error.source}", error.problem) from error
    return tuple(tools.values())


def _list_weighing(
    path: Path, key: str, entry: ToolEntry | ComponentEntry, parts: tuple[int, ...]
) -> tuple[Weighing, ...]:
    """Returns a tuple with the weighing of an entry; empty if the entry has no mass.

    Raises:
        BadValueError: There is a ``mass_sd`` without a mass.
    """
    if entry.mass is None:
        if entry.mass_sd is not None:
            raise BadValueError(path, f"{key}.mass_sd", "is the standard deviation of a mass, which is missing")
        return ()
    return (Weighing(parts, entry.mass, entry.mass_sd or WEIGHING_SD * entry.mass),)


def _add_strike(
    components: Sequence[Component], name: str, entry: StrikeEntry, path: Path, key: str
) -> tuple[Component, ...]:
    """Adds a striking face to the part on which the face is located."""
    point, normal = np.array(entry.point), np.array(entry.normal)
    length = float(np.linalg.norm(normal))
    if length < _MIN_LENGTH:
        raise BadValueError(path, f"{key}.normal", f"has a length of {length:g}, must be at least {_MIN_LENGTH:g}")
    normal /= length
    number, gap = find_struck_part([(part.shape, part.X_TE) for part in components], point, normal)
    if gap > PLANE_TOLERANCE:
        problem = (
            f"is {1e3 * gap:.3g} mm from the nearest place where a part ends along the normal, must be at most "
            f"{1e3 * PLANE_TOLERANCE:g} mm from it: a striking face is on its part's convex hull"
        )
        raise BadValueError(path, f"{key}.point", problem)
    part = components[number]
    R_TE, p_TE = part.X_TE[:3, :3], part.X_TE[:3, 3]
    face = StrikingFace(name, R_TE.T @ (point - p_TE), R_TE.T @ normal)
    struck = replace(part, strikes=(*part.strikes, face))
    return (*components[:number], struck, *components[number + 1 :])
