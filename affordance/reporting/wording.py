"""Words of report and figures that depend on data: counts, numbers beside a bound, names of any length."""

import re

# With fewer observers chance alone decides many of the verdicts.
ENOUGH_OBSERVERS = 20
# Letters in a line of a name that stands beside an axis.
AXIS_WIDTH = 14
_MAX_DIGITS = 9


def count_observers(num: int) -> str:
    """Counts observers: 1 observer, 2 observers."""
    return f"{num} observer{'' if num == 1 else 's'}"


def introduce_observers(num: int, verb: str, verb_of_one: str) -> str:
    """Begins a sentence about simulated observers."""
    return f"1 simulated observer {verb_of_one}" if num == 1 else f"{num} simulated observers {verb}"


def warn_of_few_observers(num: int) -> str:
    """A sentence to add to a summary where verdicts are of few observers, otherwise nothing."""
    if num >= ENOUGH_OBSERVERS:
        return ""
    return f" Verdicts want about {ENOUGH_OBSERVERS} observers or more; these are of {num}."


def show_beside(value: float, bound: float, digits: int = 1) -> str:
    """Writes a number with so many digits that it is seen on which side of a bound it lies.

    Args:
        value: The number.
        bound: The bound, in the same unit.
        digits: Digits after the point, if they do.
    """
    for more in range(digits, _MAX_DIGITS):
        shown = float(f"{value:.{more}f}")
        if (shown < bound, shown > bound) == (value < bound, value > bound):
            return f"{value:.{more}f}"
    return f"{value:.{digits}f}"


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
