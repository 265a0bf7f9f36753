"""Mistakes that users make with recordings; the study makes each of them in a pair of runs that is known to be good.

Mistakes that the data cannot show are marked with ``can_be_seen=False``; reports list them as assumptions.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from affordance.arrays import Array
from affordance.identification.recording.run import Run
from affordance.identification.settings import SignalKind
from studies.recorded.mistake_outcomes import Case, Mistake


def _of_runs(change: Callable[[Run], Run], which: str = "both") -> Callable[[Case], Case]:
    """Returns a mistake that changes the recording of one run, or of both."""

    def make(case: Case) -> Case:
        empty = change(case.empty) if which in ("empty", "both") else case.empty
        loaded = change(case.loaded) if which in ("loaded", "both") else case.loaded
        return replace(case, empty=empty, loaded=loaded)

    return make


def _describe(**changes: object) -> Callable[[Run], Run]:
    return lambda run: replace(run, description=replace(run.description, **changes))  # type: ignore[arg-type]


def _of_signal(change: Callable[[Array], Array]) -> Callable[[Run], Run]:
    return lambda run: replace(run, signal=change(run.signal.copy()))


def _scale(factor: float | Sequence[float]) -> Callable[[Run], Run]:
    return _of_signal(lambda signal: signal * np.asarray(factor))


def _shift(seconds: float) -> Callable[[Run], Run]:
    """Returns a change that delays the signal by a time, [s]."""

    def change(run: Run) -> Run:
        late = [np.interp(run.times - seconds, run.times, column) for column in run.signal.T]
        return replace(run, signal=np.column_stack(late))

    return change


def _permute(order: Sequence[int], names: Sequence[str]) -> Callable[[Run], Run]:
    def change(run: Run) -> Run:
        values = {name: getattr(run, name) for name in names}
        return replace(run, **{name: value[:, list(order)] for name, value in values.items() if value is not None})

    return change


def _swap(i: int, j: int, n: int = 6) -> list[int]:
    return [{i: j, j: i}.get(k, k) for k in range(n)]


def _change_joint(joint: int, change: Callable[[Array], Array]) -> Callable[[Run], Run]:
    """Returns a change of one joint's signal; joints are numbered from 1."""

    def change_signal(signal: Array) -> Array:
        signal[:, joint - 1] = change(signal[:, joint - 1])
        return signal

    return _of_signal(change_signal)


def _offset_angle(joint: int, offset: float) -> Callable[[Run], Run]:
    def change(run: Run) -> Run:
        q = run.q.copy()
        q[:, joint - 1] += offset
        return replace(run, q=q)

    return change


def _cut(first: float, seconds: float) -> Callable[[Run], Run]:
    """Returns a change that removes a stretch, [s], which starts at a given fraction of the run."""

    def change(run: Run) -> Run:
        start = run.times[0] + first * (run.times[-1] - run.times[0])
        return run.select(np.flatnonzero((run.times < start) | (run.times > start + seconds)))  # type: ignore[arg-type]

    return change


def _close_gap(seconds: float) -> Callable[[Run], Run]:
    """Returns a change that cuts a stretch, [s], out of a run and hides the gap with a continuous clock."""

    def change(run: Run) -> Run:
        middle = len(run.times) // 2
        count = round(seconds * run.rate)
        kept = np.r_[0 : middle - count // 2, middle + count // 2 : len(run.times)]
        v = None if run.v is None else run.v[kept]
        return replace(
            run, times=run.times[0] + np.arange(len(kept)) / run.rate, q=run.q[kept], signal=run.signal[kept], v=v
        )

    return change


def _spikes(signal: Array) -> Array:
    rng = np.random.default_rng(1)
    rows = rng.random(signal.shape) < 0.005
    return signal + rows * 20.0 * signal.std(axis=0) * rng.choice([-1.0, 1.0], signal.shape)


def _clip(values: Array) -> Array:
    middle, half = np.median(values), 0.5 * np.ptp(values)
    return np.clip(values, middle - 0.4 * half, middle + 0.4 * half)


def _hold_value(values: Array) -> Array:
    """Returns values that stay constant for a quarter of the run."""
    first, last = len(values) // 2, 3 * len(values) // 4
    values[first:last] = values[first]
    return values


def _drop_load(case: Case) -> Case:
    """Removes the load half-way through the run; both runs must have the same motion."""
    run, empty = case.loaded, case.empty
    signal = run.signal.copy()
    middle = run.times[0] + 0.5 * (run.times[-1] - run.times[0])
    late = run.times > middle
    for j in range(signal.shape[1]):
        signal[late, j] = np.interp(run.times[late] - run.times[0] + empty.times[0], empty.times, empty.signal[:, j])
    return replace(case, loaded=replace(run, signal=signal))


def _touch_table(signal: Array) -> Array:
    """Adds a contact during a fifth of the run: a signal as large as the load's, on the first three joints."""
    rows = slice(2 * len(signal) // 5, 3 * len(signal) // 5)
    signal[rows, :3] += np.ptp(signal[:, :3], axis=0) * np.array([0.5, -0.5, 0.5])
    return signal


def _other_robot(lengths: float, mass: float) -> Callable[[Case], Case]:
    """Returns a mistake in which the model is another robot of the family, with links scaled in length and mass."""

    def make(case: Case) -> Case:
        chain = case.robot
        links = chain.link_parameters * mass * np.array([1.0, *[lengths] * 3, *[lengths**2] * 6])
        other = replace(chain, p_PF=lengths * chain.p_PF, p_MT=lengths * chain.p_MT, link_parameters=links)
        return replace(case, robot=other)

    return make


def _other_axis(joint: int) -> Callable[[Case], Case]:
    def make(case: Case) -> Case:
        axes = case.robot.axes.copy()
        axes[joint - 1] *= -1.0
        return replace(case, robot=replace(case.robot, axes=axes))

    return make


def _weigh(factor: float) -> Callable[[Case], Case]:
    """Returns a mistake in reading the scale: another unit, or a part of the load left out."""

    def make(case: Case) -> Case:
        if case.reference_mass is not None:
            return replace(case, reference_mass=factor * case.reference_mass)
        if (gains := case.gains) is not None:  # these gains come from the same misread weighing
            wrong = replace(gains, mean=gains.mean / factor, covariance=gains.covariance / factor**2)
            return replace(case, gains=wrong)
        return replace(case, reference_mass=factor * case.mass)

    return make


def _permute_gains(case: Case) -> Case:
    if (gains := case.gains) is None:
        return _of_runs(_permute(_swap(1, 4), ["signal"]))(case)
    order = _swap(1, 4, len(gains.joint_names))
    return replace(case, gains=replace(gains, mean=gains.mean[order], covariance=gains.covariance[order]))


def _move_tip(case: Case) -> Case:
    """Names another link as the tip, ten centimetres from the right one."""
    chain = case.robot
    return replace(case, robot=replace(chain, p_MT=chain.p_MT + chain.R_MT @ np.array([0.1, 0.0, 0.0])))


def _forget_gripper(case: Case) -> Case:
    """Adds a gripper, 0.9 kg at six centimetres from the tip, to the loaded run only."""
    robot, run = case.robot.with_gravity(case.loaded.description.gravity), case.loaded
    v = np.gradient(run.q, run.times, axis=0) if run.v is None else run.v
    vdot = np.gradient(v, run.times, axis=0)
    gripper = np.array([0.9, 0.0, 0.0, 0.9 * 0.06, 0.9 * 0.0036, 0.9 * 0.0036, 1e-3, 0.0, 0.0, 0.0])
    torque = robot.compute_payload_regressors(run.q, v, vdot) @ gripper
    gain = 1.0 if case.gains is None else case.gains.mean[:, 0]
    return replace(case, loaded=replace(run, signal=run.signal + gain * torque))


def _take_other_rows(signal: Array) -> Array:
    return np.roll(signal, len(signal) // 3, axis=0)


_JOINTS = ("joint 1", "joint 2", "joint 3", "joint 4", "joint 5", "joint 6")
_ALL = ["q", "v", "signal"]

# The list for six joints was written before any mistake was tried, from users' questions about such programs and from
# early errors of the studies' own authors. Mistakes added later are at the end.
MISTAKES: tuple[Mistake, ...] = (
    # Units and kinds of the signal
    Mistake("the signal is called a joint torque", _of_runs(_describe(kind=SignalKind.JOINT_TORQUE))),
    Mistake("the signal is called a motor torque", _of_runs(_describe(kind=SignalKind.MOTOR_TORQUE))),
    Mistake("the signal is called a current", _of_runs(_describe(kind=SignalKind.CURRENT))),
    Mistake("a thousandth of the unit, both runs", _of_runs(_scale(1e-3)), of_sensors=True),
    Mistake("a thousand times the unit, both runs", _of_runs(_scale(1e3)), of_sensors=True),
    Mistake("a thousandth of the unit, loaded run", _of_runs(_scale(1e-3), "loaded")),
    Mistake("a tenth of the unit, loaded run", _of_runs(_scale(0.1), "loaded")),
    Mistake("ten times the unit, both runs", _of_runs(_scale(10.0)), of_sensors=True),
    Mistake("one joint in another unit, both runs", _of_runs(_change_joint(2, lambda x: 1e-3 * x)), of_sensors=True),
    # Joints and columns
    *(
        Mistake(f"names of {_JOINTS[i]} and {_JOINTS[j]} exchanged", _of_runs(_permute(_swap(i, j), _ALL)))
        for i, j in ((0, 1), (1, 2), (2, 3), (3, 4), (4, 5))
    ),
    Mistake("joints in reverse order", _of_runs(_permute(range(5, -1, -1), _ALL))),
    Mistake("joints in reverse order, loaded run", _of_runs(_permute(range(5, -1, -1), _ALL), "loaded")),
    *(
        Mistake(f"signals of {_JOINTS[i]} and {_JOINTS[j]} exchanged", _of_runs(_permute(_swap(i, j), ["signal"])))
        for i, j in ((0, 1), (1, 2), (2, 3))
    ),
    Mistake("signals of joints 2 and 3 exchanged, loaded run", _of_runs(_permute(_swap(1, 2), ["signal"]), "loaded")),
    Mistake("velocities of joints 1 and 2 exchanged", _of_runs(_permute(_swap(0, 1), ["v"]))),
    Mistake("velocities of joints 4 and 5 exchanged", _of_runs(_permute(_swap(3, 4), ["v"]))),
    Mistake("all velocities shifted by a column", _of_runs(_permute([1, 2, 3, 4, 5, 0], ["v"]))),
    # Time
    Mistake("clock twice too fast, both runs", _of_runs(lambda run: replace(run, times=0.5 * run.times))),
    Mistake("clock twice too slow, loaded run", _of_runs(lambda run: replace(run, times=2.0 * run.times), "loaded")),
    Mistake("signal 0.2 s late, both runs", _of_runs(_shift(0.2))),
    Mistake("signal 0.2 s late, loaded run", _of_runs(_shift(0.2), "loaded")),
    Mistake("signal 1 s late, both runs", _of_runs(_shift(1.0))),
    Mistake("signal 1 s early, loaded run", _of_runs(_shift(-1.0), "loaded")),
    Mistake("signals of other rows, both runs", _of_runs(_of_signal(_take_other_rows))),
    Mistake("signals of other rows, loaded run", _of_runs(_of_signal(_take_other_rows), "loaded")),
    Mistake("signals backwards in time", _of_runs(_of_signal(lambda signal: signal[::-1]))),
    Mistake("4 s missing from the loaded run", _of_runs(_cut(0.4, 4.0), "loaded")),
    Mistake("4 s missing from the empty run", _of_runs(_cut(0.4, 4.0), "empty")),
    Mistake("1 s missing from both runs", _of_runs(_cut(0.6, 1.0))),
    Mistake("4 s missing while the clock continues, loaded run", _of_runs(_close_gap(4.0), "loaded")),
    Mistake("4 s missing while the clock continues, both runs", _of_runs(_close_gap(4.0))),
    # Runs exchanged
    Mistake("empty and loaded run exchanged", lambda case: replace(case, empty=case.loaded, loaded=case.empty)),
    Mistake("the loaded run twice", lambda case: replace(case, empty=case.loaded)),
    Mistake("the empty run twice", lambda case: replace(case, loaded=case.empty)),
    # Signs
    Mistake("all signs flipped, both runs", _of_runs(_scale(-1.0)), of_sensors=True),
    Mistake("all signs flipped, loaded run", _of_runs(_scale(-1.0), "loaded")),
    Mistake("sign of joint 2 flipped, both runs", _of_runs(_change_joint(2, np.negative)), of_sensors=True),
    Mistake("sign of joint 3 flipped, both runs", _of_runs(_change_joint(3, np.negative)), of_sensors=True),
    Mistake("sign of joint 2 flipped, loaded run", _of_runs(_change_joint(2, np.negative), "loaded")),
    # Gravity
    *(
        Mistake(f"gravity {list(gravity)}", _of_runs(_describe(gravity=gravity)))
        for gravity in (
            (0.0, 0.0, 9.81),
            (9.81, 0.0, 0.0),
            (0.0, 9.81, 0.0),
            (0.0, 0.0, 0.0),
            (0.0, 0.0, -1.0),
            (0.0, 0.0, -1.62),
            (4.905, 0.0, -8.496),
        )
    ),
    # Sensors
    Mistake("joint 2 dead, both runs", _of_runs(_change_joint(2, np.zeros_like))),
    Mistake("joint 2 dead, loaded run", _of_runs(_change_joint(2, np.zeros_like), "loaded")),
    Mistake("joint 3 dead, both runs", _of_runs(_change_joint(3, np.zeros_like))),
    Mistake("joint 2 clipped, both runs", _of_runs(_change_joint(2, _clip))),
    Mistake("joint 2 clipped, loaded run", _of_runs(_change_joint(2, _clip), "loaded")),
    Mistake("joint 2 stuck for a quarter of the loaded run", _of_runs(_change_joint(2, _hold_value), "loaded")),
    Mistake("joint 2 reads double, loaded run", _of_runs(_change_joint(2, lambda x: 2.0 * x), "loaded")),
    Mistake("joint 2 reads double, both runs", _of_runs(_change_joint(2, lambda x: 2.0 * x)), of_sensors=True),
    Mistake("spikes, loaded run", _of_runs(_of_signal(_spikes), "loaded")),
    Mistake("spikes, both runs", _of_runs(_of_signal(_spikes))),
    # Angles
    Mistake("angles in degrees", _of_runs(lambda run: replace(run, q=np.rad2deg(run.q)))),
    Mistake("angles in degrees, no velocities", _of_runs(lambda run: replace(run, q=np.rad2deg(run.q), v=None))),
    Mistake("joint 2 counted from elsewhere, 90 degrees", _of_runs(_offset_angle(2, np.pi / 2.0))),
    Mistake("joint 3 counted from elsewhere, 30 degrees", _of_runs(_offset_angle(3, np.pi / 6.0))),
    Mistake("joint 2 counted from elsewhere, 180 degrees", _of_runs(_offset_angle(2, np.pi))),
    # Robot
    Mistake("a robot of the family, .7 as long and .4 as heavy", _other_robot(0.7, 0.4)),
    Mistake("a robot of the family, .55 as long and .3 as heavy", _other_robot(0.55, 0.3)),
    Mistake("a robot of the family, 1.4 as long and 1.8 as heavy", _other_robot(1.4, 1.8)),
    Mistake("joint 2 turns the other way in the file", _other_axis(2)),
    Mistake("joint 3 turns the other way in the file", _other_axis(3)),
    Mistake("the tip is 10 cm from the flange", _move_tip, can_be_seen=False),
    # Load
    Mistake("gains of other joints", _permute_gains),
    Mistake("weighed in pounds", _weigh(2.2046)),
    Mistake("weighed in grams", _weigh(1000.0)),
    Mistake("weighed a tenth too heavy", _weigh(1.1), can_be_seen=False),
    Mistake("the load lost half-way", _drop_load),
    Mistake("a table touched in the loaded run", _of_runs(_of_signal(_touch_table), "loaded")),
    Mistake("a gripper forgotten in the empty run", _forget_gripper, can_be_seen=False),
)
