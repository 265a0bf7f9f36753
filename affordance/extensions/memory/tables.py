"""SQLite file of a ledger: its tables, and transactions.

A stranger's file can neither run code nor fill memory. Before anything else is read, only tables and indices with
exactly the definitions that this program writes are accepted. A page that is used twice is rejected, because such a
tree of pages can contain more rows than could ever be read. Nothing that can be derived from the records is stored.
"""

import re
import sqlite3
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from affordance.exceptions import BadArgumentError, BadValueError, show_value
from affordance.files.bounded import check_size

PROGRAM = "visual-inertial-affordances"
# Largest file, about 200 000 trials, and largest record, an object with about thirty parts, [bytes].
LARGEST_FILE, LARGEST_RECORD = 1_000_000_000, 1_000_000
# Largest length of a row without its record, [bytes].
_ROW_HEAD = 10_000
# Time for which a writer waits for another one, [s].
_PATIENCE = 30.0
_SQLITE = b"SQLite format 3\x00"
# First page of a file: position and value of the flag of a leaf page, position of its number of entries, and the
# largest number allowed, twice the number of tables and indices of any version.
_MARK, _IS_LEAF, _COUNT, _MOST_ENTRIES = 100, 0x0D, slice(103, 105), 24
_URL = re.compile(r"([\w+.-]{2,}):/")


# Kind, name and definition of a table or an index.
type _Entry = tuple[str, str, str | None]


def _define(name: str, key: str, *columns: str) -> list[_Entry]:
    """Defines a table and the index of its primary key."""
    listed = ", ".join(f"{column} NOT NULL" for column in columns)
    table = f"CREATE TABLE {name} ( {listed}, PRIMARY KEY ({key}) )"
    return [("table", name, table), ("index", f"sqlite_autoindex_{name}_1", None)]


def _index(name: str, columns: str) -> _Entry:
    return "index", name, f"CREATE INDEX {name} ON trials ({columns})"


_ABOUT = _define("about", "name", "name VARCHAR(40)", "value TEXT")
_HEAD = ("id VARCHAR(24)", "time VARCHAR(32)", "robot VARCHAR(200)", "fingerprint VARCHAR(64)", "object VARCHAR(200)")
_TAIL = ("digest VARCHAR(24)", "content TEXT")
# Tables and indices.
SCHEMA = "3"
_SCHEMAS = {
    SCHEMA: [*_ABOUT, *_define("trials", "id", *_HEAD, *_TAIL), _index("by_time", "time, id")],
}


def check_place(place: Path | str) -> Path:
    """Returns the path of a memory.

    Raises:
        BadArgumentError: If the place is neither a path nor a string.
        BadValueError: If it is a URL; the message does not show its password.
    """
    if not isinstance(place, str | Path) or not str(place) or "\0" in str(place):
        raise BadArgumentError("place", "", f"is {place!r}, must be the path of an SQLite file")
    if found := _URL.match(str(place)):
        advice = "to share memories between robots use affordance memory merge"
        raise BadValueError(f"{found[1]}://...", "", f"is a URL, must be the path of an SQLite file; {advice}")
    return Path(place)


def check_file(path: Path, *, create: bool) -> None:
    """Raises a BadValueError for a file that is not a database, or that does not exist and cannot be created."""
    if not path.exists():
        if not create:
            raise BadValueError(path, "", "does not exist, must be a memory that a command has written")
        if not path.parent.is_dir():
            raise BadValueError(path, "", f"cannot be created: there is no folder {str(path.parent)!r}")
        return
    check_size(path, LARGEST_FILE)
    if path.is_dir():
        raise BadValueError(path, "", "is a folder, must be a file")
    with path.open("rb") as file:
        begin = file.read(_COUNT.stop)
    if begin.lstrip()[:1] == b"{":
        hint = "affordance memory import reads a memory of an earlier version, or an exported one"
        raise BadValueError(path, "", f"is JSON, must be an SQLite file; {hint}")
    if begin and not begin.startswith(_SQLITE):
        raise BadValueError(path, "", "is not an SQLite file, must be a memory that a command has written")
    if len(begin) == _COUNT.stop and (
        begin[_MARK] != _IS_LEAF or int.from_bytes(begin[_COUNT]) > _MOST_ENTRIES
    ):  # SQLite would read all of them into memory at once
        raise BadValueError(path, "", f"has more than {_MOST_ENTRIES} tables and indices, must be a memory")


def open_database(path: Path, *, create: bool) -> sqlite3.Connection:
    """Opens the database of a ledger, and creates its tables if it is new; the caller must close it.

    Raises:
        BadValueError: If the file does not exist and must not be created, is too large, cannot be read, is from
            another program or version, or contains anything but the tables of a ledger.
    """
    check_file(path, create=create)
    with _translate(path, "read"):
        connection = sqlite3.connect(path.absolute(), timeout=_PATIENCE, autocommit=True)
        try:
            _set_up(connection, path, create=create)
        except BaseException:
            connection.close()
            raise
    return connection


@contextmanager
def transact(connection: sqlite3.Connection, path: Path, *, writes: bool) -> Iterator[None]:
    """Runs one transaction; if it fails, nothing is changed, and errors of the database raise a BadValueError.

    A transaction that writes waits for other writers at its start, because it could not wait later.
    """
    with _translate(path, "written" if writes else "read"):
        connection.execute("BEGIN IMMEDIATE" if writes else "BEGIN")
        try:
            yield
            connection.execute("COMMIT")
        except BaseException:
            if connection.in_transaction:  # if the disk is full, SQLite has ended it already
                connection.execute("ROLLBACK")
            raise


def check_integrity(connection: sqlite3.Connection, kind: str = "integrity_check") -> str:
    """Lets SQLite check the file; returns the first fault, or an empty string."""
    found = str(connection.execute(f"PRAGMA {kind}(1)").fetchone()[0])
    return "" if found == "ok" else found


def describe_schema(schema: object, wanted: str) -> str:
    """Describes the problem of a memory whose schema is that of another version."""
    return f"is {show_value(schema)}, must be {wanted!r}: another version of the program wrote the memory"


@contextmanager
def _translate(path: Path, what: str) -> Iterator[None]:
    """Converts errors of the database to a BadValueError."""
    try:
        yield
    except sqlite3.Error as error:
        is_full = getattr(error, "sqlite_errorcode", None) == sqlite3.SQLITE_FULL
        bound = f"; a memory has at most {LARGEST_FILE / 1e6:g} MB" if is_full else ""
        raise BadValueError(path, "", f"cannot be {what}: {error}{bound}; nothing was changed") from error


def _set_up(connection: sqlite3.Connection, path: Path, *, create: bool) -> None:
    """Checks a database, creates its tables if it is new, and limits its size to what can be opened again."""
    connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, LARGEST_RECORD + _ROW_HEAD)
    connection.execute("PRAGMA synchronous=FULL")  # committed data are on the disk
    with transact(connection, path, writes=False):
        is_new = not _check_schema(connection, path)
        if problem := "" if is_new else check_integrity(connection, "quick_check"):
            raise BadValueError(path, "", f"is damaged: {problem}")
    if is_new and not create:
        raise BadValueError(path, "", "is empty, must be a memory that a command has written")
    if is_new:
        _create_tables(connection, path)
    (page_size,) = connection.execute("PRAGMA page_size").fetchone()
    connection.execute(f"PRAGMA max_page_count={LARGEST_FILE // page_size}")


def _check_schema(connection: sqlite3.Connection, path: Path) -> bool:
    """Checks the tables of a database; returns False if there are none.

    Raises:
        BadValueError: If a table or index differs from what this program writes.
    """
    rows = connection.execute("SELECT type, name, sql FROM sqlite_schema").fetchall()
    found = {(str(kind), str(name), None if sql is None else " ".join(sql.split())) for kind, name, sql in rows}
    if not found:
        return False
    about: dict[str, object] = {}
    if found.issuperset(_ABOUT):
        about = dict(connection.execute("SELECT name, value FROM about WHERE name IN ('program', 'schema')"))
    if about.get("program") != PROGRAM:
        names = sorted(name for kind, name, _ in found if kind == "table")
        raise BadValueError(path, "", f"is a database of another program (tables: {', '.join(names[:5]) or 'none'})")
    schema = about.get("schema")
    if schema not in _SCHEMAS:
        raise BadValueError(path, "schema", describe_schema(schema, SCHEMA))
    for kind, name, _ in sorted(found.symmetric_difference(_SCHEMAS[str(schema)]), key=str):
        raise BadValueError(
            path,
            f"{kind} {name}",
            "differs from what this program writes, must be as in a memory that a command has written",
        )
    return True


def _create_tables(connection: sqlite3.Connection, path: Path) -> None:
    """Creates the tables of a new database, unless another process has just done so."""
    _set_journal(connection, path)
    with transact(connection, path, writes=True):
        if not _check_schema(connection, path):
            for _, _, sql in _SCHEMAS[SCHEMA]:
                connection.execute(sql or "")
            connection.executemany("INSERT INTO about VALUES (?, ?)", [("program", PROGRAM), ("schema", SCHEMA)])


def _set_journal(connection: sqlite3.Connection, path: Path) -> None:
    """Turns on the write-ahead log, with which readers and a writer do not block each other.

    The setting is stored in the file. SQLite does not wait for other processes here, so this function does.
    """
    deadline = time.monotonic() + _PATIENCE
    while True:
        try:
            connection.execute("PRAGMA journal_mode=WAL")
            return
        except sqlite3.Error as error:
            if time.monotonic() > deadline:
                raise BadValueError(path, "", f"cannot be written: {error}; nothing was changed") from error
            time.sleep(0.02)
