"""Shared libraries of the system that wheels leave to it: which are missing, and getting them.

Everything else comes with the wheels. Nothing here imports a library that could be missing.
"""

import ctypes
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from typing import NamedTuple

from affordance.exceptions import AffordanceError

_STDERR = 2  # its number, by which libraries in C know it


class SystemLibrary(NamedTuple):
    """A shared library of the system.

    Attributes:
        file: Its name, as the loader knows it.
        package: Of Debian and its descendants.
        needed_for: What does not work without it.
        is_required: Whether nothing works without it.
    """

    file: str
    package: str
    needed_for: str
    is_required: bool


LIBRARIES = (
    SystemLibrary("libglib-2.0.so.0", "libglib2.0-0", "Drake", True),
    SystemLibrary("libgthread-2.0.so.0", "libglib2.0-0", "Drake", True),
    SystemLibrary("libX11.so.6", "libx11-6", "pictures of Diagrams", False),
    SystemLibrary("libXext.so.6", "libxext6", "pictures of Diagrams", False),
    SystemLibrary("libXrender.so.1", "libxrender1", "pictures of Diagrams", False),
    SystemLibrary("libEGL.so.1", "libegl1", "rendered pictures", False),
)
# For the tests: Pinocchio, which they compare with.
TEST_LIBRARIES = (SystemLibrary("libgomp.so.1", "libgomp1", "Pinocchio, for tests", False),)


@contextmanager
def hide_font_warnings() -> Iterator[None]:
    """Keeps fontconfig's warnings about the system's own files off the terminal; what else is written there stays."""
    sys.stderr.flush()
    terminal = os.dup(_STDERR)
    with tempfile.TemporaryFile() as caught:
        os.dup2(caught.fileno(), _STDERR)
        try:
            yield
        finally:
            sys.stderr.flush()
            os.dup2(terminal, _STDERR)
            os.close(terminal)
            caught.seek(0)
            for line in caught:
                if not line.startswith(b"Fontconfig "):
                    os.write(_STDERR, line)


def find_missing(for_tests: bool = False) -> list[SystemLibrary]:
    """Lists the libraries that the loader does not find."""
    return [library for library in LIBRARIES + (TEST_LIBRARIES if for_tests else ()) if not _is_there(library.file)]


def write_command(missing: list[SystemLibrary]) -> str:
    """The one command that installs libraries."""
    return f"apt-get install -y {' '.join(dict.fromkeys(library.package for library in missing))}"


def provide_libraries(for_tests: bool = False) -> None:
    """Installs missing libraries where that is allowed, by root with apt-get; else says how to get them.

    Args:
        for_tests: Whether those that only tests need count.

    Raises:
        AffordanceError: One without which nothing works is missing still.
    """
    missing = find_missing(for_tests)
    if not missing:
        return
    if os.geteuid() == 0 and shutil.which("apt-get"):
        packages = ", ".join(dict.fromkeys(library.package for library in missing))
        print(f"affordance: installing with apt-get what this system lacks: {packages}", file=sys.stderr)
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "check": False}
        environment = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
        subprocess.run(["apt-get", "update"], env=environment, **quiet)  # type: ignore[call-overload]
        subprocess.run([*write_command(missing).split(), "--no-install-recommends"], env=environment, **quiet)  # type: ignore[call-overload]
        missing = find_missing(for_tests)
    if not missing:
        return
    purposes = ", ".join(dict.fromkeys(library.needed_for for library in missing))
    message = f"this system lacks libraries for {purposes}; to get them, type: sudo {write_command(missing)}"
    if any(library.is_required for library in missing):
        raise AffordanceError(message)
    print(f"affordance: {message}", file=sys.stderr)


def _is_there(file: str) -> bool:
    try:
        ctypes.CDLL(file)
    except OSError:
        return False
    return True
