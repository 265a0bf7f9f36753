"""Recorded run: a validated table of times, joint motion and signals.

Impossible data are rejected: numbers that are not finite, times that do not increase, angles in degrees or with
jumps, currents in milliamperes. Each error names the file, the row, the column, the value and its bound.
"""

import difflib
import hashlib
import itertools
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from affordance.arguments import check_array, check_kind, check_member, read_numbers
from affordance.arrays import Array
from affordance.exceptions import BadValueError
from affordance.extensions.payload.recording.joint_rates import (
    DEGREES,
    FASTEST,
    LONGER_UNIT,
    LONGEST_STEP,
    compare_rate,
    find_fault,
)
from affordance.extensions.payload.settings import SignalKind

GRAVITY = (0.0, 0.0, -9.81)  # Drake's default
_MIN_ROWS, FEWEST_POSTURES = 20, 4
# Nominal time between held postures, [s]. It has no physical meaning.
POSTURE_STEP = 0.5
# Largest gap between samples, [s] and as a multiple of the typical step, across which motion is interpolated.
_GAP, _GAP_STEPS = 0.25, 5.0
# Bounds of the magnitude of gravity on Earth, with the rounding of drivers, [m/s^2].
_EARTH = (9.7, 9.9)
_LONG_STEPS = "in another unit, the description must have 'units: {time: ms}'; of held postures, 'postures: true'"
_STEP_BOUNDS = (1e-5, LONGEST_STEP)  # from 100 kHz to 2 Hz, [s]
# Bounds of all quantities: two turns either way, four turns per second, and the signals of arms of any size.
_BOUNDS = {
    "q": (4.0 * np.pi, "rad"),
    "v": (FASTEST, "rad/s"),
    "vdot": (1e4, "rad/s^2"),
    "tau": (5e3, "N m"),
    "current": (100.0, "A"),
    "wrench": (5e3, "N or N m"),
}
_HINTS = {
    "q": DEGREES,
    "v": "are these degrees per second? then its description must have 'units: {v: deg/s}'",
    "vdot": "are these degrees? then its description must have 'units: {vdot: deg/s^2}'",
    "current": "are these milliamperes? then its description must have 'units: {current: mA}'",
}
# Tolerance for comparing samples of two recordings: a share of a signal's range, or an angle in [rad].
_SAME = 1e-3
WRENCH_COLUMNS = ("fx", "fy", "fz", "tx", "ty", "tz")


@dataclass(frozen=True)
class RunDescription:
    """Joints, signal, frames and load of a recorded run.

    Attributes:
        joint_names: Names of the joints, in the order of the columns.
        kind: Kind of the signal.
        tip: Link that carries the payload or the wrist sensor; empty to let the caller choose it.
        base: Link in whose frame gravity is given; empty for the first link of the chain.
        gravity: Gravity in the base frame, shape (3,), [m/s^2].
        compensates_arm: True if the controller has subtracted the arm's own torque from the signal.
        leaves_inertia: True if the controller has subtracted only the gravity part of that torque.
        compensated_payload: Ten parameters, at the tip, of a payload whose torque the controller has subtracted,
            shape (10,).
        reference_mass: Mass of the load, [kg]; None if it was not weighed.
        object_pose: Pose of the held tool in the tip, X_tip_T, shape (4, 4).
        postures: True if the arm was held at rest in each row, so that times have no meaning.
        wrench_in_base: True if force and torque about the tip's origin are given along the base's axes, not the
            tip's.
    """

    joint_names: tuple[str, ...]
    kind: SignalKind
    tip: str = ""
    base: str = ""
    gravity: tuple[float, float, float] = GRAVITY
    compensates_arm: bool = False
    leaves_inertia: bool = False
    compensated_payload: Array = field(default_factory=lambda: np.zeros(10))
    reference_mass: float | None = None
    object_pose: Array = field(default_factory=lambda: np.eye(4))
    postures: bool = False
    wrench_in_base: bool = False

    def __post_init__(self) -> None:
        """Checks the types and shapes of the fields.

        Raises:
            BadArgumentError: A joint has no name, the signal is unknown, or an array has another shape.
        """
        names = check_kind("joint_names", self.joint_names, tuple, "the names of the joints, in order")
        joints = {f"joint_names[{i}]": name for i, name in enumerate(names)}
        for name, text in {"tip": self.tip, "base": self.base, **joints}.items():
            check_kind(name, text, str)
        object.__setattr__(self, "kind", check_member("kind", self.kind, SignalKind))
        for name, shape in {"gravity": (3,), "compensated_payload": (10,), "object_pose": (4, 4)}.items():
            check_array(name, getattr(self, name), shape)


@dataclass(frozen=True)
class Run:
    """Recorded run.

    Attributes:
        source: File of the run, for messages.
        description: Description of the table.
        times: Times of the samples, shape (N,), increasing, [s].
        q: Joint angles, shape (N, n), [rad].
        signal: Signals, shape (N, n). A wrench has shape (N, 6): force, then torque, on the held object, about the
            tip's origin, along the tip's axes unless the description chooses the base's axes.
        v: Joint velocities, shape (N, n), [rad/s]; None to derive them from the angles.
        vdot: Joint accelerations, shape (N, n), [rad/s^2]; None to derive them from the velocities.
        rows: Row number of each sample in the file, shape (N,), for messages; None to count samples from 1.
        notes: Changes made to the table, which are reported with results.

    Example:
        >>> from affordance import MODELS, read_run
        >>> run = read_run(MODELS / "demo" / "empty.csv")
        >>> run.q.shape
        (400, 7)
    """

    source: str
    description: RunDescription
    times: Array
    q: Array
    signal: Array
    v: Array | None = None
    vdot: Array | None = None
    rows: NDArray[np.intp] | None = None
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Checks shapes, times and values.

        Raises:
            BadArgumentError: A field is not an array of numbers.
            BadValueError: A shape, time or value is impossible.
        """
        check_kind("source", self.source, str)
        check_kind("description", self.description, RunDescription)
        optional = [name for name in ("v", "vdot") if getattr(self, name) is not None]
        for name in ("times", "q", "signal", *optional):
            object.__setattr__(self, name, read_numbers(name, getattr(self, name)))
        # Only the shape is checked here. The numbers are checked below, with their row in the message.
        check_array("times", np.zeros_like(self.times), (None,))
        joints = self.description.joint_names
        tables = {"q": self.q, "v": self.v, "vdot": self.vdot, self.signal_name: self.signal}
        given = {name: values for name, values in tables.items() if values is not None}
        for name, values in given.items():
            shape = (len(self.times), 6 if name == "wrench" else len(joints))
            if values.shape != shape:
                problem = f"has shape {values.shape}, must be {shape}: one column for each of {', '.join(joints)}"
                raise BadValueError(self.source, name, problem)
        least, what = (FEWEST_POSTURES, "postures") if self.description.postures else (_MIN_ROWS, "samples")
        if len(self.times) < least:
            raise BadValueError(self.source, "", f"has {len(self.times)} {what}, must have at least {least}")
        if not self.description.postures:
            self._check_times()
        length, (low, high) = float(np.linalg.norm(self.description.gravity)), _EARTH
        if not low <= length <= high:
            problem = f"has a magnitude of {length:.4g} m/s^2, must be from {low:g} to {high:g}"
            raise BadValueError(self.source, "gravity", problem)
        for name, values in given.items():
            self._check_values(name, values)
        if self.v is not None:
            self.check_rates()  # first, because a jump would look like velocities in another unit
            pairs = [("v", self.v, "q", self.q)]
            if self.vdot is not None:
                pairs.append(("vdot", self.vdot, "v", self.v))
            for name, rate, of_name, of in pairs:
                if (found := compare_rate(self.times, of, rate, self.q)) is not None:
                    hint = f"; {_HINTS[name]}" if found.is_larger else ""
                    problem = found.problem.format(f"{of_name}_{found.joint + 1}")
                    raise BadValueError(self.source, f"column {name}_{found.joint + 1}", f"{problem}{hint}")

    @property
    def fingerprint(self) -> str:
        """Identifier of the recording: the smallest hash of a sample, so that most trimmed copies share it.

        Samples that occur more than once are ignored unless there are no others. An arm at rest gives such samples,
        which may also occur in other runs.
        """
        samples = np.concatenate([self.q, self.signal], axis=1)
        counts = Counter(hashlib.sha256(sample.tobytes()).hexdigest() for sample in samples)
        return min([digest for digest, count in counts.items() if count == 1] or counts)[:16]

    def __repr__(self) -> str:
        rows, joints = self.q.shape
        many, at = ("postures", "") if self.description.postures else ("samples", f" at {self.rate:.4g} Hz")
        return f"Run({self.source}: {rows} {many} of {joints} joints{at}, {self.signal_name})"

    @property
    def signal_name(self) -> str:
        """Prefix of the names of the signal's columns."""
        return {SignalKind.CURRENT: "current", SignalKind.WRENCH: "wrench"}.get(self.description.kind, "tau")

    @property
    def rate(self) -> float:
        """Sampling rate from the median time step, [Hz]."""
        return float(1.0 / np.median(np.diff(self.times)))

    def arrange(self, joint_names: Sequence[str]) -> "Run":
        """Reorders the joints to match an arm.

        Raises:
            BadValueError: A joint of the arm is not in the run.
        """
        own = self.description.joint_names
        if tuple(joint_names) == own:
            return self
        order = []
        # Makers change the prefix of joint names between models: panda_joint1, fer_joint1.
        own_prefix, prefix = _find_prefix(own), _find_prefix(joint_names)
        for name in joint_names:
            match = name if name in own else own_prefix + name[len(prefix) :]
            if match not in own:
                near = difflib.get_close_matches(name, own, n=1, cutoff=0.0)
                problem = f"are {', '.join(own)}, must include {name} of the arm; the nearest is {near[0]}"
                raise BadValueError(self.source, "joints", problem)
            order.append(own.index(match))
        names = ("q", "v", "vdot") if self.description.kind is SignalKind.WRENCH else ("q", "v", "vdot", "signal")
        given = {name: getattr(self, name) for name in names}
        return replace(
            self,
            description=replace(self.description, joint_names=tuple(joint_names)),
            **{name: values[:, order] for name, values in given.items() if values is not None},
        )

    def measure_overlap(self, other: "Run") -> float:
        """Computes the share of this run's samples that also occur in another run, at any time.

        Angles must agree to a thousandth of a radian and signals to a thousandth of their range. Rounding errors are
        usually smaller and noise is usually larger, so two recordings of the same motion hardly overlap.
        """
        step = np.concatenate(
            [np.full(self.q.shape[1], _SAME), _SAME * np.maximum(np.ptp(other.signal, axis=0), 1e-9)]
        )
        own, others = (
            {row.tobytes() for row in np.rint(np.hstack([run.q, run.signal]) / step).astype(np.int64)}
            for run in (self, other)
        )
        return len(own & others) / len(own)

    def select(self, rows: slice) -> "Run":
        """Selects samples of the run."""
        given = {name: getattr(self, name) for name in ("times", "q", "signal", "v", "vdot", "rows")}
        return replace(self, **{name: values[rows] for name, values in given.items() if values is not None})

    def error_at(self, row: int, column: str, problem: str) -> BadValueError:
        """Builds an error message about one sample."""
        number = row + 1 if self.rows is None else int(self.rows[row])
        return BadValueError(self.source, f"row {number}, column {column}", problem)

    def check_rates(self, limits: Array | None = None, ranges: Array | None = None, source: str = "") -> None:
        """Checks that no joint exceeds its velocity limit.

        Args:
            limits: Velocity limits, shape (n,), [rad/s]; None if not known.
            ranges: Lower and upper angle limits, shape (2, n), [rad], for the message; None if not known.
            source: Name of the robot's file, for the message.

        Raises:
            BadValueError: A joint turns too fast.
        """
        if self.description.postures:
            return
        fault = find_fault(self.times, self.q, limits=limits, ranges=ranges, source=source)
        if fault is not None:
            name = self.description.joint_names[fault.joint]
            raise self.error_at(fault.row, f"q_{fault.joint + 1} ({name})", fault.problem)

    def _check_times(self) -> None:
        bad = np.flatnonzero(~np.isfinite(self.times))
        if bad.size:
            raise self.error_at(int(bad[0]), "time", f"is {self.times[bad[0]]}, must be a finite number of seconds")
        steps = np.diff(self.times)
        back = np.flatnonzero(steps <= 0.0)
        if back.size:
            row = int(back[0]) + 1
            before = f"must be more than {self.times[row - 1]:.6f}, the time in the row before"
            raise self.error_at(row, "time", f"is {self.times[row]:.6f}, {before}")
        typical, (low, high) = float(np.median(steps)), _STEP_BOUNDS
        if not low <= typical <= high:
            hint = LONGER_UNIT if typical < low else _LONG_STEPS
            problem = f"advances by {typical:g} s per row, must be from {low:g} to {high:g}; {hint}"
            raise self.error_at(1, "time", problem)
        longest = int(np.argmax(steps))
        bound = max(_GAP, _GAP_STEPS * typical)
        if steps[longest] > bound:
            problem = f"jumps by {steps[longest]:.3g} s, must be at most {bound:.3g} s; cut the table there"
            raise self.error_at(longest + 1, "time", problem)

    def _check_values(self, name: str, values: Array) -> None:
        bound, unit = _BOUNDS[name]
        bad = np.argwhere(~np.isfinite(values) | (np.abs(values) > bound))
        if not bad.size:
            return
        row, column = (int(index) for index in bad[0])
        value = values[row, column]
        label = WRENCH_COLUMNS[column] if name == "wrench" else f"{name}_{column + 1}"
        if not np.isfinite(value):
            raise self.error_at(row, label, f"is {value}, must be a finite number")
        hint = f"; {_HINTS[name]}" if name in _HINTS else ""
        raise self.error_at(row, label, f"is {value:g}, must be from {-bound:.4g} to {bound:.4g} {unit}{hint}")


def resample(times: Array, recorded: Array, values: Array) -> Array:
    """Interpolates values, (N, columns), linearly at other times."""
    return np.column_stack([np.interp(times, recorded, column) for column in values.T])


def _find_prefix(names: Sequence[str]) -> str:
    """Returns the common prefix of names, up to and including the last underscore."""
    letters = itertools.takewhile(lambda same: len(set(same)) == 1, zip(*names, strict=False))
    common = "".join(same[0] for same in letters)
    return common[: common.rfind("_") + 1]
