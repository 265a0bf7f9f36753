"""Checks of a fit: its gains, what it leaves of the signals, and whether both halves of the run agree with it."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from affordance.arrays import Array, Mask
from affordance.identification.evidence.evidence import Evidence, build_evidence
from affordance.identification.evidence.gains import Gains
from affordance.identification.posterior.payload_belief import PayloadBelief
from affordance.identification.posterior.payload_fit import build_channel_prior, fit_payload
from affordance.identification.posterior.solid_prior import SolidPrior
from affordance.identification.recording.run import Run
from affordance.identification.settings import IdentificationSettings, SignalKind
from affordance.plant.serial_chain import SerialChain

# Least spread of a joint's torque by the arm's own weight at which it is judged, as a share of what gravity asks of
# the strongest joint; number of postures over which this is found, and of samples that are needed to judge a joint.
JUDGED, _NUM_POSTURES, FEWEST = 0.1, 50, 50
# Gains of currents, from the geared motors of the largest arms to servos, with a factor of ten to spare, [A/(N m)].
_CURRENT_GAINS = (2e-3, 20.0)
# Factor by which a gain that a weighed load determines may differ from the median of the joints'.
_UNLIKE = 4.0
# Largest residual relative to the signal of the arm's own weight. Where runs are paired it is 0.01 to 0.03 on
# recordings, and up to 0.2 on a simulated UR5, whose motors lose a share of the load that jumps where a joint turns
# round. Where the empty arm was fitted to other motions it is up to 0.25 in windows of 8 s; where it is only as its
# file says, the file's own error is part of it. By whether the signal is a difference, and of repeated motions.
_RESIDUAL = {(True, True): 0.25, (True, False): 0.4, (False, False): 1.0}
# Least signal that residuals are compared with, as a share of what gravity asks of the strongest joint: a joint's
# errors do not shrink with its motion. Those of a UR10e's pair are up to 0.022 of that torque; this allows 0.075.
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
# Share of a wrist sensor's forces, or moments, that a load may leave unexplained, and errors, [N] and [N m], below
# which nothing is said of it: a light load may be no larger than a sensor's drift.
_WRENCH_LEFT, _WRENCH_ERRORS = 0.5, (1.0, 0.2)
# Relative error of the mass by both halves of a run at which gains are refuted, if it is as many standard deviations.
_HALVES, _SDS = 0.05, 3.0
# Factor by which errors may be larger than in the runs that calibrated the gains or show the empty arm. Over 28
# windows of a UR10e's recording they are at most 1.5 times as large.
_LOUDER = 4.0
# Likewise the factor by which the errors of all joints may be smaller: torques or currents that a controller commands
# have the noise of no sensor.
_QUIETER = 4.0
# Standard deviations by which gains may have changed between the empty and the loaded run.
_CHANGED = 3.0
# Standard deviations by which the masses that both halves of a run show may differ, and least length of a half, [s].
_APART, _LEAST_HALF = 4.0, 4.0


def judge_fit(
    robot: SerialChain, loaded: Run, belief: PayloadBelief, before: Gains, settings: IdentificationSettings
) -> Iterator[str]:
    """Judges gains and residual of the fit."""
    evidence = belief.fit.evidence
    torque_sd = evidence.arm_torque.std(axis=0)
    strength = compute_strength(robot)
    judged = torque_sd >= JUDGED * strength
    if before.robot and before.robot != robot.fingerprint:
        yield f"the gains ({before.source}) were found with the file of another robot than {robot.source}"
    # By the arm's own weight the gains of the other joints are open.
    yield from _judge_gains(robot, belief, judged if belief.calibration is None else np.ones_like(judged))
    yield from _judge_weighing(belief)
    if belief.calibration is None:
        shift = np.abs(belief.gains[:, 0] - before.mean[:, 0]) / np.sqrt(
            np.maximum(before.covariance[:, 0, 0], 1e-30)
        )
        for j in np.flatnonzero(settings.gains & (shift > _SHIFT)):
            yield (
                f"{robot.joint_names[j]}: the load says a gain {shift[j]:.0f} standard deviations away from what was "
                "known before: another robot's, or another signal's"
            )
    change, change_sd = belief.fit.likelihood.estimate_changes(belief.fit.mode.load)
    for j in np.flatnonzero(judged & (np.abs(change) > _CHANGED * np.maximum(change_sd, 1e-30))):
        yield (
            f"{robot.joint_names[j]}: the signal for the arm's own weight has changed by {100.0 * change[j]:+.1f} % "
            f"since the empty run, within {100.0 * _CHANGED * change_sd[j]:.1f} % is usual: gains of both runs differ"
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
    yield from _judge_errors(belief, settings)
    if evidence.is_difference and _leaves_much(belief):
        yield from _compare_alternatives(robot, loaded, belief, before, settings)
    yield from _judge_halves(loaded, belief, before, settings)


def judge_wrench(
    loaded: Run, belief: PayloadBelief, before: Gains, settings: IdentificationSettings
) -> Iterator[str]:
    """Judges tare, residual and mass of a sensor at the wrist."""
    evidence = belief.fit.evidence
    tare, tare_sd = evidence.phantom[0], np.sqrt(evidence.phantom_covariance[0, 0])
    if tare < -_SDS * tare_sd:
        yield f"the empty hand weighs {tare:.3g} kg: signs, gravity or the order of the forces are wrong"
    yield from _judge_weighing(belief)
    spread = evidence.samples.signal.std(axis=0)
    for part, name, unit, least in zip(
        (slice(3), slice(3, 6)), ("forces", "moments"), ("N", "N m"), _WRENCH_ERRORS, strict=True
    ):
        left, whole = (float(np.linalg.norm(each[part])) for each in (belief.noise_sd, spread))
        if left > max(_WRENCH_LEFT * whole, least):
            yield (
                f"{loaded.source}: {left:.3g} of {whole:.3g} {unit} by which the {name} vary are left unexplained: "
                "gravity, joints, times or the order of the columns are wrong"
            )
    yield from _judge_errors(belief, settings)
    yield from _judge_halves(loaded, belief, before, settings)


def _judge_weighing(belief: PayloadBelief) -> Iterator[str]:
    """Compares the mass that is felt with that of the scale, unless gains were found by it."""
    if belief.reference_mass is not None and belief.calibration is None:
        apart = abs(belief.mass - belief.reference_mass)
        if apart > max(_SHIFT * belief.mass_sd, _HALVES * belief.reference_mass):
            yield f"{belief.reference_mass:g} kg was weighed, {belief.mass:.3g} kg is felt: units or scale are wrong"


def _judge_errors(belief: PayloadBelief, settings: IdentificationSettings) -> Iterator[str]:
    """Compares the errors with those of the runs that calibrated the gains or show the empty arm."""
    fit = belief.fit
    bare = replace(fit.evidence, least_variance=np.zeros(1)).describe_errors(settings)
    variance = bare.estimate_variance(fit.statistics, fit.weights)
    before: Array = np.broadcast_to(fit.evidence.least_variance, variance.shape)
    known = (before > 0.0) & (fit.statistics.counts >= FEWEST)
    louder = np.divide(np.sqrt(variance), np.sqrt(before), out=np.zeros_like(variance), where=known)
    if known.any() and (louder[known] < 1.0 / _QUIETER).all():
        yield (
            f"errors of all joints are at most {louder[known].max():.2g} times those of the runs before, at least "
            f"{1.0 / _QUIETER:g} times is usual: are these commanded values, and no measured ones?"
        )
    for j in np.flatnonzero(louder > _LOUDER):
        yield (
            f"{belief.channel_names[j]}: errors are {louder[j]:.3g} times those of the runs before, at most "
            f"{_LOUDER:g} times is usual: the sensor, the angles or the match of signal and motion is wrong"
        )


def _judge_halves(
    loaded: Run, belief: PayloadBelief, before: Gains, settings: IdentificationSettings
) -> Iterator[str]:
    """Compares the masses that both halves of the run show by the same gains, or with gains of the other half."""
    if belief.calibration is not None:
        halves = belief.halves
        if halves is not None and (np.abs(halves.error) > np.maximum(_HALVES, _SDS * halves.sd / halves.mass)).all():
            found = " and ".join(f"{mass:.3g}" for mass in halves.mass)
            yield f"gains of one half give {found} kg in the other, {belief.reference_mass:g} kg was weighed"
        return
    evidence = belief.fit.evidence
    middle = len(evidence.prepared.times) // 2
    if middle < _LEAST_HALF * evidence.rate:
        return
    solid = SolidPrior.for_hand().with_common_factor(before.common_sd)
    modes = []
    for rows in (slice(middle), slice(middle, None)):
        half = evidence.select(rows)
        modes.append(fit_payload(half, build_channel_prior(half, before, settings), solid, settings).mode)
    logarithms = np.array([mode.theta[0] for mode in modes])
    apart = abs(logarithms[1] - logarithms[0]) / np.sqrt(sum(mode.covariance[0, 0] for mode in modes))
    if apart > _APART:
        first, second = np.exp(logarithms)
        yield (
            f"{loaded.source}: its first half says {first:.3g} kg, its second {second:.3g} kg: part of the load was "
            "lost, something was touched, or the sensors have drifted"
        )


def _judge_gains(robot: SerialChain, belief: PayloadBelief, judged: Mask) -> Iterator[str]:
    """Finds gains that no robot has among those of the judged joints, as far as the run determines them."""
    evidence = belief.fit.evidence
    if belief.calibration is not None:  # with what the body leaves open
        gains, covariance = belief.calibration.mean, belief.calibration.covariance
    else:
        gains, covariance = belief.fit.likelihood.estimate_gains(belief.fit.mode.load)
    typical = float(np.median(gains[:, 0]))
    low, high = _CURRENT_GAINS if evidence.kind is SignalKind.CURRENT else (0.0, np.inf)
    for j in np.flatnonzero(judged):
        gain, sd = gains[j, 0], np.sqrt(covariance[j, 0, 0])
        found = f"{robot.joint_names[j]}: the gain is {gain:.3g} {evidence.kind.unit} per N m"
        if gain + _SHIFT * sd < 0.0:
            yield f"{found}, negative: signs or joints are wrong"
        elif gain + _SHIFT * sd < low or gain - _SHIFT * sd > high:
            yield f"{found}, {low:g} to {high:g} are usual: the signal has another unit"
        elif belief.calibration is not None and sd < 0.5 * typical and not 1.0 / _UNLIKE < gain / typical < _UNLIKE:
            yield f"{found}, of the others {typical:.3g}: the sensor, its unit or the angle of this joint is wrong"


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
    if (thin.samples.used.sum(axis=0) < FEWEST).all():
        return

    def measure(other: Evidence) -> float:
        """Computes the mean logarithm of the joints' error variances."""
        fit = fit_payload(other, build_channel_prior(other, before, settings), SolidPrior.for_hand(), settings)
        return float(np.log(fit.long_run_variance[other.samples.used.sum(axis=0) >= FEWEST]).mean())

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


def compute_strength(robot: SerialChain) -> float:
    """Computes what gravity asks of the strongest joint, root mean square over all postures, [N m]."""
    q = np.random.default_rng(0).uniform(-np.pi, np.pi, (_NUM_POSTURES, robot.num_joints))
    torque = robot.compute_arm_torques(q, np.zeros_like(q), np.zeros_like(q))
    return max(float(np.sqrt((torque**2).mean(axis=0)).max()), 1e-9)
