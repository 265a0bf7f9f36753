"""ROS 2 bags (sqlite and MCAP), without ROS: joint states, and wrenches of a wrist sensor.

Wants the extra [bags], rosbags.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.exceptions import BadValueError
from affordance.identification.run import WRENCH_COLUMNS

JOINT_STATES, WRENCHES = "sensor_msgs/msg/JointState", "geometry_msgs/msg/WrenchStamped"


class BagTable(NamedTuple):
    """Joint states of a bag.

    Attributes:
        joint_names: Of the first message.
        columns: Our names of columns.
        values: Shape (N, len(columns)).
    """

    joint_names: tuple[str, ...]
    columns: tuple[str, ...]
    values: Array


def read_bag(path: Path, topic: str = "", wrench_topic: str = "") -> BagTable:
    """Reads the joint states of a bag, and wrenches at their times.

    Args:
        path: The bag's folder, or its .mcap or .db3 file.
        topic: Of joint states; empty for the only one there is.
        wrench_topic: Of wrenches; empty for none.

    Raises:
        BadValueError: rosbags is not installed, the bag cannot be read, or has no such topic.
    """
    try:
        from rosbags.highlevel import AnyReader, AnyReaderError
        from rosbags.typesys import Stores, get_typestore
    except ImportError as error:
        problem = "is a ROS bag, which wants the extra [bags]: pip install '.[bags]' in a clone"
        raise BadValueError(path, "", problem) from error
    try:
        with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
            states = _read_topic(reader, path, topic, JOINT_STATES)
            wrenches = _read_topic(reader, path, wrench_topic, WRENCHES) if wrench_topic else []
    except (AnyReaderError, OSError, AssertionError) as error:
        raise BadValueError(path, "", f"cannot be read as a ROS bag: {error}") from error
    names = tuple(states[0][1].name)
    columns, parts = ["time"], [np.array([time for time, _ in states])[:, None]]
    for ours, theirs in (("q", "position"), ("v", "velocity"), ("tau", "effort")):
        arrays = [np.asarray(getattr(message, theirs)) for _, message in states]
        if all(len(array) == 0 for array in arrays):
            continue  # a message may leave out what its sender does not know
        parts.append(_arrange(path, theirs, names, states, arrays))
        columns += [f"{ours}_{i + 1}" for i in range(len(names))]
    if wrenches:
        parts.append(_interpolate(parts[0][:, 0], wrenches))
        columns += WRENCH_COLUMNS
    return BagTable(names, tuple(columns), np.hstack(parts))


def _read_topic(reader: Any, path: Path, topic: str, kind: str) -> list[tuple[float, Any]]:
    """Messages of a topic with their stamps, [s]."""
    of_kind = sorted({connection.topic for connection in reader.connections if connection.msgtype == kind})
    if not topic and len(of_kind) == 1:
        topic = of_kind[0]
    if topic not in of_kind:
        what = f"is {topic!r}" if topic else "is not given"
        raise BadValueError(path, "topic", f"{what}, must be one of the bag's {kind}: {', '.join(of_kind) or 'none'}")
    connections = [connection for connection in reader.connections if connection.topic == topic]
    messages = []
    for connection, received, raw in reader.messages(connections=connections):
        message = reader.deserialize(raw, connection.msgtype)
        stamp = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec
        messages.append((stamp if stamp > 0.0 else 1e-9 * received, message))
    if not messages:
        raise BadValueError(path, topic, "holds no message")
    return messages


def _arrange(
    path: Path, field: str, names: Sequence[str], states: list[tuple[float, Any]], arrays: list[Array]
) -> Array:
    """Values in the order of the first message's names; later ones may list their joints otherwise."""
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
    values = np.array(
        [
            [w.force.x, w.force.y, w.force.z, w.torque.x, w.torque.y, w.torque.z]
            for w in (message.wrench for _, message in wrenches)
        ]
    )
    return np.column_stack([np.interp(times, stamps, column) for column in values.T])
