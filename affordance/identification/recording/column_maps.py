"""Column names of loggers, mapped to time, q_1.., v_1.., vdot_1.., tau_1.., current_1.., fx..tz.

A map is a set of patterns, whose group in parentheses is the joint's number, counted from ``first``.
"""

import re
from collections.abc import Sequence
from typing import NamedTuple


class ColumnMap(NamedTuple):
    """Column names of one logger.

    Attributes:
        patterns: Regular expression of the logger's names, by our name of the column; a group is the joint's number.
        first: Number of the first joint.
        time_unit: Logger's unit of time, [s].
    """

    patterns: dict[str, str]
    first: int
    time_unit: float


_WRENCH = {name: name for name in ("fx", "fy", "fz", "tx", "ty", "tz")}
COLUMN_MAPS = {
    "standard": ColumnMap(
        {
            "time": "time",
            "q": r"q_(\d+)",
            "v": r"v_(\d+)",
            "vdot": r"vdot_(\d+)",
            "tau": r"tau_(\d+)",
            "current": r"current_(\d+)",
            **_WRENCH,
        },
        1,
        1.0,
    ),
    # franka::logToCSV of any version; tau_J is the torque of the link-side sensors, without any compensation.
    "libfranka": ColumnMap(
        {
            "time": r"time|duration",
            "q": r"(?:state\.)?q\[(\d+)\]",
            "v": r"(?:state\.)?dq\[(\d+)\]",
            "tau": r"(?:state\.)?tau_J\[(\d+)\]",
        },
        0,
        1e-3,
    ),
    # The record script of Universal Robots' RTDE client; targets are not measurements and are ignored.
    "ur_rtde": ColumnMap(
        {
            "time": "timestamp",
            "q": r"actual_q_(\d+)",
            "v": r"actual_qd_(\d+)",
            "current": r"actual_current_(\d+)",
        },
        0,
        1.0,
    ),
}


def name_columns(names: Sequence[str], column_map: ColumnMap) -> list[str | None]:
    """Returns our name of each column of a table, such as q_1; None for columns that are not used."""
    ours: list[str | None] = []
    for name in names:
        found = None
        for kind, pattern in column_map.patterns.items():
            match = re.fullmatch(pattern, name.strip())
            if match and match.groups():
                found = f"{kind}_{int(match.group(1)) - column_map.first + 1}"
            elif match:
                found = kind
            if match:
                break
        ours.append(found)
    return ours
