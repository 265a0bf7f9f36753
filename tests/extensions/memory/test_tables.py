"""Files of strangers that are no plain memories: refused before anything in them is calculated or read at length."""

import sqlite3
from contextlib import closing

import pytest
from helpers.refusals import refuse
from helpers.trials import hold_workshop

from affordance.extensions.memory import tables
from affordance.extensions.memory.ledger import has_memory, open_memory

# What SQLite would calculate for each row, with any amount of memory.
SLOW = "length(hex(zeroblob(1000 + length(id))))"
COLUMNS = "id, time, robot, fingerprint, object, digest, content"


@pytest.fixture
def place(tmp_path):
    with open_memory(tmp_path / "memory.sqlite") as ledger:
        ledger.append(hold_workshop(9))
    return tmp_path / "memory.sqlite"


def _execute(place, script):
    with closing(sqlite3.connect(place, autocommit=True)) as connection:
        connection.setconfig(sqlite3.SQLITE_DBCONFIG_DEFENSIVE, False)
        connection.executescript(script)


def _replace_table(changed):
    """Script that replaces the table of trials by one with another definition, filled with the same rows."""
    return f"CREATE TABLE x {changed}; DROP INDEX by_time; DROP TABLE trials; ALTER TABLE x RENAME TO trials;"


@pytest.mark.parametrize(
    ("script", "named"),
    [
        (f"CREATE INDEX evil ON trials ({SLOW})", "index evil"),
        (f"CREATE INDEX evil ON trials (id) WHERE {SLOW} > 0", "index evil"),
        (f"DROP INDEX by_time; CREATE INDEX by_time ON trials ({SLOW})", "index by_time"),
        ("DROP INDEX by_time; CREATE INDEX by_time ON trials (time COLLATE nocase, id)", "index by_time"),
        ("DROP INDEX by_time; CREATE UNIQUE INDEX by_time ON trials (time, id)", "index by_time"),
        ("DROP INDEX by_time", "index by_time"),
        (f"CREATE TRIGGER evil AFTER DELETE ON trials BEGIN SELECT {SLOW} FROM trials; END", "trigger evil"),
        (f"CREATE VIEW evil AS SELECT {SLOW} FROM trials", "view evil"),
        ("CREATE VIRTUAL TABLE evil USING fts5(x)", "table evil"),
        (f"ALTER TABLE trials ADD COLUMN evil AS ({SLOW})", "table trials"),
        (f"ALTER TABLE trials ADD COLUMN evil CHECK ({SLOW} > 0)", "table trials"),
        ("ALTER TABLE trials ADD COLUMN evil DEFAULT 1", "table trials"),
        ("CREATE TABLE notes (x INT)", "table notes"),
        (_replace_table(f"AS SELECT {COLUMNS} FROM trials"), "index by_time"),
        (f"CREATE TABLE x AS SELECT * FROM about; DROP TABLE about; CREATE VIEW about AS SELECT {SLOW} FROM x", ""),
        ("ANALYZE", "table sqlite_stat1"),
    ],
)
def test_what_is_not_as_the_program_writes_it_is_refused_and_not_calculated(place, script, named, monkeypatch):
    _execute(place, script)
    before = place.read_bytes()
    message = (
        f"{named}: differs from what this program writes, must be as in a memory that a command has written"
        if named
        else "of another program"
    )
    assert message in refuse(open_memory, place)
    assert place.read_bytes() == before


def test_definitions_with_other_line_breaks_are_the_same(place):
    _execute(place, "PRAGMA writable_schema=ON; UPDATE sqlite_schema SET sql = replace(sql, ', ', ',\n\t')")
    with open_memory(place) as ledger:
        assert len(ledger) == 9


def test_a_file_of_many_tables_is_refused_before_they_are_read(place):
    _execute(place, ";".join(f"CREATE TABLE t{i} (x)" for i in range(200)))
    assert "has more than 24 tables and indices, must be a memory" in refuse(open_memory, place)
    assert "has more than 24 tables and indices, must be a memory" in refuse(has_memory, place)


def test_pages_that_are_used_twice_are_refused(place):
    """Ten levels of a hundred references to one page each hold as many rows as no reading would end with."""
    with open_memory(place) as ledger:
        ledger.append(hold_workshop(200))
        (root,) = ledger._connection.execute("SELECT rootpage FROM sqlite_schema WHERE name = 'trials'").fetchone()
        (number,) = ledger._connection.execute("PRAGMA page_count").fetchone()
    content = bytearray(place.read_bytes())
    start = (root - 1) * 4096
    leaf = int.from_bytes(content[start + 8 : start + 12])
    for level in range(10):
        child = leaf if level == 0 else number + level
        cells = [child.to_bytes(4) + bytes([1 + i]) for i in range(100)]
        body = b"".join(cells).rjust(4096 - 12 - 200, b"\0")
        begin = 4096 - 5 * len(cells)
        places = b"".join((begin + 5 * i).to_bytes(2) for i in range(len(cells)))
        content += b"\5\0\0" + len(cells).to_bytes(2) + begin.to_bytes(2) + b"\0" + child.to_bytes(4) + places + body
    content[start : start + 4096] = content[-4096:]
    content[28:32] = (number + 10).to_bytes(4)
    content[18:20] = b"\1\1"
    place.write_bytes(content)
    assert "is damaged: " in refuse(open_memory, place)


def test_a_trial_that_is_stored_twice_is_refused(place):
    """The index by time is one of a table that holds each row twice; its pages are well used."""
    _execute(
        place,
        """CREATE TABLE x AS SELECT * FROM trials UNION ALL SELECT * FROM trials;
        CREATE INDEX y ON x (time, id);
        CREATE TEMP TABLE roots AS SELECT name AS other, rootpage AS root FROM sqlite_schema;
        UPDATE roots SET other = CASE other WHEN 'x' THEN 'trials' WHEN 'trials' THEN 'x' WHEN 'y' THEN 'by_time'
            WHEN 'by_time' THEN 'y' ELSE other END;
        PRAGMA writable_schema=ON;
        UPDATE sqlite_schema SET rootpage = (SELECT root FROM roots WHERE other = name);""",
    )
    _execute(place, "DROP TABLE x")
    with open_memory(place) as ledger:
        assert "is stored twice or out of order: the file is damaged" in refuse(ledger.recall)
        assert any("is damaged" in fault for fault in ledger.verify())


@pytest.mark.parametrize(
    ("script", "message"),
    [
        (
            "UPDATE trials SET content = cast(content AS BLOB)",
            "has a column that is not text, must be written by this program",
        ),
        ("UPDATE trials SET id = 7 || id WHERE rowid = 3", "column id is '7"),
        ("UPDATE trials SET time = x'00'", "has a column that is not text"),
        ("UPDATE trials SET robot = cast(x'ff' AS TEXT)", "Could not decode to UTF-8"),
        ("UPDATE trials SET content = hex(zeroblob(500500))", "has a record of more than 1 MB, must be smaller"),
        ("UPDATE trials SET content = hex(zeroblob(600000))", "cannot be read: string or blob too big"),
        ("UPDATE about SET value = zeroblob(1000) WHERE name = 'schema'", "must be '3': another version"),
        ("UPDATE about SET value = 7 WHERE name = 'program'", "is a database of another program"),
    ],
)
def test_rows_of_other_kinds_and_sizes_are_refused(place, script, message):
    _execute(place, script)

    def read():
        with open_memory(place) as ledger:
            ledger.recall()

    assert message in refuse(read)


def test_a_file_that_is_too_large_is_refused_and_none_is_written(place, monkeypatch):
    monkeypatch.setattr(tables, "LARGEST_FILE", 40_000)
    message = r"memory.sqlite: has 0.0\d+ MB, must have at most 0.04 MB"
    with pytest.raises(tables.BadValueError, match=message):
        open_memory(place)
