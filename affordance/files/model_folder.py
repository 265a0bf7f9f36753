"""Location of the models: next to the package in a checkout, inside it once installed; and of the studies."""

import importlib
import sys
from pathlib import Path
from typing import Any

from affordance.exceptions import UnavailableError

_PACKAGE = Path(__file__).resolve().parents[1]
_INSTALLED = _PACKAGE / "models"

# Folder of arms, materials, tools, paths and the nail that come with the program.
MODELS = _INSTALLED if _INSTALLED.is_dir() else _PACKAGE.parent / "models"
_CLONE = Path(__file__).resolve().parents[2]


def has_studies() -> bool:
    """Returns whether the package lies in a clone of the repository."""
    return (_CLONE / "studies" / "__init__.py").is_file()


def import_study(module: str) -> Any:
    """Imports a module, as ``studies.seeing.experiment``; raises an UnavailableError outside of a clone."""
    if not has_studies():
        raise UnavailableError(f"the study {module.split('.')[1]} is", "studies need a clone of the repository")
    if str(_CLONE) not in sys.path:  # the command of an installed package; its processes inherit the path
        sys.path.append(str(_CLONE))
    return importlib.import_module(module)
