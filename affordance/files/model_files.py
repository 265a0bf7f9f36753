"""Lists the files in a model folder that can affect results."""

import re
from collections.abc import Iterable, Iterator
from pathlib import Path

from affordance.files.bounded import MESH, read_bytes

# Files and folders in a model folder.
_ARMS = "*.dmd.yaml"
_FILES = ("materials.yaml", "faults.yaml", "nail.yaml")
_FOLDERS = ("tools", "paths", "workshop")
_PACKAGE = "package.xml"
# References to other files: URIs and file names in robot descriptions, meshes in tools files, and textures of meshes.
_DESCRIPTIONS = (".yaml", ".yml", ".sdf", ".urdf", ".xml")
_URI = re.compile(r"package://[^/\s\"'<>]+/([^\s\"'<>?#]+)")
_RELATIVE = re.compile(r"(?:<uri>|filename=[\"'])\s*(?!\w+://)([^<\"'\s]+)")
_MESH = re.compile(r"\bmesh:\s*(?:\"([^\"]+)\"|'([^']+)'|([^,}\s][^,}\n]*))")
_LIBRARY = re.compile(r"^\s*(?:mtllib|map_\w+)\s+(\S+)\s*$", re.MULTILINE)


def list_arm_files(directives: Path) -> tuple[Path, ...]:
    """Lists the files of an arm, sorted: directives, package file, and all files that these reference recursively."""
    package = directives.parent / _PACKAGE
    found: dict[Path, None] = {}
    waiting = [directives, package]
    while waiting:
        path = waiting.pop()
        if path in found or not path.is_file():
            continue
        found[path] = None
        waiting += _list_named(path, directives.parent)
    return tuple(sorted(found))


def list_model_files(folder: Path) -> tuple[Path, ...]:
    """Lists all files of a model folder that the program reads, including meshes of tools, sorted."""
    tasks = [folder / name for name in _FILES]
    tasks += [path for name in _FOLDERS for path in (folder / name).glob("*.yaml")]
    there = [path for path in tasks if path.is_file()]
    meshes = [mesh for path in there for mesh in _list_meshes(path)]
    arms = [path for directives in folder.glob(_ARMS) for path in list_arm_files(directives)]
    return tuple(sorted({*arms, *there, *meshes}))


def _list_named(path: Path, package: Path) -> Iterable[Path]:
    """Lists the files that a file references, either in its package or in its own folder."""
    if path.suffix in _DESCRIPTIONS:
        text = _read(path)
        return [
            *(package / name for name in _URI.findall(text)),
            *(path.parent / name for name in _RELATIVE.findall(text)),
        ]
    if path.suffix in (".obj", ".mtl"):
        return [path.parent / name for name in _LIBRARY.findall(_read(path))]
    return []


def _list_meshes(path: Path) -> Iterator[Path]:
    for names in _MESH.findall(_read(path)):
        mesh = path.parent / next(name for name in names if name).strip()
        if mesh.is_file():
            yield mesh


def _read(path: Path) -> str:
    return read_bytes(path, MESH).decode("utf-8", errors="replace")
