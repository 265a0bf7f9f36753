"""Test of fit: reasons not to trust an identification, from its recordings and its result.

The arm's own weight is the reference: a robot's file knows it to a factor of two, whatever the payload. Signals that
do not follow it have wrong signs, units, joints, gravity or times, or are those of another robot. Joints are judged
whose torque by the arm's own weight varies, along the run, by a tenth or more of what gravity asks of the strongest
joint over all postures; the others may show little but friction.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array, Mask
from affordance.exceptions import BadValueError
from affordance.identification.evidence.evidence import Evidence, build_evidence, restore_compensated
from affordance.identification.evidence.gains import Gains
from affordance.identification.posterior.payload_belief import PayloadBelief
from affordance.identification.posterior.payload_fit import build_channel_prior, fit_payload
from affordance.identification.posterior.solid_prior import SolidPrior
from affordance.identification.recording.preparation import prepare
from affordance.identification.recording.run import Run
from affordance.identification.settings import IdentificationSettings, SignalKind
from affordance.plant.serial_chain import SerialChain

_JUDGED, _NUM_POSTURES = 0.1, 50  # see the module
# Factor to which a robot's file knows the torques of the arm's own weight: two standard deviations of the gains that
# it gives (gain_common_sd and gain_own_sd of the settings). A UR10e's file is 1.1 to 1.3 off at judged joints.
_FILE_FACTOR = 1.6
# Gains of currents, from the geared motors of the largest arms to servos, with a factor of ten to spare, [A/(N m)].
_CURRENT_GAINS = (2e-3, 20.0)
# Least share of an empty arm's signal that its own weight explains beyond friction, and of a loaded arm's, whose load
# is not in the file. On recordings of a UR10e and a Panda it is .97 and more in windows of 10 s and more.
_EXPLAINED, _EXPLAINED_LOADED = 0.9, 0.6
# Largest residual relative to the signal of the arm's own weight. Where runs are paired it is 0.01 to 0.03; where the
# empty arm was fitted to other motions, up to 0.25 in windows of 8 s; where it is only as its file says, the file's
# own error is part of it. By whether the signal is a difference, and of repeated motions.
_RESIDUAL = {(True, True): 0.15, (True, False): 0.4, (False, False): 1.0}
# Least signal that residuals are compared with, as a share of what gravity asks of the strongest joint: a joint's
# errors do not shrink with its motion. Those of a UR10e's pair are up to 0.022 of that torque; this allows 0.045.
_LEAST_SIGNAL = 0.3
# Largest shift of a gain from what was known before the run, and of a weighed mass, in standard deviations.
_SHIFT = 5.0
# Factor by which another reading of the runs must lower the errors' variance, in the mean over joints, to be the
# better one; and rate of the samples by which they are compared, [Hz].
_BETTER, _ENOUGH_RATE = 4.0, 25.0
# Residual relative to the load's signal above which other readings are tried; of heavy loads it is 0.02 to 0.4.
_LEFT = 0.5
# Torque of the load below which a joint carries no information on it, as a share of the largest torque of any joint.
_TURNED = 0.05
# Relative error of the mass by both halves of a run at which gains are refuted, if it is as many standard deviations.
_HALVES, _SDS = 0.05, 3.0
# Time over which the errors of a model of the arm agree, [s].
_AGREEMENT = 1.0
_FEWEST = 50  # samples of a joint that are needed to judge it
# Duration of the run by whose own weight gains are found, [s]: in shorter ones a joint has few independent stretches
# for its five unknowns, and half of the intervals and more miss the truth (docs/identify.md).
_LEAST_DURATION = 15.0
# Time over which a moving joint's signal may stay at one value, to the last digit, [s].
_STUCK = 1.0
_MOVES = 0.05  # range of a joint's angle above which it moves, [rad]


class OwnWeight(NamedTuple):
    """Comparison of a run's signals with the torques of the arm's own weight.

    Attributes:
        gain: Signal per torque, by least squares along with friction, shape (n,), [unit of the signal per N m].
        explained: Share of the signal's variance beyond friction that the torques explain, shape (n,).
        error: Relative standard error of the gain, shape (n,).
        torque_sd: Standard deviation of the torques, shape (n,), [N m].
        judged: True for the joints that can be judged, shape (n,).
    """

    gain: Array
    explained: Array
    error: Array
    torque_sd: Array
    judged: Mask


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
        if np.count_nonzero(used) < _FEWEST:
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
    return OwnWeight(gain, explained, error, torque_sd, torque_sd >= _JUDGED * _compute_strength(robot))


def _compute_strength(robot: SerialChain) -> float:
    """Computes what gravity asks of the strongest joint, root mean square over all postures, [N m]."""
    q = np.random.default_rng(0).uniform(-np.pi, np.pi, (_NUM_POSTURES, robot.num_joints))
    torque = robot.compute_arm_torques(q, np.zeros_like(q), np.zeros_like(q))
    return max(float(np.sqrt((torque**2).mean(axis=0)).max()), 1e-9)


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
    if loaded.description.kind is SignalKind.WRENCH:
        return ()
    doubts: list[str] = []
    for run in (*empty, loaded):
        doubts += _find_stuck(run)
        if not run.description.compensates_arm:
            doubts += _judge_signals(robot, run, run is loaded, belief, settings)
    doubts += _judge_duration((*empty, loaded)[0], belief, before)
    doubts += _judge_fit(robot, loaded, belief, before, settings)
    return tuple(doubts)


def _judge_duration(run: Run, belief: PayloadBelief, before: Gains) -> Iterator[str]:
    """Judges the run that has to show gains and arm, where no load was weighed and no motion repeated."""
    duration = float(run.times[-1] - run.times[0])
    if before.common_sd > 0.0 and not belief.fit.evidence.is_repeated and duration < _LEAST_DURATION:
        yield (
            f"{run.source}: {duration:.1f} s are too short to tell the gains by the arm's own weight, at least "
            f"{_LEAST_DURATION:g} s are needed: repeat the motion with an empty hand, or weigh a load"
        )


def _judge_signals(
    robot: SerialChain, run: Run, is_loaded: bool, belief: PayloadBelief, settings: IdentificationSettings
) -> Iterator[str]:
    """Judges a run's signals by the arm's own weight."""
    own = compare_with_own_weight(robot, run, settings)
    bound = _EXPLAINED_LOADED if is_loaded else _EXPLAINED
    unit = run.description.kind.unit
    for j in np.flatnonzero(own.judged):
        ratio, explained = own.gain[j] / belief.gains[j, 0], 100.0 * own.explained[j]
        where = f"{run.source}, {robot.joint_names[j]}"
        if own.explained[j] < bound:
            yield (
                f"{where}: the arm's own weight explains {explained:.0f} % of the signal, at least "
                f"{100 * bound:.0f} % is usual: joints, gravity, times or the robot's file are not those of the run"
            )
        elif ratio <= 0.0:
            yield (
                f"{where}: the signal falls where the arm's own weight pulls more ({own.gain[j]:.3g} {unit} per N "
                "m): signs, gravity or joints are wrong"
            )
        elif abs(np.log(ratio)) > np.log(_FILE_FACTOR) + _SDS * own.error[j] and not is_loaded:
            found = f"{own.gain[j]:.3g} {unit} per N m, the load {belief.gains[j, 0]:.3g}"
            yield (
                f"{where}: the arm's own weight says {found}: the signal, its unit, the gains, the weighed mass or "
                "the robot's file are others"
            )


def _judge_fit(
    robot: SerialChain, loaded: Run, belief: PayloadBelief, before: Gains, settings: IdentificationSettings
) -> Iterator[str]:
    """Judges gains and residual of the fit."""
    evidence = belief.fit.evidence
    torque_sd = evidence.arm_torque.std(axis=0)
    strength = _compute_strength(robot)
    judged = torque_sd >= _JUDGED * strength
    if before.robot and before.robot != robot.fingerprint:
        yield f"the gains ({before.source}) were found with the file of another robot than {robot.source}"
    # By the arm's own weight the gains of the other joints are open.
    yield from _judge_gains(robot, belief, judged if belief.calibration is None else np.ones_like(judged))
    if belief.reference_mass is not None and belief.calibration is None:
        apart = abs(belief.mass - belief.reference_mass)
        if apart > max(_SHIFT * belief.mass_sd, _HALVES * belief.reference_mass):
            yield f"{belief.reference_mass:g} kg was weighed, {belief.mass:.3g} kg is felt: units or scale are wrong"
    if belief.calibration is None:
        shift = np.abs(belief.gains[:, 0] - before.mean[:, 0]) / np.sqrt(
            np.maximum(before.covariance[:, 0, 0], 1e-30)
        )
        for j in np.flatnonzero(settings.gains & (shift > _SHIFT)):
            yield (
                f"{robot.joint_names[j]}: the load says a gain {shift[j]:.0f} standard deviations away from what was "
                "known before: another robot's, or another signal's"
            )
    bound = _RESIDUAL[evidence.is_difference, evidence.is_repeated]
    usual = np.maximum(torque_sd, _LEAST_SIGNAL * strength)
    share = belief.noise_sd / np.maximum(np.abs(belief.gains[:, 0]) * usual, 1e-30)
    for j in np.flatnonzero(judged & (share > bound)):
        signal = "the arm's own signal" if torque_sd[j] == usual[j] else "a usual signal of the arm"
        left = f"leaves {100.0 * share[j]:.0f} % of {signal} unexplained"
        yield (
            f"{robot.joint_names[j]}: the load {left}, at most {100.0 * bound:.0f} % is usual: the sensor, or the "
            "match of signal and motion, is wrong"
        )
    if evidence.is_difference and _leaves_much(belief):
        yield from _compare_alternatives(robot, loaded, belief, before, settings)
    halves = belief.halves
    if halves is not None and (np.abs(halves.error) > np.maximum(_HALVES, _SDS * halves.sd / halves.mass)).all():
        found = " and ".join(f"{mass:.3g}" for mass in halves.mass)
        yield f"gains of one half give {found} kg in the other, {belief.reference_mass:g} kg was weighed"


def _judge_gains(robot: SerialChain, belief: PayloadBelief, judged: Mask) -> Iterator[str]:
    """Finds gains that no robot has among those of the judged joints, as far as the run determines them."""
    evidence = belief.fit.evidence
    if belief.calibration is not None:  # with what the body leaves open
        gains, covariance = belief.calibration.mean, belief.calibration.covariance
    else:
        gains, covariance = belief.fit.likelihood.estimate_gains(belief.fit.mode.load)
    low, high = _CURRENT_GAINS if evidence.kind is SignalKind.CURRENT else (0.0, np.inf)
    for j in np.flatnonzero(judged):
        gain, sd = gains[j, 0], np.sqrt(covariance[j, 0, 0])
        found = f"{robot.joint_names[j]}: the gain is {gain:.3g} {evidence.kind.unit} per N m"
        if gain + _SHIFT * sd < 0.0:
            yield f"{found}, negative: signs or joints are wrong"
        elif gain + _SHIFT * sd < low or gain - _SHIFT * sd > high:
            yield f"{found}, {low:g} to {high:g} are usual: the signal has another unit"


def _leaves_much(belief: PayloadBelief) -> bool:
    """Returns whether the fit leaves much of the load's signal at a joint that the load turns."""
    load_sd = (belief.fit.evidence.samples.Y @ belief.parameters).std(axis=0)
    turned = load_sd >= _TURNED * load_sd.max()
    left = belief.noise_sd / np.maximum(np.abs(belief.gains[:, 0]) * load_sd, 1e-30)
    return bool((left > _LEFT)[turned].any())


def _compare_alternatives(
    robot: SerialChain, loaded: Run, belief: PayloadBelief, before: Gains, settings: IdentificationSettings
) -> Iterator[str]:
    """Compares the fit with that of the opposite load, and with neighbouring joints exchanged."""
    if belief.calibration is not None:  # the gains were found by the reading that is to be compared
        before = before.widen()
    evidence = belief.fit.evidence
    every = max(1, round(evidence.rate / _ENOUGH_RATE))
    rows = slice(None, None, every)
    thin = replace(evidence.select(rows), rate=evidence.rate / every, least_variance=np.zeros(1))
    if (thin.samples.used.sum(axis=0) < _FEWEST).all():
        return

    def measure(other: Evidence) -> float:
        """Computes the mean logarithm of the joints' error variances."""
        fit = fit_payload(other, build_channel_prior(other, before, settings), SolidPrior.for_hand(), settings)
        return float(np.log(fit.long_run_variance[other.samples.used.sum(axis=0) >= _FEWEST]).mean())

    best = measure(thin) - np.log(_BETTER)
    samples = thin.samples
    if measure(replace(thin, samples=samples._replace(signal=-samples.signal))) < best:
        yield (
            f"{loaded.source}: the opposite of the load explains the runs better: the empty and the loaded run, or "
            "signs, are exchanged"
        )
    names = robot.joint_names
    for j in range(robot.num_joints - 1):
        order = np.arange(robot.num_joints)
        order[[j, j + 1]] = order[[j + 1, j]]
        exchanged = thin.prepared._replace(
            q=thin.prepared.q[:, order],
            v=thin.prepared.v[:, order],
            vdot=thin.prepared.vdot[:, order],
            signal=samples.signal[:, order],
        )
        other = build_evidence(robot, loaded.source, thin.kind, exchanged, settings, analysis="", is_difference=True)
        if measure(replace(other, rate=thin.rate)) < best:
            yield f"{loaded.source}: {names[j]} and {names[j + 1]} exchanged explain the load better"


def check_sensors(run: Run) -> None:
    """Raises a BadValueError for a signal of a moving joint that does not change."""
    dead = (np.ptp(run.signal, axis=0) == 0.0) & (np.ptp(run.q, axis=0) > _MOVES)
    for j in np.flatnonzero(dead):
        name = run.description.joint_names[j]
        problem = f"is {run.signal[0, j]:g} throughout, must change as the joint moves"
        raise BadValueError(run.source, f"signal of {name}", problem)


def _find_stuck(run: Run) -> Iterator[str]:
    """Finds signals that stay at one value, to the last digit, while their joint moves."""
    for j, name in enumerate(run.description.joint_names):
        # Rows at which the signal takes another value, and those before them.
        first = np.concatenate([[0], np.flatnonzero(np.diff(run.signal[:, j])) + 1])
        last = np.concatenate([first[1:], [len(run.times)]]) - 1
        durations = run.times[last] - run.times[first]
        for k in np.flatnonzero(durations > _STUCK):
            if np.ptp(run.q[first[k] : last[k] + 1, j]) > _MOVES:
                value, start = run.signal[first[k], j], run.times[first[k]] - run.times[0]
                yield (
                    f"{run.source}, {name}: the signal is {value:g} from {start:.1f} s on for {durations[k]:.1f} s "
                    "while the joint moves: the sensor is saturated, or sticks"
                )
                break
