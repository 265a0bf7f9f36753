"""Computes a digest of everything that functions use: the values, functions and classes that they reach by name.

Values are read from memory, whatever their type, because a parameter may be changed after its module was imported.
"""

import hashlib
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import cached_property, partial
from pathlib import Path
from types import CellType, CodeType, FunctionType, MethodType, ModuleType
from typing import Any

import numpy as np
from pydrake.common.cpp_template import TemplateBase

type Named = FunctionType | type


def read_reached(
    values: Sequence[Any], is_foreign: Callable[[ModuleType | None], bool]
) -> tuple[str, list[ModuleType]]:
    """Computes a digest of values and of everything that the functions and classes in them reach by name.

    A value that cannot be taken apart, such as a lock or a Diagram, is represented by its type alone.

    Args:
        values: Functions that are run, and their arguments.
        is_foreign: Function that returns True if the functions and classes of a module, or of None if it is not
            loaded, are represented by their names alone, like those of installed libraries.

    Returns: Digest, and the modules of the functions and classes that are not foreign.
    """
    reader = _Reader(is_foreign)
    parts = [reader.read(each) for each in values]
    return _digest([*parts, *sorted(reader.read_waiting())]), list(reader.modules.values())


def _digest(parts: Sequence[str]) -> str:
    return hashlib.sha256("\n".join(parts).encode("utf-8", "surrogatepass")).hexdigest()


class _Reader:
    """Reader that computes digests of values and queues functions and classes, each of which is read once."""

    def __init__(self, is_foreign: Callable[[ModuleType | None], bool]) -> None:
        self.modules: dict[str, ModuleType] = {}
        self._is_foreign = is_foreign
        self._noted: dict[int, Named] = {}
        self._waiting: list[Named] = []
        self._open: list[int] = []

    def read(self, value: Any) -> str:
        """Computes the digest of a value, which is the same for equal values of one type."""
        if id(value) in self._open:  # the value contains itself
            return f"{len(self._open) - self._open.index(id(value))} above"
        self._open.append(id(value))
        try:
            return _digest([self._note(type(value)), *self._list(value)])
        finally:
            self._open.pop()

    def read_waiting(self) -> Iterator[str]:
        """Yields the digests of all queued functions and classes, and of those that they reach."""
        while self._waiting:
            each = self._waiting.pop()
            listed = self._list_function(each) if isinstance(each, FunctionType) else self._list_class(each)
            yield _digest([_name(each), *listed])

    def _note(self, each: Named) -> str:
        """Queues a function or class to be read later, unless it is foreign; returns its name."""
        if id(each) not in self._noted:
            self._noted[id(each)] = each
            module = sys.modules.get(each.__module__)
            if not self._is_foreign(module):
                self._waiting.append(each)
                if module is not None:
                    self.modules[module.__name__] = module
        return _name(each)

    def _list(self, value: Any) -> Iterator[str]:
        """Lists strings that together are the same for equal values."""
        if isinstance(value, FunctionType | type):
            yield self._note(value)
        elif isinstance(value, Path | Enum | TemplateBase):
            yield value.name  # of a template of pydrake, which holds the types that were imported so far
        elif value is None or isinstance(value, bool | int | float | complex | str | bytes | np.generic):
            yield repr(value)
        elif isinstance(value, ModuleType):
            yield value.__name__
        elif isinstance(value, set | frozenset):
            yield from sorted(map(self.read, value))
        elif type(value) is np.ndarray:
            yield f"{value.dtype} {value.shape}"
            yield self.read(value.tolist()) if value.dtype.hasobject else hashlib.sha256(value.tobytes()).hexdigest()
        elif isinstance(value, dict | list | tuple) or not self._is_of_library(value):
            yield from map(self.read, _take_apart(value))

    def _is_of_library(self, value: Any) -> bool:
        """Returns True for an object of a library, such as a SciPy distribution, which may hold random state."""
        module = sys.modules.get(type(value).__module__)
        names = vars(module) if module is not None and self._is_foreign(module) else {}
        return any(each is value for each in names.values())

    def _list_function(self, function: FunctionType) -> Iterator[str]:
        """Lists a function's code, defaults and closure, and the globals that its code names."""
        yield from self._list_code(function.__code__)
        yield from map(self.read, (function.__defaults__, function.__kwdefaults__))
        yield from (self.read(_get_content(cell)) for cell in function.__closure__ or ())
        yield from self._list_named(function.__globals__.get, set(_list_names(function.__code__)), set())

    def _list_code(self, code: CodeType) -> Iterator[str]:
        yield code.co_code.hex()
        for constant in code.co_consts:
            if isinstance(constant, CodeType):
                yield from self._list_code(constant)
            else:
                yield self.read(constant)

    def _list_named(self, get: Callable[[str, Any], Any], names: set[str], seen: set[str]) -> Iterator[str]:
        """Lists the values that have these names; from a module, only the members with any of these names."""
        missing = object()
        for name in sorted(names):
            value = get(name, missing)
            if isinstance(value, ModuleType):
                if value.__name__ not in seen and not self._is_foreign(value):
                    seen.add(value.__name__)
                    self.modules[value.__name__] = value
                    yield from self._list_named(partial(getattr, value), names, seen)
            elif value is not missing:
                yield f"{name} {self.read(value)}"

    def _list_class(self, kind: type) -> Iterator[str]:
        """Lists what a class and its bases define."""
        yield from map(self.read, kind.__bases__)
        for name, value in vars(kind).items():
            if isinstance(value, FunctionType) or not (name.startswith("__") or name == "_abc_impl"):
                yield f"{name} {self.read(value)}"


def _name(each: Named) -> str:
    line = f":{each.__code__.co_firstlineno}" if isinstance(each, FunctionType) else ""  # distinguishes lambdas
    return f"{each.__module__}.{each.__qualname__}{line}"


def _list_names(code: CodeType) -> Iterator[str]:
    """Lists the names of globals and attributes in code, and in the functions inside it."""
    yield from code.co_names
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _list_names(constant)


def _take_apart(value: Any) -> Iterable[Any]:
    """Splits a value into parts that, together with its type, determine it."""
    if isinstance(value, dict):
        return list(value.items())
    if isinstance(value, list | tuple):
        return value
    if is_dataclass(value):
        return [getattr(value, each.name) for each in fields(value)]
    if isinstance(value, MethodType):
        return value.__func__, value.__self__
    if isinstance(value, property):
        return value.fget, value.fset, value.fdel
    if isinstance(value, cached_property):
        return (value.func,)
    if callable(getattr(value, "__wrapped__", None)):  # class methods, static methods and cached functions
        return (value.__wrapped__,)
    try:
        reduced = value.__reduce_ex__(4)
    except Exception:  # its author's code may raise anything
        return ()
    return (reduced,) if isinstance(reduced, str) else [list(p) if isinstance(p, Iterator) else p for p in reduced]


def _get_content(cell: CellType) -> Any:
    """Returns the content of a closure's cell; None if it is still empty."""
    try:
        return cell.cell_contents
    except ValueError:
        return None
