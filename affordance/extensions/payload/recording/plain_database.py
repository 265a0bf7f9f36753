"""Checks that foreign SQLite files contain only plain tables, without views, triggers or computed columns."""

import itertools
import re
import sqlite3
from contextlib import closing
from pathlib import Path

from affordance.exceptions import BadValueError

# Largest number of instructions of SQLite's virtual machine, about ten per row, and number between two checks.
_MOST_STEPS, _CHECKED = 500_000_000, 100_000
_VIRTUAL = re.compile(r"\s*create\s+virtual", re.IGNORECASE)


def check_plain_tables(path: Path, what: str, *, is_immutable: bool) -> None:
    """Raises a BadValueError if a database can run programs: views, triggers, virtual tables, computed columns.

    ``what`` names the kind of file in messages. An immutable file must not be written meanwhile; a journal next to it
    is ignored.
    """
    options = "mode=ro&immutable=1" if is_immutable else "mode=ro"
    try:
        with closing(sqlite3.connect(f"{path.absolute().as_uri()}?{options}", uri=True)) as database:
            limit_steps(database)
            entries = database.execute("SELECT type, name, sql FROM sqlite_schema").fetchall()
            tables = [name for kind, name, sql in entries if kind == "table" and not _VIRTUAL.match(sql or "")]
            calculated = [
                name
                for name in tables
                if any(row[0] for row in database.execute("SELECT hidden FROM pragma_table_xinfo(?)", (name,)))
            ]
    except (sqlite3.Error, ValueError) as error:
        raise BadValueError(path, "", f"cannot be read as a {what}: {error}") from error
    others = [name for kind, name, _ in entries if kind != "index" and name not in tables]
    if programs := [*others, *calculated]:
        raise BadValueError(path, "", f"calculates {programs[0]!r}, must be a database of plain tables")


def limit_steps(database: sqlite3.Connection) -> None:
    """Ends long queries with an OperationalError after seconds, because a malicious file may never end."""
    checks = itertools.count()
    database.set_progress_handler(lambda: next(checks) > _MOST_STEPS // _CHECKED, _CHECKED)
