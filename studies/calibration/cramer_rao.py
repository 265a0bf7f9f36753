"""Cramer-Rao bound on estimates of material densities from one trial, along the true motion.

Motion and regressor are computed from the log of the trial. The bound shares only the noise model and the geometry
with the estimator.
"""

from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.belief.density_belief import Prior
from affordance.objects.inertia import NUM_PARAMETERS
from affordance.plant.arm_model import ArmModel
from affordance.plant.chain_plant import build_chain
from affordance.proprioception.torque_noise import NoiseModel, WeberNoise
from affordance.settings import Settings
from affordance.simulation.trial_record import TrialRecord


class Felt(NamedTuple):
    """Statistics of a motion that determine the information about an object."""

    tau_arm: Array  # mean joint torques of the arm without object, (num_joints,), [N m]
    Y: Array  # mean payload regressor, (num_joints, 10), [N m] per unit of each inertial parameter
    YtY: Array  # sum of Y^T Y over samples, (10, 10)


def feel_at_rest(tau_arm: Array, Y: Array, num_samples: int) -> Felt:
    """Returns the statistics of ``num_samples`` samples at rest; tau_arm and Y are as in ``Felt``."""
    return Felt(tau_arm, Y, num_samples * Y.T @ Y)


def feel_along(record: TrialRecord, model: ArmModel, settings: Settings) -> Felt:
    """Computes the statistics along a logged trial, with accelerations from finite differences of velocities."""
    vdot = np.gradient(record.v, settings.log_period, axis=0, edge_order=2)
    step = round(settings.sample_period / settings.log_period)
    q, v, vdot = (column[step::step] for column in (record.q, record.v, vdot))
    Y = build_chain(model.arm).compute_payload_regressors(q, v, vdot)
    model.set_payload(np.zeros(NUM_PARAMETERS))
    tau_arm = []
    for k in range(len(q)):
        model.set_state(np.concatenate([q[k], v[k]]))
        tau_arm.append(model.compute_inverse_dynamics(vdot[k]))
    return Felt(np.mean(tau_arm, axis=0), Y.mean(axis=0), np.einsum("kij,kil->jl", Y, Y))


def compute_bound(felt: Felt, Phi: Array, own: Array, noise: NoiseModel, prior: Prior) -> Array:
    """Computes bounds on the variances of the mean densities of M materials, (M,), [(kg/m^3)^2].

    The bound is the inverse of prior precision plus Fisher information at the true densities of the object. With
    Weber noise, the mean torque is measured once, and both its mean and its variance are informative about densities.
    With white noise, every sample adds information.

    Args:
        felt: Statistics of the trial.
        Phi: Geometry, (10, M).
        own: True densities of the object, (M,), [kg/m^3].
        noise: Model of torque errors.
        prior: Prior of the materials.
    """
    H = felt.Y @ Phi  # (num_joints, M)
    tau = felt.tau_arm + H @ own
    weights = 1.0 / noise.compute_sd(tau) ** 2
    if isinstance(noise, WeberNoise):
        growth = 2.0 * noise.weber_fraction**2 * weights * tau  # derivative of the log variance
        information = H.T @ ((weights + 0.5 * growth**2)[:, None] * H)
    else:
        information = weights[0] * Phi.T @ felt.YtY @ Phi  # independent of torque
    one = np.eye(len(own))
    of_materials = np.linalg.solve(one + information * (prior.deviation * own) ** 2, information)
    bound: Array = np.diag(np.linalg.inv(of_materials + one / prior.sd**2)).copy()
    return bound
