"""Comparison of joint signals with the torques of the arm's own weight, which its file knows to a factor of two.

Joints are judged whose torque by the arm's own weight varies, along the run, by a tenth or more of what gravity asks
of the strongest joint over all postures; the others may show little but friction.
"""

from typing import NamedTuple

import numpy as np

from affordance.arrays import Array, Mask
from affordance.identification.evidence.evidence import restore_compensated
from affordance.identification.recording.preparation import prepare
from affordance.identification.recording.run import Run
from affordance.identification.settings import IdentificationSettings
from affordance.plant.serial_chain import SerialChain

JUDGED, _NUM_POSTURES = 0.1, 50  # see the module
# Time over which the errors of a model of the arm agree, [s].
_AGREEMENT = 1.0
FEWEST = 50  # samples of a joint that are needed to judge it


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
        if np.count_nonzero(used) < FEWEST:
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
    return OwnWeight(gain, explained, error, torque_sd, torque_sd >= JUDGED * compute_strength(robot))


def compute_strength(robot: SerialChain) -> float:
    """Computes what gravity asks of the strongest joint, root mean square over all postures, [N m]."""
    q = np.random.default_rng(0).uniform(-np.pi, np.pi, (_NUM_POSTURES, robot.num_joints))
    torque = robot.compute_arm_torques(q, np.zeros_like(q), np.zeros_like(q))
    return max(float(np.sqrt((torque**2).mean(axis=0)).max()), 1e-9)
