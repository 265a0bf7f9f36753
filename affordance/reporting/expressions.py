"""Expressions over numbers, restricted to arithmetic, comparisons, indexing and the functions below.

They come from files of users. The syntax tree is therefore checked before it is evaluated, and evaluation takes no
more time and memory than a few passes over the named numbers: integers stay exactly representable as doubles,
texts can only be compared, and no result is larger than its operands.
"""

import ast
import operator
import warnings
from collections.abc import Callable, Iterator, Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from affordance.exceptions import AffordanceError, suggest

# Letters of all texts of a list.
_MOST_LETTERS = 10_000_000
# Most characters and most nested operations; the longest of our own has 70 characters and 3 levels.
_LONGEST, _DEEPEST = 1000, 60
# Whole numbers beyond are no exact doubles.
_LARGEST = 2**53


def take(value: Any) -> Any:
    """Converts an operand: lists become arrays, of numbers or of texts."""
    if isinstance(value, list | tuple):
        # NumPy gives each text of a list the room of the longest.
        if len(value) * max((len(each) for each in value if isinstance(each, str)), default=0) > _MOST_LETTERS:
            raise ValueError("its texts are too long to be compared")
        value = np.array(value)
    if isinstance(value, np.ndarray) and value.dtype.kind not in "biufU":
        raise TypeError("its entries are not numbers")
    return value


def _list_values(mapping: Any) -> Any:
    if not isinstance(mapping, Mapping):
        raise TypeError("values() needs numbers by name")
    return take(list(mapping.values()))


def _reduce_by(reduce: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Returns a function of lists that is NaN for an empty one."""
    return lambda values: reduce(values) if np.size(values) else np.float64(np.nan)


def _divide_by(divide: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
    """Returns the division of doubles: by zero it is infinite or NaN, for whole numbers too."""
    return lambda value, by: divide(value, by if np.all(by) else np.asarray(by, dtype=float)[()])


# Functions that expressions may call, with the number of arguments.
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
# Functions of values other than numbers.
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


def find_names(expression: str | float | bool) -> frozenset[str]:
    """Finds the names of the numbers that an expression uses; raises an AffordanceError if it is invalid."""
    if not isinstance(expression, str):
        return frozenset()
    called = {id(node.func) for node in ast.walk(parse_expression(expression)) if isinstance(node, ast.Call)}
    names = (node for node in ast.walk(parse_expression(expression)) if isinstance(node, ast.Name))
    return frozenset(node.id for node in names if id(node) not in called)


def evaluate(expression: str | float | bool, numbers: Mapping[str, Any], parts: list[Any] | None = None) -> Any:
    """Evaluates an expression over numbers, lists (as arrays), texts and mappings by name.

    Parts, if given, receives the values of all operands on the way, and the value itself. An invalid expression, an
    unknown name, or a failed evaluation raises an AffordanceError.
    """
    if not isinstance(expression, str):
        return expression
    body = parse_expression(expression)
    try:
        with np.errstate(all="ignore", over="raise"), warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of means of nothing, which are NaN
            return _evaluate(body, numbers, [] if parts is None else parts)
    except (LookupError, TypeError, ValueError, ArithmeticError) as error:
        raise _complain(expression, str(error)) from error


def comes_of_numbers(expression: str | float | bool, numbers: Mapping[str, Any]) -> bool:
    """Returns True if no part that decides the value of an expression is infinite, NaN, or a list without entries.

    Such a part may be hidden in the value: 1 / 0 > 0 is true, and so is all() of nothing. Errors are those of
    ``evaluate``.
    """
    parts: list[Any] = []
    if isinstance(expression, str):
        evaluate(expression, numbers, parts)
    else:
        parts.append(expression)
    return all(_is_definite(part) for part in parts)


def _is_definite(value: Any) -> bool:
    if value is None or isinstance(value, str | Mapping) or _is_text(value):
        return value is not None and bool(np.size(value))
    return bool(np.size(value)) and bool(np.isfinite(value).all())


def _complain(expression: str, problem: str) -> AffordanceError:
    shown = expression if len(expression) <= 100 else f"{expression[:97]}..."
    return AffordanceError(f"the expression {shown!r} cannot be evaluated: {problem}")


@lru_cache(maxsize=1024)
def parse_expression(expression: str) -> ast.expr:
    """Parses an expression; raises an AffordanceError if it is invalid, too long or too deeply nested."""
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
    match node:
        case ast.Constant(value=int(value)) if abs(value) > _LARGEST:
            yield f"it has a whole number beyond {_LARGEST}"
        case ast.BinOp(op=op, right=ast.Constant(value=0)) if isinstance(op, DIVISIONS):
            yield "it divides by zero"
        case ast.Call(func=ast.Name(id=name), args=arguments, keywords=keywords):
            yield from _list_problems_of_call(name, len(arguments), has_others=bool(keywords))
        case _ if not _is_known(node):
            yield f"it has a {type(node).__name__.lower()}, which expressions may not have"
    for part in ast.iter_child_nodes(node):
        if isinstance(part, ast.expr):
            yield from _list_problems(part, deepest - 1)


def _is_known(node: ast.expr) -> bool:
    """Returns True for a node that expressions may have, whatever its operands."""
    match node:
        case ast.Constant(value=value):
            return isinstance(value, str | int | float)
        case ast.BinOp(op=op):
            return type(op) in ARITHMETIC
        case ast.UnaryOp(op=unary):
            return type(unary) in UNARY
        case ast.Compare(ops=ops):
            return all(type(each) in COMPARE for each in ops)
    return isinstance(node, ast.Name | ast.BoolOp | ast.IfExp | ast.Subscript | ast.Slice)


def _list_problems_of_call(name: str, count: int, *, has_others: bool) -> Iterator[str]:
    if name not in FUNCTIONS:
        yield f"it calls {name!r}, must be one of {', '.join(FUNCTIONS)}{suggest(name, FUNCTIONS)}"
    elif has_others or count != FUNCTIONS[name][1]:
        wanted = FUNCTIONS[name][1]
        yield f"{name} takes {wanted} argument{'' if wanted == 1 else 's'} and nothing else"


def _evaluate(node: ast.expr | None, numbers: Mapping[str, Any], parts: list[Any]) -> Any:
    """Computes the value of a part of a checked expression, which the list of parts receives."""
    value = _compute(node, numbers, parts)
    if node is not None:
        parts.append(value)
    return value


def _compute(node: ast.expr | None, numbers: Mapping[str, Any], parts: list[Any]) -> Any:
    match node:
        case None:
            return None
        case ast.Constant(value=value):
            return value
        case ast.Name(id=name):
            if name not in numbers:
                raise LookupError(f"there is no number {name!r}")
            return take(numbers[name])
        case ast.BinOp(left=left, op=op, right=right):
            operands = _evaluate(left, numbers, parts), _evaluate(right, numbers, parts)
            _check_numbers(*operands)
            found = ARITHMETIC[type(op)](*operands)
            return float(found) if isinstance(found, int) and abs(found) > _LARGEST else found  # as an exact double
        case ast.UnaryOp(op=unary, operand=operand):
            value = _evaluate(operand, numbers, parts)
            _check_numbers(value)
            return UNARY[type(unary)](value)
        case ast.BoolOp(op=both, values=values):
            value = None
            for part in values:
                value = _evaluate(part, numbers, parts)
                if bool(value) != isinstance(both, ast.And):
                    break
            return value
        case ast.Compare(left=left, ops=ops, comparators=others):
            value, holds = _evaluate(left, numbers, parts), None
            for compare, part in zip(ops, others, strict=True):
                other = _evaluate(part, numbers, parts)
                if _is_text(value) and _is_text(other):
                    _check_shapes(value, other)
                else:
                    _check_numbers(value, other)
                found = COMPARE[type(compare)](value, other)
                holds = found if holds is None else np.logical_and(holds, found)
                value = other
            return holds
        case ast.IfExp(test=test, body=body, orelse=orelse):
            return _evaluate(body if _evaluate(test, numbers, parts) else orelse, numbers, parts)
        case ast.Subscript(value=of, slice=ast.Slice(lower=lower, upper=upper, step=step)):
            ends = [_evaluate(end, numbers, parts) for end in (lower, upper, step)]
            return _compute(of, numbers, parts)[
                slice(*(None if end is None else operator.index(end) for end in ends))
            ]
        case ast.Subscript(value=of, slice=index):
            return _take_entry(_compute(of, numbers, parts), _evaluate(index, numbers, parts))
        case ast.Call(func=ast.Name(id=name), args=arguments):
            if name in OF_LISTS:
                return FUNCTIONS[name][0](*(_compute(argument, numbers, parts) for argument in arguments))
            values = [_evaluate(argument, numbers, parts) for argument in arguments]
            _check_numbers(*values)
            return FUNCTIONS[name][0](*values)
    raise TypeError(f"it has a {type(node).__name__.lower()}")  # unreachable after the check


def _take_entry(value: Any, index: Any) -> Any:
    if isinstance(value, Mapping):
        if index not in value:
            raise LookupError(f"it has no {index!r}{suggest(index, map(str, value))}")
        return take(value[index])
    if not isinstance(value, np.ndarray):
        raise TypeError("a single number or text has no entries")
    return value[operator.index(index)]


def _is_text(value: Any) -> bool:
    return isinstance(value, str) or (isinstance(value, np.ndarray) and value.dtype.kind == "U")


def _check_numbers(*values: Any) -> None:
    """Checks that values are numbers, and that broadcasting them does not exceed the largest of their sizes."""
    for value in values:
        kind = value.dtype.kind if isinstance(value, np.ndarray | np.generic) else ""
        if kind not in ("b", "i", "u", "f") and not isinstance(value, bool | int | float):
            raise TypeError(f"{'nothing' if value is None else 'a text or a mapping'} is not a number")
    _check_shapes(*values)


def _check_shapes(*values: Any) -> None:
    shape = np.broadcast_shapes(*(np.shape(value) for value in values))
    if np.prod(shape, dtype=float) > max(np.size(value) for value in values):
        raise ValueError("lists of different shapes make a table of each with each")
