"""Detects and installs missing system libraries that Python packages do not include.

This module imports only libraries that are always available.
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

_STDERR = 2  # file descriptor, to which C libraries write


class SystemLibrary(NamedTuple):
    """System library, with its file name and its Debian package."""

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
# Libraries that Pinocchio needs, with which tests compare results.
TEST_LIBRARIES = (SystemLibrary("libgomp.so.1", "libgomp1", "Pinocchio, for tests", False),)


@contextmanager
def hide_font_warnings() -> Iterator[None]:
    """Suppresses fontconfig's warnings about system files on standard error. Other output is still printed."""
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
    """Lists the libraries that the loader cannot find."""
    return [library for library in LIBRARIES + (TEST_LIBRARIES if for_tests else ()) if not _is_there(library.file)]


def write_command(missing: list[SystemLibrary]) -> str:
    """Builds the command that installs libraries."""
    return f"apt-get install -y {' '.join(dict.fromkeys(library.package for library in missing))}"


def provide_libraries(for_tests: bool = False) -> None:
    """Installs missing libraries with apt-get if the user is root. Otherwise prints the command that installs them.

    Raises:
        AffordanceError: A required library is still missing.
    """
    missing = find_missing(for_tests)
    if not missing:
        return
    if os.geteuid() == 0 and shutil.which("apt-get"):
        packages = ", ".join(dict.fromkeys(library.package for library in missing))
        print(f"affordance: installing missing libraries with apt-get: {packages}", file=sys.stderr)
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "check": False}
        environment = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
        subprocess.run(["apt-get", "update"], env=environment, **quiet)  # type: ignore[call-overload]
        subprocess.run([*write_command(missing).split(), "--no-install-recommends"], env=environment, **quiet)  # type: ignore[call-overload]
        missing = find_missing(for_tests)
    if not missing:
        return
    purposes = ", ".join(dict.fromkeys(library.needed_for for library in missing))
    message = f"this system lacks libraries for {purposes}; to install them, run: sudo {write_command(missing)}"
    if any(library.is_required for library in missing):
        raise AffordanceError(message)
    print(f"affordance: {message}", file=sys.stderr)


def _is_there(file: str) -> bool:
    try:
        ctypes.CDLL(file)
    except OSError:
        return False
    return True
