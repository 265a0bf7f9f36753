"""Reasons to doubt an identification, from its recordings and its result.

The reference is the torque due to the arm's own weight, which a robot's file predicts to within a factor of two,
whatever the payload. Signals that do not follow it have wrong signs, units, joints, gravity or times, or come from
another robot. A joint is judged only if its own-weight torque varies along the run by at least a tenth of the gravity
torque that the strongest joint bears over all postures. The other joints may show little but friction.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array, Mask
from affordance.exceptions import BadValueError
from affordance.extensions.payload.evidence.evidence import restore_compensated
from affordance.extensions.payload.evidence.gains import Gains
from affordance.extensions.payload.fit_checks import (
    FEWEST_SAMPLES,
    LEAST_OWN_TORQUE,
    compute_strength,
    judge_fit,
    judge_wrench,
)
from affordance.extensions.payload.posterior.payload_belief import PayloadBelief
from affordance.extensions.payload.recording.joint_rates import find_lag
from affordance.extensions.payload.recording.preparation import prepare
from affordance.extensions.payload.recording.run import WRENCH_COLUMNS, Run
from affordance.extensions.payload.settings import IdentificationSettings, SignalKind
from affordance.plant.serial_chain import SerialChain

# Factor by which a robot's file may be wrong about the torques due to the arm's own weight: two standard deviations
# of the gains that follow from it (gain_common_sd and gain_own_sd of the settings). The file of a UR10e is wrong by a
# factor of 1.1 to 1.3 at the joints that are judged.
_MOST_FILE_FACTOR = 1.6
# The same for a loaded arm without an empty run, as the load adds to the arm's own weight.
_MOST_FILE_FACTOR_LOADED = 3.0 * _MOST_FILE_FACTOR
# Least share of an empty arm's signal that its own weight must explain beyond friction, and the same for a loaded
# arm, whose load is not in the file. In recordings of a UR10e and a Panda the share is at least .97 in windows of 10
# s or more.
_LEAST_EXPLAINED, _LEAST_EXPLAINED_LOADED = 0.9, 0.6
# Largest change of a gain that follows from the arm's own weight, and largest distance from the file's gain, in
# standard deviations: chance exceeds it once in 370.
_MOST_CHANGE = 3.0
_LEAST_ERROR = 1e-6  # relative standard error assumed for simulated signals without noise
# Least duration of a run from whose own-weight torques gains are estimated, [s]. In shorter runs a joint has too few
# independent stretches for its five unknowns, and at least half of the intervals miss the truth
# (docs/identify_evidence.md).
_LEAST_DURATION = 15.0
# The same for held postures: four for each of a joint's three unknowns (gain, offset and error of the file).
_LEAST_POSTURES = 12
# Longest time for which the signal of a moving joint may repeat exactly the same value, [s]: an assumption.
_LONGEST_STILL = 1.0
# Range of angles above which a joint counts as moving, [rad]: an assumption.
_LEAST_RANGE = 0.05
# Largest delay of velocities behind angles, [s]. A UR10e's controller delays them by 1 to 2 ms, a Panda's by 5 ms.
_MOST_LATE = 0.02
# Correlation time of the errors of an arm's model, [s]: 0.2 to 2 s for the UR10e and the Panda.
_AGREEMENT = 1.0


class OwnWeight(NamedTuple):
    """Regression of a run's signals on the torques due to the arm's own weight."""

    gain: Array  # signal per torque, fitted together with friction, shape (n,), [unit of the signal per N m]
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
    """Finds the reasons to doubt a belief, one sentence each.

    The arm must have the gravity of the runs, and the runs the joint order of the arm. ``before`` has the gains as
    known before the loaded run, drift included, or as calibrated in it.

    Returns: The sentences; an empty tuple if there is no reason to doubt.
    """
    if loaded.description.kind is SignalKind.WRENCH:
        return tuple(judge_wrench(loaded, belief, before, settings))
    doubts: list[str] = []
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
    """Compares a run of joint signals with the torques of the arm alone, under the gravity of the run."""
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
        pieces = max(len(x) / (prepared.rate * _AGREEMENT), 1.0)  # number of independent stretches
        covariance = np.linalg.pinv(own.T @ own) * rest / pieces
        error[j] = np.sqrt(covariance[0, 0]) / max(abs(solution[0]), 1e-30)
        explained[j] = 1.0 - rest / all_of_it if all_of_it > 0.0 else 0.0
    return OwnWeight(gain, explained, error, torque_sd >= LEAST_OWN_TORQUE * compute_strength(robot))


def weigh_arm(robot: SerialChain, run: Run, gains: Gains, settings: IdentificationSettings) -> Array:
    """Compares gains estimated from the arm's own weight in an empty run with known gains.

    Returns: The ratios and their relative standard errors, shape (n, 2); NaN for joints that cannot be judged.
    """
    own = compare_with_own_weight(robot, run, settings)
    ratio = own.gain / gains.mean[:, 0]
    is_sure = own.judged & (ratio > 0.0)
    return np.where(is_sure[:, None], np.column_stack([ratio, np.maximum(own.error, _LEAST_ERROR)]), np.nan)


def _judge_controller(
    robot: SerialChain, empty: Run, before: Gains, settings: IdentificationSettings
) -> Iterator[str]:
    """Compares the signal due to the arm's own weight with that of the run in which the gains were estimated."""
    if before.own_weight is None or empty.description.compensates_arm:
        return
    now, prior = weigh_arm(robot, empty, before, settings), settings.get_prior(before.kind)
    # Both runs drift; the errors of the file are the same in both.
    drift = np.sqrt(2.0) * np.hypot(prior.drift_common_sd, prior.drift_own_sd)
    change = now[:, 0] / before.own_weight[:, 0] - 1.0
    sd = np.sqrt(drift**2 + now[:, 1] ** 2 + before.own_weight[:, 1] ** 2)
    for j in np.flatnonzero(np.abs(change) > _MOST_CHANGE * sd):
        yield (
            f"{empty.source}, {robot.joint_names[j]}: the signal for the arm's own weight has changed by "
            f"{100.0 * change[j]:+.0f} % since the gains were found; usual changes stay within "
            f"{100.0 * _MOST_CHANGE * sd[j]:.0f} %: another controller or arm, or other current settings?"
        )


def _judge_duration(run: Run, belief: PayloadBelief, before: Gains) -> Iterator[str]:
    """Checks that a run is long enough to determine the gains, unless a load was weighed or a motion repeated."""
    duration = float(run.times[-1] - run.times[0])
    if not before.is_by_weight or belief.fit.evidence.is_repeated:
        return
    if run.description.postures:
        if len(run.times) < _LEAST_POSTURES:
            yield (
                f"{run.source}: {len(run.times)} postures are too few to determine the gains from the arm's own "
                f"weight, {_LEAST_POSTURES} are needed: repeat the postures with an empty hand, or weigh a load"
            )
    elif duration < _LEAST_DURATION:
        yield (
            f"{run.source}: {duration:.1f} s are too short to determine the gains from the arm's own weight, at "
            f"least {_LEAST_DURATION:g} s are needed: repeat the motion with an empty hand, or weigh a load"
        )


def _judge_signals(
    robot: SerialChain, run: Run, factor: float, belief: PayloadBelief, settings: IdentificationSettings
) -> Iterator[str]:
    """Compares a run's signals with the torques due to the arm's own weight, which may be wrong by a factor."""
    own = compare_with_own_weight(robot, run, settings)
    bound = _LEAST_EXPLAINED if factor == _MOST_FILE_FACTOR else _LEAST_EXPLAINED_LOADED
    unit = run.description.kind.unit
    for j in np.flatnonzero(own.judged):
        ratio, explained = own.gain[j] / belief.gains[j, 0], 100.0 * own.explained[j]
        where = f"{run.source}, {robot.joint_names[j]}"
        if own.explained[j] < bound:
            yield (
                f"{where}: the arm's own weight explains {explained:.0f} % of the signal, at least "
                f"{100 * bound:.0f} % is usual: joints, gravity, times or the robot's file do not belong to this run"
            )
        elif ratio <= 0.0 or abs(np.log(ratio)) > np.log(factor) + _MOST_CHANGE * own.error[j]:
            found = f"{own.gain[j]:.3g} {unit} per N m, the load one of {belief.gains[j, 0]:.3g}"
            yield (
                f"{where}: the arm's own weight implies a gain of {found}: check the signal, its sign and unit, "
                "gravity, the gains, the weighed mass and the robot's file"
            )


def check_sensors(run: Run) -> None:
    """Checks that the signals of all moving joints change.

    Raises:
        BadValueError: The signal of a moving joint is constant.
    """
    moves, names = np.ptp(run.q, axis=0) > _LEAST_RANGE, run.description.joint_names
    if run.description.postures and run.description.kind is not SignalKind.WRENCH:
        moves = moves & (run.signal[0] != 0.0)  # a joint whose axis is along gravity feels nothing at rest
    if run.description.kind is SignalKind.WRENCH:
        moves, names = np.tile(moves.any(), len(WRENCH_COLUMNS)), WRENCH_COLUMNS
    for j in np.flatnonzero(moves & (np.ptp(run.signal, axis=0) == 0.0)):
        name = names[j]
        problem = f"is {run.signal[0, j]:g} throughout, must change while the joint moves"
        raise BadValueError(run.source, f"signal of {name}", problem)


def _find_late(run: Run) -> Iterator[str]:
    """Finds velocities that are late or early relative to their angles, which distorts computed torques."""
    if run.v is None:
        return
    moves = np.flatnonzero(np.ptp(run.q, axis=0) > _LEAST_RANGE)
    lags = np.array([find_lag(run.times, run.q[:, j], run.v[:, j]) for j in moves])
    if moves.size and abs(lag := float(np.median(lags))) > _MOST_LATE:
        way = "late" if lag > 0.0 else "early"
        yield (
            f"{run.source}: velocities are {abs(1e3 * lag):.0f} ms {way} relative to their angles, at most "
            f"{1e3 * _MOST_LATE:g} ms is usual: shift them, or leave them out"
        )


def _find_stuck(run: Run) -> Iterator[str]:
    """Finds signals that repeat exactly the same value while their joint moves."""
    for j, name in enumerate(run.description.joint_names):
        # Rows at which the signal takes another value, and the rows before them.
        first = np.concatenate([[0], np.flatnonzero(np.diff(run.signal[:, j])) + 1])
        last = np.concatenate([first[1:], [len(run.times)]]) - 1
        durations = run.times[last] - run.times[first]
        for k in np.flatnonzero(durations > _LONGEST_STILL):
            if np.ptp(run.q[first[k] : last[k] + 1, j]) > _LEAST_RANGE:
                value, start = run.signal[first[k], j], run.times[first[k]] - run.times[0]
                yield (
                    f"{run.source}, {name}: from {start:.1f} s on, the signal stays at {value:g} for "
                    f"{durations[k]:.1f} s while the joint moves: the sensor is saturated or stuck"
                )
                break
