"""Reads robot files in any of the three formats, and expands xacro templates, which are programs."""

import importlib.util
import re
from collections.abc import Mapping
from pathlib import Path

from affordance.exceptions import BadValueError, ModelFileError
from affordance.extensions.robots.description import Description
from affordance.extensions.robots.mjcf import read_mjcf
from affordance.extensions.robots.sdf import read_sdf
from affordance.extensions.robots.urdf import read_urdf
from affordance.extensions.robots.xml_reader import read_xml
from affordance.files.bounded import ROBOT, read_bytes

_READERS = {"robot": read_urdf, "sdf": read_sdf, "mujoco": read_mjcf}
# Found only in templates: xacro's elements, substitutions and expressions. What xacro has expanded may still declare
# its namespace, and have expressions in comments.
_TEMPLATE = re.compile(rb"</?xacro:|\$\{|\$\(")
_COMMENT = re.compile(rb"<!--.*?(-->|\Z)", re.DOTALL)
# Number of levels above a template on which packages are searched.
_LEVELS = 7


def read_robot(
    path: Path, arguments: Mapping[str, str] | None = None, packages: Mapping[str, str] | None = None
) -> Description:
    """Reads a URDF, SDF or MJCF file, or expands a xacro template.

    Args:
        path: Robot's file.
        arguments: Arguments of a template, which is then run; None refuses templates.
        packages: Folders of packages that a template uses, by name, in addition to those near it.

    Raises:
        BadValueError: The file is invalid, or is a template although there are no arguments.
        ModelFileError: The template cannot be expanded.
    """
    sources: tuple[Path, ...] = ()
    if not is_template(path):
        if arguments or packages:
            raise BadValueError(path, "", "is no xacro template, must be one if NAME:=VALUE or --package is given")
        root = read_xml(path)
    elif arguments is None:
        line = f"affordance import-arm {path} --out FOLDER"
        raise BadValueError(path, "", f"is a xacro template, a program; to run it and use FOLDER instead: {line}")
    else:
        text, sources = _expand(path, arguments, packages or {})
        root = read_xml(path, text.encode())
    if root.tag not in _READERS:
        raise BadValueError(path, "", f"begins with <{root.tag}>, must with <robot> (URDF), <sdf> or <mujoco> (MJCF)")
    description = _READERS[root.tag](path, root)
    description.sources += sources
    return description


def is_template(path: Path) -> bool:
    """Returns True if a file is a xacro template, by its name or contents."""
    return path.suffix == ".xacro" or bool(_TEMPLATE.search(_COMMENT.sub(b"", read_bytes(path, ROBOT))))


def _expand(path: Path, arguments: Mapping[str, str], packages: Mapping[str, str]) -> tuple[str, tuple[Path, ...]]:
    """Runs a template; returns the text of the robot's file, and the files that the template includes."""
    if importlib.util.find_spec("xacrodoc") is None:
        problem = "is a xacro template, which needs pip install 'visual-inertial-affordances[xacro]'"
        raise BadValueError(path, "", problem)
    import xacro
    import xacrodoc  # lets xacro find packages without ROS

    xacrodoc.packages.reset()
    xacrodoc.packages.update_package_cache({**_find_packages(path), **packages})
    xacro.all_includes.clear()
    try:
        text: str = xacro.process_file(str(path.resolve()), mappings=dict(arguments)).toxml()
    except Exception as error:  # a program can raise anything
        cause = getattr(error, "exc", None) or error  # xacro wraps exceptions
        problem = f"cannot be expanded by xacro: {type(cause).__name__}: {' '.join(str(error).split())}"
        ways = "NAME:=VALUE gives it an argument, --package NAME=DIR a package"
        raise ModelFileError(path, f"{problem}; {ways}") from error
    return text, tuple(map(Path, xacro.all_includes))


def _find_packages(path: Path) -> dict[str, str]:
    """Searches the folders above a template, and their siblings, for packages (``package.xml``), nearest first."""
    found: dict[str, str] = {}
    for folder in list(path.resolve().parents)[:_LEVELS]:
        for file in sorted(folder.glob("*/package.xml")):
            name = (read_xml(file).findtext("name") or "").strip()
            found.setdefault(name, str(file.parent))
    return found
