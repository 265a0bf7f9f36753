"""Finds the models and studies, in a clone of the repository or an installed package."""

import importlib
import sys
from pathlib import Path
from typing import Any

from affordance.exceptions import BadValueError, UnavailableError, describe_choice

_PACKAGE = Path(__file__).resolve().parents[1]
_INSTALLED = _PACKAGE / "models"

# Folder with the program's own arms, materials, tools, paths and nail.
MODELS = _INSTALLED if _INSTALLED.is_dir() else _PACKAGE.parent / "models"
_CLONE = Path(__file__).resolve().parents[2]


def list_studies() -> list[str]:
    """Lists the studies of a clone; empty outside of a clone. A study is a folder with a module ``command``."""
    return sorted(path.parent.name for path in (_CLONE / "studies").glob("*/command.py"))


def import_study(name: str) -> Any:
    """Imports a study, and returns ``STUDY`` from its module ``command``.

    Raises:
        UnavailableError: The program does not run from a clone.
        BadValueError: The name is unknown.
    """
    known = list_studies()
    if not known:
        raise UnavailableError(f"the study {name} is", "studies need a clone of the repository")
    if name not in known:
        raise BadValueError("study", "", describe_choice(name, known))
    if str(_CLONE) not in sys.path:  # the path is missing in an installed command; child processes inherit it
        sys.path.append(str(_CLONE))
    return importlib.import_module(f"studies.{name}.command").STUDY
