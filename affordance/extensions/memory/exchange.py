"""Exports and imports trials as JSON Lines."""

import json
from collections.abc import Generator
from pathlib import Path

from affordance.exceptions import BadValueError
from affordance.extensions.memory.ledger import Ledger
from affordance.extensions.memory.stored_trials import read_record, write_record
from affordance.extensions.memory.tables import LARGEST_FILE, LARGEST_RECORD, PROGRAM, describe_schema
from affordance.extensions.memory.trial_evidence import TrialEvidence
from affordance.files.atomic import write_text
from affordance.files.bounded import check_size

# Version of the record format, which has not changed since 0.3.0.
_SCHEMA = "2"


def export_trials(ledger: Ledger, path: Path) -> int:
    """Writes all trials to a file, one per line after a header line; returns their number."""
    trials = ledger.list_trials()
    lines = (json.dumps({"program": PROGRAM, "schema": _SCHEMA}), *map(write_record, trials))
    write_text(path, "".join(f"{line}\n" for line in lines))
    return len(trials)


def read_trials(path: Path) -> list[TrialEvidence]:
    """Reads a file of trials.

    Raises:
        BadValueError: If the file is no exported memory, or cannot be read.
    """
    lines = _read_lines(path)
    _, begin = next(lines, (0, ""))
    if not begin:
        raise BadValueError(path, "", "is empty, must be an exported memory")
    try:
        first = json.loads(begin)
    except (ValueError, RecursionError):
        first = None
    if not (isinstance(first, dict) and "schema" in first):
        raise BadValueError(path, "", "is not an exported memory")
    if first.get("program") != PROGRAM:
        problem = f"is {first['schema']!r} of {first.get('program')!r}, must be {_SCHEMA!r} of {PROGRAM!r}"
        raise BadValueError(path, "line 1: schema", problem)
    if first["schema"] != _SCHEMA:
        raise BadValueError(path, "line 1: schema", describe_schema(first["schema"], _SCHEMA))
    return [read_record(path, f"line {number}", line) for number, line in lines]


def _read_lines(path: Path) -> Generator[tuple[int, str]]:
    """Yields the non-empty lines of a file with their numbers."""
    check_size(path, LARGEST_FILE)
    try:
        with path.open(encoding="utf-8") as file:
            # A line that is too long is truncated here and then rejected by ``read_record``.
            for number, line in enumerate(iter(lambda: file.readline(LARGEST_RECORD + 2), ""), 1):
                if line.strip():
                    yield number, line
    except OSError as error:
        raise BadValueError(path, "", f"cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise BadValueError(path, "", "is not a text file in UTF-8") from error
