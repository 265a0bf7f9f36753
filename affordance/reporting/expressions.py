"""Expressions over numbers, restricted to arithmetic, comparisons, indexing and the functions below.

They come from files of users. The syntax tree is therefore checked before it is evaluated, and evaluation takes no
more time and memory than a few passes over the named numbers: integers stay exactly representable as doubles,
texts can only be compared, and no result is larger than its operands.
"""

import ast
import difflib
import operator
import warnings
from collections.abc import Callable, Iterator, Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from affordance.exceptions import AffordanceError

# Most characters and most nested operations; the longest of our own has 70 characters and 3 levels.
_LONGEST, _DEEPEST = 1000, 60
# Most characters of all texts of a list.
_MOST_LETTERS = 10_000_000
# Integers beyond this are not exactly representable as doubles.
_LARGEST = 2**53


def _list_values(mapping: Any) -> Any:
    if not isinstance(mapping, Mapping):
        raise TypeError("values() wants numbers by name")
    return _take(list(mapping.values()))


# Functions that expressions may call, with their number of arguments.
FUNCTIONS: Mapping[str, tuple[Callable[..., Any], int]] = {
    "abs": (np.abs, 1),
    "all": (np.all, 1),
    "any": (np.any, 1),
    "diff": (np.diff, 1),
    "len": (len, 1),
    "log": (np.log, 1),
    "max": (np.max, 1),
    "maximum": (np.maximum, 2),
    "mean": (np.mean, 1),
    "min": (np.min, 1),
    "minimum": (np.minimum, 2),
    "ptp": (np.ptp, 1),
    "sqrt": (np.sqrt, 1),
    "sum": (np.sum, 1),
    "values": (_list_values, 1),
}
# Functions that take other than numbers.
_OF_LISTS = ("len", "values")
_ARITHMETIC: Mapping[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv,
    ast.Mod: operator.mod,
    ast.Pow: np.float_power,  # on doubles: integers would grow without bound
}
_UNARY: Mapping[type[ast.unaryop], Callable[[Any], Any]] = {
    ast.UAdd: operator.pos,
    ast.USub: operator.neg,
    ast.Not: operator.not_,
}
_COMPARE: Mapping[type[ast.cmpop], Callable[[Any, Any], Any]] = {
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
}


def check_expression(expression: str) -> None:
    """Checks the syntax of an expression.

    Raises:
        AffordanceError: It is not a valid expression, or is too long or too deeply nested.
    """
    _parse(expression)


def find_names(expression: str | float | bool) -> frozenset[str]:
    """Finds the names of the numbers that an expression uses.

    Raises:
        AffordanceError: It is not a valid expression.
    """
    if not isinstance(expression, str):
        return frozenset()
    called = {id(node.func) for node in ast.walk(_parse(expression)) if isinstance(node, ast.Call)}
    names = (node for node in ast.walk(_parse(expression)) if isinstance(node, ast.Name))
    return frozenset(node.id for node in names if id(node) not in called)


def evaluate(expression: str | float | bool, numbers: Mapping[str, Any]) -> Any:
    """Evaluates an expression over numbers; lists become arrays.

    Raises:
        AffordanceError: It is invalid, names an unknown number, or its evaluation fails.
    """
    if not isinstance(expression, str):
        return expression
    body = _parse(expression)
    try:
        with np.errstate(all="ignore", over="raise"), warnings.catch_warnings():
            warnings.simplefilter("ignore")  # on means of empty arrays, which are NaN
            return _evaluate(body, numbers)
    except (LookupError, TypeError, ValueError, ArithmeticError) as error:
        raise _complain(expression, str(error)) from error


def _complain(expression: str, problem: str) -> AffordanceError:
    shown = expression if len(expression) <= 100 else f"{expression[:97]}..."
    return AffordanceError(f"the expression {shown!r} cannot be evaluated: {problem}")


@lru_cache(maxsize=1024)
def _parse(expression: str) -> ast.expr:
    """Parses and checks an expression."""
    if len(expression) > _LONGEST:
        raise _complain(expression, f"it has {len(expression)} letters, must have at most {_LONGEST}")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # on backslashes in texts
            body = ast.parse(expression.strip(), mode="eval").body
        for problem in _list_problems(body, _DEEPEST):
            raise _complain(expression, problem)
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        problem = error.msg if isinstance(error, SyntaxError) else str(error)
        raise _complain(expression, problem) from error
    return body


def _list_problems(node: ast.expr, deepest: int) -> Iterator[str]:
    """Lists the faults of a node of an expression and of the nodes below."""
    if deepest <= 0:
        yield f"it has more than {_DEEPEST} nested operations"
        return
    parts: list[ast.expr | None] = []
    match node:
        case ast.Constant(value=str() | float()):
            pass
        case ast.Constant(value=int(value)):
            if abs(value) > _LARGEST:
                yield f"it has a whole number beyond {_LARGEST}"
        case ast.Name():
            pass
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _ARITHMETIC:
            parts = [left, right]
        case ast.UnaryOp(op=unary, operand=operand) if type(unary) in _UNARY:
            parts = [operand]
        case ast.BoolOp(values=values):
            parts = [*values]
        case ast.Compare(left=left, ops=ops, comparators=others) if all(type(each) in _COMPARE for each in ops):
            parts = [left, *others]
        case ast.IfExp(test=test, body=body, orelse=orelse):
            parts = [test, body, orelse]
        case ast.Subscript(value=value, slice=ast.Slice(lower=lower, upper=upper, step=step)):
            parts = [value, lower, upper, step]
        case ast.Subscript(value=value, slice=index):
            parts = [value, index]
        case ast.Call(func=ast.Name(id=name), args=arguments, keywords=keywords):
            yield from _list_problems_of_call(name, len(arguments), has_others=bool(keywords))
            parts = [*arguments]
        case _:
            yield f"it has a {type(node).__name__.lower()}, which expressions have not"
    for part in parts:
        if part is not None:
            yield from _list_problems(part, deepest - 1)


def _list_problems_of_call(name: str, count: int, *, has_others: bool) -> Iterator[str]:
    if name not in FUNCTIONS:
        near = difflib.get_close_matches(name, FUNCTIONS, n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        yield f"it calls {name!r}, must be one of {', '.join(FUNCTIONS)}{hint}"
    elif has_others or count != FUNCTIONS[name][1]:
        wanted = FUNCTIONS[name][1]
        yield f"{name} takes {wanted} argument{'' if wanted == 1 else 's'} and nothing else"


def _evaluate(node: ast.expr | None, numbers: Mapping[str, Any]) -> Any:
    """Computes the value of a node of a checked expression."""
    match node:
        case None:
            return None
        case ast.Constant(value=value):
            return value
        case ast.Name(id=name):
            if name not in numbers:
                raise LookupError(f"there is no number {name!r}")
            return _take(numbers[name])
        case ast.BinOp(left=left, op=op, right=right):
            operands = _evaluate(left, numbers), _evaluate(right, numbers)
            _check_numbers(*operands)
            return _bound(_ARITHMETIC[type(op)](*operands))
        case ast.UnaryOp(op=unary, operand=operand):
            value = _evaluate(operand, numbers)
            _check_numbers(value)
            return _UNARY[type(unary)](value)
        case ast.BoolOp(op=both, values=values):
            value = None
            for part in values:
                value = _evaluate(part, numbers)
                if bool(value) != isinstance(both, ast.And):
                    break
            return value
        case ast.Compare(left=left, ops=ops, comparators=others):
            value, holds = _evaluate(left, numbers), None
            for compare, part in zip(ops, others, strict=True):
                other = _evaluate(part, numbers)
                if _is_text(value) and _is_text(other):
                    _check_shapes(value, other)
                else:
                    _check_numbers(value, other)
                found = _COMPARE[type(compare)](value, other)
                holds = found if holds is None else np.logical_and(holds, found)
                value = other
            return holds
        case ast.IfExp(test=test, body=body, orelse=orelse):
            return _evaluate(body if _evaluate(test, numbers) else orelse, numbers)
        case ast.Subscript(value=of, slice=ast.Slice(lower=lower, upper=upper, step=step)):
            ends = [_evaluate(end, numbers) for end in (lower, upper, step)]
            return _evaluate(of, numbers)[slice(*(None if end is None else operator.index(end) for end in ends))]
        case ast.Subscript(value=of, slice=index):
            return _take_entry(_evaluate(of, numbers), _evaluate(index, numbers))
        case ast.Call(func=ast.Name(id=name), args=arguments):
            values = [_evaluate(argument, numbers) for argument in arguments]
            if name not in _OF_LISTS:
                _check_numbers(*values)
            return FUNCTIONS[name][0](*values)
    raise TypeError(f"it has a {type(node).__name__.lower()}")  # unreachable after the check


def _take(value: Any) -> Any:
    """Converts lists to arrays of numbers or of texts; other values pass unchanged."""
    if isinstance(value, list | tuple):
        # NumPy pads each text of a list to the length of the longest.
        if len(value) * max((len(each) for each in value if isinstance(each, str)), default=0) > _MOST_LETTERS:
            raise ValueError("its texts are too long to be compared")
        value = np.array(value)
    if isinstance(value, np.ndarray) and value.dtype.kind not in "biufU":
        raise TypeError("its entries are no numbers")
    return value


def _take_entry(value: Any, index: Any) -> Any:
    if isinstance(value, Mapping):
        if index not in value:
            near = difflib.get_close_matches(str(index)[:100], [str(name) for name in value], n=1)
            raise LookupError(f"it has no {index!r}" + (f"; did you mean {near[0]!r}?" if near else ""))
        return _take(value[index])
    if not isinstance(value, np.ndarray):
        raise TypeError("a single number or text has no entries")
    return value[operator.index(index)]


def _is_text(value: Any) -> bool:
    return isinstance(value, str) or (isinstance(value, np.ndarray) and value.dtype.kind == "U")


def _check_numbers(*values: Any) -> None:
    """Checks that values are numbers, and that broadcasting them does not exceed the largest of their sizes.

    Raises:
        TypeError: A value is a text, a mapping or None.
        ValueError: Their shapes do not match, or would broadcast to a larger array.
    """
    for value in values:
        kind = value.dtype.kind if isinstance(value, np.ndarray | np.generic) else ""
        if kind not in ("b", "i", "u", "f") and not isinstance(value, bool | int | float):
            raise TypeError(f"{'nothing' if value is None else 'a text or a mapping'} is no number")
    _check_shapes(*values)


def _check_shapes(*values: Any) -> None:
    shape = np.broadcast_shapes(*(np.shape(value) for value in values))
    if np.prod(shape, dtype=float) > max(np.size(value) for value in values):
        raise ValueError("lists of different shapes make a table of each with each")


def _bound(value: Any) -> Any:
    """Converts integers that are not exactly representable as doubles to doubles."""
    return float(value) if isinstance(value, int) and abs(value) > _LARGEST else value
