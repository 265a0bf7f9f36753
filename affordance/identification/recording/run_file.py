"""Reader of a run: a table, and the small YAML file next to it that describes the table.

joints: [shoulder_pan_joint, ...]      # in the order of the columns; a ROS bag names them itself
signal: current                        # or joint_torque, motor_torque, wrench; by the columns if omitted
tip: tool0                             # link that carries the payload, or the wrist sensor
base: base_link
gravity: [0, 0, -9.81]                 # in the base frame, m/s^2
columns: ur_rtde                       # or libfranka, standard, or a list of names for a table without any
units: {time: s, q: rad, v: rad/s, current: A}
compensates: nothing                   # or arm: the controller has subtracted the arm's own torque from the signal
compensated_payload: {mass: 0.73, com: [0, 0, 0.06], inertia: [0.001, 0.0025, 0.0017]}
reference_mass: 2.805                  # mass of the load, if it was weighed, kg
object_pose: {position: [0, 0, 0], rpy_deg: [0, -90, 0]}   # pose of the seen tool in the tip, m and degrees
force_on: object                       # or robot: which of the two a wrench pushes
drop_torn_rows: 3                      # number of incomplete rows that may be left out
topic: /joint_states                   # topic of joint states in a bag; wrench_topic for wrenches
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from affordance.arguments import StrPath, check_path
from affordance.arrays import Array
from affordance.exceptions import BadValueError
from affordance.files.record import Record, read_record
from affordance.identification.recording.column_maps import COLUMN_MAPS, name_columns
from affordance.identification.recording.run import GRAVITY, WRENCH_COLUMNS, Run, RunDescription
from affordance.identification.recording.run_bag import read_bag
from affordance.identification.recording.run_table import Table, read_netcdf, read_text
from affordance.identification.settings import SignalKind
from affordance.objects.inertia import build_transform_map

_UNITS = {
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9},
    "q": {"rad": 1.0, "deg": np.pi / 180.0},
    "v": {"rad/s": 1.0, "deg/s": np.pi / 180.0},
    "vdot": {"rad/s^2": 1.0, "deg/s^2": np.pi / 180.0},
    "tau": {"N m": 1.0, "N mm": 1e-3},
    "current": {"A": 1.0, "mA": 1e-3},
    "wrench": {"N, N m": 1.0},
}
_BAGS = (".mcap", ".db3", ".bag")
_MOST = 1e3  # largest mass, [kg], and moment of inertia, [kg m^2]


class _Layout(NamedTuple):
    """Layout of the table: columns, units, signs and topics."""

    columns: str | tuple[str, ...]
    units: dict[str, float]
    force_sign: float
    max_torn: int
    topic: str
    wrench_topic: str
    joints: tuple[str, ...]
    kind: SignalKind | None


def read_run(path: StrPath, description: StrPath | None = None) -> Run:
    """Reads a run from its table and description.

    Args:
        path: Table (.csv, .txt, .tsv or .nc) or ROS bag.
        description: YAML file that describes the table; None for the one next to it, of the same name.

    Raises:
        BadValueError: A file or one of its values is wrong; the message says which and how.
    """
    path = check_path("path", path)
    description_file = path.with_suffix(".yaml") if description is None else check_path("description", description)
    if not path.exists():
        raise BadValueError(path, "", "does not exist")
    if not description_file.exists():
        problem = f"has no description: {description_file.name} in the same folder must name at least its joints"
        raise BadValueError(path, "", problem)
    record = read_record(description_file)
    layout = _read_layout(record)
    if path.is_dir() or path.suffix in _BAGS:
        bag = read_bag(path, layout.topic, layout.wrench_topic)
        table = Table(bag.columns, bag.values, np.arange(1, len(bag.values) + 1), 0)
        layout = layout._replace(joints=layout.joints or bag.joint_names, columns="standard")
        if layout.kind is None:
            raise BadValueError(
                description_file,
                "signal",
                "is missing: efforts of a bag may be joint_torque, motor_torque or current",
            )
        # The description determines the meaning of a bag's effort.
        if layout.kind is SignalKind.CURRENT:
            table = table._replace(names=tuple(name.replace("tau_", "current_") for name in table.names))
    elif path.suffix == ".nc":
        table = read_netcdf(path)
    else:
        table = read_text(path, layout.max_torn)
    if not layout.joints:
        raise BadValueError(
            description_file, "joints", "is missing: must list the joints in the order of the columns"
        )
    columns = _find_columns(path, description_file, table, layout)
    kind = layout.kind or _guess_kind(path, columns)
    run = _build_run(path, table, columns, _read_description(record, layout.joints, kind), layout)
    record.finish()
    return run


def _read_layout(record: Record) -> _Layout:
    columns: str | tuple[str, ...] = "standard"
    if record.has("columns"):
        columns = record.names("columns") if record.holds_list("columns") else record.text("columns")
        if isinstance(columns, str) and columns not in COLUMN_MAPS:
            raise record.error("columns", f"is {columns!r}, must be a list of names, or {', '.join(COLUMN_MAPS)}")
    units = dict.fromkeys(_UNITS, 1.0)
    if isinstance(columns, str):
        units["time"] = COLUMN_MAPS[columns].time_unit
    if record.has("units"):
        given = record.record("units")
        for quantity, choices in _UNITS.items():
            if given.has(quantity):
                unit = given.text(quantity)
                if unit not in choices:
                    raise given.error(quantity, f"is {unit!r}, must be {' or '.join(choices)}")
                units[quantity] = choices[unit]
        given.finish()
    kind = None
    if record.has("signal"):
        name = record.text("signal")
        kinds = {kind.value: kind for kind in SignalKind}
        if name not in kinds:
            raise record.error("signal", f"is {name!r}, must be one of {', '.join(kinds)}")
        kind = kinds[name]
    return _Layout(
        columns,
        units,
        -1.0 if _read_choice(record, "force_on", ("object", "robot")) == "robot" else 1.0,
        int(record.number("drop_torn_rows", low=0.0, high=1e6)) if record.has("drop_torn_rows") else 0,
        record.text("topic") if record.has("topic") else "",
        record.text("wrench_topic") if record.has("wrench_topic") else "",
        record.names("joints") if record.has("joints") else (),
        kind,
    )


def _read_description(record: Record, joints: tuple[str, ...], kind: SignalKind) -> RunDescription:
    gravity = tuple(record.vector("gravity", 3, low=-20.0, high=20.0)) if record.has("gravity") else GRAVITY
    payload = np.zeros(10)
    if record.has("compensated_payload"):
        payload = _read_payload(record.record("compensated_payload"))
    pose = np.eye(4)
    if record.has("object_pose"):
        placed = record.record("object_pose")
        pose[:3, 3] = placed.vector("position", 3, low=-2.0, high=2.0)
        if placed.has("rpy_deg"):
            turn = placed.vector("rpy_deg", 3, low=-360.0, high=360.0)
            pose[:3, :3] = Rotation.from_euler("xyz", turn, degrees=True).as_matrix()
        placed.finish()
    mass = record.number("reference_mass", low=1e-3, high=_MOST) if record.has("reference_mass") else None
    return RunDescription(
        joints,
        kind,
        tip=record.text("tip") if record.has("tip") else "",
        base=record.text("base") if record.has("base") else "",
        gravity=(float(gravity[0]), float(gravity[1]), float(gravity[2])),
        compensates_arm=_read_choice(record, "compensates", ("nothing", "arm")) == "arm",
        compensated_payload=payload,
        reference_mass=mass,
        object_pose=pose,
    )


def _read_choice(record: Record, key: str, choices: tuple[str, ...]) -> str:
    """Reads one of some words; the first if the key is missing."""
    if not record.has(key):
        return choices[0]
    choice = record.text(key)
    if choice not in choices:
        raise record.error(key, f"is {choice!r}, must be {' or '.join(choices)}")
    return choice


def _read_payload(record: Record) -> Array:
    """Reads mass, centre of mass and principal moments about it, as controllers take them."""
    mass = record.number("mass", low=0.0, high=_MOST)
    X = np.eye(4)
    X[:3, 3] = record.vector("com", 3, low=-2.0, high=2.0)
    moments = record.vector("inertia", 3, low=0.0, high=_MOST) if record.has("inertia") else np.zeros(3)
    record.finish()
    payload: Array = build_transform_map(X) @ np.array([mass, 0.0, 0.0, 0.0, *moments, 0.0, 0.0, 0.0])
    return payload


def _find_columns(path: Path, description_file: Path, table: Table, layout: _Layout) -> dict[str, int]:
    """Finds the places of our columns in the table."""
    names = table.names
    if not isinstance(layout.columns, str):
        names = layout.columns
        if len(names) != table.values.shape[1]:
            problem = f"lists {len(names)} names, must list the {table.values.shape[1]} columns of {path.name}"
            raise BadValueError(description_file, "columns", problem)
    elif not names:
        problem = "names no columns in its first row; the description must list them under columns"
        raise BadValueError(path, "row 1", problem)
    column_map = COLUMN_MAPS[layout.columns if isinstance(layout.columns, str) else "standard"]
    ours = name_columns(names, column_map)
    columns: dict[str, int] = {}
    for place, name in enumerate(ours):
        if name is not None:
            columns.setdefault(name, place)  # newer logs repeat q_d of commands after the state's
    for name in ("time", *(f"q_{i + 1}" for i in range(len(layout.joints)))):
        if name not in columns:
            problem = f"is missing: has {', '.join(names)[:200]}"
            raise BadValueError(path, f"column {name}", problem)
    extra = f"q_{len(layout.joints) + 1}"
    if extra in columns:
        problem = f"has {extra}, must have as many joints as the {len(layout.joints)} of {description_file.name}"
        raise BadValueError(path, f"column {extra}", problem)
    return columns


def _guess_kind(path: Path, columns: dict[str, int]) -> SignalKind:
    kinds = {"tau_1": SignalKind.JOINT_TORQUE, "current_1": SignalKind.CURRENT, "fx": SignalKind.WRENCH}
    found = [kind for name, kind in kinds.items() if name in columns]
    if len(found) != 1:
        problem = "no signal" if not found else "several signals"
        raise BadValueError(path, "columns", f"has {problem}, must have tau_1.., current_1.. or fx..tz, or say which")
    return found[0]


def _build_run(
    path: Path, table: Table, columns: dict[str, int], description: RunDescription, layout: _Layout
) -> Run:
    num = len(layout.joints)

    def take(quantity: str, names: tuple[str, ...] | None = None) -> Array | None:
        names = names or tuple(f"{quantity}_{i + 1}" for i in range(num))
        given = [name for name in names if name in columns]
        if not given:
            return None
        if len(given) < len(names):
            missing = next(name for name in names if name not in columns)
            raise BadValueError(path, f"column {missing}", f"is missing, while there are {', '.join(given)}")
        scale = layout.units.get(quantity, 1.0)
        return table.values[:, [columns[name] for name in names]] * scale

    kind = description.kind
    if kind is SignalKind.WRENCH:
        signal = take("wrench", WRENCH_COLUMNS)
        signal = None if signal is None else layout.force_sign * signal
    else:
        signal = take("current" if kind is SignalKind.CURRENT else "tau")
    if signal is None:
        raise BadValueError(path, "columns", f"has no columns of the signal, {kind.value}")
    q = take("q")
    assert q is not None  # _find_columns
    notes = (f"{table.num_torn} torn rows were left out",) if table.num_torn else ()
    times = table.values[:, columns["time"]] * layout.units["time"]
    return Run(str(path), description, times, q, signal, take("v"), take("vdot"), rows=table.rows, notes=notes)
