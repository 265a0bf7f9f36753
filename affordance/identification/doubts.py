"""Test of fit: reasons not to trust an identification, from its recordings and its result.

The arm's own weight is the reference: a robot's file knows it to a factor of two, whatever the payload. Signals that
do not follow it have wrong signs, units, joints, gravity or times, or are those of another robot. Joints are judged
whose torque by the arm's own weight varies, along the run, by a tenth or more of what gravity asks of the strongest
joint over all postures; the others may show little but friction.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array, Mask
from affordance.exceptions import BadValueError
from affordance.identification.evidence.evidence import restore_compensated
from affordance.identification.evidence.gains import Gains
from affordance.identification.fit_checks import (
    FEWEST_SAMPLES,
    LEAST_OWN_TORQUE,
    compute_strength,
    judge_fit,
    judge_wrench,
)
from affordance.identification.posterior.payload_belief import PayloadBelief
from affordance.identification.recording.joint_rates import find_lag
from affordance.identification.recording.preparation import prepare
from affordance.identification.recording.run import WRENCH_COLUMNS, Run
from affordance.identification.settings import PRIORS, IdentificationSettings, SignalKind
from affordance.plant.serial_chain import SerialChain

# Factor to which a robot's file knows the torques of the arm's own weight: two standard deviations of the gains that
# it gives (gain_common_sd and gain_own_sd of the settings). A UR10e's file is 1.1 to 1.3 off at judged joints.
_MOST_FILE_FACTOR = 1.6
# The same of a loaded arm where there is no empty run: a load pulls along with the arm's own weight.
_MOST_FILE_FACTOR_LOADED = 3.0 * _MOST_FILE_FACTOR
# Least share of an empty arm's signal that its own weight explains beyond friction, and of a loaded arm's, whose load
# is not in the file. On recordings of a UR10e and a Panda it is .97 and more in windows of 10 s and more.
_LEAST_EXPLAINED, _LEAST_EXPLAINED_LOADED = 0.9, 0.6
# Largest change of a gain by the arm's own weight, and distance from the file's, in standard deviations: one of 370.
_MOST_CHANGE = 3.0
_LEAST_ERROR = 1e-6  # relative standard error of simulated signals without noise
# Duration of the run by whose own weight gains are found, [s]: in shorter ones a joint has few independent stretches
# for its five unknowns, and half of the intervals and more miss the truth (docs/identify_evidence.md).
_LEAST_DURATION = 15.0
# The same of postures that are held: four for each of a joint's three unknowns, gain, offset and error of the file.
_LEAST_POSTURES = 12
# Longest time over which a moving joint's signal stays at one value, to the last digit, [s]: an assumption.
_LONGEST_STILL = 1.0
# Least range of the angle of a joint that moves, [rad]: an assumption.
_LEAST_RANGE = 0.05
# Largest lag of velocities behind angles, [s]: those of a UR10e's controller are 1 to 2 ms late, a Panda's 5 ms.
_MOST_LATE = 0.02
# Time over which the errors of a model of the arm agree, [s]: those of the UR10e and the Panda over 0.2 to 2.
_AGREEMENT = 1.0
# What a result lacks if a part of its uncertainty is switched off, by the setting.
_SWITCHED_OFF = {
    "gains": "intervals are too narrow, as gains may not differ in this run from those known, or of the empty run",
    "load_friction": "intervals may be too narrow, as friction that grows with the load is left out",
    "friction": "intervals are wrong, as the load takes the part of friction and offsets, which are left out",
    "tare": "the empty run is not used: what it shows counts as load, and the errors it shows are in no interval",
    "floor": "intervals are too narrow, as errors of the models that do not average out are left out",
    "correlated_noise": "intervals are too narrow, as neighbouring samples count as independent",
}


class OwnWeight(NamedTuple):
    """Comparison of a run's signals with the torques of the arm's own weight."""

    gain: Array  # signal per torque, by least squares along with friction, shape (n,), [unit of the signal per N m]
    explained: Array  # share of the signal's variance beyond friction that the torques explain, shape (n,)
    error: Array  # relative standard error of the gain, shape (n,)
    judged: Mask  # True for the joints that can be judged, shape (n,)


def find_doubts(
    robot: SerialChain,
    loaded: Run,
    empty: Sequence[Run],
    belief: PayloadBelief,
    before: Gains,
    settings: IdentificationSettings,
) -> tuple[str, ...]:
    """Finds the reasons not to trust a belief, a sentence each; an empty tuple if there are none.

    The arm has the gravity and the joints the order of the runs; gains are those before the loaded run, drift
    included, or as calibrated in it.
    """
    doubts = list(_list_switched_off(belief, before, settings, has_empty=bool(empty)))
    if loaded.description.kind is SignalKind.WRENCH:
        return (*doubts, *judge_wrench(loaded, belief, before, settings))
    if empty:
        doubts += _judge_controller(robot, empty[0], before, settings)
    for run in (*empty, loaded):
        if not run.description.postures:
            doubts += [*_find_stuck(run), *_find_late(run)]
        if not run.description.compensates_arm:
            factor = _MOST_FILE_FACTOR if run is not loaded else np.inf if empty else _MOST_FILE_FACTOR_LOADED
            doubts += _judge_signals(robot, run, factor, belief, settings)
    doubts += _judge_duration((*empty, loaded)[0], belief, before)
    doubts += judge_fit(robot, loaded, belief, before, settings)
    return tuple(doubts)


def compare_with_own_weight(robot: SerialChain, run: Run, settings: IdentificationSettings) -> OwnWeight:
    """Compares a run of joint signals with the torques of the arm alone, with gravity as in the run."""
    robot = robot.with_gravity(run.description.gravity)
    prepared = prepare(run, settings)
    torque = robot.compute_arm_torques(*prepared.motion)
    signal = restore_compensated(robot, run, prepared, np.ones(robot.num_joints))
    n = robot.num_joints
    gain, explained, error, torque_sd = np.zeros((4, n))
    for j in range(n):
        used = np.abs(prepared.v[:, j]) >= settings.min_speed
        if np.count_nonzero(used) < FEWEST_SAMPLES:
            continue
        v, tau, x = prepared.v[used, j], torque[used, j], signal[used, j]
        friction = np.column_stack([np.sign(v), v, np.ones_like(v)])
        own = np.column_stack([tau, np.abs(tau) * np.sign(v), friction])
        solution, without = np.linalg.lstsq(own, x)[0], np.linalg.lstsq(friction, x)[0]
        rest, all_of_it = np.sum((x - own @ solution) ** 2), np.sum((x - friction @ without) ** 2)
        gain[j], torque_sd[j] = solution[0], tau.std()
        pieces = max(len(x) / (prepared.rate * _AGREEMENT), 1.0)  # stretches with errors of their own
        covariance = np.linalg.pinv(own.T @ own) * rest / pieces
        error[j] = np.sqrt(covariance[0, 0]) / max(abs(solution[0]), 1e-30)
        explained[j] = 1.0 - rest / all_of_it if all_of_it > 0.0 else 0.0
    return OwnWeight(gain, explained, error, torque_sd >= LEAST_OWN_TORQUE * compute_strength(robot))


def weigh_arm(robot: SerialChain, run: Run, gains: Gains, settings: IdentificationSettings) -> Array:
    """Compares gains by the arm's own weight in an empty run with known ones: ratios and relative errors, (n, 2)."""
    own = compare_with_own_weight(robot, run, settings)
    ratio = own.gain / gains.mean[:, 0]
    is_sure = own.judged & (ratio > 0.0)
    return np.where(is_sure[:, None], np.column_stack([ratio, np.maximum(own.error, _LEAST_ERROR)]), np.nan)


def _judge_controller(
    robot: SerialChain, empty: Run, before: Gains, settings: IdentificationSettings
) -> Iterator[str]:
    """Compares the signal for the arm's own weight with that of the run in which the gains were found."""
    if before.own_weight is None or empty.description.compensates_arm:
        return
    now, prior = weigh_arm(robot, empty, before, settings), settings.get_prior(before.kind)
    # Drift of both runs; the file's own errors are the same.
    drift = np.sqrt(2.0) * np.hypot(prior.drift_common_sd, prior.drift_own_sd)
    change = now[:, 0] / before.own_weight[:, 0] - 1.0
    sd = np.sqrt(drift**2 + now[:, 1] ** 2 + before.own_weight[:, 1] ** 2)
    for j in np.flatnonzero(np.abs(change) > _MOST_CHANGE * sd):
        yield (
            f"{empty.source}, {robot.joint_names[j]}: the signal for the arm's own weight has changed by "
            f"{100.0 * change[j]:+.0f} % since the gains were found, within {100.0 * _MOST_CHANGE * sd[j]:.0f} % is "
            "usual: another controller or arm, or a setting of the currents has changed"
        )


def _list_switched_off(
    belief: PayloadBelief, before: Gains, settings: IdentificationSettings, *, has_empty: bool
) -> Iterator[str]:
    """Lists parts of the uncertainty that were switched off and that this analysis would have had."""
    evidence, prior = belief.fit.evidence, settings.signal_prior or PRIORS[belief.fit.evidence.kind]
    is_wrench = evidence.kind is SignalKind.WRENCH
    drifts = belief.calibration is None and not before.is_by_weight and prior.drift_own_sd > 0.0
    would_count = {
        "gains": drifts or (evidence.is_difference and prior.change_own_sd > 0.0),
        "load_friction": prior.load_friction_sd > 0.0,
        "friction": prior.friction_sd > 0.0,
        "tare": is_wrench and has_empty,
        "floor": (has_empty and settings.tare) if is_wrench else True,
        "correlated_noise": True,
    }
    for name, lack in _SWITCHED_OFF.items():
        if would_count[name] and not getattr(settings, name):
            yield f"{lack} (--off {name.replace('_', '-')})"


def _judge_duration(run: Run, belief: PayloadBelief, before: Gains) -> Iterator[str]:
    """Judges the run that has to show gains and arm, where no load was weighed and no motion repeated."""
    duration = float(run.times[-1] - run.times[0])
    if not before.is_by_weight or belief.fit.evidence.is_repeated:
        return
    if run.description.postures:
        if len(run.times) < _LEAST_POSTURES:
            yield (
                f"{run.source}: {len(run.times)} postures are too few to tell the gains by the arm's own weight, "
                f"at least {_LEAST_POSTURES} are needed: repeat the postures with an empty hand, or weigh a load"
            )
    elif duration < _LEAST_DURATION:
        yield (
            f"{run.source}: {duration:.1f} s are too short to tell the gains by the arm's own weight, at least "
            f"{_LEAST_DURATION:g} s are needed: repeat the motion with an empty hand, or weigh a load"
        )


def _judge_signals(
    robot: SerialChain, run: Run, factor: float, belief: PayloadBelief, settings: IdentificationSettings
) -> Iterator[str]:
    """Judges a run's signals by the arm's own weight, which may be off by a factor."""
    own = compare_with_own_weight(robot, run, settings)
    bound = _LEAST_EXPLAINED if factor == _MOST_FILE_FACTOR else _LEAST_EXPLAINED_LOADED
    unit = run.description.kind.unit
    for j in np.flatnonzero(own.judged):
        ratio, explained = own.gain[j] / belief.gains[j, 0], 100.0 * own.explained[j]
        where = f"{run.source}, {robot.joint_names[j]}"
        if own.explained[j] < bound:
            yield (
                f"{where}: the arm's own weight explains {explained:.0f} % of the signal, at least "
                f"{100 * bound:.0f} % is usual: joints, gravity, times or the robot's file are not those of the run"
            )
        elif ratio <= 0.0 or abs(np.log(ratio)) > np.log(factor) + _MOST_CHANGE * own.error[j]:
            found = f"{own.gain[j]:.3g} {unit} per N m, the load {belief.gains[j, 0]:.3g}"
            yield (
                f"{where}: the arm's own weight says {found}: the signal, its sign or unit, gravity, the gains, the "
                "weighed mass or the robot's file are others"
            )


def check_sensors(run: Run) -> None:
    """Raises a BadValueError for a signal of a moving joint that does not change."""
    moves, names = np.ptp(run.q, axis=0) > _LEAST_RANGE, run.description.joint_names
    if run.description.postures and run.description.kind is not SignalKind.WRENCH:
        moves = moves & (run.signal[0] != 0.0)  # a joint along gravity shows nothing at rest
    if run.description.kind is SignalKind.WRENCH:
        moves, names = np.tile(moves.any(), len(WRENCH_COLUMNS)), WRENCH_COLUMNS
    for j in np.flatnonzero(moves & (np.ptp(run.signal, axis=0) == 0.0)):
        name = names[j]
        problem = f"is {run.signal[0, j]:g} throughout, must change as the joint moves"
        raise BadValueError(run.source, f"signal of {name}", problem)


def _find_late(run: Run) -> Iterator[str]:
    """Finds velocities that are late behind their angles, or early, which moves the torques that they explain."""
    if run.v is None:
        return
    moves = np.flatnonzero(np.ptp(run.q, axis=0) > _LEAST_RANGE)
    lags = np.array([find_lag(run.times, run.q[:, j], run.v[:, j]) for j in moves])
    if moves.size and abs(lag := float(np.median(lags))) > _MOST_LATE:
        way = "late" if lag > 0.0 else "early"
        yield (
            f"{run.source}: velocities are {abs(1e3 * lag):.0f} ms {way} by their angles, at most "
            f"{1e3 * _MOST_LATE:g} ms is usual: shift them, or leave them out"
        )


def _find_stuck(run: Run) -> Iterator[str]:
    """Finds signals that stay at one value, to the last digit, while their joint moves."""
    for j, name in enumerate(run.description.joint_names):
        # Rows at which the signal takes another value, and those before them.
        first = np.concatenate([[0], np.flatnonzero(np.diff(run.signal[:, j])) + 1])
        last = np.concatenate([first[1:], [len(run.times)]]) - 1
        durations = run.times[last] - run.times[first]
        for k in np.flatnonzero(durations > _LONGEST_STILL):
            if np.ptp(run.q[first[k] : last[k] + 1, j]) > _LEAST_RANGE:
                value, start = run.signal[first[k], j], run.times[first[k]] - run.times[0]
                yield (
                    f"{run.source}, {name}: the signal is {value:g} from {start:.1f} s on for {durations[k]:.1f} s "
                    "while the joint moves: the sensor is saturated, or sticks"
                )
                break
