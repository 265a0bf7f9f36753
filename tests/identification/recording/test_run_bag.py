"""Bags of others: databases that calculate, and metadata that unfold, are refused before they are opened."""

import sqlite3

import pytest

from affordance.exceptions import BadValueError
from affordance.files import yaml_reader
from affordance.identification.recording.run_bag import read_bag

FOREVER = "CREATE VIEW schema AS WITH RECURSIVE a(x) AS (SELECT 1 UNION ALL SELECT x FROM a) SELECT x FROM a;"
TABLES = "CREATE TABLE topics(id, name, type); CREATE TABLE messages(id, topic_id, timestamp, data);"


@pytest.mark.parametrize(
    ("statements", "named"),
    [
        (TABLES + FOREVER, "schema"),
        (TABLES + "CREATE TRIGGER t AFTER INSERT ON topics BEGIN DELETE FROM topics; END;", "t"),
        (TABLES + "CREATE VIRTUAL TABLE v USING fts5(x);", "v"),
        ("CREATE TABLE topics(id, name, type AS (zeroblob(1000000000)));", "topics"),
    ],
)
def test_database_that_calculates_is_one_line(tmp_path, statements, named):
    path = tmp_path / "bag" / "bag.db3"
    path.parent.mkdir()
    with sqlite3.connect(path) as database:
        database.executescript(statements)
    database.close()
    with pytest.raises(BadValueError, match=f"bag.db3: calculates '{named}', must be a database of plain tables"):
        read_bag(path.parent)


def test_what_is_no_database_is_one_line(tmp_path):
    path = tmp_path / "bag.db3"
    path.write_bytes(b"SQLite format 3\0" + b"\xff" * 500)
    with pytest.raises(BadValueError, match=r"bag.db3: cannot be read as a ROS bag: ") as caught:
        read_bag(path)
    assert "\n" not in str(caught.value)


def test_metadata_is_bounded(tmp_path, monkeypatch):
    monkeypatch.setattr(yaml_reader, "_MOST_ENTRIES", 1000)
    (tmp_path / "metadata.yaml").write_text("a: &a [1, 2, 3, 4]\nb: [" + "*a, " * 300 + "]")
    with pytest.raises(BadValueError, match=r"metadata.yaml: line 2, .*: makes more than 1000 entries"):
        read_bag(tmp_path)


@pytest.mark.parametrize("suffix", [".mcap", ".bag"])
@pytest.mark.parametrize("content", [b"", b"\x89MCAP0\r\n\x01" + b"\xff" * 60, b"#ROSBAG V2.0\n" + b"\xff" * 60])
def test_what_is_no_bag_is_one_line(tmp_path, suffix, content):
    pytest.importorskip("rosbags")
    path = tmp_path / f"bag{suffix}"
    path.write_bytes(content)
    with pytest.raises(BadValueError, match=r"cannot be read as a ROS bag: ") as caught:
        read_bag(path)
    assert "\n" not in str(caught.value)
