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
from affordance.identification.evidence.evidence import restore_compensated
from affordance.identification.evidence.gains import Gains
from affordance.identification.posterior.payload_belief import PayloadBelief
from affordance.identification.posterior.payload_fit import build_channel_prior, fit_payload
from affordance.identification.posterior.solid_prior import SolidPrior
from affordance.identification.recording.preparation import prepare
from affordance.identification.recording.robot_chain import RobotChain
from affordance.identification.recording.run import Run
from affordance.identification.settings import IdentificationSettings, SignalKind

_JUDGED, _NUM_POSTURES = 0.1, 50  # see the module
# Factor to which a robot's file knows the torques of the arm's own weight (a UR10e's: 1.1 to 1.3 at judged joints).
_FILE_FACTOR = 2.0
# Least share of an empty arm's signal that its own weight explains beyond friction, and of a loaded arm's, whose load
# is not in the file. On recordings of a UR10e and a Panda it is .97 and more in windows of 10 s and more.
_EXPLAINED, _EXPLAINED_LOADED = 0.9, 0.6
# Largest residual relative to the signal of the arm's own weight. Where runs are paired it is 0.01 to 0.03; where the
# empty arm was fitted to other motions, up to 0.25 in windows of 8 s; where it is only as its file says, the file's
# own error is part of it. By whether the signal is a difference, and of repeated motions.
_RESIDUAL = {(True, True): 0.15, (True, False): 0.4, (False, False): 1.0}
# Largest shift of a gain from what was known before the run, in standard deviations.
_GAIN_SHIFT = 5.0
# Least ratio of the noise of the fit to that of a fit with the opposite signal.
_OPPOSITE = 2.0
# Relative error of the mass by both halves of a run at which gains are refuted if no interval contains the mass.
_HALVES = 0.05
_FEWEST = 50  # samples of a joint that are needed to judge it


class OwnWeight(NamedTuple):
    """Comparison of a run's signals with the torques of the arm's own weight.

    Attributes:
        gain: Signal per torque, by least squares along with friction, shape (n,), [unit of the signal per N m].
        explained: Share of the signal's variance beyond friction that the torques explain, shape (n,).
        torque_sd: Standard deviation of the torques, shape (n,), [N m].
        judged: True for the joints that can be judged, shape (n,).
    """

    gain: Array
    explained: Array
    torque_sd: Array
    judged: Mask


def compare_with_own_weight(robot: RobotChain, run: Run, settings: IdentificationSettings) -> OwnWeight:
    """Compares a run of joint signals with the torques of the arm alone, with gravity as in the run."""
    robot = robot.with_gravity(run.description.gravity)
    prepared = prepare(run, settings)
    torque = robot.compute_arm_torques(*prepared.motion)
    signal = restore_compensated(robot, run, prepared, np.ones(robot.num_joints))
    n = robot.num_joints
    gain, explained, torque_sd = np.zeros(n), np.zeros(n), np.zeros(n)
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
        explained[j] = 1.0 - rest / all_of_it if all_of_it > 0.0 else 0.0
    return OwnWeight(gain, explained, torque_sd, torque_sd >= _JUDGED * _compute_strength(robot))


def _compute_strength(robot: RobotChain) -> float:
    """Computes what gravity asks of the strongest joint, root mean square over all postures, [N m]."""
    q = np.random.default_rng(0).uniform(-np.pi, np.pi, (_NUM_POSTURES, robot.num_joints))
    torque = robot.compute_arm_torques(q, np.zeros_like(q), np.zeros_like(q))
    return max(float(np.sqrt((torque**2).mean(axis=0)).max()), 1e-9)


def find_doubts(
    robot: RobotChain,
    loaded: Run,
    empty: Sequence[Run],
    belief: PayloadBelief,
    before: Gains,
    settings: IdentificationSettings,
) -> tuple[str, ...]:
    """Finds the reasons not to trust a belief, a sentence each; an empty tuple if there are none.

    Args:
        robot: Model of the arm, with gravity as in the runs.
        loaded: Run with the load, joints in the order of the arm's.
        empty: Runs with an empty hand, likewise.
        belief: Result of the identification.
        before: Gains as known before the loaded run, drift included, or as calibrated in it.
        settings: Identification settings.
    """
    if loaded.description.kind is SignalKind.WRENCH:
        return ()
    doubts: list[str] = []
    for run in (*empty, loaded):
        if not run.description.compensates_arm:
            doubts += _judge_signals(robot, run, run is loaded, belief, settings)
    doubts += _judge_fit(robot, loaded, belief, before, settings)
    return tuple(doubts)


def _judge_signals(
    robot: RobotChain, run: Run, is_loaded: bool, belief: PayloadBelief, settings: IdentificationSettings
) -> Iterator[str]:
    """Judges a run's signals by the arm's own weight."""
    own = compare_with_own_weight(robot, run, settings)
    bound = _EXPLAINED_LOADED if is_loaded else _EXPLAINED
    unit = run.description.kind.unit
    for j in np.flatnonzero(own.judged):
        name, ratio = robot.joint_names[j], own.gain[j] / belief.gains[j, 0]
        where = f"{run.source}, {name}"
        if own.explained[j] < bound:
            yield (
                f"{where}: the arm's own weight explains {100.0 * own.explained[j]:.0f} % of the signal, at "
                f"least {100.0 * bound:.0f} % is usual: joints, gravity, times or the robot's file are not those of the run"
            )
        elif ratio <= 0.0:
            yield (
                f"{where}: the signal falls where the arm's own weight pulls more ({own.gain[j]:.3g} {unit} per N m): "
                "signs, gravity or joints are wrong"
            )
        elif not 1.0 / _FILE_FACTOR <= ratio <= _FILE_FACTOR and not is_loaded:
            yield (
                f"{where}: the arm's own weight says {own.gain[j]:.3g} {unit} per N m, the load "
                f"{belief.gains[j, 0]:.3g}: the signal, its unit, the gains, the weighed mass or the robot's file are others"
            )


def _judge_fit(
    robot: RobotChain, loaded: Run, belief: PayloadBelief, before: Gains, settings: IdentificationSettings
) -> Iterator[str]:
    """Judges gains and residual of the fit."""
    evidence = belief.fit.evidence
    if belief.calibration is None:
        shift = np.abs(belief.gains[:, 0] - before.mean[:, 0]) / np.sqrt(
            np.maximum(before.covariance[:, 0, 0], 1e-30)
        )
        for j in np.flatnonzero(settings.gains & (shift > _GAIN_SHIFT)):
            yield (
                f"{robot.joint_names[j]}: the load says a gain {shift[j]:.0f} standard deviations away from what was "
                "known before: another robot's, or another signal's"
            )
    torque_sd = evidence.arm_torque.std(axis=0)
    judged = torque_sd >= _JUDGED * _compute_strength(robot)
    bound = _RESIDUAL[evidence.is_difference, evidence.is_repeated]
    share = belief.noise_sd / np.maximum(np.abs(belief.gains[:, 0]) * torque_sd, 1e-30)
    for j in np.flatnonzero(judged & (share > bound)):
        yield (
            f"{robot.joint_names[j]}: the load leaves {100.0 * share[j]:.0f} % of the arm's own signal unexplained, at "
            f"most {100.0 * bound:.0f} % is usual: the sensor, or the match of signal and motion, is wrong"
        )
    if evidence.is_difference:
        opposite = replace(evidence, samples=evidence.samples._replace(signal=-evidence.samples.signal))
        fit = fit_payload(opposite, build_channel_prior(evidence, before, settings), SolidPrior.for_hand(), settings)
        better = np.log(belief.fit.long_run_variance / fit.long_run_variance)[judged]
        ratio = float(np.exp(better.mean())) if better.size else 0.0
        if ratio > _OPPOSITE:
            yield (
                f"{loaded.source}: the opposite of the load explains the runs {ratio:.3g} times as well: the empty "
                "and the loaded run, or signs, are exchanged"
            )
    halves = belief.halves
    if halves is not None and not halves.inside.any() and np.abs(halves.error).max() > _HALVES:
        found = " and ".join(f"{mass:.3g}" for mass in halves.mass)
        yield f"gains of one half give {found} kg in the other, {belief.reference_mass:g} kg was weighed"
