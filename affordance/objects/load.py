"""Reading materials and tools from the YAML files of the models."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from affordance.files.yaml_reader import Record, read_record
from affordance.objects.component_reader import SIZE_MAX, read_colour, read_components, read_pose
from affordance.objects.striking_face import PLANE_TOLERANCE, StrikingFace, find_struck_part
from affordance.objects.tool import DENSITY_MAX, DENSITY_MIN, Component, Grip, Material, Tool

# Shorter vectors do not say a direction, [1].
_MIN_LENGTH = 0.01


def load_materials(path: Path) -> dict[str, Material]:
    """Reads a materials file: a mapping from names to colour, density, density_sd and source.

    Raises:
        BadValueError: The file or one of its values is wrong; the message says which and how.
    """
    materials = {}
    for name, record in read_record(path).named_records():
        materials[name] = Material(
            name=name,
            colour=read_colour(record),
            density=record.number("density", low=DENSITY_MIN, high=DENSITY_MAX),
            density_sd=record.number("density_sd", low=0.0, high=DENSITY_MAX),
            source=record.text("source"),
        )
        record.finish()
    return materials


def load_tools(
    path: Path,
    materials: dict[str, Material],
    meshes: Path | None = None,
    chosen: Callable[[str], bool] = lambda name: True,
) -> tuple[Tool, ...]:
    """Reads a tools file: ``tools``, a list of a name, a list of components and, if need be, named grips and strikes.

    Args:
        path: The file.
        materials: What components may be made of, by name.
        meshes: Paths of mesh files are relative to this folder; to that of the file if None.
        chosen: Says by its name whether a tool is read; the meshes of others are not opened.

    Raises:
        BadValueError: The file or one of its values is wrong, or a mesh file is; the message says which and how.
    """
    document = read_record(path)
    tools: list[Tool] = []
    for record in document.records("tools"):
        name = record.text("name")
        if name in (tool.name for tool in tools):
            raise record.error("name", f"is {name!r}, which an earlier tool of the file is called already")
        if not chosen(name):
            continue
        folder = path.parent if meshes is None else meshes
        components = tuple(
            component
            for entry in record.records("components")
            for component in read_components(entry, materials, folder)
        )
        if record.has("strikes"):
            for face_name, face in record.record("strikes").named_records():
                components = _add_strike(components, face_name, face)
        grips: tuple[Grip, ...] = ()
        if record.has("grips"):
            grips = tuple(_read_grip(grip_name, grip) for grip_name, grip in record.record("grips").named_records())
        record.finish()
        tools.append(Tool(name, components, grips))
    document.finish()
    return tuple(tools)


def _read_grip(name: str, record: Record) -> Grip:
    grip = Grip(name, read_pose(record))
    record.finish()
    return grip


def _add_strike(components: Sequence[Component], name: str, record: Record) -> tuple[Component, ...]:
    """Reads a striking face, and gives it to the part that has it."""
    point = record.vector("point", 3, low=-SIZE_MAX, high=SIZE_MAX)
    normal = record.vector("normal", 3, low=-1.0, high=1.0)
    length = float(np.linalg.norm(normal))
    if length < _MIN_LENGTH:
        raise record.error("normal", f"has a length of {length:g}, must be at least {_MIN_LENGTH:g}")
    record.finish()
    normal /= length
    number, gap = find_struck_part([(part.shape, part.X_TE) for part in components], point, normal)
    if gap > PLANE_TOLERANCE:
        problem = f"is {1e3 * gap:.3g} mm from where any part ends along the normal"
        raise record.error(
            "point",
            f"{problem}, must be at most {1e3 * PLANE_TOLERANCE:g} mm: a face that strikes lies on its part's hull",
        )
    part = components[number]
    R_TE, p_TE = part.X_TE[:3, :3], part.X_TE[:3, 3]
    face = StrikingFace(name, R_TE.T @ (point - p_TE), R_TE.T @ normal)
    return (*components[:number], part.with_strike(face), *components[number + 1 :])
