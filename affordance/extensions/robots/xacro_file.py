"""Expands xacro templates, which can run Python, in a process that the kernel restricts."""

import contextlib
import importlib.util
import json
import os
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from affordance.exceptions import BadValueError, ModelFileError
from affordance.extensions.robots import xacro_child
from affordance.extensions.robots.xml_reader import read_xml
from affordance.files.bounded import ROBOT, read_bytes

# Limits for a template: processor time and elapsed time, [s], and memory, [bytes].
_SECONDS, _WAIT, _BYTES = 20, 40.0, 2_000_000_000
# Number of levels above a template on which packages are searched, and of folders searched on each.
_LEVELS, _MOST_FOLDERS = 6, 500
# Found only in templates: xacro's elements, substitutions and expressions. What xacro has expanded may still declare
# its namespace, and have expressions in comments.
_TEMPLATE = re.compile(rb"</?xacro:|\$\{|\$\(")
_UNKNOWN_PACKAGE = re.compile(r"Package not found: ([\w.-]+)")
_UNDEFINED = re.compile(r"[Uu]ndefined substitution argument (\w+)")
_MISSING = re.compile(r"No such file or directory: '?(.+?)'?(?: \[Errno|$)")


@dataclass(frozen=True)
class XacroOptions:
    """Options for expanding a template.

    Attributes:
        values: Values of the template's arguments, by name.
        packages: Folders of packages by name, in addition to packages found near the template.
        trusts: True to expand the template even if the kernel cannot restrict it.
    """

    values: Mapping[str, str] = field(default_factory=dict)
    packages: Mapping[str, str] = field(default_factory=dict)
    trusts: bool = False


# A template without arguments, near its packages.
AS_IT_IS = XacroOptions()


class Expanded(NamedTuple):
    """Robot's file expanded from a template, and the files that the template includes."""

    content: bytes
    sources: tuple[Path, ...]


def is_template(path: Path) -> bool:
    """Returns True if a file is a xacro template, by its name or contents."""
    if path.suffix == ".xacro":
        return True
    first, *others = read_bytes(path, ROBOT).split(b"<!--")
    return any(_TEMPLATE.search(part) for part in (first, *(each.partition(b"-->")[2] for each in others)))


def parse_xacro(values: Sequence[str], packages: Sequence[str], *, trusts: bool) -> XacroOptions:
    """Parses words such as ``prefix:=left_`` and ``NAME=DIR``; other forms raise a BadValueError."""
    given, folders = {}, {}
    for word in values:
        name, sign, value = word.partition(":=")
        if not (sign and name):
            raise BadValueError("NAME:=VALUE", "", f"is {word!r}, must be a name, := and a value")
        given[name] = value
    for word in packages:
        name, sign, folder = word.partition("=")
        if not (sign and name) or not Path(folder).is_dir():
            raise BadValueError("--package", "", f"is {word!r}, must be NAME=DIR, a folder")
        folders[name] = str(Path(folder).resolve())
    return XacroOptions(given, folders, trusts)


def expand(path: Path, options: XacroOptions) -> Expanded:
    """Expands a template in a sandboxed process.

    The process can read files only from the template's folder and from packages. It cannot write or execute files,
    and its time and memory are limited. If the kernel cannot enforce this, only trusted templates are expanded.

    Raises:
        BadValueError: xacrodoc is not installed, the kernel lacks Landlock, or an argument or package is missing.
        ModelFileError: The template is faulty, takes too much time or memory, or expands to too long a text.
    """
    if importlib.util.find_spec("xacrodoc") is None:
        problem = "is a xacro template, which needs the extra [xacro]: pip install '.[xacro]' in a clone"
        raise BadValueError(path, "", problem)
    packages = {**dict(_find_packages(path.resolve())), **options.packages}
    job = {
        "file": str(path.resolve()),
        "values": dict(options.values),
        "packages": packages,
        "folders": [str(path.resolve().parent), *packages.values()],
        "libraries": [each for each in sys.path if each and Path(each).is_absolute()],
        "trusted": options.trusts,
        "seconds": _SECONDS,
        "bytes": _BYTES,
    }
    status, out, said = _run(json.dumps(job).encode(), path.resolve().parent)
    if status == xacro_child.UNLIMITED:
        problem = "is a xacro template, which can run Python, and this kernel lacks Landlock to restrict it"
        raise BadValueError(path, "", f"{problem}; if you trust it, --trust-xacro gives it access to all files")
    if status:
        raise _explain(path, status, said, packages)
    if len(out) > ROBOT:
        raise ModelFileError(path, f"expands to more than {ROBOT / 1e6:g} MB")
    found = json.loads(out)
    return Expanded(str(found["text"]).encode(), tuple(Path(each) for each in found["sources"]))


def _run(job: bytes, folder: Path) -> tuple[int, bytes, str]:
    """Runs the child process on a job; returns exit status, standard output, and last lines of standard error."""
    child = subprocess.Popen(
        [sys.executable, "-I", xacro_child.__file__],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        cwd=folder,
        env={"PATH": os.defpath, "HOME": "/nonexistent"},
        start_new_session=True,
    )
    said: list[bytes] = []

    def end() -> None:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(child.pid, signal.SIGKILL)

    timer = threading.Timer(_WAIT, end)
    assert child.stdin is not None
    assert child.stdout is not None
    assert child.stderr is not None
    complaints = threading.Thread(target=lambda stream: said.append(stream.read(ROBOT)), args=(child.stderr,))
    timer.start()
    complaints.start()
    out = b""
    try:
        with contextlib.suppress(BrokenPipeError):
            child.stdin.write(job)
            child.stdin.close()
        out = child.stdout.read(2 * ROBOT)
    finally:
        if len(out) == 2 * ROBOT:  # it may never stop writing
            end()
        child.wait()
        end()  # with the processes that it started
        timer.cancel()
        complaints.join()
        child.stdout.close()
        child.stderr.close()
    lines = b"".join(said).decode(errors="replace").strip().splitlines()
    return child.returncode, out, ": ".join(lines[-2:])


def _explain(path: Path, status: int, said: str, packages: Mapping[str, str]) -> BadValueError | ModelFileError:
    """Builds the error that explains why a template could not be expanded, and how to fix it."""
    if status in (-signal.SIGXCPU, -signal.SIGKILL) or "MemoryError" in said:
        return ModelFileError(path, f"takes more than {_SECONDS} s, or {_BYTES / 1e9:g} GB, to expand: does it hang?")
    if missing := _UNKNOWN_PACKAGE.search(said):
        known = ", ".join(sorted(packages)) or "none"
        problem = f"needs the package {missing[1]!r}, which is not near it (found: {known})"
        return BadValueError(path, "", f"{problem}; --package {missing[1]}=DIR says where it is")
    if undefined := _UNDEFINED.search(said):
        name = undefined[1]
        return BadValueError(path, "", f"needs a value for {name}: --xacro {name}:=VALUE sets it")
    if missing := _MISSING.search(said):
        return BadValueError(path, "", f"includes {missing[1]}, which does not exist")
    if "Permission denied" in said:
        problem = f"reads a file outside its own folder and all packages: {said.partition(': ')[2]}"
        return BadValueError(path, "", f"{problem}; --package NAME=DIR adds a folder")
    return ModelFileError(path, f"cannot be expanded by xacro: {said}")


def _find_packages(path: Path) -> Iterator[tuple[str, str]]:
    """Searches the folders above a template, and their siblings, for packages (``package.xml``)."""
    for folder in list(path.parents)[:_LEVELS]:
        if folder == folder.parent:
            return
        with contextlib.suppress(OSError):
            siblings = sorted(folder.parent.iterdir())[:_MOST_FOLDERS]
            for each in (folder, *siblings):
                if (each / "package.xml").is_file():
                    with contextlib.suppress(BadValueError):
                        name = (read_xml(each / "package.xml").findtext("name") or "").strip()
                        if name:
                            yield name, str(each)
