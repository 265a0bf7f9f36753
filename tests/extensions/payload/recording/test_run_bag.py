"""ROS bags: those of ROS 1, packed ones and parts are read, and what is no bag is refused in one line."""

import sys

import numpy as np
import pytest
from helpers.refusals import refuse

from affordance.exceptions import BadValueError
from affordance.extensions.payload.recording.run_bag import JOINT_STATES, read_bag
from affordance.files import bounded

pytest.importorskip("rosbags")
from rosbags import rosbag1, rosbag2
from rosbags.typesys import Stores, get_typestore

SECONDS = (1, 2, 3)


def encode(second, padding=0, store=Stores.ROS2_HUMBLE):
    """A joint's state, encoded, with so many letters in the name of its frame."""
    types = get_typestore(store)
    State, Header, Time = (
        types.types[name] for name in (JOINT_STATES, "std_msgs/msg/Header", "builtin_interfaces/msg/Time")
    )
    frame = "x" * padding
    head = Header(0, Time(second, 0), frame) if store is Stores.ROS1_NOETIC else Header(Time(second, 0), frame)
    message = State(head, ["a"], np.array([0.1 * second]), np.array([]), np.array([]))
    serialize = types.serialize_ros1 if store is Stores.ROS1_NOETIC else types.serialize_cdr
    return bytes(serialize(message, JOINT_STATES))


def write_bag(path, messages, mode=None, plugin=rosbag2.StoragePlugin.MCAP):
    writer = rosbag2.Writer(path, version=9, storage_plugin=plugin)
    if mode is not None:
        writer.set_compression(mode, rosbag2.CompressionFormat.ZSTD)
    with writer:
        states = writer.add_connection("/j", JOINT_STATES, typestore=get_typestore(Stores.ROS2_HUMBLE))
        for second, message in enumerate(messages, start=1):
            writer.write(states, second * 10**9, message)
    return path


def check_states(path):
    """Asserts that the three states are read."""
    table = read_bag(path)
    assert (list(table.columns), table.attrs["joints"]) == (["time", "q_1"], ("a",))
    np.testing.assert_allclose(table, [[second, 0.1 * second] for second in SECONDS])


@pytest.mark.parametrize("plugin", list(rosbag2.StoragePlugin))
@pytest.mark.parametrize("mode", [None, *list(rosbag2.CompressionMode)[1:]])
def test_packed_bags_are_read(tmp_path, mode, plugin):
    if mode is rosbag2.CompressionMode.STORAGE and plugin is rosbag2.StoragePlugin.SQLITE3:
        return  # only MCAP packs its storage
    check_states(write_bag(tmp_path / "bag", map(encode, SECONDS), mode, plugin))


def test_a_file_of_a_bag_is_read_alone(tmp_path):
    check_states(write_bag(tmp_path / "bag", map(encode, SECONDS)) / "bag.mcap")


@pytest.mark.parametrize("compression", [None, *rosbag1.Writer.CompressionFormat])
def test_bags_of_ros_1_are_read(tmp_path, compression):
    writer = rosbag1.Writer(tmp_path / "bag.bag")
    if compression is not None:
        writer.set_compression(compression)
    with writer:
        states = writer.add_connection("/j", JOINT_STATES, typestore=get_typestore(Stores.ROS1_NOETIC))
        for second in SECONDS:
            writer.write(states, second * 10**9, encode(second, store=Stores.ROS1_NOETIC))
    check_states(tmp_path / "bag.bag")


def test_messages_that_unpack_beyond_the_bound_are_refused(tmp_path, monkeypatch):
    path = write_bag(tmp_path / "bag", [encode(i, 500_000) for i in SECONDS], rosbag2.CompressionMode.STORAGE)
    monkeypatch.setattr(bounded, "RECORDING", 1_000_000)
    assert "bag: unpacks to 1 MB, must be at most 1 MB" in refuse(read_bag, path)


@pytest.mark.parametrize("suffix", [".mcap", ".bag", ".db3"])
@pytest.mark.parametrize("content", [b"", b"\x89MCAP0\r\n\x01" + b"\xff" * 60, b"#ROSBAG V2.0\n" + b"\xff" * 60])
def test_what_is_no_bag_is_one_line(tmp_path, suffix, content):
    path = tmp_path / f"bag{suffix}"
    path.write_bytes(content)
    assert "cannot be read as a ROS bag: " in refuse(read_bag, path)


def test_without_the_library_a_bag_names_the_extra(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "rosbags", None)
    monkeypatch.setitem(sys.modules, "rosbags.typesys", None)  # which another test may have imported
    (tmp_path / "bag").mkdir()
    assert "is a ROS bag, which needs the extra [bags]" in refuse(read_bag, tmp_path / "bag")


def test_a_message_of_other_joints_is_named(tmp_path):
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
