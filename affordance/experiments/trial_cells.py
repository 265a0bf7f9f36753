"""Cells of a table that a spreadsheet or another program wrote, and errors that name row and column."""

import csv
import difflib
import math
import re
from collections.abc import Collection, Mapping, Sequence
from io import StringIO
from pathlib import Path
from typing import NoReturn

from affordance.exceptions import PROSE, BadArgumentError, BadValueError, describe_choice, find_hidden, show_value
from affordance.files.bounded import read_text
from affordance.files.constraints import OneLine, Within, run_check

# Bounds of a table (SECURITY.md): bytes, columns and rows.
_MOST_BYTES, _MOST_COLUMNS, _MOST_ROWS = 20_000_000, 100, 200_000
_DELIMITERS = ",;\t"
_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?"
# Truth values, in the languages whose spreadsheets write decimal commas too.
_TRUE = ("true", "yes", "1", "wahr", "ja", "vrai", "oui", "vero", "verdadero")
_FALSE = ("false", "no", "0", "falsch", "nein", "faux", "non", "falso")
_EMPTY = ("", "n/a")  # the second as BIDS has it
# What others call columns without which a table would be taken for another experiment.
_OTHERS = {
    "participant": ("subject", "subj", "sub", "participant_id", "subject_id", "subject_nr", "pp", "vp"),
    "object": ("stimulus", "stim", "stim_file", "item"),
}
# How names of columns with parameters of each observer begin; they are those of settings.
OWN_VALUES = ("participant.", "learner.")
# Similarity, as of difflib, from which the name of a column is taken for a slip.
_ALIKE = 0.75


class Cells:
    """Cells of a table by our names of its columns.

    Attributes:
        path: File of the table.
        numbers: Number of each row, as a spreadsheet counts them: that of names is the first.
        labels: Names of the columns in the file, by ours; those that we do not know have the same.
    """

    def __init__(
        self,
        path: Path,
        rows: Sequence[tuple[int, Sequence[str]]],
        known: Collection[str],
        renamed: Mapping[str, str],
        *,
        has_commas: bool = False,
    ) -> None:
        """Finds the columns; a wrong head, or a row of another width, raises a BadValueError.

        Args:
            path: File of the table.
            rows: Numbers and cells of the rows, the first of which has the names of the columns.
            known: Our names of columns.
            renamed: The file's names of some of them, by ours.
            has_commas: True if numbers may have a decimal comma.
        """
        self.path, self._has_commas = path, has_commas
        if len(rows) < 2:
            raise BadValueError(path, "", "has no trials, must have a row of names and a row for each trial")
        (_, names), *body = rows
        head = _strip(names)
        if len(head) > _MOST_COLUMNS:
            raise BadValueError(path, "", f"has {len(head)} columns, must have at most {_MOST_COLUMNS}")
        self.labels = self._find_columns(head, known, renamed)
        self.numbers = [number for number, _ in body]
        for number, row in body:
            if len(row) < len(head) or len(_strip(row)) > len(head):
                problem = f"has {max(len(row), len(_strip(row)))} cells, must have {len(head)}, one for each column"
                raise BadValueError(path, f"row {number}", problem)
            if hidden := find_hidden("".join(row), PROSE):
                raise BadValueError(path, f"row {number}", f"holds {hidden}")
        self._cells = {
            name: ["" if row[place].lower() in _EMPTY else row[place] for _, row in body]
            for place, name in enumerate(self.labels)
        }

    @classmethod
    def read(cls, path: Path, known: Collection[str], renamed: Mapping[str, str]) -> "Cells":
        """Reads a file in UTF-8, with or without a byte-order mark, with commas, semicolons or tabs between cells.

        Numbers may have decimal commas unless commas separate cells. Rows without a filled cell do not count.
        """
        text = read_text(path, _MOST_BYTES, encoding="utf-8-sig")
        first, _, rest = text.partition("\n")
        skipped = 0
        if re.fullmatch(r"\"?sep=.\"?", first.strip()):  # which Excel puts above a table
            text, skipped = rest, 1
        delimiter = max(_DELIMITERS, key=text.partition("\n")[0].count)
        rows = _split(path, text, delimiter, skipped)
        return cls(path, rows, known, renamed, has_commas=delimiter != ",")

    def __getitem__(self, name: str) -> list[str]:
        """Returns the cells of a column; empty ones if the table has no such column."""
        return self._cells.get(name, [""] * len(self.numbers))

    def _find_columns(
        self, head: Sequence[str], known: Collection[str], renamed: Mapping[str, str]
    ) -> dict[str, str]:
        """Finds the file's name of each column by ours, in the order of the file."""
        for ours, theirs in renamed.items():
            if theirs not in head:
                raise BadValueError(self.path, f"--columns {ours}", describe_choice(theirs, head))
        by_theirs = {theirs: ours for ours, theirs in renamed.items()}
        labels: dict[str, str] = {}
        for place, theirs in enumerate(head, start=1):
            plain = theirs.lower().replace(" ", "_")
            name = by_theirs.get(theirs) or (plain if plain in known and plain not in renamed else theirs)
            if not theirs or name in labels:
                problem = f"is {theirs!r}, which is there twice" if theirs else "has no name"
                raise BadValueError(self.path, f"row 1, column {place}", problem)
            try:
                run_check("", OneLine().check, theirs)
            except BadArgumentError as error:
                raise BadValueError(self.path, f"row 1, column {place}", error.problem) from error
            labels[name] = theirs
        missing = [name for name in known if name not in labels]
        for name in labels:
            near = [each for each in missing if name.lower() in _OTHERS.get(each, ())]
            near += difflib.get_close_matches(name.lower(), missing, n=1, cutoff=_ALIKE)
            if name not in known and near and not name.startswith(OWN_VALUES):
                problem = f"is {name!r}; did you mean {near[0]!r}? Then name it so, or say --columns {near[0]}={name}"
                raise BadValueError(self.path, "row 1", problem)
        return labels

    def refuse(self, place: int, name: str, problem: str) -> NoReturn:
        """Raises a BadValueError about a cell, given by the place of its row and our name of its column."""
        raise BadValueError(self.path, f"row {self.numbers[place]}, {self.labels.get(name, name)}", problem)

    def read_names(self, name: str, default: str) -> list[str]:
        """Reads a column of names, each a line of visible letters that no spreadsheet would calculate."""
        for place, cell in enumerate(self[name]):
            if cell:
                try:
                    run_check("", OneLine().check, cell)
                except BadArgumentError as error:
                    self.refuse(place, name, error.problem)
                if is_formula(cell):
                    self.refuse(place, name, f"is {show_value(cell)}, which a spreadsheet would calculate")
        return [cell or default for cell in self[name]]

    def read_choices(self, name: str, known: Collection[str], default: str = "") -> list[str]:
        """Reads a column of names out of several, of which upper and lower case may differ."""
        by_lower = {each.lower(): each for each in known}
        found = []
        for place, cell in enumerate(self[name]):
            if not (cell or default):
                self.refuse(place, name, f"is empty, must be one of {', '.join(known)}")
            chosen = (cell if cell in known else by_lower.get(cell.lower(), cell)) if cell else default
            if chosen not in known:
                self.refuse(place, name, describe_choice(cell, known))
            found.append(chosen)
        return found

    def read_truths(self, name: str) -> list[bool]:
        """Reads a column of truth values, true where empty."""
        for place, cell in enumerate(self[name]):
            if cell and cell.lower() not in (*_TRUE, *_FALSE):
                self.refuse(place, name, f"is {show_value(cell)}, must be yes or no")
        return [cell.lower() not in _FALSE for cell in self[name]]

    def read_numbers(self, name: str, low: float, high: float, unit: str = "", small: str = "") -> list[float]:
        """Reads a column of numbers within bounds, NaN where empty.

        A thousandth of the unit, ``small``, is suggested where it was meant.
        """
        return [
            self._read_number(place, name, cell, Within(low, high), unit, small) if cell else math.nan
            for place, cell in enumerate(self[name])
        ]

    def _read_number(self, place: int, name: str, cell: str, bounds: Within, unit: str, small: str) -> float:
        low, high, of_unit = bounds.low, bounds.high, f" {unit}" if unit else ""
        bare = re.sub(r"\s*[^\W\d_]+$", "", cell)  # without a unit
        has_comma = bare.count(",") == 1 and "." not in bare
        plain = bare.replace(",", ".") if has_comma else bare
        value = float(plain) if re.fullmatch(_NUMBER, plain) else math.nan
        if math.isnan(value) or bare != cell or (has_comma and not self._has_commas):
            suffix = cell.removeprefix(bare).strip()
            meant = 1e-3 * value if small and suffix == small else value
            hint = f"; {meant:g} would be one" if low <= meant <= high else ""
            self.refuse(place, name, f"is {show_value(cell)}, must be a number{f' of {unit}' if unit else ''}{hint}")
        if not low <= value <= high:
            meant = 1e-3 * value
            hint = f"{meant:g} if {small} were meant" if small and low <= meant <= high else ""
            hint = hint or f"the nearest is {min(max(value, low), high):g}"
            self.refuse(place, name, f"is {cell}, must be from {low:g} to {high:g}{of_unit}; {hint}")
        return value


def is_formula(cell: str) -> bool:
    """Says whether a spreadsheet would take a text for a formula."""
    return cell[:1] in ("=", "@") or (cell[:1] in ("+", "-") and bool(re.search(r"[(|!]", cell)))


def _strip(row: Sequence[str]) -> list[str]:
    """Returns a row without the empty cells at its end."""
    filled = [place for place, cell in enumerate(row) if cell]
    return list(row[: filled[-1] + 1]) if filled else []


def _split(path: Path, text: str, delimiter: str, skipped: int) -> list[tuple[int, list[str]]]:
    """Splits a text into the cells of its rows, with their numbers."""
    rows: list[tuple[int, list[str]]] = []
    number = skipped
    try:
        for number, row in enumerate(csv.reader(StringIO(text), delimiter=delimiter, strict=True), start=1 + skipped):
            cells = [cell.strip() for cell in row]
            if any(cells):
                rows.append((number, cells))
            if len(rows) > _MOST_ROWS + 1:
                raise BadValueError(path, "", f"has more than {_MOST_ROWS} rows, must have at most as many")
    except csv.Error as error:
        raise BadValueError(path, f"row {number + 1}", f"is not a row of a table: {error}") from error
    return rows
