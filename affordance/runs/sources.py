"""Sources that a function runs: its module and all that it imports, other than installed libraries."""

import ast
import importlib.util
import inspect
import sys
import sysconfig
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

# Folders of Python itself and of installed libraries, whose versions a key names instead.
_INSTALLED = tuple(Path(sysconfig.get_path(name)).resolve() for name in ("stdlib", "purelib", "platlib"))


def list_sources(function: Callable[..., Any], *, but: Path) -> tuple[Path, ...]:
    """Lists the files that a function may run, sorted: that of its module, and of modules imported from there on.

    Imports inside of functions count too, whether or not they are reached.

    Args:
        function: Function defined in a module.
        but: Folder of a package whose sources are left out, as installed libraries are.
    """
    module = inspect.getmodule(function)
    assert module is not None  # it is defined in one
    found: dict[Path, None] = {}
    waiting = [_find_file(module)]
    while waiting:
        path = waiting.pop()
        if path is None or path in found or path.is_relative_to(but) or _is_installed(path):
            continue
        found[path] = None
        waiting += [_locate(name, path) for name in _list_imports(path)]
    return tuple(sorted(found))


def list_values(function: Callable[..., Any]) -> dict[str, Any]:
    """Lists the values that a function's module assigns to names, sorted: knobs, tables and objects, no functions."""
    module = inspect.getmodule(function)
    assert module is not None  # it is defined in one
    path = _find_file(module)
    tree = ast.parse("" if path is None else path.read_bytes())
    nodes = (node for node in ast.walk(tree) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store))
    names = sorted({node.id for node in nodes} & vars(module).keys())
    return {name: vars(module)[name] for name in names if not callable(vars(module)[name])}


def _find_file(module: ModuleType) -> Path | None:
    file = getattr(module, "__file__", None)
    return None if file is None else Path(file).resolve()


def _is_installed(path: Path) -> bool:
    return any(path.is_relative_to(folder) for folder in _INSTALLED)


def _list_imports(path: Path) -> Iterator[str]:
    """Lists the names of the modules that a file imports, and of what it imports from them, which may be modules."""
    for node in ast.walk(ast.parse(path.read_bytes())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            before = "." * node.level + (node.module or "")
            yield before
            yield from (f"{before}{'' if before.endswith('.') else '.'}{alias.name}" for alias in node.names)


def _locate(name: str, importer: Path) -> Path | None:
    """Locates the file of a module; None if it is none, is installed, or has no source."""
    package = None
    if name.startswith("."):
        package = next((each.__package__ for each in [*sys.modules.values()] if _find_file(each) == importer), None)
        if not package:
            return None
    elif "." in name and _locate(name.partition(".")[0], importer) is None:  # spares the import of its package
        return None
    try:
        spec = importlib.util.find_spec(name, package)
    except (ImportError, ValueError, AttributeError):  # what is imported from a module is mostly no module
        return None
    if spec is None or spec.origin is None or not spec.origin.endswith(".py"):
        return None
    path = Path(spec.origin).resolve()
    return None if _is_installed(path) else path
