"""Bags of strangers: databases that calculate, and metadata that unfold, are refused before they are opened."""

import sqlite3
import sys

import numpy as np
import pytest
from helpers.refusals import refuse

from affordance.exceptions import BadValueError
from affordance.extensions.payload.recording.run_bag import JOINT_STATES, read_bag
from affordance.files import bounded

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
    path = tmp_path / "bag.db3"
    with sqlite3.connect(path) as database:
        database.executescript(statements)
    database.close()
    assert f"bag.db3: calculates '{named}', must be a database of plain tables" in refuse(read_bag, path)


def test_what_is_no_database_is_one_line(tmp_path):
    path = tmp_path / "bag.db3"
    path.write_bytes(b"SQLite format 3\0" + b"\xff" * 500)
    assert "bag.db3: cannot be read as a ROS bag: " in refuse(read_bag, path)


def test_metadata_is_bounded(tmp_path, monkeypatch):
    monkeypatch.setattr(bounded, "_MOST_ENTRIES", 1000)
    (tmp_path / "metadata.yaml").write_text("a: &a [1, 2, 3, 4]\nb: [" + "*a, " * 300 + "]")
    with pytest.raises(BadValueError, match=r"metadata.yaml: line 2, .*: expands to more than 1000 entries"):
        read_bag(tmp_path)


@pytest.mark.parametrize("suffix", [".mcap", ".bag"])
@pytest.mark.parametrize("content", [b"", b"\x89MCAP0\r\n\x01" + b"\xff" * 60, b"#ROSBAG V2.0\n" + b"\xff" * 60])
def test_what_is_no_bag_is_one_line(tmp_path, suffix, content):
    pytest.importorskip("rosbags")
    path = tmp_path / f"bag{suffix}"
    path.write_bytes(content)
    assert "cannot be read as a ROS bag: " in refuse(read_bag, path)


def test_without_the_library_a_bag_names_the_extra(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "rosbags", None)
    monkeypatch.setitem(sys.modules, "rosbags.typesys", None)  # which another test may have imported
    (tmp_path / "bag").mkdir()
    assert "is a ROS bag, which needs the extra [bags]" in refuse(read_bag, tmp_path / "bag")


def test_a_message_of_other_joints_is_named(tmp_path):
    rosbag2 = pytest.importorskip("rosbags.rosbag2")
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    JointState, Header, Time = (
        store.types[name] for name in (JOINT_STATES, "std_msgs/msg/Header", "builtin_interfaces/msg/Time")
    )
    path, none = tmp_path / "bag", np.array([])
    with rosbag2.Writer(path, version=9) as writer:
        states = writer.add_connection("/joint_states", JOINT_STATES, typestore=store)
        writer.add_connection("/silent", JOINT_STATES, typestore=store)
        for second, name in enumerate(("a", "b"), start=1):
            message = JointState(Header(Time(second, 0), ""), [name], np.zeros(1), none, none)
            writer.write(states, second * 10**9, store.serialize_cdr(message, JOINT_STATES))
    with pytest.raises(BadValueError, match="message 2, position: has 1 values of b, must have one for each of a"):
        read_bag(path, "/joint_states")
    assert "/silent: has no message" in refuse(read_bag, path, "/silent")
