"""Reader of ROS bags (ROS 2: sqlite and MCAP) without ROS: joint states, and wrenches of a wrist sensor.

It needs the extra [bags], rosbags. Messages are decoded by ROS's own definitions, as definitions from the bag would
become code that is run.
"""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from affordance.arrays import Array
from affordance.exceptions import BadValueError
from affordance.files.bounded import RECORDING, check_size, check_yaml
from affordance.files.plain_database import check_plain_tables
from affordance.identification.recording.run import WRENCH_COLUMNS, resample
from affordance.identification.recording.run_table import RunTable

type _Decode = Callable[[bytes, str], Any]
JOINT_STATES, WRENCHES = "sensor_msgs/msg/JointState", "geometry_msgs/msg/WrenchStamped"


def read_bag(path: Path, topic: str = "", wrench_topic: str = "", *, is_current: bool = False) -> RunTable:
    """Reads the joint states of a bag, a folder or a .mcap, .db3 or .bag file, and wrenches at their times.

    An empty topic is the only one of joint states, or no wrenches; efforts may be currents. A bag that cannot be read
    or has no such topic raises a BadValueError, and so does a missing rosbags.
    """
    _check_files(path)
    try:
        from rosbags import rosbag1, rosbag2
        from rosbags.typesys import Stores, get_typestore
    except ImportError as error:
        problem = "is a ROS bag, which wants the extra [bags]: pip install '.[bags]' in a clone"
        raise BadValueError(path, "", problem) from error
    is_old = path.suffix == ".bag"
    store = get_typestore(Stores.ROS1_NOETIC if is_old else Stores.ROS2_HUMBLE)
    decode = store.deserialize_ros1 if is_old else store.deserialize_cdr
    try:
        with rosbag1.Reader(path) if is_old else rosbag2.Reader(path) as reader:
            states = _read_topic(reader, decode, path, topic, JOINT_STATES)
            wrenches = _read_topic(reader, decode, path, wrench_topic, WRENCHES) if wrench_topic else []
    except BadValueError:
        raise
    except Exception as error:  # the library raises any exception on a damaged bag
        raise BadValueError(path, "", f"cannot be read as a ROS bag: {error}") from error
    names = tuple(states[0][1].name)
    columns, parts = ["time"], [np.array([time for time, _ in states])[:, None]]
    for ours, theirs in (("q", "position"), ("v", "velocity"), ("current" if is_current else "tau", "effort")):
        arrays = [np.asarray(getattr(message, theirs)) for _, message in states]
        if all(len(array) == 0 for array in arrays):
            continue  # a message may leave out what its sender does not know
        parts.append(_arrange(path, theirs, names, states, arrays))
        columns += [f"{ours}_{i + 1}" for i in range(len(names))]
    if wrenches:
        parts.append(_interpolate(parts[0][:, 0], wrenches))
        columns += WRENCH_COLUMNS
    values = np.hstack(parts)
    return RunTable(tuple(columns), values, np.arange(1, len(values) + 1), joint_names=names)


def _check_files(path: Path) -> None:
    """Raises a BadValueError for a bag with a file that is too large, or a database that may run code."""
    files = sorted(path.iterdir()) if path.is_dir() else [path]
    for file in files:
        check_size(file, RECORDING)
        if file.name == "metadata.yaml":
            check_yaml(file)
        if file.suffix == ".db3":
            check_plain_tables(file, "ROS bag", is_immutable=True)


def _read_topic(reader: Any, decode: _Decode, path: Path, topic: str, kind: str) -> list[tuple[float, Any]]:
    """Reads the messages of a topic with their time stamps, [s]."""
    of_kind = sorted({connection.topic for connection in reader.connections if connection.msgtype == kind})
    if not topic and len(of_kind) == 1:
        topic = of_kind[0]
    if topic not in of_kind:
        what = f"is {topic!r}" if topic else "is not given"
        raise BadValueError(path, "topic", f"{what}, must be one of the bag's {kind}: {', '.join(of_kind) or 'none'}")
    connections = [connection for connection in reader.connections if connection.topic == topic]
    messages = []
    for connection, received, raw in reader.messages(connections=connections):
        message = decode(raw, connection.msgtype)
        stamp = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec
        messages.append((stamp if stamp > 0.0 else 1e-9 * received, message))
    if not messages:
        raise BadValueError(path, topic, "holds no message")
    return messages


def _arrange(
    path: Path, field: str, names: Sequence[str], states: list[tuple[float, Any]], arrays: list[Array]
) -> Array:
    """Arranges values in the order of the first message's names, from which later messages may differ."""
    rows = []
    for number, ((_, message), array) in enumerate(zip(states, arrays, strict=True), start=1):
        if len(array) != len(names) or set(message.name) != set(names):
            problem = (
                f"has {len(array)} values of {', '.join(message.name)}, must have one for each of {', '.join(names)}"
            )
            raise BadValueError(path, f"message {number}, {field}", problem)
        order = [list(message.name).index(name) for name in names]
        rows.append(array[order])
    return np.array(rows, dtype=float)


def _interpolate(times: Array, wrenches: list[tuple[float, Any]]) -> Array:
    stamps = np.array([time for time, _ in wrenches])
    both = [(message.wrench.force, message.wrench.torque) for _, message in wrenches]
    return resample(times, stamps, np.array([[getattr(each, axis) for each in w for axis in "xyz"] for w in both]))
