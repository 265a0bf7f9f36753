"""Finds everything that a function runs: its source files, by following imports, and values in memory."""

import ast
import importlib.util
import sys
import sysconfig
from collections.abc import Callable, Iterator, Sequence
from functools import cache, partial
from pathlib import Path
from types import ModuleType
from typing import Any

from affordance.runs.reached_values import read_reached

# Folders of Python itself and of installed libraries; a key contains their versions instead of their sources.
_INSTALLED = tuple(Path(sysconfig.get_path(name)).resolve() for name in ("stdlib", "purelib", "platlib"))


def describe_run(function: Callable[..., Any], given: Sequence[Any], *, but: Path) -> tuple[str, list[Path]]:
    """Describes what a function runs, as a digest of values and a list of files.

    The files are those of the modules that the function and its arguments reach, and of everything that these import,
    also inside functions and whether or not the import is ever executed. The code of a function without a file, as in
    a notebook, is part of the digest.

    Args:
        function: Function that is run; also a ``partial``, a method, a closure or a callable object.
        given: Arguments whose values matter.
        but: Folder of a package whose sources are left out; its values are included.
    """
    own = tuple(map(_find_root, (but.name, _find_owner(function).partition(".")[0])))
    digest, modules = read_reached((function, *given), cache(partial(_is_foreign, own=own)))
    return digest, _list_sources(modules, own, but)


def _find_owner(function: Any) -> str:
    """Finds the name of the module that defines a function, or the function that it wraps."""
    while isinstance(function, partial):
        function = function.func
    return str(getattr(function, "__module__", ""))


def _find_root(name: str) -> Path | None:
    """Finds the folder of a package, or the file of a module; None if it has neither."""
    path = _find_file(sys.modules.get(name))
    return path.parent if path is not None and path.name == "__init__.py" else path


def _is_foreign(module: ModuleType | None, own: Sequence[Path | None]) -> bool:
    """Returns True for a module of Python or of an installed library other than the user's own packages."""
    if module is None:
        return False
    root = module.__name__.partition(".")[0]
    path = _find_file(module) or _find_root(root)  # for a compiled module, only its package may have a file
    return root in sys.stdlib_module_names if path is None else _is_installed(path, own)


def _is_installed(path: Path, own: Sequence[Path | None]) -> bool:
    is_own = any(root is not None and path.is_relative_to(root) for root in own)
    return not is_own and any(path.is_relative_to(folder) for folder in _INSTALLED)


def _list_sources(modules: Sequence[ModuleType], own: Sequence[Path | None], but: Path) -> list[Path]:
    """Lists the files of modules, of their packages, and of everything that these import, sorted."""
    found: set[Path] = set()
    names = {name for module in modules for name in _list_packages(module.__name__)}
    waiting = [*map(_find_file, modules), *(_find_file(sys.modules.get(name)) for name in names)]
    while waiting:
        path = waiting.pop()
        if path is None or path in found or path.suffix != ".py" or path.is_relative_to(but):
            continue
        if not _is_installed(path, own):
            found.add(path)
            waiting += [_locate(name, path) for name in _list_imports(path)]
    return sorted(found)


def _find_file(module: ModuleType | None) -> Path | None:
    file = getattr(module, "__file__", None)
    return None if file is None else Path(file).resolve()


def _list_packages(name: str) -> Iterator[str]:
    """Lists the names of a module's packages, outermost first, and its own: a, a.b, a.b.c."""
    dots = [place for place, letter in enumerate(name) if letter == "." and name[:place].strip(".")]
    yield from (name[:place] for place in (*dots, len(name)))


def _list_imports(path: Path) -> Iterator[str]:
    """Lists the modules that a file imports, and the names imported from them, which may be modules too."""
    for node in ast.walk(ast.parse(path.read_bytes())):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield from _list_packages(alias.name)
        elif isinstance(node, ast.ImportFrom):
            before = "." * node.level + (node.module or "")
            yield before
            for alias in node.names:
                yield from _list_packages(f"{before}{'' if before.endswith('.') else '.'}{alias.name}")


def _locate(name: str, importer: Path) -> Path | None:
    """Locates the file of a module; None if it has no file or no source."""
    package = None
    if name.startswith("."):
        package = next((each.__package__ for each in [*sys.modules.values()] if _find_file(each) == importer), None)
        if not package:
            return None
    elif "." in name and _locate(name.partition(".")[0], importer) is None:  # avoids importing its package
        return None
    try:
        spec = importlib.util.find_spec(name, package)
    except (ImportError, ValueError, AttributeError):  # most names imported from a module are not modules
        return None
    if spec is None or spec.origin is None or not spec.origin.endswith(".py"):
        return None
    return Path(spec.origin).resolve()
