"""The version of the installed program; pyproject.toml says it."""

import importlib.metadata

__version__ = importlib.metadata.version("visual-inertial-affordances")
