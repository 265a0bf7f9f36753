"""Description of a run's table: the small YAML file next to it.

joints: [shoulder_pan_joint, ...]      # in the order of the columns; not needed for a ROS bag
signal: current                        # or joint_torque, motor_torque, wrench; inferred from the columns if omitted
files: [run_1.csv, run_2.csv]          # parts of one recording with one clock; pass this file as the run
tip: tool0                             # link that carries the payload, or the wrist sensor
base: base_link
gravity: [0, 0, -9.81]                 # in the base frame, m/s^2
columns: ur_rtde                       # or libfranka, standard, a list of names for a table without names, or a map:
# columns: {time: stamp, q: "pos_{}", current: [i_base, i_shoulder]}   # the log's own names; {} is the joint's number
units: {time: s, q: rad, v: rad/s, current: A}
compensates: nothing                   # or arm: the controller has subtracted the arm's own torque from the signal;
#                                        gravity: the controller has subtracted only the gravity torque
compensated_payload: {mass: 0.73, com: [0, 0, 0.06], inertia: [0.001, 0.0025, 0.0017]}
reference_mass: 2.805                  # mass of the load, if it was weighed, kg
object_pose: {position: [0, 0, 0], rpy_deg: [0, -90, 0]}   # pose of the seen tool in the tip, m and degrees
force_on: object                       # or robot: the body on which the wrench acts
wrench_axes: sensor                    # or base: the axes along which force and torque about the sensor are given
postures: true                         # the arm was held at rest in each row; no time is needed
skip_rows: 2                           # number of rows above the table
topic: /joint_states                   # topic of joint states in a bag; wrench_topic for wrenches
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple, override

import numpy as np
import scipy
from pydantic import Field, PlainValidator, WithJsonSchema
from pydantic.json_schema import JsonSchemaValue

from affordance.arrays import Array
from affordance.exceptions import describe_choice, show_value
from affordance.extensions.payload.recording.run import GRAVITY, RunDescription
from affordance.extensions.payload.settings import SignalKind
from affordance.files.constraints import Constraint, Name, OneOf, Vector, Whole, Within, complain
from affordance.files.data_model import DataModel
from affordance.objects.inertia import build_transform_map

type _Triple = tuple[float, float, float]
_LENGTHS = Vector(3, Within(-2.0, 2.0))  # [m]
_MOST_FILES = 1000  # parts of a recording
_MOST = 1e3  # largest mass, [kg], and largest moment of inertia, [kg m^2]


class ColumnMap(NamedTuple):
    """Column names that a logger writes."""

    # Regular expressions of the logger's names, by standard name; a group captures the joint's number.
    patterns: dict[str, str]
    first: int | None  # number of the first joint; None for the smallest number in the table
    time_unit: float  # unit of time of the logger, [s]


_WRENCH = {name: name for name in ("fx", "fy", "fz", "tx", "ty", "tz")}
# Standard names and LeRobot's names; LeRobot's action is commanded, not measured, and is not read.
_LEROBOT = {"q": "state", "v": "velocity", "vdot": "acceleration", "tau": "effort|torque", "current": "current"}
_STANDARD = {name: rf"(?:{name}|observation\.(?:{theirs}))_(\d+)" for name, theirs in _LEROBOT.items()}
COLUMN_MAPS = {
    "standard": ColumnMap({"time": "time", **_STANDARD, **_WRENCH}, 1, 1.0),
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
        {"time": "timestamp", "q": r"actual_q_(\d+)", "v": r"actual_qd_(\d+)", "current": r"actual_current_(\d+)"},
        0,
        1.0,
    ),
}


def name_columns(names: Sequence[str], column_map: ColumnMap) -> list[str | None]:
    """Translates column names to standard names such as q_1. Unused columns are None."""
    found: list[tuple[str, int | None] | None] = []
    for name in names:
        matches = ((ours, re.fullmatch(pattern, name.strip())) for ours, pattern in column_map.patterns.items())
        hit = next(((ours, match) for ours, match in matches if match), None)
        found.append(None if hit is None else (hit[0], int(hit[1][1]) if hit[1].groups() else None))
    first: dict[str, int] = {}  # number of each quantity's first joint, 0 or 1
    for ours, number in filter(None, found):
        if number is not None:
            first[ours] = min(number, first.get(ours, number)) if column_map.first is None else column_map.first
    return [
        None if each is None else each[0] if each[1] is None else f"{each[0]}_{each[1] - first[each[0]] + 1}"
        for each in found
    ]


def build_column_map(own: Mapping[str, str | tuple[str, ...]]) -> ColumnMap:
    """Builds a column map from the names in a description.

    A name with {} contains the joint's number, from 0 or 1. A list names each joint's column.
    """
    patterns = {}
    for ours, names in own.items():
        if isinstance(names, str):
            patterns[ours] = re.escape(names).replace(r"\{\}", r"(\d+)")
        else:
            patterns |= {f"{ours}_{i + 1}": re.escape(name) for i, name in enumerate(names)}
    return ColumnMap(patterns, None, 1.0)


@dataclass(frozen=True)
class _Word(Constraint):
    """Constraint that maps each allowed word to a value."""

    choices: Mapping[str, Any]

    @override
    def describe(self) -> JsonSchemaValue:
        return {"enum": list(self.choices)}

    @override
    def check(self, value: Any) -> Any:
        if not isinstance(value, str) or value not in self.choices:
            raise complain(f"is {show_value(value)}, must be {' or '.join(self.choices)}")
        return self.choices[value]


def _describe(meaning: str, default: Any) -> Any:
    """Declares the meaning and the default of a key."""
    return Field(description=meaning, json_schema_extra={"default": default})


def _check_columns(value: object) -> str | tuple[str, ...] | dict[str, str | tuple[str, ...]]:
    if isinstance(value, dict):
        known = COLUMN_MAPS["standard"].patterns
        own: dict[str, str | tuple[str, ...]] = {}
        for ours, names in value.items():
            if ours not in known:
                raise complain(f"{describe_choice(str(ours), known)}")
            listed = names if isinstance(names, list) else [names]
            if not listed or not all(isinstance(name, str) and name.strip() for name in listed):
                raise complain(f"is {show_value(names)}, must be a name, a name with {{}}, or a list of names", ours)
            own[ours] = tuple(names) if isinstance(names, list) else names
        return own
    if isinstance(value, list) and value:
        for i, name in enumerate(value):
            if not isinstance(name, str) or not name.strip():
                raise complain(f"is {show_value(name)}, must be a non-empty text", f"[{i}]")
        return tuple(value)
    if not isinstance(value, str) or value not in COLUMN_MAPS:
        raise complain(f"is {show_value(value)}, must be a list of names, a mapping, or {', '.join(COLUMN_MAPS)}")
    return value


class UnitsEntry(DataModel):
    """Units of a table's columns, as factors to SI units."""

    time: Annotated[
        float | None,
        _Word({"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}),
        Field(description="Unit of time; the logger's own if left out."),
    ] = None
    q: Annotated[float, _Word({"rad": 1.0, "deg": np.pi / 180.0}), _describe("Unit of joint angles.", "rad")] = 1.0
    v: Annotated[
        float, _Word({"rad/s": 1.0, "deg/s": np.pi / 180.0}), _describe("Unit of joint velocities.", "rad/s")
    ] = 1.0
    vdot: Annotated[
        float, _Word({"rad/s^2": 1.0, "deg/s^2": np.pi / 180.0}), _describe("Unit of joint accelerations.", "rad/s^2")
    ] = 1.0
    tau: Annotated[float, _Word({"N m": 1.0, "N mm": 1e-3}), _describe("Unit of torques.", "N m")] = 1.0
    current: Annotated[float, _Word({"A": 1.0, "mA": 1e-3}), _describe("Unit of currents.", "A")] = 1.0
    wrench: Annotated[
        float, _Word({"N, N m": 1.0}), _describe("Unit of forces and torques at the wrist.", "N, N m")
    ] = 1.0


class CompensatedEntry(DataModel):
    """Payload as controllers define it: mass, centre of mass and principal moments."""

    mass: Annotated[float, Within(0.0, _MOST), Field(description="Mass, [kg].")]
    com: Annotated[_Triple, _LENGTHS, Field(description="Centre of mass in the tip, [m].")]
    inertia: Annotated[
        _Triple,
        Vector(3, Within(0.0, _MOST)),
        Field(description="Principal moments about the centre of mass, along the tip's axes, [kg m^2]."),
    ] = (0.0, 0.0, 0.0)

    def build(self) -> Array:
        """Builds the ten parameters at the tip, shape (10,)."""
        X = np.eye(4)
        X[:3, 3] = self.com
        payload: Array = build_transform_map(X) @ np.array([self.mass, 0.0, 0.0, 0.0, *self.inertia, 0.0, 0.0, 0.0])
        return payload


class ObjectPoseEntry(DataModel):
    """Pose of the seen tool in the tip frame."""

    position: Annotated[_Triple, _LENGTHS, Field(description="Position of the origin, [m].")]
    rpy_deg: Annotated[
        _Triple, Vector(3, Within(-360.0, 360.0)), Field(description="Roll, pitch and yaw, [deg].")
    ] = (0.0, 0.0, 0.0)

    def build(self) -> Array:
        """Builds the pose X_tip_T, shape (4, 4)."""
        X = np.eye(4)
        X[:3, :3] = scipy.spatial.transform.Rotation.from_euler("xyz", self.rpy_deg, degrees=True).as_matrix()
        X[:3, 3] = self.position
        return X


class RunEntry(DataModel):
    """Contents of the YAML file that describes a recording."""

    joints: Annotated[
        list[Name],
        Field(min_length=1, description="Joints in the order of the columns; a ROS bag contains their names."),
    ] = Field(default_factory=list)
    signal: Annotated[
        SignalKind | None, OneOf(SignalKind), Field(description="Kind of the signal; by default that of the columns.")
    ] = None
    files: Annotated[
        list[Name],
        Field(max_length=_MOST_FILES, description="Parts of one recording, in order, in the folder of this file."),
    ] = Field(default_factory=list)
    tip: Annotated[Name, Field(description="Link that carries the payload, or the wrist sensor.")] = ""
    base: Annotated[Name, Field(description="Link in whose frame gravity is given.")] = ""
    gravity: Annotated[
        _Triple, Vector(3, Within(-20.0, 20.0)), Field(description="Gravity in the base, [m/s^2].")
    ] = GRAVITY
    columns: Annotated[
        str | tuple[str, ...] | dict[str, str | tuple[str, ...]],
        PlainValidator(_check_columns),
        WithJsonSchema({"type": ["string", "array", "object"]}),
        Field(
            description="standard, libfranka, ur_rtde, names for a table without any, or a map to the log's names."
        ),
    ] = "standard"
    units: Annotated[UnitsEntry, _describe("Units of the columns.", {})] = UnitsEntry()
    compensates: Annotated[
        str,
        _Word({each: each for each in ("nothing", "arm", "gravity")}),
        _describe(
            "arm or gravity if the controller has subtracted that torque of the arm from the signal.", "nothing"
        ),
    ] = "nothing"
    compensated_payload: Annotated[
        CompensatedEntry | None, Field(description="Payload that the controller has subtracted as well.")
    ] = None
    reference_mass: Annotated[
        Annotated[float, Within(1e-3, _MOST)] | None, Field(description="Mass of the load, if it was weighed, [kg].")
    ] = None
    object_pose: Annotated[ObjectPoseEntry | None, Field(description="Pose of the seen object in the tip.")] = None
    force_on: Annotated[
        float,
        _Word({"object": 1.0, "robot": -1.0}),
        _describe("Body on which a wrench acts: the object or the robot.", "object"),
    ] = 1.0
    wrench_axes: Annotated[
        bool,
        _Word({"sensor": False, "base": True}),
        _describe("Axes along which a wrench about the sensor's origin is given: sensor or base.", "sensor"),
    ] = False
    postures: Annotated[
        bool | None,
        Field(description="true if the arm was held at rest in postures; by default inferred from the columns."),
    ] = None
    skip_rows: Annotated[int, Whole(0, 1_000_000), Field(description="Number of rows above the table.")] = 0
    topic: Annotated[Name, Field(description="Topic of joint states in a bag that has several such topics.")] = ""
    wrench_topic: Annotated[Name, Field(description="Topic of wrenches in a bag.")] = ""

    def build(self, joints: Sequence[str], kind: SignalKind, *, postures: bool = False) -> RunDescription:
        """Builds the description of a run for given joints and kind of signal."""
        payload, pose = self.compensated_payload, self.object_pose
        return RunDescription(
            tuple(joints),
            kind,
            tip=self.tip,
            base=self.base,
            gravity=self.gravity,
            compensates_arm=self.compensates != "nothing",
            leaves_inertia=self.compensates == "gravity",
            compensated_payload=np.zeros(10) if payload is None else payload.build(),
            reference_mass=self.reference_mass,
            object_pose=np.eye(4) if pose is None else pose.build(),
            postures=postures,
            wrench_in_base=self.wrench_axes,
        )
