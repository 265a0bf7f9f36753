"""Location of the models: next to the package in a checkout, inside it once installed; and of the studies."""

import importlib
import sys
from pathlib import Path
from typing import Any

from affordance.exceptions import BadValueError, UnavailableError, describe_choice

_PACKAGE = Path(__file__).resolve().parents[1]
_INSTALLED = _PACKAGE / "models"

# Folder of arms, materials, tools, paths and the nail that come with the program.
MODELS = _INSTALLED if _INSTALLED.is_dir() else _PACKAGE.parent / "models"
_CLONE = Path(__file__).resolve().parents[2]


def list_studies() -> list[str]:
    """Lists the names of the studies, which are folders with a module ``command``; none outside of a clone."""
    return sorted(path.parent.name for path in (_CLONE / "studies").glob("*/command.py"))


def import_study(name: str) -> Any:
    """Imports a study, ``STUDY`` of its module ``command``.

    Outside of a clone it raises an UnavailableError, for an unknown name a BadValueError.
    """
    known = list_studies()
    if not known:
        raise UnavailableError(f"the study {name} is", "studies need a clone of the repository")
    if name not in known:
        raise BadValueError("study", "", describe_choice(name, known))
    if str(_CLONE) not in sys.path:  # the command of an installed package; its processes inherit the path
        sys.path.append(str(_CLONE))
    return importlib.import_module(f"studies.{name}.command").STUDY
