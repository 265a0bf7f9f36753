"""Reads the cells of a table that a spreadsheet or another program wrote; errors name row and column."""

import csv
import difflib
import math
import re
from collections.abc import Collection, Mapping, Sequence
from io import StringIO
from pathlib import Path
from typing import NoReturn

from affordance.exceptions import PROSE, BadArgumentError, BadValueError, describe_choice, find_hidden, show_value
from affordance.experiments.shared.holds import OWN_VALUES
from affordance.files.bounded import read_text
from affordance.files.constraints import OneLine, Within, run_check

# Value of the column ``learner`` for people.
PEOPLE = "people"
# Largest table (SECURITY.md): bytes, columns and rows.
_MOST_BYTES, _MOST_COLUMNS, _MOST_ROWS = 20_000_000, 100, 200_000
_DELIMITERS = ",;\t"
_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?"
# Truth values in several languages whose spreadsheets write decimal commas.
_TRUE = ("true", "yes", "1", "wahr", "ja", "vrai", "oui", "vero", "verdadero")
_FALSE = ("false", "no", "0", "falsch", "nein", "faux", "non", "falso")
_EMPTY = ("", "n/a")  # the second is used by BIDS
# Other common names of columns; ignoring such a column would change the experiment.
_OTHERS = {
    "participant": ("subject", "subj", "sub", "participant_id", "subject_id", "subject_nr", "pp", "vp"),
    "object": ("stimulus", "stim", "stim_file", "item"),
}
# Similarity (of difflib) above which an unknown column name counts as a misspelling.
_ALIKE = 0.75


class Cells:
    """Cells of a table, by this program's names of the columns.

    Attributes:
        path: File of the table.
        numbers: Number of each row, as a spreadsheet counts: the row of names is row 1.
        labels: Name of each column in the file, by this program's name; unknown columns keep their name.
    """

    def __init__(
        self,
        path: Path,
        rows: Sequence[tuple[int, Sequence[str]]],
        known: Collection[str],
        renamed: Mapping[str, str] | None,
        *,
        has_commas: bool = False,
    ) -> None:
        """Finds the columns; raises a BadValueError for a wrong head or a row of another width.

        Args:
            path: File of the table.
            rows: Number and cells of each row; the first row has the names of the columns.
            known: This program's names of columns.
            renamed: Names in the file of some columns, by this program's names; None where the user cannot say them.
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
    def read(cls, path: Path, known: Collection[str], renamed: Mapping[str, str] | None) -> "Cells":
        """Reads a UTF-8 file, with or without byte-order mark; commas, semicolons or tabs separate its cells.

        Numbers may have decimal commas unless commas separate the cells. Empty rows are ignored.
        """
        text = read_text(path, _MOST_BYTES, encoding="utf-8-sig")
        first, _, rest = text.partition("\n")
        skipped = 0
        if re.fullmatch(r"\"?sep=.\"?", first.strip()):  # a line that Excel writes above a table
            text, skipped = rest, 1
        delimiter = max(_DELIMITERS, key=text.partition("\n")[0].count)
        rows = _split(path, text, delimiter, skipped)
        return cls(path, rows, known, renamed, has_commas=delimiter != ",")

    def __getitem__(self, name: str) -> list[str]:
        """Returns the cells of a column; they are empty texts if the table has no such column."""
        return self._cells.get(name, [""] * len(self.numbers))

    def _find_columns(
        self, head: Sequence[str], known: Collection[str], renamed: Mapping[str, str] | None
    ) -> dict[str, str]:
        """Finds each column's name in the file, by this program's name, in the order of the file."""
        option = "" if renamed is None else ", or say --columns {}={}"
        renamed = renamed or {}
        for ours, theirs in renamed.items():
            if ours not in known:
                raise BadValueError("--columns", "", describe_choice(ours, known))
            if theirs not in head:
                raise BadValueError(self.path, f"--columns {ours}", describe_choice(theirs, head))
        by_theirs = {theirs: ours for ours, theirs in renamed.items()}
        labels: dict[str, str] = {}
        for place, theirs in enumerate(head, start=1):
            plain = theirs.lower().replace(" ", "_")
            name = by_theirs.get(theirs) or (plain if plain in known and plain not in renamed else theirs)
            if not theirs or name in labels:
                problem = f"is {theirs!r}, which occurs twice" if theirs else "has no name"
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
                problem = f"is {name!r}; did you mean {near[0]!r}? Then name it so{option.format(near[0], name)}"
                raise BadValueError(self.path, "row 1", problem)
        return labels

    def refuse(self, place: int, name: str, problem: str) -> NoReturn:
        """Raises a BadValueError about a cell, given by its row, from 0, and this program's name of its column."""
        raise BadValueError(self.path, f"row {self.numbers[place]}, {self.labels.get(name, name)}", problem)

    def read_names(self, name: str, default: str) -> list[str]:
        """Reads a column of names: single lines of visible characters that no spreadsheet takes for a formula."""
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
        """Reads a column whose cells must be among known names; case is ignored."""
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
        """Reads a column of truth values; empty cells are true."""
        for place, cell in enumerate(self[name]):
            if cell and cell.lower() not in (*_TRUE, *_FALSE):
                self.refuse(place, name, f"is {show_value(cell)}, must be yes or no")
        return [cell.lower() not in _FALSE for cell in self[name]]

    def read_numbers(
        self, name: str, low: float, high: float, unit: str = "", small: str = "", share: float = 1e-3
    ) -> list[float]:
        """Reads a column of numbers within bounds; empty cells are NaN.

        If a value is out of bounds and seems to be in ``small``, a smaller unit (``share`` times ``unit``), the error
        suggests the conversion.
        """
        return [
            self._read_number(place, name, cell, Within(low, high), unit, small, share) if cell else math.nan
            for place, cell in enumerate(self[name])
        ]

    def _read_number(
        self, place: int, name: str, cell: str, bounds: Within, unit: str, small: str, share: float
    ) -> float:
        low, high, of_unit = bounds.low, bounds.high, f" {unit}" if unit else ""
        bare = re.sub(r"\s*[^\W\d_]+$", "", cell)  # the cell without a unit
        has_comma = bare.count(",") == 1 and "." not in bare
        plain = bare.replace(",", ".") if has_comma else bare
        value = float(plain) if re.fullmatch(_NUMBER, plain) else math.nan
        if math.isnan(value) or bare != cell or (has_comma and not self._has_commas):
            suffix = cell.removeprefix(bare).strip()
            meant = share * value if small and suffix == small else value
            hint = f"; {meant:g} would be one" if low <= meant <= high else ""
            self.refuse(place, name, f"is {show_value(cell)}, must be a number{f' of {unit}' if unit else ''}{hint}")
        if not low <= value <= high:
            meant = share * value
            hint = f"{meant:g} if {small} were meant" if small and low <= meant <= high else ""
            hint = hint or f"the nearest is {min(max(value, low), high):g}"
            self.refuse(place, name, f"is {cell}, must be from {low:g} to {high:g}{of_unit}; {hint}")
        return value


def is_formula(cell: str) -> bool:
    """Says whether a spreadsheet might take a text for a formula."""
    return cell[:1] in ("=", "@") or (cell[:1] in ("+", "-") and bool(re.search(r"[(|!]", cell)))


def _strip(row: Sequence[str]) -> list[str]:
    """Removes the empty cells at the end of a row."""
    filled = [place for place, cell in enumerate(row) if cell]
    return list(row[: filled[-1] + 1]) if filled else []


def _split(path: Path, text: str, delimiter: str, skipped: int) -> list[tuple[int, list[str]]]:
    """Splits a text into rows; returns the number and the cells of each row that is not empty."""
    rows: list[tuple[int, list[str]]] = []
    number = skipped
    try:
        for number, row in enumerate(csv.reader(StringIO(text), delimiter=delimiter, strict=True), start=1 + skipped):
            cells = [cell.strip() for cell in row]
            if any(cells):
                rows.append((number, cells))
            if len(rows) > _MOST_ROWS + 1:
                raise BadValueError(path, "", f"has more than {_MOST_ROWS} rows, must have at most that many")
    except csv.Error as error:
        raise BadValueError(path, f"row {number + 1}", f"is not a row of a table: {error}") from error
    return rows
