"""Formats numbers, names and tables for reports, figures and commands."""

import itertools
import math
import re
import textwrap
from collections.abc import Collection, Sequence

from affordance.exceptions import show_text

# With fewer observers, many claims are met or not met by chance.
ENOUGH_OBSERVERS = 20
# Characters per line of a name on an axis.
AXIS_WIDTH = 14
_MAX_DIGITS = 9


def format_number(value: float, digits: int = 3) -> str:
    """Formats a number with significant digits, and without an exponent from 1e-4 to 1e6.

    Zero, infinity and NaN are formatted as "0", "infinite" and "undefined".
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
    zeros = len(decimals) - len(decimals.lstrip("0"))
    shown = digits - len(whole.lstrip("-").lstrip("0")) if whole.lstrip("-0") else digits + zeros
    return f"{value:.{max(0, shown)}f}"


def format_beside(value: float, bound: float, digits: int = 1) -> str:
    """Formats a number with at least ``digits`` decimals, and enough to show if it is above or below a bound."""
    if 0.0 < abs(bound) < 1e-4:
        return format_number(value, max(2, digits))
    for more in range(digits, _MAX_DIGITS):
        shown = float(f"{value:.{more}f}")
        if (shown < bound, shown > bound) == (value < bound, value > bound):
            return f"{value:z.{more}f}"
    return f"{value:z.{digits}f}"


def tabulate(rows: Sequence[Sequence[str]], right: Collection[int] = (), width: int = 0) -> list[str]:
    """Formats rows of cells as the lines of a table, with two spaces between columns.

    Invisible characters, and line breaks within a cell, are replaced.

    Args:
        rows: Rows of cells.
        right: Columns that are right-aligned.
        width: Largest width; 0 for any width. If the table is wider, cells in the widest columns are wrapped.
    """
    rows = [[show_text(cell) for cell in row] for row in rows]
    columns = list(zip(*rows, strict=True))
    widths = [max(len(cell) for cell in column) for column in columns]
    least = [max((len(word) for cell in column for word in cell.split()), default=0) for column in columns]
    while width and sum(widths) + 2 * (len(widths) - 1) > width:
        shrinkable = [k for k, each in enumerate(widths) if each > least[k]]
        if not shrinkable:
            break
        widths[max(shrinkable, key=widths.__getitem__)] -= 1
    lines = []
    for row in rows:
        cells = [_break_cell(cell, widths[k]) for k, cell in enumerate(row)]
        for parts in itertools.zip_longest(*cells, fillvalue=""):
            padded = (f"{part:{'>' if k in right else '<'}{widths[k]}}" for k, part in enumerate(parts))
            lines.append("  ".join(padded).rstrip())
    return lines


def _break_cell(cell: str, width: int) -> list[str]:
    """Wraps a cell between words into lines of at most ``width`` characters."""
    if len(cell) <= width:
        return [cell]
    return textwrap.wrap(cell, width, break_long_words=False, break_on_hyphens=False)


def tabulate_within(
    rows: Sequence[Sequence[str]],
    width: int,
    order: Sequence[int],
    left_out: Collection[int] = (),
    right: Collection[int] = (),
) -> list[str]:
    """Formats a table as ``tabulate`` does, but drops less important columns if it is too wide.

    If the table is still too wide without these columns, cells are wrapped.

    Args:
        rows: Rows of cells.
        width: Largest width; 0 for any width.
        order: Columns that can be dropped, in this order.
        left_out: Columns that are always dropped.
        right: Columns that are right-aligned.
    """
    omitted = set(left_out)
    waiting = list(order)
    while True:
        columns = [k for k in range(len(rows[0])) if k not in omitted]
        kept = [[row[k] for k in columns] for row in rows]
        aligned = [place for place, k in enumerate(columns) if k in right]
        if not (width and waiting and max(map(len, tabulate(kept, aligned))) > width):
            return tabulate(kept, aligned, width)
        omitted.add(waiting.pop(0))


def break_line(line: str, width: int) -> list[str]:
    """Wraps a line between words at ``width`` characters (0 for any width), with indented continuation lines."""
    if not width or len(line) <= width:
        return [line]
    indent = " " * (len(line) - len(line.lstrip()) + 2)
    return textwrap.wrap(line, width, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)


def format_known(value: float, uncertainty: float) -> str:
    """Formats a number with as many digits as its uncertainty allows.

    The last digit is in the place of the uncertainty's second significant digit. At most three significant digits are
    shown.
    """
    if not (math.isfinite(value) and math.isfinite(uncertainty)) or uncertainty <= 0.0 or value == 0.0:
        return format_number(value)
    of_uncertainty = 1 - math.floor(math.log10(uncertainty))
    of_value = 2 - math.floor(math.log10(abs(value)))
    decimals = min(of_uncertainty, of_value)
    if decimals < 0 or not 1e-4 <= abs(value) < 1e6:
        return format_number(value, max(1, 3 + min(0, of_uncertainty - of_value)))
    return f"{value:.{decimals}f}"


def format_duration(seconds: float) -> str:
    """Formats a duration in seconds, minutes or hours, whichever is easiest to read."""
    if seconds < 100.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 100.0 * 60.0 else f"{seconds / 3600.0:.1f} h"


def count_observers(num: int) -> str:
    """Formats a number of observers: "1 observer", "2 observers"."""
    return f"{num} observer{'' if num == 1 else 's'}"


def fold(text: str, width: int = AXIS_WIDTH) -> str:
    """Wraps a text at spaces, hyphens and underscores. A piece that is wider than a line is split."""
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
    """Wraps a text for use as a legend label, and replaces underscores by spaces.

    Matplotlib hides labels that begin with an underscore.
    """
    return fold(text.replace("_", " "), width)
