"""Version of the installed program, from pyproject.toml, and its git commit."""

import functools
import importlib.metadata
import shutil
import subprocess
from pathlib import Path

__version__ = importlib.metadata.version("visual-inertial-affordances")


_TIMEOUT = 10.0  # for a call of git, [s]


@functools.cache
def find_commit(folder: Path = Path(__file__).parents[1]) -> str | None:
    """Finds the git commit of a source folder, as 40 digits. The suffix ``-dirty`` marks uncommitted changes.

    The result is None if git is missing, or if the folder is not in a repository, as for an installed program.
    """
    git = shutil.which("git")
    if git is None or _ask(git, folder, "ls-files", "--error-unmatch", ".") is None:
        return None
    return _ask(git, folder, "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*")


def _ask(git: str, folder: Path, *arguments: str) -> str | None:
    """Runs git in a folder, and returns its output; None if it fails."""
    try:
        done = subprocess.run(
            [git, "-C", str(folder), *arguments], capture_output=True, text=True, timeout=_TIMEOUT, check=True
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return done.stdout.strip()
