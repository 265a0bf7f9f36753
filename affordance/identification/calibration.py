"""Gains from a load of known mass, whose centre of mass and moments are estimated along with them."""

import numpy as np

from affordance.arrays import Array
from affordance.identification.evidence import Evidence
from affordance.identification.gains import Gains
from affordance.identification.joint_statistics import FRICTION
from affordance.identification.log_cholesky import compute_jacobian
from affordance.identification.payload_fit import PayloadFit, fit_payload, list_friction_sds
from affordance.identification.payload_likelihood import ChannelPrior
from affordance.identification.settings import IdentificationSettings
from affordance.identification.solid_prior import SolidPrior

# Relative error of a kitchen scale.
SCALE_SD = 1e-3
# SD of a gain before calibration, of either sign, as a multiple of the typical ratio of signal to torque.
_BROAD = 3.0
_NUM_PASSES = 3
_STEP = 1e-4  # finite-difference step by which gains are differentiated, in standard deviations of the body


def calibrate_gains(evidence: Evidence, reference_mass: float | None, settings: IdentificationSettings) -> Gains:
    """Estimates gains and load friction of each joint from a load of known mass.

    Args:
        evidence: Evidence of a run with the load.
        reference_mass: Mass of the load, [kg]; None if the load is fully known and part of the evidence's tau_arm.
        settings: Identification settings, for the priors of friction.

    Returns: The gains; their covariance includes the uncertainty of the load's centre of mass and moments.
    """
    solid = SolidPrior.for_hand()
    if reference_mass is not None:
        solid = solid.with_mass(reference_mass, SCALE_SD * reference_mass)
    signal_prior = settings.get_prior(evidence.kind)
    num = len(evidence.channel_names)
    friction_sd = list_friction_sds(evidence, settings)
    scale = np.full(num, _guess_scale(evidence, reference_mass or 0.0))
    broad = (_BROAD * scale) ** 2
    for _ in range(_NUM_PASSES):
        mean = np.column_stack([np.zeros(num), signal_prior.load_friction * scale])
        covariance = np.zeros((num, 2, 2))
        covariance[:, 0, 0] = broad
        covariance[:, 1, 1] = (signal_prior.load_friction_sd * scale) ** 2
        prior = ChannelPrior(
            mean, covariance, np.zeros((num, 3)), friction_sd, evidence.phantom, evidence.phantom_covariance
        )
        fit = fit_payload(evidence, prior, solid, settings)
        found, _ = fit.likelihood.estimate_gains(fit.mode.load)
        scale = found[:, 0]  # the priors of mu g scale with the gains
    load = "a known load" if reference_mass is None else f"{reference_mass:g} kg"
    return Gains(
        evidence.channel_names,
        evidence.kind,
        found,
        _propagate(fit),
        0.0,
        -fit.weights[:, FRICTION],
        None if evidence.is_difference else _estimate_friction_sd(fit),
        fit.long_run_variance,
        f"calibrated with {load} in {evidence.source}",
    )


def _estimate_friction_sd(fit: PayloadFit) -> Array:
    """Computes the standard deviations of friction given the load and gains, shape (n, 3)."""
    products = fit.statistics.products[:, FRICTION, FRICTION] / fit.long_run_variance[:, None, None]
    prior_precision = fit.likelihood.prior.friction_sd**-2.0
    covariance = np.linalg.inv(products + prior_precision[:, :, None] * np.eye(3))
    return np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))


def _guess_scale(evidence: Evidence, mass: float) -> float:
    """Guesses the ratio of signal to torque as the joints' median, with a point mass at the tip."""
    torque = evidence.samples.tau_arm + evidence.samples.Y[..., 0] * mass
    signal = evidence.samples.signal
    by_joint = np.sqrt((signal**2).mean(axis=0)) / np.maximum(np.sqrt((torque**2).mean(axis=0)), 1e-9)
    return float(np.median(by_joint))


def _propagate(fit: PayloadFit) -> Array:
    """Computes the covariance of the gains: that given the body, plus the part due to the body's uncertainty."""
    gain, covariance = fit.likelihood.estimate_gains(fit.mode.load)
    D = compute_jacobian(fit.mode.theta)
    root = D @ np.linalg.cholesky(fit.mode.covariance)  # each column is one standard deviation of the body
    steps = []
    for column in root.T:
        displaced, _ = fit.likelihood.estimate_gains(fit.mode.load + _STEP * column)
        steps.append((displaced - gain) / _STEP)
    change = np.array(steps)  # (10, n, 2)
    total: Array = covariance + np.einsum("kca,kcb->cab", change, change)
    return total
