"""Reads robot files in three formats, and runs xacro templates, which are programs."""

import contextlib
import importlib.util
import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

from affordance.exceptions import AffordanceError, BadValueError, ModelFileError
from affordance.extensions.robots.description import Description
from affordance.extensions.robots.mjcf import read_mjcf
from affordance.extensions.robots.sdf import read_sdf
from affordance.extensions.robots.urdf import read_urdf
from affordance.extensions.robots.xml_reader import read_xml
from affordance.files.bounded import ROBOT, read_bytes

_READERS = {"robot": read_urdf, "sdf": read_sdf, "mujoco": read_mjcf}
# Contents that occur only in templates: xacro's elements, substitutions and expressions. Expanded files may still
# declare xacro's namespace, and contain expressions in comments.
_TEMPLATE = re.compile(rb"</?xacro:|\$\{|\$\(")
_COMMENT = re.compile(rb"<!--.*?(-->|\Z)", re.DOTALL)
# Number of folder levels above a template that are searched for packages, and below each of them. A workspace's
# ``src`` contains repositories with packages, which may be grouped.
_LEVELS, _BELOW, _BELOW_SRC = 7, 2, 3
# Includes, packages, arguments and macros in a template.
_INCLUDES = re.compile(r"""<xacro:include\s+[^>]*?filename\s*=\s*["']([^"']+)""")
_FINDS = re.compile(r"\$\(find\s+([^)]+?)\s*\)")
_ARGUMENTS = re.compile(r"<xacro:arg\s[^>]*>")
_MACROS = re.compile(r"""<xacro:macro\s+[^>]*?name\s*=\s*["']([^"']+)""")


def read_robot(
    path: Path, arguments: Mapping[str, str] | None = None, packages: Mapping[str, str] | None = None
) -> Description:
    """Reads a URDF, SDF or MJCF file, or expands a xacro template.

    Args:
        path: Robot's file.
        arguments: Arguments of a template, which is then run; None refuses templates.
        packages: Folders of packages that a template uses, by name, in addition to nearby packages.

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
    """Returns True if a file's name or contents are those of a xacro template."""
    return path.suffix == ".xacro" or bool(_TEMPLATE.search(_COMMENT.sub(b"", read_bytes(path, ROBOT))))


def _expand(path: Path, arguments: Mapping[str, str], packages: Mapping[str, str]) -> tuple[str, tuple[Path, ...]]:
    """Runs a template. Returns the text of the robot's file, and the files that the template includes."""
    if importlib.util.find_spec("xacrodoc") is None:
        problem = "is a xacro template, which needs pip install 'visual-inertial-affordances[xacro]'"
        raise BadValueError(path, "", problem)
    import xacro
    import xacrodoc  # lets xacro find packages without ROS

    known = {**_find_packages(path), **packages}
    xacrodoc.packages.reset()
    xacrodoc.packages.update_package_cache(known)
    xacro.all_includes.clear()
    try:
        root = xacro.process_file(str(path.resolve()), mappings=dict(arguments)).documentElement
    except Exception as error:  # a program can raise anything
        raise _explain(path, error, _scan(path, known)) from error
    sources = tuple(map(Path, xacro.all_includes))
    if not any(child.nodeName == "link" for child in root.childNodes) and root.nodeName == "robot":
        macros = ", ".join(_MACROS.findall(path.read_text(encoding="utf-8", errors="replace")))
        if macros:
            raise BadValueError(
                path, "", f"has no link: it only defines macros ({macros}); give the file that calls one"
            )
    texts = [each.read_text(encoding="utf-8", errors="replace") for each in (path, *sources)]
    stated = dict(_list_arguments(texts))
    if unknown := [name for name in arguments if name not in stated and not any(f"arg {name})" in t for t in texts)]:
        raise BadValueError(path, f"{unknown[0]}:={arguments[unknown[0]]}", f"is no argument; {_describe(stated)}")
    return root.toxml(), sources


class _Scanned(NamedTuple):
    """Names found in a template and its includes without running it."""

    missing: list[str]  # unknown packages
    arguments: dict[str, str | None]  # defaults of arguments; None without a default


def _scan(path: Path, known: Mapping[str, str]) -> _Scanned:
    """Searches a template and its includes for packages and arguments."""
    files, texts = [path.resolve()], list[str]()
    for file in files:  # the list grows in the loop
        texts.append(file.read_text(encoding="utf-8", errors="replace"))
        for name in _INCLUDES.findall(texts[-1]):
            found = file.parent / _FINDS.sub(lambda match: known.get(match[1], match[0]), name)
            if found.is_file() and found.resolve() not in files:
                files.append(found.resolve())
    named = dict.fromkeys(name for text in texts for name in _FINDS.findall(text))
    return _Scanned([name for name in named if name not in known and "$" not in name], dict(_list_arguments(texts)))


def _list_arguments(texts: Iterable[str]) -> Iterator[tuple[str, str | None]]:
    """Lists the arguments that templates declare, with their defaults."""
    for text in texts:
        for element in _ARGUMENTS.findall(text):
            values = {name: value for name, _, value in re.findall(r"""(\w+)\s*=\s*(["'])(.*?)\2""", element)}
            if "name" in values:
                yield values["name"], values.get("default")


def _describe(arguments: Mapping[str, str | None]) -> str:
    if not arguments:
        return "the template declares no arguments"
    shown = {None: "no default", "": "empty by default"}
    listed = [f"{name} ({shown.get(default, default)})" for name, default in arguments.items()]
    return f"the template's arguments: {', '.join(listed)}"


def _explain(path: Path, error: Exception, scanned: _Scanned) -> AffordanceError:
    """Explains in one line why a template cannot be expanded."""
    cause = error
    while isinstance(inner := getattr(cause, "exc", None), Exception):  # xacro wraps exceptions
        cause = inner
    if type(cause).__name__ == "PackageNotFoundError" and scanned.missing:
        needed, few = ", ".join(scanned.missing), len(scanned.missing) == 1
        problem = f"needs the package{'' if few else 's'} {needed}, which {'is' if few else 'are'} not near it"
        return ModelFileError(path, f"{problem}; --package NAME=DIR gives one")
    if isinstance(cause, OSError) and cause.filename:
        problem = f"needs {cause.filename}: {cause.strerror}"
    else:
        problem = f"cannot be expanded by xacro: {type(cause).__name__}: {' '.join(str(error).split())}"
    ways = "NAME:=VALUE gives an argument, --package NAME=DIR a package"
    return ModelFileError(path, f"{problem}; {_describe(scanned.arguments)}; {ways}")


def _find_packages(path: Path) -> dict[str, str]:
    """Finds packages (``package.xml``) in the folders above a template and below these folders, nearest first."""
    found: dict[str, str] = {}
    for folder in list(path.resolve().parents)[:-1][:_LEVELS]:
        below = _BELOW_SRC if folder.name == "src" else _BELOW
        for depth in range(1, below + 1):
            for file in sorted(folder.glob("*/" * depth + "package.xml")):
                with contextlib.suppress(AffordanceError):  # another package may have a broken file
                    found.setdefault((read_xml(file).findtext("name") or "").strip(), str(file.parent))
    return found
