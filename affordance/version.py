"""Version of the installed program, as given in pyproject.toml."""

import importlib.metadata

__version__ = importlib.metadata.version("visual-inertial-affordances")
