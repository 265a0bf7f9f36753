"""Reader of tools from the YAML files of the models."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field

from affordance.exceptions import BadArgumentError, BadValueError
from affordance.files.constraints import StrPath, check_path
from affordance.files.data_model import DataModel, load_model
from affordance.files.model_folder import MODELS
from affordance.objects.component_reader import Part, read_components
from affordance.objects.material import Material
from affordance.objects.materials import check_materials, load_materials
from affordance.objects.tool import PLANE_TOLERANCE, Component, Grip, StrikingFace, Tool, find_struck_part
from affordance.objects.tool_entries import StrikeEntry, ToolEntry

# Least length of a vector that defines a direction, [1].
_MIN_LENGTH = 0.01
# Files of tools and of held objects, in the folder workshop/ of the models.
_WORKSHOP = ("tools.yaml", "uncommon.yaml", "blanks.yaml", "hps.yaml")


class _ToolsFile(DataModel):
    """Content of a tools file."""

    tools: Annotated[list[ToolEntry], Field(min_length=1)]


def load_tools(
    path: StrPath,
    materials: Mapping[str, Material] | None = None,
    meshes: StrPath | None = None,
    chosen: Callable[[str], bool] = lambda name: True,
) -> tuple[Tool, ...]:
    """Reads a tools file: ``tools``, a list of entries with name, components and optional named grips and strikes.

    Args:
        path: Path of the file.
        materials: Materials that components may be made of, by name; those that come with the program if None.
        meshes: Folder to which paths of mesh files are relative; None for that of the file.
        chosen: Predicate on a tool's name, True to read it; the meshes of others are not opened.

    Raises:
        BadValueError: The file, one of its values or a mesh file is invalid; the message says which and how.
    """
    path = check_path("path", path)
    folder = path.parent if meshes is None else check_path("meshes", meshes)
    materials = load_materials() if materials is None else check_materials(materials)
    return build_tools(path, "tools", load_model(path, _ToolsFile).tools, materials, folder, chosen)


def list_materials(path: StrPath) -> tuple[str, ...]:
    """Lists the materials that a tools file names, without duplicates; no mesh is opened.

    Raises:
        BadValueError: The file or one of its values is invalid; the message says which and how.
    """
    named = [
        name
        for tool in load_model(check_path("path", path), _ToolsFile).tools
        for part in tool.components
        for name in (part.material, part.looks_like, *(part.materials or ()))
    ]
    return tuple(dict.fromkeys(name for name in named if name is not None))


def load_workshop_materials(models: Path = MODELS) -> dict[str, Material]:
    """Loads the materials that workshop tools are made of, by name, in the order of the materials file.

    They are those that an observer who knows workshop tools recognises by sight.

    Raises:
        BadValueError: A file is wrong; the message gives file and reason.
    """
    return select_known(load_materials(models / "materials.yaml"), (), models)


def select_known(
    materials: Mapping[str, Material], tools: Sequence[Tool], models: Path = MODELS
) -> dict[str, Material]:
    """Selects the materials of the models' workshop tools and of some further tools, by name, in their order."""
    names = {name for file in _WORKSHOP for name in list_materials(models / "workshop" / file)}
    names |= {each.name for tool in tools for part in tool.components for each in (part.material, part.looks_like)}
    return {name: material for name, material in materials.items() if name in names}


def build_tools(
    path: Path,
    key: str,
    entries: Sequence[ToolEntry],
    materials: Mapping[str, Material],
    meshes: Path,
    chosen: Callable[[str], bool] = lambda name: True,
) -> tuple[Tool, ...]:
    """Builds the tools at a key of a file; see ``load_tools``.

    Raises:
        BadValueError: Two tools share a name, or one cannot be built; the message says which and how.
    """
    tools: dict[str, Tool] = {}
    names: set[str] = set()
    for index, entry in enumerate(entries):
        place = f"{key}[{index}]"
        if entry.name in names:
            problem = f"is {entry.name!r}, which an earlier tool of the file is called already"
            raise BadValueError(path, f"{place}.name", problem)
        names.add(entry.name)
        if not chosen(entry.name):
            continue
        components = tuple(
            component
            for part, each in enumerate(entry.components)
            for component in read_components(Part(path, f"{place}.components[{part}]", each, materials), meshes)
        )
        for name, face in (entry.strikes or {}).items():
            components = _add_strike(components, name, face, path, f"{place}.strikes.{name}")
        grips = tuple(Grip(name, grip.build_pose()) for name, grip in (entry.grips or {}).items())
        try:
            tools[entry.name] = Tool(entry.name, components, grips)
        except BadArgumentError as error:
            raise BadValueError(path, f"{place}.{error.source}", error.problem) from error
    return tuple(tools.values())


def _add_strike(
    components: Sequence[Component], name: str, entry: StrikeEntry, path: Path, key: str
) -> tuple[Component, ...]:
    """Adds a striking face to the part that has it."""
    point, normal = np.array(entry.point), np.array(entry.normal)
    length = float(np.linalg.norm(normal))
    if length < _MIN_LENGTH:
        raise BadValueError(path, f"{key}.normal", f"has a length of {length:g}, must be at least {_MIN_LENGTH:g}")
    normal /= length
    number, gap = find_struck_part([(part.shape, part.X_TE) for part in components], point, normal)
    if gap > PLANE_TOLERANCE:
        problem = (
            f"is {1e3 * gap:.3g} mm from where any part ends along the normal, must be at most "
            f"{1e3 * PLANE_TOLERANCE:g} mm: a face that strikes lies on its part's hull"
        )
        raise BadValueError(path, f"{key}.point", problem)
    part = components[number]
    R_TE, p_TE = part.X_TE[:3, :3], part.X_TE[:3, 3]
    face = StrikingFace(name, R_TE.T @ (point - p_TE), R_TE.T @ normal)
    return (*components[:number], part.with_strike(face), *components[number + 1 :])
