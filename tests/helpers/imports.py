"""Imports that pages and lessons show."""

import importlib
import importlib.util


def can_import(module, name):
    """Whether ``from module import name`` works; the name may be a module of a package."""
    found = importlib.import_module(module)
    is_module = hasattr(found, "__path__") and importlib.util.find_spec(f"{module}.{name}") is not None
    return is_module or hasattr(found, name)
