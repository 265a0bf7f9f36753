"""Finds reasons to doubt an identified payload.

The main test compares signals with the torque due to the arm's own weight. A robot's file predicts this torque to
within a factor of two, whatever the payload. Signals that do not fit have wrong signs, units, joints, gravity or
times, or belong to another robot. A joint is tested only if its own-weight torque varies during the run by at least a
tenth of the gravity torque of the strongest joint over all postures. The signals of other joints may be mostly
friction.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array, Mask
from affordance.exceptions import BadValueError
from affordance.extensions.payload.evidence.evidence import Evidence, build_evidence, restore_compensated
from affordance.extensions.payload.evidence.gains import Gains
from affordance.extensions.payload.posterior.calibration import SCALE_SD
from affordance.extensions.payload.posterior.payload_belief import PayloadBelief
from affordance.extensions.payload.posterior.payload_fit import (
    build_channel_prior,
    estimate_changes,
    fit_payload,
    measure_axes,
)
from affordance.extensions.payload.posterior.solid_prior import SolidPrior
from affordance.extensions.payload.recording.joint_rates import find_lag
from affordance.extensions.payload.recording.preparation import prepare
from affordance.extensions.payload.recording.run import WRENCH_COLUMNS, Run
from affordance.extensions.payload.settings import IdentificationSettings, SignalKind
from affordance.plant.serial_chain import SerialChain

# Factor by which a robot's file may be wrong about own-weight torques: two standard deviations of the gains that are
# estimated from these torques (gain_common_sd and gain_own_sd of the settings). The file of a UR10e is wrong by a
# factor of 1.1 to 1.3 at the joints that are tested.
_MOST_FILE_FACTOR = 1.6
# The same for a loaded arm without an empty run, as the load adds to the arm's own weight.
_MOST_FILE_FACTOR_LOADED = 3.0 * _MOST_FILE_FACTOR
# Least share of an empty arm's signal that its own weight must explain beyond friction, and the same for a loaded
# arm, whose load is not in the file. In recordings of a UR10e and a Panda the share is at least .97 in windows of 10
# s or more.
_LEAST_EXPLAINED, _LEAST_EXPLAINED_LOADED = 0.9, 0.6
# Largest change of a gain (between own weight and load, or between empty and loaded run), largest distance from the
# file's gain, and largest error of the arm's model that a load of negative mass may need, in standard deviations. By
# chance this is exceeded once in 370 cases.
_MOST_CHANGE = 3.0
_LEAST_ERROR = 1e-6  # relative standard error assumed for simulated signals without noise
# Shortest run from whose own-weight torques gains are estimated, [s]. Shorter runs have too few independent errors
# for the five unknowns of a joint, and at least half of the intervals miss the truth (docs/identify_evidence.md).
_LEAST_DURATION = 15.0
# The same in postures: four for each of a joint's three unknowns (gain, offset and error of the file).
_LEAST_POSTURES = 12
# Longest time for which the signal of a moving joint may be exactly constant, [s]: an assumption.
_LONGEST_STILL = 1.0
# Range of angles above which a joint counts as moving, [rad]: an assumption.
_LEAST_RANGE = 0.05
# Relative range below which the signals of all postures are equal up to rounding.
_SAME = 1e-9
# Largest delay of velocities behind angles, [s]. A UR10e's controller delays them by 1 to 2 ms, a Panda's by 5 ms.
_MOST_LATE = 0.02
# Correlation time of the errors of an arm's model, [s]: 0.2 to 2 s for the UR10e and the Panda.
_AGREEMENT = 1.0
# Thresholds of the tests. Unless a source is given, each was chosen between the values in good windows of recordings
# (a UR10e's pair of runs, a Panda's empty run) and the values with deliberate mistakes
# (docs/decisions/0020-recorded-data.md).
#
# Least standard deviation of a joint's own-weight torque at which the joint is tested, as a share of the gravity
# torque of the strongest joint, and number of random postures that determine the latter. The signals of other joints
# may be mostly friction.
_LEAST_OWN_TORQUE, _NUM_POSTURES = 0.1, 50
# Fewest samples with which a joint is tested: ten for each of the five unknowns of its own weight and friction.
_FEWEST_SAMPLES = 50
# Usual gains of motor currents, [A/(N m)], from the largest arms to small servos, widened by a factor of ten.
_USUAL_CURRENT_GAINS = (2e-3, 20.0)
# Largest ratio between a calibrated gain and the median over joints: an assumption, because the motors of one arm
# have similar gear ratios and torque constants.
_MOST_UNLIKE_GAINS = 4.0
# Largest residual relative to the own-weight signal; the keys are (difference of two runs, repeated motion). For
# paired runs the residual is 0.01 to 0.03 in recordings, and up to 0.2 on a simulated UR5, whose load friction jumps
# when a joint reverses. With an empty arm fitted to other motions it is up to 0.25 in windows of 8 s. If the arm's
# model comes from its file, the residual includes the file's error.
_MOST_RESIDUAL = {(True, True): 0.25, (True, False): 0.4, (False, False): 1.0}
# Least own-weight signal with which residuals are compared, as a share of the gravity torque of the strongest joint,
# because errors do not shrink with motion. The errors in a UR10e's pair are up to 0.022 of that torque; this
# threshold allows 0.075.
_LEAST_SIGNAL = 0.3
# Largest difference between a gain and its prior mean, or between identified and weighed mass, in standard
# deviations. By chance this is exceeded once in 1.7 million cases if errors are normal, and once in 1,200 if the
# standard deviations are a third too small.
_MOST_SHIFT = 5.0
# Least factor by which another interpretation of the runs must divide the error variance to be better (geometric mean
# over joints). In good pairs of the UR10e and of simulated arms no alternative lowers the variance (factors up to
# 0.9). With the runs exchanged the factor is 1,900 in the UR10e's pair and at least 4.1 in simulated pairs. With
# neighbouring joints exchanged it is 2.4 to 83 in the UR10e's pair, and below 4 in some simulated pairs, which other
# tests detect.
_LEAST_IMPROVEMENT = 4.0
_EXCHANGED = "the empty and the loaded run are exchanged, or the signs are wrong"
# Sampling rate at which interpretations are compared, [Hz]: the errors of arms are correlated over tenths of a
# second.
_COMPARISON_RATE = 25.0
# Residual relative to the load's signal above which other interpretations are tested; for heavy loads it is 0.02 to
# 0.4.
_LARGE_RESIDUAL = 0.5
# Smallest load torque, relative to the largest of any joint, at which a joint is informative about the load.
_LEAST_LOAD_TORQUE = 0.05
# Largest unexplained share of the variation of a wrist sensor's forces, or moments: an assumption. Residuals below
# the second pair, [N] and [N m], are never reported, because a light load may be smaller than the drift.
_MOST_WRENCH_RESIDUAL, _WRENCH_DRIFT = 0.5, (1.0, 0.2)
# Largest relative error of the mass from each half of a run at which the gains are accepted, and the same in standard
# deviations. The errors of the UR10e's halves are below 0.4 %. The second limit also applies to the weight of an
# empty hand.
_MOST_HALF_ERROR, _MOST_HALF_SDS = 0.05, 3.0
# Largest ratio between the errors of a run and those of the runs that calibrated the gains or show the empty arm. In
# 28 windows of a UR10e's recording the ratio is at most 1.5; with mistakes it is 4.6 or more.
_MOST_ERRORS = 4.0
# Ratio below which errors are suspiciously small (geometric mean over joints), because commanded torques or currents
# have no sensor noise. In the UR10e's pair commanded values have a mean of .09, or .15 with 30 % of the measured
# error at the first joint; in its windows of 12 s the mean is at least .65.
_LEAST_ERRORS = 0.25
# Largest difference between the masses from the two halves of a run, in standard deviations: at most 1.7 in good
# windows, at least 7 if the load is lost half-way. Shortest half, [s], because errors are correlated over two
# seconds.
_MOST_APART, _SHORTEST_HALF = 4.0, 4.0


class OwnWeight(NamedTuple):
    """Regression of a run's signals on the torques due to the arm's own weight."""

    # Signal per torque, fitted together with friction and rotor inertia, shape (n,), [unit of the signal per N m].
    gain: Array
    # Share of the signal's variance beyond friction that own weight and rotor inertia explain, shape (n,).
    explained: Array
    error: Array  # relative standard error of the gain, shape (n,)
    judged: Mask  # True for each joint that can be tested, shape (n,)


def find_doubts(
    robot: SerialChain,
    loaded: Run,
    empty: Sequence[Run],
    belief: PayloadBelief,
    before: Gains,
    settings: IdentificationSettings,
) -> tuple[str, ...]:
    """Finds reasons to doubt an identified payload.

    Args:
        robot: Arm, with the gravity of the runs.
        loaded: Loaded run, with joints in the order of the arm's joints.
        empty: Empty runs, with joints in the same order.
        belief: Posterior of the payload.
        before: Gains that were known before the loaded run, including their drift; or gains calibrated in this run.
        settings: Settings of the identification.

    Returns: One sentence per reason; an empty tuple without any.
    """
    if loaded.description.kind is SignalKind.WRENCH:
        return tuple(_judge_wrench(loaded, belief, before, settings))
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
    doubts += _judge_fit(robot, loaded, belief, before, settings)
    return tuple(doubts)


def compare_with_own_weight(robot: SerialChain, run: Run, settings: IdentificationSettings) -> OwnWeight:
    """Fits joint signals with the torques due to the arm's own weight, for the gravity in the run's description."""
    robot = robot.with_gravity(run.description.gravity)
    prepared = prepare(run, settings)
    torque = robot.compute_arm_torques(*prepared.motion)
    signal = restore_compensated(robot, run, prepared, np.ones(robot.num_joints))
    n = robot.num_joints
    gain, explained, error, torque_sd = np.zeros((4, n))
    for j in range(n):
        used = np.abs(prepared.v[:, j]) >= settings.min_speed
        if np.count_nonzero(used) < _FEWEST_SAMPLES:
            continue
        v, tau, x = prepared.v[used, j], torque[used, j], signal[used, j]
        friction = np.column_stack([np.sign(v), v, np.ones_like(v)])
        columns = [tau, np.abs(tau) * np.sign(v), friction]
        if run.description.kind.feels_gears:
            columns.append(prepared.vdot[used, j])  # rotor inertia, which robots' files do not contain
        own = np.column_stack(columns)
        solution, without = np.linalg.lstsq(own, x)[0], np.linalg.lstsq(friction, x)[0]
        rest, all_of_it = np.sum((x - own @ solution) ** 2), np.sum((x - friction @ without) ** 2)
        gain[j], torque_sd[j] = solution[0], tau.std()
        pieces = max(len(x) / (prepared.rate * _AGREEMENT), 1.0)  # number of independent errors
        covariance = np.linalg.pinv(own.T @ own) * rest / pieces
        error[j] = np.sqrt(covariance[0, 0]) / max(abs(solution[0]), 1e-30)
        explained[j] = 1.0 - rest / all_of_it if all_of_it > 0.0 else 0.0
    return OwnWeight(gain, explained, error, torque_sd >= _LEAST_OWN_TORQUE * _compute_strength(robot))


def weigh_arm(robot: SerialChain, run: Run, gains: Gains, settings: IdentificationSettings) -> Array:
    """Compares gains estimated from the arm's own weight in an empty run with known gains.

    Returns: The ratios and their relative standard errors, shape (n, 2); NaN for joints that cannot be tested.
    """
    own = compare_with_own_weight(robot, run, settings)
    ratio = own.gain / gains.mean[:, 0]
    is_sure = own.judged & (ratio > 0.0)
    return np.where(is_sure[:, None], np.column_stack([ratio, np.maximum(own.error, _LEAST_ERROR)]), np.nan)


def _judge_controller(
    robot: SerialChain, empty: Run, before: Gains, settings: IdentificationSettings
) -> Iterator[str]:
    """Tests if own-weight signals have changed since the run that calibrated the gains."""
    if before.own_weight is None or empty.description.compensates_arm:
        return
    now, prior = weigh_arm(robot, empty, before, settings), settings.get_prior(before.kind)
    # Gains drift in both runs, while the errors of the file are the same in both.
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
    """Tests if a run is long enough to determine the gains from the arm's own weight.

    The duration does not matter with a weighed load or a repeated motion.
    """
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
    """Compares a run's signals with own-weight torques that may be wrong by a given factor."""
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
            found = f"{own.gain[j]:.3g} {unit} per N m, the load {belief.gains[j, 0]:.3g}"
            yield (
                f"{where}: the arm's own weight implies a gain of {found}: check the signal, its sign and unit, "
                "gravity, the gains, the weighed mass and the robot's file"
            )


def check_sensors(run: Run) -> None:
    """Checks that the signals of all moving joints change.

    Raises:
        BadValueError: The signal of a moving joint is constant, or all signals are the same in all postures.
    """
    if run.description.postures and np.ptp(run.signal, axis=0).max() <= _SAME * np.abs(run.signal).max():
        problem = f"is the same in all {len(run.times)} postures, must change: turn joints that turn the hand about"
        raise BadValueError(run.source, "signal", f"{problem} an axis that is not along gravity")
    moves, names = np.ptp(run.q, axis=0) > _LEAST_RANGE, run.description.joint_names
    if run.description.postures and run.description.kind is not SignalKind.WRENCH:
        moves = moves & (run.signal[0] != 0.0)  # a joint with a vertical axis bears no load at rest
    if run.description.kind is SignalKind.WRENCH:
        moves, names = np.tile(moves.any(), len(WRENCH_COLUMNS)), WRENCH_COLUMNS
    for j in np.flatnonzero(moves & (np.ptp(run.signal, axis=0) == 0.0)):
        name = names[j]
        problem = f"is {run.signal[0, j]:g} throughout, must change while the joint moves"
        raise BadValueError(run.source, f"signal of {name}", problem)


def _find_late(run: Run) -> Iterator[str]:
    """Detects velocities that are late or early relative to the angles, which distorts torques."""
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
    """Finds signals that are constant although their joint moves."""
    for j, name in enumerate(run.description.joint_names):
        # Rows at which the signal changes, and the rows before them.
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


def _judge_fit(
    robot: SerialChain, loaded: Run, belief: PayloadBelief, before: Gains, settings: IdentificationSettings
) -> Iterator[str]:
    """Tests the fit of a run with joint signals: gains, residuals, and agreement of both halves.

    Yields one sentence per doubt.
    """
    evidence = belief.fit.evidence
    torque_sd = evidence.arm_torque.std(axis=0)
    strength = _compute_strength(robot)
    judged = torque_sd >= _LEAST_OWN_TORQUE * strength
    if before.robot and before.robot != robot.fingerprint:
        yield f"the gains ({before.source}) were calibrated with the file of another robot, not with {robot.source}"
    # The arm's own weight does not determine the gains of the other joints.
    yield from _judge_gains(robot, belief, judged if belief.calibration is None else np.ones_like(judged))
    yield from _judge_weighing(belief)
    yield from _judge_shifts(belief, before)
    if evidence.is_repeated and not evidence.is_at_rest:
        yield from _judge_changes(robot, belief, before, np.flatnonzero(judged), settings)
    bound = _MOST_RESIDUAL[evidence.is_difference, evidence.is_repeated]
    usual = np.maximum(torque_sd, _LEAST_SIGNAL * strength)
    share = belief.noise_sd / np.maximum(np.abs(belief.gains[:, 0]) * usual, 1e-30)
    for j in np.flatnonzero(judged & (share > bound)):
        signal = "the arm's own signal" if torque_sd[j] == usual[j] else "a typical signal of the arm"
        left = f"leaves {100.0 * share[j]:.0f} % of {signal} unexplained"
        yield (
            f"{robot.joint_names[j]}: the load {left}, at most {100.0 * bound:.0f} % is usual: the sensor is wrong, "
            "or signal and motion do not belong together"
        )
    yield from _judge_errors(belief, settings)
    if evidence.is_difference:
        compared = _compare_alternatives(robot, loaded, belief, before, settings) if _leaves_much(belief) else ()
        yield from tuple(compared) or _judge_sign(loaded, belief)
    yield from _judge_halves(loaded, belief, before, settings)


def _judge_wrench(
    loaded: Run, belief: PayloadBelief, before: Gains, settings: IdentificationSettings
) -> Iterator[str]:
    """Tests the fit of a run with wrist forces: tare, mass, gains, residuals, and agreement of both halves.

    Yields one sentence per doubt.
    """
    evidence = belief.fit.evidence
    tare, tare_sd = evidence.phantom[0], np.sqrt(evidence.phantom_covariance[0, 0])
    if tare < -_MOST_HALF_SDS * tare_sd:
        yield f"the empty hand weighs {tare:.3g} kg: signs, gravity or the order of the forces are wrong"
    yield from _judge_weighing(belief)
    yield from _judge_shifts(belief, before)
    spread = evidence.samples.signal.std(axis=0)
    for part, name, unit, least in zip(
        (slice(3), slice(3, 6)), ("forces", "moments"), ("N", "N m"), _WRENCH_DRIFT, strict=True
    ):
        left, whole = (float(np.linalg.norm(each[part])) for each in (belief.noise_sd, spread))
        if left > max(_MOST_WRENCH_RESIDUAL * whole, least):
            yield (
                f"{loaded.source}: the {name} vary by {whole:.3g} {unit}, of which {left:.3g} are left unexplained: "
                "gravity, joints, times or the order of the columns are wrong"
            )
    yield from _judge_errors(belief, settings)
    yield from _judge_halves(loaded, belief, before, settings)


def _judge_shifts(belief: PayloadBelief, before: Gains) -> Iterator[str]:
    """Compares gains with their prior. Gains calibrated in this run are not compared."""
    if belief.calibration is not None:
        return
    shift = np.abs(belief.gains[:, 0] - before.mean[:, 0]) / np.sqrt(np.maximum(before.covariance[:, 0, 0], 1e-30))
    reason = "these are the gains of another robot or of another signal"
    if belief.fit.evidence.kind is SignalKind.WRENCH:
        masses = measure_axes(belief.fit)[0] * (belief.fit.mode.load + belief.fit.likelihood.prior.phantom)[0]
        shown = ", ".join(f"{name} {mass:.3g} kg" for name, mass in zip(WRENCH_COLUMNS, masses, strict=False))
        reason = f"the sensor's scale or axes, or the fit, are wrong; mass according to each axis: {shown}"
    for j in np.flatnonzero(shift > _MOST_SHIFT):
        yield (
            f"{belief.channel_names[j]}: the load implies a gain {shift[j]:.0f} standard deviations away from what "
            f"was known before: {reason}"
        )


def _judge_weighing(belief: PayloadBelief) -> Iterator[str]:
    """Compares the identified mass with the weighed mass, unless the latter calibrated the gains."""
    if belief.reference_mass is not None and belief.calibration is None:
        apart = abs(belief.mass - belief.reference_mass)
        if apart > max(_MOST_SHIFT * belief.mass_sd, _MOST_HALF_ERROR * belief.reference_mass):
            yield (
                f"{belief.reference_mass:g} kg was weighed, but {belief.mass:.3g} kg is found: units or scale are "
                "wrong"
            )


def _judge_errors(belief: PayloadBelief, settings: IdentificationSettings) -> Iterator[str]:
    """Compares the errors with those of the runs that calibrated the gains or show the empty arm."""
    fit = belief.fit
    bare = replace(fit.evidence, least_variance=np.zeros(1)).build_error_model(settings)
    variance = bare.estimate_variance(fit.statistics, fit.weights)
    before: Array = np.broadcast_to(fit.evidence.least_variance, variance.shape)
    known = (before > 0.0) & (fit.statistics.counts >= _FEWEST_SAMPLES)
    louder = np.divide(np.sqrt(variance), np.sqrt(before), out=np.zeros_like(variance), where=known)
    typical = float(np.exp(np.log(louder[known]).mean())) if known.any() else 1.0
    if typical < _LEAST_ERRORS:
        yield (
            f"the errors are {typical:.2g} times those of the earlier runs (geometric mean over the joints), at "
            f"least {_LEAST_ERRORS:g} times is usual: are these commanded values instead of measured ones?"
        )
    for j in np.flatnonzero(louder > _MOST_ERRORS):
        yield (
            f"{belief.channel_names[j]}: errors are {louder[j]:.3g} times those of the earlier runs, at most "
            f"{_MOST_ERRORS:g} times is usual: sensor or angles are wrong, or signal and motion do not belong "
            "together"
        )


def _judge_changes(
    robot: SerialChain,
    belief: PayloadBelief,
    before: Gains,
    judged: NDArray[np.intp],
    settings: IdentificationSettings,
) -> Iterator[str]:
    """Tests if gains changed since the empty run, for all tested joints together, then for each joint.

    Only repeated motions are tested, because the errors of a fitted arm, or of a few postures, resemble such a
    change.
    """
    if not judged.size:
        return
    solid = SolidPrior.for_hand()
    if belief.calibration is not None and belief.reference_mass is not None:
        solid = solid.with_mass(belief.reference_mass, SCALE_SD * belief.reference_mass)
    change, covariance = estimate_changes(belief.fit, solid.with_common_factor(before.common_sd), settings)
    change, covariance = change[judged], covariance[np.ix_(judged, judged)]
    weights = np.linalg.solve(covariance, np.ones(len(judged)))
    tests = [("all joints", weights @ change / weights.sum(), 1.0 / np.sqrt(weights.sum()))]
    if abs(tests[0][1]) <= _MOST_CHANGE * tests[0][2]:
        names = np.array(robot.joint_names)[judged]
        tests = list(zip(names, change, np.sqrt(np.diagonal(covariance)), strict=True))
    for name, found, sd in tests:
        if abs(found) > _MOST_CHANGE * sd:
            yield (
                f"{name}: the signal for the arm's own weight has changed by {100.0 * found:+.1f} % since the empty "
                f"run; usual changes stay within {100.0 * _MOST_CHANGE * sd:.1f} %: the gains of the two runs differ"
            )


def _judge_halves(
    loaded: Run, belief: PayloadBelief, before: Gains, settings: IdentificationSettings
) -> Iterator[str]:
    """Compares the masses identified from the two halves of a run.

    Both halves use the same gains, or in a calibration the gains from the other half.
    """
    if belief.calibration is not None:
        halves = belief.halves
        if (
            halves is not None
            and (np.abs(halves.error) > np.maximum(_MOST_HALF_ERROR, _MOST_HALF_SDS * halves.sd / halves.mass)).all()
        ):
            found = " and ".join(f"{mass:.3g}" for mass in halves.mass)
            yield f"the gains of each half give {found} kg in the other, but {belief.reference_mass:g} kg was weighed"
        return
    evidence = belief.fit.evidence
    middle = len(evidence.prepared.times) // 2
    if middle < _SHORTEST_HALF * evidence.rate:
        return
    solid = SolidPrior.for_hand().with_common_factor(before.common_sd)
    modes = []
    for rows in (slice(middle), slice(middle, None)):
        half = evidence.select(rows)
        modes.append(fit_payload(half, build_channel_prior(half, before, settings), solid, settings).mode)
    logarithms = np.array([mode.theta[0] for mode in modes])
    apart = abs(logarithms[1] - logarithms[0]) / np.sqrt(sum(mode.covariance[0, 0] for mode in modes))
    if apart > _MOST_APART:
        first, second = np.exp(logarithms)
        yield (
            f"{loaded.source}: its first half shows {first:.3g} kg, its second {second:.3g} kg: part of the load was "
            "lost, something was touched, or the sensors drifted"
        )


def _judge_gains(robot: SerialChain, belief: PayloadBelief, judged: Mask) -> Iterator[str]:
    """Finds implausible gains of tested joints, allowing for their uncertainty."""
    evidence = belief.fit.evidence
    if belief.calibration is not None:  # includes the uncertainty of the body
        gains, covariance = belief.calibration.mean, belief.calibration.covariance
    else:
        gains, covariance = belief.fit.likelihood.estimate_gains(belief.fit.mode.load)
    typical = float(np.median(gains[:, 0]))
    low, high = _USUAL_CURRENT_GAINS if evidence.kind is SignalKind.CURRENT else (0.0, np.inf)
    for j in np.flatnonzero(judged):
        gain, sd = gains[j, 0], np.sqrt(covariance[j, 0, 0])
        found = f"{robot.joint_names[j]}: the gain is {gain:.3g} {evidence.kind.unit} per N m"
        if gain + _MOST_SHIFT * sd < 0.0:
            yield f"{found}, negative: signs or joints are wrong"
        elif gain + _MOST_SHIFT * sd < low or gain - _MOST_SHIFT * sd > high:
            yield f"{found}, {low:g} to {high:g} is usual: the signal has another unit"
        elif (
            belief.calibration is not None
            and sd < 0.5 * typical
            and not 1.0 / _MOST_UNLIKE_GAINS < gain / typical < _MOST_UNLIKE_GAINS
        ):
            yield f"{found}, the median {typical:.3g}: the sensor, its unit or the angle of this joint is wrong"


def _leaves_much(belief: PayloadBelief) -> bool:
    """Returns True if the residual is large relative to the load's signal, at joints that the load affects."""
    load_sd = (belief.fit.evidence.samples.Y @ belief.parameters).std(axis=0)
    turned = load_sd >= _LEAST_LOAD_TORQUE * load_sd.max()
    left = belief.noise_sd / np.maximum(np.abs(belief.gains[:, 0]) * load_sd, 1e-30)
    return bool((left > _LARGE_RESIDUAL)[turned].any())


def _judge_sign(loaded: Run, belief: PayloadBelief) -> Iterator[str]:
    """Finds a load of negative mass.

    The residual may not show it, because a body of positive mass far from the tip, together with an error of the
    arm's model, can explain a slow motion as well.
    """
    mode = belief.fit.mode
    sd = float(np.sqrt(belief.fit.likelihood.prior.phantom_covariance[0, 0]))
    if mode.load[0] < 0.0 and mode.pi[0] - mode.load[0] > _MOST_CHANGE * sd:
        yield f"{loaded.source}: the load has a negative mass ({mode.load[0]:.3g} kg): {_EXCHANGED}"


def _compare_alternatives(
    robot: SerialChain, loaded: Run, belief: PayloadBelief, before: Gains, settings: IdentificationSettings
) -> Iterator[str]:
    """Tests two other interpretations of the runs: a load with the opposite sign, and exchanged joints."""
    if belief.calibration is not None:  # these gains depend on the tested interpretation
        before = before.widen()
    evidence = belief.fit.evidence
    every = max(1, round(evidence.rate / _COMPARISON_RATE))
    rows = slice(None, None, every)
    thin = replace(evidence.select(rows), rate=evidence.rate / every, least_variance=np.zeros(1))
    if (thin.samples.used.sum(axis=0) < _FEWEST_SAMPLES).all():
        return

    def measure(other: Evidence) -> float:
        """Computes the mean log error variance over joints."""
        fit = fit_payload(other, build_channel_prior(other, before, settings), SolidPrior.for_hand(), settings)
        return float(np.log(fit.long_run_variance[other.samples.used.sum(axis=0) >= _FEWEST_SAMPLES]).mean())

    best = measure(thin) - np.log(_LEAST_IMPROVEMENT)
    samples = thin.samples
    if measure(replace(thin, samples=samples._replace(signal=-samples.signal))) < best:
        yield f"{loaded.source}: the opposite of the load explains the runs better: {_EXCHANGED}"
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
            yield f"{loaded.source}: exchanging {names[j]} and {names[j + 1]} explains the load better"


def _compute_strength(robot: SerialChain) -> float:
    """Computes the RMS gravity torque of the strongest joint over random postures, [N m]."""
    q = np.random.default_rng(0).uniform(-np.pi, np.pi, (_NUM_POSTURES, robot.num_joints))
    torque = robot.compute_arm_torques(q, np.zeros_like(q), np.zeros_like(q))
    return max(float(np.sqrt((torque**2).mean(axis=0)).max()), 1e-9)
