"""Reader of ROS bags: joint states, and wrenches of a wrist sensor, as a table.

It needs rosbags (the extra [bags]), but no ROS. Messages are decoded with ROS's own definitions, because definitions
from the bag would become code that is executed.
"""

from array import array
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from affordance.arrays import Array
from affordance.exceptions import BadValueError
from affordance.extensions.payload.recording.bag_files import Storage, open_bag
from affordance.extensions.payload.recording.run import WRENCH_COLUMNS, resample
from affordance.extensions.payload.recording.run_table import RunTable

JOINT_STATES, WRENCHES = "sensor_msgs/msg/JointState", "geometry_msgs/msg/WrenchStamped"


def read_bag(path: Path, topic: str = "", wrench_topic: str = "", *, is_current: bool = False) -> RunTable:
    """Reads the joint states of a bag (a folder, or a .mcap, .db3 or .bag file), and wrenches at their times.

    Args:
        path: Bag.
        topic: Topic of the joint states; empty for the only one.
        wrench_topic: Topic of the wrenches; empty for none.
        is_current: True if the efforts are currents.

    Raises:
        BadValueError: The bag cannot be read or has no such topic, or rosbags is missing.
    """
    try:
        from rosbags.typesys import Stores, get_typestore
    except ImportError as error:
        problem = "is a ROS bag, which needs the extra [bags]: pip install '.[bags]' in a clone"
        raise BadValueError(path, "", problem) from error
    decoders = (
        get_typestore(Stores.ROS2_HUMBLE).deserialize_cdr,
        get_typestore(Stores.ROS1_NOETIC).deserialize_ros1,
    )

    def read(storages: list[Storage], topic: str, kind: str) -> Iterator[tuple[float, Any]]:
        """Reads the messages of a topic with their time stamps, [s]."""
        topic = _choose_topic(path, storages, topic, kind)
        is_empty = True
        for storage in storages:
            for received, content in storage.read(topic):
                is_empty = False
                message: Any = decoders[storage.is_ros1](content, kind)
                stamp = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec
                yield stamp if stamp > 0.0 else 1e-9 * received, message
        if is_empty:
            raise BadValueError(path, topic, "has no message")

    try:
        with open_bag(path) as storages:
            names, columns = _collect_states(path, read(storages, topic, JOINT_STATES), is_current=is_current)
            if wrench_topic:
                columns |= _collect_wrenches(columns["time"], read(storages, wrench_topic, WRENCHES))
    except (BadValueError, MemoryError):
        raise
    except Exception as error:  # the libraries raise any exception on a damaged bag
        raise BadValueError(path, "", f"cannot be read as a ROS bag: {error}") from error
    values = np.column_stack(list(columns.values()))
    return RunTable(tuple(columns), values, np.arange(1, len(values) + 1), joint_names=names)


def _choose_topic(path: Path, storages: list[Storage], topic: str, kind: str) -> str:
    """Returns the named topic if its messages are of a kind, or the only such topic if none is named."""
    of_kind = sorted({name for storage in storages for name, its_kind in storage.topics if its_kind == kind})
    if not topic and len(of_kind) == 1:
        return of_kind[0]
    if topic not in of_kind:
        what = f"is {topic!r}" if topic else "is not given"
        raise BadValueError(path, "topic", f"{what}, must be a topic of {kind}: {', '.join(of_kind) or 'none'}")
    return topic


def _collect_states(
    path: Path, states: Iterator[tuple[float, Any]], *, is_current: bool
) -> tuple[tuple[str, ...], dict[str, Array]]:
    """Collects the joint names, and the columns of times, positions, velocities and efforts that were sent.

    Messages may list the joints of the first message in another order.
    """
    fields = {"position": "q", "velocity": "v", "effort": "current" if is_current else "tau"}
    times, values = array("d"), {field: array("d") for field in fields}  # no messages in memory
    lacking: dict[str, BadValueError] = {}
    names: list[str] = []
    for number, (time, message) in enumerate(states, start=1):
        names = names if len(times) else list(message.name)
        times.append(time)
        is_same = set(message.name) == set(names)
        order = [list(message.name).index(name) for name in names] if is_same else []
        for field in fields:
            given = np.asarray(getattr(message, field), dtype=float)
            if len(given) == len(names) and is_same:
                values[field].frombytes(given[order].tobytes())
                continue
            has = f"has {len(given)} values of {', '.join(message.name)}"
            problem = f"{has}, must have one for each of {', '.join(names)}"
            error = BadValueError(path, f"message {number}, {field}", problem)
            if len(given):
                raise error
            lacking.setdefault(field, error)  # a sender may leave out a quantity, but only in all messages
    columns = {"time": np.array(times)}
    for field, ours in fields.items():
        if values[field] and field in lacking:
            raise lacking[field]
        if values[field]:
            table = np.array(values[field]).reshape(len(times), len(names))
            columns |= {f"{ours}_{i + 1}": column for i, column in enumerate(table.T)}
    return tuple(names), columns


def _collect_wrenches(times: Array, wrenches: Iterator[tuple[float, Any]]) -> dict[str, Array]:
    """Collects the columns of forces and torques, interpolated at the times of the joint states."""
    stamps, values = array("d"), array("d")
    for time, message in wrenches:
        stamps.append(time)
        values.extend(getattr(each, axis) for each in (message.wrench.force, message.wrench.torque) for axis in "xyz")
    table = np.array(values).reshape(len(stamps), len(WRENCH_COLUMNS))
    return dict(zip(WRENCH_COLUMNS, resample(times, np.array(stamps), table).T, strict=True))
