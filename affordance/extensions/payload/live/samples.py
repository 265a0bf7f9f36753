"""Reads samples of a running robot from lines of text or from a recording."""

import json
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.exceptions import BadValueError, show_value
from affordance.extensions.payload.payload_setting import PayloadSetting
from affordance.extensions.payload.recording.run import Run
from affordance.extensions.payload.recording.run_entry import COLUMN_MAPS, name_columns

_MOST_FOREIGN = 1000  # number of messages about other joints after which the stream is rejected
_BETWEEN = 1.0  # time between successive recordings, [s]


class Sample(NamedTuple):
    """Joint state from a driver, in any order of joints and possibly with additional joints."""

    time: float  # time of measurement, [s]
    names: Sequence[str]
    q: Sequence[float] | Array  # [rad]
    v: Sequence[float] | Array | None  # [rad/s]
    signal: Sequence[float] | Array
    payload: PayloadSetting | None = None  # payload set on the controller, in the flange frame; None if unknown


class JointOrder:
    """Selects an arm's joints from messages by name."""

    def __init__(self, joints: Sequence[str]) -> None:
        """Stores the names in the arm's order."""
        self._joints, self._num_foreign = joints, 0
        self._foreign: tuple[str, ...] = ()  # names in the last message about other joints
        self._orders: dict[tuple[str, ...], list[int] | None] = {}

    def refuse(self) -> None:
        """Raises a BadValueError with the joints of the last message if it was about other joints."""
        if self._foreign:
            problem = f"are {', '.join(self._foreign)[:200]}, must include {', '.join(self._joints)}"
            raise BadValueError("the stream", "names", problem)

    def pick(self, sample: Sample) -> tuple[Array, Array | None, Array] | None:
        """Selects angles, velocities and signals, (n,) each. Returns None if the message is about other joints.

        Raises:
            BadValueError: Numbers are missing in the message, or too many successive messages are about other joints.
        """
        names = tuple(sample.names)
        if names not in self._orders:
            missing = [name for name in self._joints if name not in names]
            self._orders[names] = None if missing else [names.index(name) for name in self._joints]
        order = self._orders[names]
        if order is None:
            self._num_foreign, self._foreign = self._num_foreign + 1, names
            if self._num_foreign > _MOST_FOREIGN:
                self.refuse()
            return None
        self._num_foreign = 0

        def take(name: str, values: Sequence[float] | Array) -> Array:
            if len(values) != len(names):
                problem = f"has {len(values)} numbers, must have {len(names)}, one for each joint"
                raise BadValueError("the stream", name, problem)
            return np.asarray(values, dtype=float)[order]

        v = None if sample.v is None else take("velocity", sample.v)
        return take("position", sample.q), v, take("effort", sample.signal)


def read_lines(lines: Iterable[str], joints: Sequence[str]) -> Iterator[Sample]:
    """Reads joint states from lines of text.

    A line is a JSON object with the fields of a JointState (time or header, name, position, velocity, effort), or a
    row of a table with a header line. The columns of a table are those of a recording: time, q_1.., v_1.. and tau_1..
    or current_1.., or the names of a logger.

    Args:
        lines: Lines of text.
        joints: Names of the joints, in order, for tables and for messages without names.

    Raises:
        BadValueError: A line has neither format.
    """
    columns: dict[str, int] | None = None
    for number, line in enumerate(lines, start=1):
        text = line.strip()
        if not text:
            continue
        try:
            if text.startswith("{"):
                yield _read_message(json.loads(text), joints)
            elif columns is None:
                columns = _find_columns(text.split(","), len(joints))
            else:
                row = [float(cell) for cell in text.split(",")]
                yield _read_row(row, columns, joints)
        except (ValueError, KeyError, TypeError, IndexError) as error:
            problem = f"is {show_value(text[:60])}, must be a joint state as JSON, or a row of a table ({error})"
            raise BadValueError("the stream", f"line {number}", problem) from error


def _read_message(message: dict[str, Any], joints: Sequence[str]) -> Sample:
    if "time" in message:
        time = float(message["time"])
    elif "header" not in message:
        raise ValueError("time or header is missing")
    else:  # a JointState as rosbridge writes it
        stamp = message["header"]["stamp"]
        time = float(stamp.get("sec", stamp.get("secs"))) + 1e-9 * float(stamp.get("nanosec", stamp.get("nsecs", 0)))
    v = message.get("velocity") or None
    return Sample(time, message.get("name") or joints, message["position"], v, message["effort"])


def _find_columns(names: Sequence[str], num: int) -> dict[str, int]:
    """Finds the columns in a header line, by standard names or a logger's names."""
    for columns in COLUMN_MAPS.values():
        ours = name_columns(names, columns)
        found = {name: place for place, name in reversed(list(enumerate(ours))) if name is not None}
        signal = "tau" if "tau_1" in found else "current"
        if columns.time_unit == 1.0 and {"time", *(f"{x}_{num}" for x in ("q", signal))} <= found.keys():
            return found
    raise ValueError("columns time, q_1.., and tau_1.. or current_1.. are missing")


def _read_row(row: Sequence[float], columns: dict[str, int], joints: Sequence[str]) -> Sample:
    def take(name: str) -> list[float]:
        return [row[columns[f"{name}_{i + 1}"]] for i in range(len(joints))]

    signal = take("tau" if "tau_1" in columns else "current")
    return Sample(row[columns["time"]], joints, take("q"), take("v") if "v_1" in columns else None, signal)


def replay(runs: Sequence[Run]) -> Iterator[Sample]:
    """Replays recordings one after another, with pauses of one second."""
    start = 0.0
    for run in runs:
        for i, t in enumerate(run.times - run.times[0]):
            v = None if run.v is None else run.v[i]
            yield Sample(start + float(t), run.description.joint_names, run.q[i], v, run.signal[i])
        start += float(run.times[-1] - run.times[0]) + _BETWEEN
