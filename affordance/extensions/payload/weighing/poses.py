"""Reads poses of a force-torque sensor from a table: orientations and wrenches at rest.

Frames: B is the base, in which the direction of gravity is known; S is the sensor.
"""

import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from affordance.arrays import Array, Mask
from affordance.exceptions import BadValueError, describe_choice
from affordance.files.constraints import StrPath, check_path
from affordance.files.text_table import TextTable, read_table

WRENCH = ("fx", "fy", "fz", "tx", "ty", "tz")
# Forms of the sensor's orientation and their columns: the orientation of S in B, or a direction in S.
FORMS: Mapping[str, tuple[str, ...]] = {
    "quaternion": ("qw", "qx", "qy", "qz"),
    "matrix": tuple(f"r{i}{j}" for i in (1, 2, 3) for j in (1, 2, 3)),
    "rpy": ("roll", "pitch", "yaw"),
    "rotation_vector": ("rx", "ry", "rz"),
    "gravity": ("gx", "gy", "gz"),
    "accelerometer": ("ax", "ay", "az"),
}
# Other meanings of three angles, with the axes in SciPy's letters.
_BASE, _TURNED = "the base's axes x, then y, then z", "the turned axes of the sensor"
_MISTAKEN: Mapping[str, Mapping[str, str]] = {
    "rpy": {f"roll, pitch, yaw seem to be about {_TURNED}, not about the base's": "XYZ"},
    "rotation_vector": {
        f"rx, ry, rz seem to be angles about {_BASE}, and no rotation vector: name them roll, pitch, yaw": "xyz",
        f"rx, ry, rz seem to be angles about {_TURNED}, and no rotation vector": "XYZ",
    },
}
# Units other than N and N m in a column's name.
_FOREIGN_UNIT = re.compile(r"[\[(]\s*((?:kg|kp|gf|lb|oz|[km]n|n\W?[cm]m)[^\])]*)", re.IGNORECASE)
FEWEST = 4  # three poses determine mass, centre of mass and offsets; a fourth reveals errors
# Names that ROS programs write, as in "wrench.force.x", and the letter of our column name.
_LONG = {"force": "f", "torque": "t", "orientation": "q", "quaternion": "q", "linear_acceleration": "a"}
_LONG_NAME = re.compile(rf"(?:.*[./_])?({'|'.join(_LONG)})[./_]([wxyz])")
# Names that Universal Robots' recorder (RTDE) writes: force and torque at the TCP, and its pose as a rotation vector.
_RTDE = {f"actual_tcp_force_{i}": name for i, name in enumerate(WRENCH)}
_RTDE |= {f"actual_tcp_pose_{i}": name for i, name in enumerate(FORMS["rotation_vector"], start=3)}
_SAME_POSE = np.radians(2.0)  # largest angle between rows of one pose, [rad]
# If the longest stay has at least this many rows, shorter stays are poses only with at least this share of its rows.
_LEAST_SHARE, _MANY = 0.2, 5
_ROUNDING = 0.02  # largest error in the norm of a quaternion or of a matrix's columns, [1]


class Poses(NamedTuple):
    """Poses of a sensor at rest, each averaged over its rows."""

    source: str  # name of the table
    form: str  # form of the orientation, a key of ``FORMS``
    R_BS: Array | None  # orientation of the sensor, shape (N, 3, 3); None if only the direction of gravity is known
    down_S: Array  # unit vector along gravity in the sensor's axes, shape (N, 3)
    wrench: Array  # force, [N], and torque about So, [N m], in the axes of the table, shape (N, 6)
    counts: Array  # number of rows of each pose, shape (N,)
    lengths: Array  # norm of the accelerometer's reading, in the table's unit, shape (N,); empty without one
    num_left_out: int = 0  # number of rows between poses
    mistaken: Mapping[str, Array] = {}  # R_BS for other meanings of the angles, by their description


def read_poses(path: StrPath, form: str = "", down_B: Sequence[float] = (0.0, 0.0, -1.0)) -> Poses:
    """Reads a force-torque sensor's poses and wrenches from a table.

    A pose consists of successive rows whose orientations agree within two degrees, or that have the same number in a
    column ``pose``. Short stays between long stays are left out.

    Args:
        path: CSV with columns ``fx fy fz tx ty tz``, [N] and [N m], and the columns of one form of orientation.
        form: Form of orientation to use if the table has several, a key of ``FORMS``; empty if there is only one.
        down_B: Direction of gravity in the base, shape (3,).

    Raises:
        BadValueError: The table cannot be read, lacks columns, has a wrong value, or has fewer than four poses.
    """
    path = check_path("path", path)
    table = read_table(path)
    names = [_shorten(name) for name in table.names]
    columns = {name: table.values[:, k] for k, name in enumerate(names)}
    for angle in ("roll", "pitch", "yaw"):
        if f"{angle}_deg" in columns:
            columns[angle] = np.radians(columns[f"{angle}_deg"])
    if missing := [name for name in WRENCH if name not in columns]:
        raise BadValueError(path, missing[0], f"is missing, must be a column; needed are {', '.join(WRENCH)}")
    for name, ours in zip(table.names, names, strict=True):
        if ours in WRENCH and (unit := _FOREIGN_UNIT.search(name)):
            needed = "N (1 kgf is 9.807 N)" if ours[0] == "f" else "N m"
            raise BadValueError(path, f"column {name}", f"is in {unit[1].strip()}, must be in {needed}")
    form = _choose_form(path, form, columns)
    if twice := [name for name in (*WRENCH, *FORMS[form]) if names.count(name) > 1]:
        which = ", ".join(f"{long!r}" for long, name in zip(table.names, names, strict=True) if name == twice[0])
        raise BadValueError(path, twice[0], f"could be {which}, must be one column")
    values = np.column_stack([columns[name] for name in FORMS[form]])
    rotations, lengths = None, np.zeros(0)
    if form in ("gravity", "accelerometer"):
        lengths = np.linalg.norm(values, axis=1)
        _refuse(path, table, FORMS[form][0], lengths < 1e-3, "is part of a direction of length 0, must have a length")
        # At rest an accelerometer measures the supporting force, which points up.
        marks = values / lengths[:, None] * (1.0 if form == "gravity" else -1.0)
    else:
        rotations = _build_rotations(path, table, form, values)
        # The distance of two scaled rotation matrices equals the angle between them if it is small.
        marks = rotations.as_matrix().reshape(-1, 9) / np.sqrt(2.0)
    starts, ends = _find_stays(marks, columns.get("pose"))
    counts = ends - starts
    kept = counts >= (_LEAST_SHARE * counts.max() if counts.max(initial=0) >= _MANY else 1)
    stays = [slice(a, b) for a, b in zip(starts[kept], ends[kept], strict=True)]
    if len(stays) < FEWEST:
        problem = "three determine mass, centre of mass and offsets, and the fourth shows the errors"
        poses = f"{len(stays)} poses that differ by two degrees or more"
        raise BadValueError(path, "", f"has {poses}, must have at least {FEWEST}: {problem}")
    wrench = np.column_stack([columns[name] for name in WRENCH])
    R_BS, of_wrench = None, np.array([wrench[stay].mean(axis=0) for stay in stays])
    mistaken: dict[str, Array] = {}
    if rotations is None:
        means = np.array([marks[stay].mean(axis=0) for stay in stays])
        down_S = means / np.linalg.norm(means, axis=1)[:, None]
    else:
        R_BS = np.array([rotations[stay].mean().as_matrix() for stay in stays])
        for said, axes in _MISTAKEN.get(form, {}).items():
            other = Rotation.from_euler(axes, values)
            mistaken[said] = np.array([other[stay].mean().as_matrix() for stay in stays])
        down_S = np.array(down_B) / np.linalg.norm(down_B) @ R_BS
    read = np.array([lengths[stay].mean() for stay in stays]) if form == "accelerometer" else np.zeros(0)
    num_left_out = int(counts[~kept].sum())
    return Poses(path.name, form, R_BS, down_S, of_wrench, counts[kept], read, num_left_out, mistaken)


def _shorten(name: str) -> str:
    """Returns our column name. Examples: "wrench.force.x" is fx, "Mx [Nm]" is tx, and "Roll (deg)" is roll_deg."""
    name = re.sub(r"\s*[\[(](deg|°).*", "_deg", name.strip().lower())
    name = re.sub(r"\s*[\[(].*", "", name)  # without the unit
    name = re.sub("^m(?=[xyz]$)", "t", name)
    found = _LONG_NAME.fullmatch(name)
    return f"{_LONG[found[1]]}{found[2]}" if found else _RTDE.get(name, name)


def _choose_form(path: Path, form: str, columns: Mapping[str, Array]) -> str:
    present = [name for name, needed in FORMS.items() if all(each in columns for each in needed)]
    if form and form not in present:
        needed = ", ".join(FORMS[form]) if form in FORMS else describe_choice(form, FORMS)
        raise BadValueError(path, "", f"has no columns {needed}, must have them for --orientation {form}")
    if not present:
        forms = "; ".join(f"{' '.join(names)} ({name})" for name, names in FORMS.items())
        raise BadValueError(path, "", f"has no orientation of the sensor, must have columns of one form: {forms}")
    if len(present) > 1 and not form:
        raise BadValueError(path, "", f"has the forms {', '.join(present)}, must be read by one: --orientation NAME")
    return form or present[0]


def _refuse(path: Path, table: TextTable, name: str, is_bad: Mask, problem: str) -> None:
    """Raises a BadValueError for the first bad row, if any."""
    if is_bad.any():
        raise BadValueError(path, f"row {table.rows[int(np.argmax(is_bad))]}, column {name}", problem)


def _build_rotations(path: Path, table: TextTable, form: str, values: Array) -> Rotation:
    """Builds rotations R_BS from the columns of a form, (N, k)."""
    if form == "quaternion":
        lengths = np.linalg.norm(values, axis=1)
        _refuse(path, table, "qw", np.abs(lengths - 1.0) > _ROUNDING, "is part of a quaternion, must have length 1")
        return Rotation.from_quat(values, scalar_first=True)
    if form == "matrix":
        R = values.reshape(-1, 3, 3)
        errors = np.abs(R.transpose(0, 2, 1) @ R - np.eye(3)).max(axis=(1, 2))
        is_bad = (errors > 2.0 * _ROUNDING) | (np.linalg.det(R) < 0.0)
        _refuse(path, table, "r11", is_bad, "is part of a matrix that is not a rotation, must be one")
        return Rotation.from_matrix(R)
    most = 2.0 * np.pi + 1e-3
    for name, column in zip(FORMS[form], values.T, strict=True):
        hint = f"; name it {name}_deg if degrees were meant" if form == "rpy" else ""
        _refuse(path, table, name, np.abs(column) > most, f"is beyond a turn, must be from -6.28 to 6.28 rad{hint}")
    if form == "rotation_vector":
        return Rotation.from_rotvec(values)
    return Rotation.from_euler("xyz", values)  # about x, then y, then z of the base


def _find_stays(marks: Array, numbers: Array | None) -> tuple[Array, Array]:
    """Finds the first row and the end of each stay, (K,) each. A stay is a series of successive rows."""
    if numbers is not None:
        starts = [0, *(np.flatnonzero(np.diff(numbers)) + 1)]
    else:
        starts, rows = [0], marks.tolist()
        for number, row in enumerate(rows):
            if math.dist(row, rows[starts[-1]]) > _SAME_POSE:
                starts.append(number)
    return np.array(starts, dtype=int), np.array([*starts[1:], len(marks)], dtype=int)
