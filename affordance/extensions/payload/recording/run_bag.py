"""Reads joint states and wrist wrenches from ROS bags.

Reading needs rosbags (the extra [bags]), but no ROS. Messages are decoded with ROS's standard definitions, because
definitions from the bag would be executed as code.
"""

import importlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from affordance.arrays import Array
from affordance.exceptions import BadValueError
from affordance.extensions.payload.recording.run import WRENCH_COLUMNS, resample
from affordance.extensions.payload.recording.run_table import build_frame, check_unpacked
from affordance.files import bounded

JOINT_STATES, WRENCHES = "sensor_msgs/msg/JointState", "geometry_msgs/msg/WrenchStamped"

# Reads the messages with a given topic and type, with their time stamps, [s]. An empty topic means the only one.
type _Read = Callable[[str, str], Iterator[tuple[float, Any]]]


def read_bag(path: Path, topic: str = "", wrench_topic: str = "", *, is_current: bool = False) -> pd.DataFrame:
    """Reads joint states and simultaneous wrenches from a bag.

    Args:
        path: Bag: a folder, or a .mcap, .db3 or .bag file.
        topic: Topic of the joint states; empty if there is only one.
        wrench_topic: Topic of the wrenches; empty to read none.
        is_current: True if the efforts are currents.

    Returns: The table, with the names of the joints in ``attrs["joints"]``.

    Raises:
        BadValueError: The bag cannot be read or has no such topic, or rosbags is missing.
    """
    is_ros1 = path.suffix == ".bag"
    try:
        types = importlib.import_module("rosbags.typesys")
        reader = importlib.import_module("rosbags.rosbag1" if is_ros1 else "rosbags.rosbag2").Reader
    except ImportError as error:
        problem = "is a ROS bag, which needs the extra [bags]: pip install '.[bags]' in a clone"
        raise BadValueError(path, "", problem) from error
    for file in path.iterdir() if path.is_dir() else [path]:
        bounded.check_size(file, bounded.RECORDING)
    if is_ros1:
        decode = types.get_typestore(types.Stores.ROS1_NOETIC).deserialize_ros1
    else:
        decode = types.get_typestore(types.Stores.ROS2_HUMBLE).deserialize_cdr
    try:
        with reader(path) as bag:

            def read(topic: str, kind: str) -> Iterator[tuple[float, Any]]:
                topic = _choose_topic(path, bag.connections, topic, kind)
                size = 0
                for _, received, content in bag.messages([each for each in bag.connections if each.topic == topic]):
                    size += len(content)
                    check_unpacked(path, size)
                    message = decode(content, kind)
                    stamp = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec
                    yield stamp if stamp > 0.0 else 1e-9 * received, message
                if not size:
                    raise BadValueError(path, topic, "has no message")

            return _collect(path, read, topic, wrench_topic, is_current=is_current)
    except BadValueError:
        raise
    except Exception as error:  # the library raises any exception on a damaged bag
        raise BadValueError(path, "", f"cannot be read as a ROS bag: {error}") from error


def _choose_topic(path: Path, connections: Any, topic: str, kind: str) -> str:
    """Returns the named topic, or the only topic with the given message type."""
    of_kind: list[str] = sorted({each.topic for each in connections if each.msgtype == kind})
    if not topic and len(of_kind) == 1:
        return of_kind[0]
    if topic not in of_kind:
        what = f"is {topic!r}" if topic else "is not given"
        raise BadValueError(path, "topic", f"{what}, must be a topic of {kind}: {', '.join(of_kind) or 'none'}")
    return topic


def _collect(path: Path, read: _Read, topic: str, wrench_topic: str, *, is_current: bool) -> pd.DataFrame:
    """Collects times, positions, velocities and efforts, and wrenches interpolated at these times.

    Later messages may list the joints in another order than the first message.
    """
    fields = {"position": "q", "velocity": "v", "effort": "current" if is_current else "tau"}
    times: list[float] = []
    values: dict[str, list[Array]] = {field: [] for field in fields}
    names: list[str] = []
    for time, message in read(topic, JOINT_STATES):
        names = names or list(message.name)
        times.append(time)
        for field, rows in values.items():
            given = np.asarray(getattr(message, field), dtype=float)
            is_whole = set(message.name) == set(names) and len(given) == len(names) and len(rows) == len(times) - 1
            if is_whole:
                rows.append(given[[list(message.name).index(name) for name in names]])
            elif len(given) or rows:  # a quantity may be missing, but only from all messages
                problem = f"has {len(given)} values of {', '.join(message.name)}, must have one for each of"
                raise BadValueError(path, f"message {len(times)}, {field}", f"{problem} {', '.join(names)}")
    columns = {"time": np.array(times)}
    for field, ours in fields.items():
        columns |= {f"{ours}_{i + 1}": column for i, column in enumerate(np.array(values[field]).T)}
    if wrench_topic:
        stamps, wrenches = [], []
        for time, message in read(wrench_topic, WRENCHES):
            stamps.append(time)
            both = message.wrench.force, message.wrench.torque
            wrenches.append([getattr(each, axis) for each in both for axis in "xyz"])
        found = resample(columns["time"], np.array(stamps), np.array(wrenches))
        columns |= dict(zip(WRENCH_COLUMNS, found.T, strict=True))
    frame = build_frame(columns)
    frame.attrs["joints"] = tuple(names)
    return frame
