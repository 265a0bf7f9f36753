"""Version of the installed program, as given in pyproject.toml, and git commit of its source folder."""

import functools
import importlib.metadata
import shutil
import subprocess
from pathlib import Path

__version__ = importlib.metadata.version("visual-inertial-affordances")


_TIMEOUT = 10.0  # for a call of git, [s]


@functools.cache
def find_commit(folder: Path = Path(__file__).parents[1]) -> str | None:
    """Finds the git commit of a source folder: 40 digits, and ``-dirty`` if files have changed since.

    It is None if the folder is not in a repository, as for an installed program, or if git is missing.
    """
    git = shutil.which("git")
    if git is None or _ask(git, folder, "ls-files", "--error-unmatch", ".") is None:
        return None
    return _ask(git, folder, "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*")


def _ask(git: str, folder: Path, *arguments: str) -> str | None:
    """Runs git in a folder and returns its output; None if it fails."""
    try:
        done = subprocess.run(
            [git, "-C", str(folder), *arguments], capture_output=True, text=True, timeout=_TIMEOUT, check=True
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return done.stdout.strip()
