"""Tables of a ledger in a database: SQLite by default, or any server that SQLAlchemy knows."""

import sqlite3
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

from sqlalchemy import (
    Column,
    Connection,
    Engine,
    Index,
    MetaData,
    String,
    Table,
    Text,
    create_engine,
    event,
    insert,
    inspect,
    make_url,
    select,
)
from sqlalchemy.exc import ArgumentError, DBAPIError, NoSuchModuleError

from affordance.exceptions import BadValueError
from affordance.files.bounded import check_size
from affordance.files.plain_database import check_plain_tables

PROGRAM, SCHEMA = "visual-inertial-affordances", "2"
# Time that a writer waits for another, [ms].
_PATIENCE = 30_000
# Size of a database, a thousand times that of 10^5 trials.
_MOST = 1_000_000_000_000
_SQLITE = b"SQLite format 3\x00"
_WRITES = "writes"
_NO_URL = "is not the URL of a database that can be used here"

_METADATA = MetaData()
ABOUT = Table("about", _METADATA, Column("name", String(40), primary_key=True), Column("value", Text, nullable=False))
# The ledger itself: rows are added or forgotten, never changed but for the name of the thing, which is derived.
TRIALS = Table(
    "trials",
    _METADATA,
    Column("id", String(24), primary_key=True),
    Column("time", String(32), nullable=False),
    Column("robot", String(200), nullable=False),
    Column("fingerprint", String(64), nullable=False),
    Column("object", String(200), nullable=False),
    Column("thing", String(220), nullable=False),
    Column("digest", String(24), nullable=False),
    Column("content", Text, nullable=False),
    Index("by_time", "time", "id"),
    Index("by_robot", "robot", "fingerprint"),
    Index("by_thing", "thing", "time", "id"),
    Index("by_object", "object", "time", "id"),
)
# Sums of the trials, which can be computed anew: of each thing, and of all materials, for a prior.
THINGS = Table(
    "things",
    _METADATA,
    Column("prior", String(120), primary_key=True),
    Column("thing", String(220), primary_key=True),
    Column("founder", String(24), nullable=False),
    Column("content", Text, nullable=False),
)
MATERIALS = Table(
    "materials",
    _METADATA,
    Column("prior", String(120), primary_key=True),
    Column("content", Text, nullable=False),
)


def open_database(place: Path | str, *, create: bool) -> Engine:
    """Opens the database of a ledger, an SQLite file or a URL, and makes its tables if it is new.

    One that does not exist and is not to be made, is of another program or version, or cannot be reached raises a
    BadValueError.
    """
    if (path := find_file(place)) is not None:
        check_file(path, create)
    try:
        engine = create_engine(place if isinstance(place, str) and "://" in place else f"sqlite:///{place}")
    except (ArgumentError, NoSuchModuleError, ImportError) as error:
        raise BadValueError(place, "", f"{_NO_URL}: {error}") from error
    if engine.dialect.name == "sqlite":
        event.listen(engine, "connect", _set_up)
        event.listen(engine, "begin", _begin)
    try:
        with connect(engine, place, writes=False) as connection:
            is_new = not _check_tables(connection, place)
        if is_new:
            _make_tables(engine, place)
    except BadValueError:
        engine.dispose()
        raise
    return engine


def find_file(place: Path | str) -> Path | None:
    """Finds the file of a path or an SQLite URL; None for a server, or a database in working memory."""
    if "://" not in str(place):
        return Path(place)
    try:
        url = make_url(str(place))
    except ArgumentError as error:
        raise BadValueError(place, "", f"{_NO_URL}: {error}") from error
    is_file = url.get_backend_name() == "sqlite" and url.database not in (None, "", ":memory:")
    return Path(str(url.database)) if is_file and "uri" not in url.query else None


@contextmanager
def connect(engine: Engine, place: Path | str, *, writes: bool) -> Iterator[Connection]:
    """Runs one transaction; if it fails nothing is changed, and errors of the database raise a BadValueError."""
    try:
        with engine.connect().execution_options(**{_WRITES: writes}) as connection, connection.begin():
            yield connection
    except DBAPIError as error:
        what = "written" if writes else "read"
        raise BadValueError(place, "", f"cannot be {what}: {error.orig}; nothing was changed") from error


def check_integrity(connection: Connection) -> str:
    """Asks SQLite whether the file is sound; returns its complaint, empty if it has no complaint."""
    if connection.dialect.name != "sqlite":
        return ""
    found = str(connection.exec_driver_sql("PRAGMA integrity_check").scalar())
    return "" if found == "ok" else found


def check_file(path: Path, create: bool) -> None:
    """Raises a BadValueError for a file that is not a database, or that does not exist and cannot be created."""
    if not path.exists():
        if not create:
            raise BadValueError(path, "", "does not exist, must be a memory that a command has written")
        if not path.parent.is_dir():
            raise BadValueError(path, "", f"cannot be created: there is no folder {str(path.parent)!r}")
        return
    check_size(path, _MOST)
    if path.is_dir():
        raise BadValueError(path, "", "is a folder, must be a file")
    with path.open("rb") as file:
        begin = file.read(len(_SQLITE))
    if begin.lstrip()[:1] == b"{":
        hint = "affordance memory import reads a memory of an earlier version, or an exported one"
        raise BadValueError(path, "", f"is JSON, must be an SQLite file; {hint}")
    if begin and begin != _SQLITE:
        raise BadValueError(path, "", "is not an SQLite file, must be a memory that a command has written")
    check_plain_tables(path, "memory", is_immutable=False)


def describe_schema(schema: object) -> str:
    """Describes the schema of a memory of another version."""
    return f"is {schema!r}, must be {SCHEMA!r}: another version of the program wrote the memory"


def _check_tables(connection: Connection, place: Path | str) -> bool:
    """Returns False if a database has no tables; those of another program or version raise a BadValueError."""
    names = set(inspect(connection).get_table_names())
    if not names:
        return False
    about: dict[str, str] = {}
    if {"about", "trials"} <= names:
        about = {str(row.name): str(row.value) for row in connection.execute(select(ABOUT))}
    if about.get("program") != PROGRAM:
        raise BadValueError(place, "", f"is a database of another program (tables: {', '.join(sorted(names)[:5])})")
    if about.get("schema") != SCHEMA:
        raise BadValueError(place, "schema", describe_schema(about.get("schema")))
    return True


def _make_tables(engine: Engine, place: Path | str) -> None:
    """Makes the tables of a new database, unless another process has just done so."""
    if engine.dialect.name == "sqlite":
        _set_journal(engine, place)
    with connect(engine, place, writes=True) as connection:
        if not _check_tables(connection, place):
            _METADATA.create_all(connection)
            about = {"program": PROGRAM, "schema": SCHEMA}
            connection.execute(insert(ABOUT), [{"name": name, "value": value} for name, value in about.items()])


def _set_journal(engine: Engine, place: Path | str) -> None:
    """Sets the write-ahead log, which is kept in the file: readers and a writer do not wait for one another.

    SQLite does not wait for other processes here, so this function does.
    """
    deadline = time.monotonic() + 1e-3 * _PATIENCE
    while True:
        try:
            with closing(engine.raw_connection()) as connection:  # outside of any transaction
                connection.cursor().execute("PRAGMA journal_mode=WAL")
                return
        except sqlite3.Error as error:
            if time.monotonic() > deadline:
                raise BadValueError(place, "", f"cannot be written: {error}; nothing was changed") from error
            time.sleep(0.02)


def _set_up(connection: Any, _: Any) -> None:
    """Configures a connection: explicit transactions, and commits that are on the disk when they return."""
    connection.isolation_level = None
    cursor = connection.cursor()
    cursor.execute(f"PRAGMA busy_timeout={_PATIENCE}")
    cursor.execute("PRAGMA synchronous=FULL")
    cursor.close()


def _begin(connection: Connection) -> None:
    """Begins a transaction; one that writes waits for other writers now, as it could not later."""
    writes = connection.get_execution_options().get(_WRITES, False)
    connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")
