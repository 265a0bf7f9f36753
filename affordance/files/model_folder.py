"""Location of the models: next to the package in a checkout, inside it once installed."""

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parents[1]
_INSTALLED = _PACKAGE / "models"

# Folder of arms, materials, tools, paths and the nail that come with the program.
MODELS = _INSTALLED if _INSTALLED.is_dir() else _PACKAGE.parent / "models"
