"""What expressions are made of: their functions and operators, and the values that these take and give."""

import ast
import operator
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

# Letters of all texts of a list.
_MOST_LETTERS = 10_000_000


def take(value: Any) -> Any:
    """A value of which others are calculated: lists as arrays, of numbers or of texts."""
    if isinstance(value, list | tuple):
        # NumPy gives each text of a list the room of the longest.
        if len(value) * max((len(each) for each in value if isinstance(each, str)), default=0) > _MOST_LETTERS:
            raise ValueError("its texts are too long to be compared")
        value = np.array(value)
    if isinstance(value, np.ndarray) and value.dtype.kind not in "biufU":
        raise TypeError("its entries are no numbers")
    return value


def _list_values(mapping: Any) -> Any:
    if not isinstance(mapping, Mapping):
        raise TypeError("values() wants numbers by name")
    return take(list(mapping.values()))


def _reduce_by(reduce: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """The function of a list that has an entry; NaN of one that has none."""
    return lambda values: reduce(values) if np.size(values) else np.float64(np.nan)


def _divide_by(divide: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
    """The division of doubles, of which a division by zero is infinite or NaN, as are those of no whole numbers."""
    return lambda value, by: divide(value, by if np.all(by) else np.asarray(by, dtype=float)[()])


# What expressions may call, with the number of arguments.
FUNCTIONS: Mapping[str, tuple[Callable[..., Any], int]] = {
    "abs": (np.abs, 1),
    "all": (_reduce_by(np.all), 1),
    "any": (_reduce_by(np.any), 1),
    "diff": (np.diff, 1),
    "len": (len, 1),
    "log": (np.log, 1),
    "max": (_reduce_by(np.max), 1),
    "maximum": (np.maximum, 2),
    "mean": (_reduce_by(np.mean), 1),
    "min": (_reduce_by(np.min), 1),
    "minimum": (np.minimum, 2),
    "ptp": (_reduce_by(np.ptp), 1),
    "sqrt": (np.sqrt, 1),
    "sum": (_reduce_by(np.sum), 1),
    "values": (_list_values, 1),
}
# Functions of what is no number.
OF_LISTS = ("len", "values")
ARITHMETIC: Mapping[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: _divide_by(operator.truediv),
    ast.FloorDiv: _divide_by(operator.floordiv),
    ast.Mod: _divide_by(operator.mod),
    ast.Pow: np.float_power,  # of doubles: whole numbers would grow without end
}
DIVISIONS = (ast.Div, ast.FloorDiv, ast.Mod)
UNARY: Mapping[type[ast.unaryop], Callable[[Any], Any]] = {
    ast.UAdd: operator.pos,
    ast.USub: operator.neg,
    ast.Not: operator.not_,
}
COMPARE: Mapping[type[ast.cmpop], Callable[[Any, Any], Any]] = {
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
}
