"""Cells of tables from spreadsheets or other programs. Error messages contain row and column."""

import difflib
import itertools
import math
import re
from collections.abc import Collection, Mapping, Sequence
from io import StringIO
from pathlib import Path
from typing import NamedTuple, NoReturn

import pandas as pd

from affordance.exceptions import BadValueError, describe_choice, show_value
from affordance.experiments.shared.holds import OWN_VALUES
from affordance.files.bounded import read_text
from affordance.files.constraints import check_names

# Value of the column ``learner`` for people.
PEOPLE = "people"
INDEX = "(row numbers)"  # name of an unnamed first column with row numbers
LARGEST = 20_000_000  # size of a table, [byte]
# Names of true in languages whose spreadsheets use decimal commas.
_TRUE = ("", "true", "yes", "1", "wahr", "ja", "vrai", "oui", "vero", "verdadero")
_FALSE = ("false", "no", "0", "falsch", "nein", "faux", "non", "falso")
# Other common names of columns, which must not be ignored silently.
_OTHERS = {
    "participant": ("subject", "subj", "sub", "participant_id", "subject_id", "subject_nr", "pp", "vp"),
    "object": ("stimulus", "stim", "stim_file", "item"),
}
# Smallest similarity (difflib) of an unknown column name that counts as a misspelling.
_ALIKE = 0.75


class Cells(NamedTuple):
    """Cells of a table.

    Attributes:
        path: File of the table.
        texts: Cells as strings. Columns have this program's names if known. The index is the row number in a
            spreadsheet, where the header is row 1.
        labels: Name of each column in the file, by this program's name.
        has_commas: True if numbers can have decimal commas.
    """

    path: Path
    texts: pd.DataFrame
    labels: dict[str, str]
    has_commas: bool = False

    def get(self, name: str) -> list[str]:
        """Returns the cells of a column, or empty strings if it is missing."""
        return list(self.texts[name]) if name in self.labels else [""] * len(self.texts)


def read_cells(path: Path, known: Collection[str], needed: Sequence[str], renamed: Mapping[str, str]) -> Cells:
    """Reads a UTF-8 file, with or without byte-order mark, whose delimiter is a comma, semicolon or tab.

    Numbers can have decimal commas unless the delimiter is a comma. Empty rows are ignored.

    Args:
        path: File of the table.
        known: Column names of this program.
        needed: Names of required columns.
        renamed: Column names in the file that differ from the column names of this program, by the latter.

    Raises:
        BadValueError: The file cannot be read, is too large, is not a table, or has a wrong header.
    """
    text = read_text(path, LARGEST, encoding="utf-8-sig")
    skipped = 1 if re.match('"?sep=', text) else 0  # Excel may write such a line above a table
    delimiter = max(",;\t", key=text.split("\n", 2)[skipped].count)
    try:
        table = pd.read_csv(
            StringIO(text),
            sep=delimiter,
            header=None,
            skiprows=skipped,
            dtype=str,
            keep_default_na=False,
            skip_blank_lines=False,
            engine="python",  # distinguishes missing from empty cells
        )
    except (pd.errors.ParserError, pd.errors.EmptyDataError) as error:
        raise BadValueError(path, "", f"is not a table: {str(error).rpartition(': ')[2].strip()}") from error
    table.index += 1 + skipped
    for row, count in table.notna().sum(axis=1).items():
        if 0 < count < table.shape[1]:
            problem = f"has {count} cells, must have {table.shape[1]}, as the row of names has"
            raise BadValueError(path, f"row {row}", problem)
    return name_cells(path, table, known, needed, renamed)._replace(has_commas=delimiter != ",")


def name_cells(
    path: Path, table: pd.DataFrame, known: Collection[str], needed: Sequence[str], renamed: Mapping[str, str]
) -> Cells:
    """Names the columns of a table of strings according to its first row; see ``read_cells``."""
    table = table.fillna("").map(
        lambda cell: "" if cell.strip().lower() == "n/a" else cell.strip()
    )  # BIDS writes n/a for missing values
    table = table.loc[(table != "").any(axis=1), (table != "").any()]
    if len(table) > 1 and _counts_rows(list(table.iloc[:, 0])):  # index of pandas
        table.iloc[0, 0] = INDEX
        table = table[(table.iloc[:, 1:] != "").any(axis=1)]
    if len(table) < 2:
        raise BadValueError(path, "", "has no trials, must have a row of names and a row for each trial")
    head = list(table.iloc[0])
    check_names(path, "row 1", head)
    labels: dict[str, str] = {}
    by_theirs = {theirs: ours for ours, theirs in renamed.items()}
    for ours, theirs in renamed.items():
        if ours not in known:
            raise BadValueError("--columns", "", describe_choice(ours, known))
        if theirs not in head:
            raise BadValueError(path, f"--columns {ours}", describe_choice(theirs, head))
    for place, theirs in zip(table.columns.to_numpy(int).tolist(), head, strict=True):
        plain = theirs.lower().replace(" ", "_")
        name = by_theirs.get(theirs) or (plain if plain in known and plain not in renamed else theirs)
        if not theirs or name in labels:
            problem = f"is {theirs!r}, which occurs twice" if theirs else "has no name"
            raise BadValueError(path, f"row 1, column {place + 1}", problem)
        labels[name] = theirs
    missing = [name for name in known if name not in labels]
    for name in labels:
        near = [each for each in missing if name.lower() in _OTHERS.get(each, ())]
        near += difflib.get_close_matches(name.lower(), missing, n=1, cutoff=_ALIKE)
        if name not in known and near and not name.startswith(OWN_VALUES):
            problem = f"is {name!r}; did you mean {near[0]!r}? Then name it so, or say --columns {near[0]}={name}"
            raise BadValueError(path, "row 1", problem)
    for name in needed:
        if name not in labels:
            problem = f"is missing among {', '.join(head[:20])}; --columns {name}=NAME names the column to use"
            raise BadValueError(path, name, problem)
    return Cells(path, table.iloc[1:].set_axis([*labels], axis=1), labels)


def _counts_rows(column: Sequence[str]) -> bool:
    """Returns True for a column of row numbers, which has no name and contains increasing integers."""
    numbers = [int(cell) for cell in column[1:] if cell.isdecimal()]
    return not column[0] and len(numbers) == len(column) - 1 and all(a < b for a, b in itertools.pairwise(numbers))


def refuse_cell(cells: Cells, place: int, name: str, problem: str) -> NoReturn:
    """Raises a BadValueError about a cell, given its row from 0 and this program's name of the column."""
    where = f"row {cells.texts.index[place]}, {cells.labels.get(name, name)}"
    raise BadValueError(cells.path, where, problem)


def read_names(cells: Cells, name: str, default: str) -> list[str]:
    """Reads a column of names, which must be single lines of visible characters."""
    for row, cell in zip(cells.texts.index, cells.get(name), strict=True):
        check_names(cells.path, f"row {row}, {cells.labels.get(name)}", [cell])
    return [cell or default for cell in cells.get(name)]


def read_choices(cells: Cells, name: str, known: Collection[str], default: str = "") -> list[str]:
    """Reads a column whose cells must be known names. Case is ignored."""
    by_name = {**{each.lower(): each for each in known}, **{each: each for each in known}}
    texts = [cell or default for cell in cells.get(name)]
    found = [by_name.get(cell, by_name.get(cell.lower(), "")) for cell in texts]
    if "" in found:
        refuse_cell(cells, found.index(""), name, describe_choice(texts[found.index("")], known))
    return found


def read_truths(cells: Cells, name: str) -> list[bool]:
    """Reads a column of truth values. Empty cells are true."""
    for place, cell in enumerate(cells.get(name)):
        if cell.lower() not in (*_TRUE, *_FALSE):
            refuse_cell(cells, place, name, f"is {show_value(cell)}, must be yes or no")
    return [cell.lower() not in _FALSE for cell in cells.get(name)]


def read_numbers(
    cells: Cells, name: str, low: float, high: float, unit: str = "", small: str = "", share: float = 1e-3
) -> list[float]:
    """Reads a column of numbers, with NaN for empty cells. Numbers out of bounds raise a BadValueError.

    If such a number seems to be in the smaller unit ``small``, which is ``share`` times ``unit``, the message
    suggests a conversion.
    """
    found = []
    for place, cell in enumerate(cells.get(name)):
        try:
            value = float(cell.replace(",", ".") if cells.has_commas else cell)
        except ValueError:
            value = math.nan
        if cell and math.isnan(value):
            of_unit = f" of {unit}" if unit else ""
            refuse_cell(cells, place, name, f"is {show_value(cell)}, must be a number{of_unit}")
        if cell:
            check_cell(cells, place, name, value, low, high, unit, small, share)
        found.append(value)
    return found


def check_cell(
    cells: Cells,
    place: int,
    name: str,
    value: float,
    low: float,
    high: float,
    unit: str = "",
    small: str = "",
    share: float = 1e-3,
) -> None:
    """Checks that a number is within bounds; arguments and errors are as in ``read_numbers``."""
    if not low <= value <= high:
        is_small = small and low <= share * value <= high
        hint = (
            f"{share * value:g} if {small} were meant"
            if is_small
            else f"the nearest is {min(max(value, low), high):g}"
        )
        refuse_cell(
            cells, place, name, f"is {value:g}, must be from {low:g} to {high:g} {unit}".rstrip() + f"; {hint}"
        )
