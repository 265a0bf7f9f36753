"""Numbers and names as report and figures show them: in one place, so that they are the same everywhere."""

import re
from collections.abc import Iterable, Mapping

# With fewer observers chance alone decides many of the claims.
ENOUGH_OBSERVERS = 20
# Letters in a line of a name that stands beside an axis.
AXIS_WIDTH = 14
_MAX_DIGITS = 9


def format_number(value: float, digits: int = 3) -> str:
    """Formats a number with so many significant digits; without an exponent where that is readable.

    Zero, infinity and NaN are "0", "infinite" and "undefined".
    """
    if value != value:
        return "undefined"
    if value in (float("inf"), float("-inf")):
        return "infinite" if value > 0 else "minus infinite"
    if value == 0.0:
        return "0"
    if not 1e-4 <= abs(value) < 1e6:
        mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
        return f"{mantissa} × 10^{int(exponent)}"
    rounded = f"{float(f'{value:.{digits - 1}e}'):.10f}"
    whole, _, decimals = rounded.partition(".")
    shown = digits - len(whole.lstrip("-").lstrip("0")) if whole.lstrip("-0") else digits + _count_zeros(decimals)
    return f"{value:.{max(0, shown)}f}"


def format_beside(value: float, bound: float, digits: int = 1) -> str:
    """Formats a number with so many decimals that it is seen on which side of a bound it lies.

    Args:
        value: The number.
        bound: The bound, in the same unit.
        digits: Decimals, if they do.
    """
    if 0.0 < abs(bound) < 1e-4:
        return format_number(value, max(2, digits))
    for more in range(digits, _MAX_DIGITS):
        shown = float(f"{value:.{more}f}")
        if (shown < bound, shown > bound) == (value < bound, value > bound):
            return f"{value:.{more}f}"
    return f"{value:.{digits}f}"


def format_list(values: Iterable[float], digits: int = 2) -> str:
    """Formats numbers with so many decimals, separated by commas."""
    return ", ".join(f"{value:.{digits}f}" for value in values)


def format_by_name(values: Mapping[str, float], unit: str, digits: int = 2) -> str:
    """Formats a quantity by the name of what it is of: 9.70 J (wood) and 13.70 J (steel)."""
    return " and ".join(f"{value:.{digits}f} {unit} ({name})" for name, value in values.items())


def count_observers(num: int) -> str:
    """Counts observers: 1 observer, 2 observers."""
    return f"{num} observer{'' if num == 1 else 's'}"


def fold(text: str, width: int = AXIS_WIDTH) -> str:
    """Breaks a text into lines at spaces, hyphens and underscores; what has none is broken anywhere."""
    lines = [""]
    for piece in re.findall(r"[^\s_-]*[\s_-]?", text):
        if len((lines[-1] + piece).rstrip()) > width:
            lines.append("")
        while len(piece.rstrip()) > width:
            lines[-1], piece = piece[:width], piece[width:]
            lines.append("")
        lines[-1] += piece
    return "\n".join(line.rstrip() for line in lines if line.strip())


def label(text: str, width: int = 44) -> str:
    """A text as a label in a legend: folded, and never hidden, as those that begin with an underscore would be."""
    return fold(f"\u200b{text}" if text.startswith("_") else text, width)


def _count_zeros(decimals: str) -> int:
    return len(decimals) - len(decimals.lstrip("0"))
