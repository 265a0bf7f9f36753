"""Gains from a load that was weighed: its mass is known, its centre of mass and its moments are found on the way."""

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

# A kitchen scale is good to a thousandth.
SCALE_SD = 1e-3
# Before calibration a gain may be anything of the size that signal over torque has at the joints, either sign.
_BROAD = 3.0
_NUM_PASSES = 3
_STEP = 1e-4  # of the differences by which a gain's dependence on the body is found, as a fraction of its mass


def calibrate_gains(evidence: Evidence, reference_mass: float | None, settings: IdentificationSettings) -> Gains:
    """Finds gains and load friction of each joint from a load of known mass.

    Args:
        evidence: A run with the load.
        reference_mass: Its mass, [kg]; None if the load is in the evidence's tau_arm, and known whole.
        settings: Priors of friction.

    Returns: The gains, with the uncertainty of the load's centre of mass and moments in theirs.
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
        scale = found[:, 0]  # now the size of mu g is known
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
    """Standard deviations of friction given the load and gains, shape (n, 3)."""
    products = fit.statistics.products[:, FRICTION, FRICTION] / fit.long_run_variance[:, None, None]
    prior_precision = fit.likelihood.prior.friction_sd**-2.0
    covariance = np.linalg.inv(products + prior_precision[:, :, None] * np.eye(3))
    return np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))


def _guess_scale(evidence: Evidence, mass: float) -> float:
    """The size of signal over torque, with a point mass at the tip, over all joints."""
    torque = evidence.samples.tau_arm + evidence.samples.Y[..., 0] * mass
    signal = evidence.samples.signal
    by_joint = np.sqrt((signal**2).mean(axis=0)) / np.maximum(np.sqrt((torque**2).mean(axis=0)), 1e-9)
    return float(np.median(by_joint))


def _propagate(fit: PayloadFit) -> Array:
    """Covariance of the gains: given the body, and what the body's own uncertainty adds."""
    gain, covariance = fit.likelihood.estimate_gains(fit.mode.load)
    D = compute_jacobian(fit.mode.theta)
    root = D @ np.linalg.cholesky(fit.mode.covariance)  # one standard deviation of the body a column
    steps = []
    for column in root.T:
        displaced, _ = fit.likelihood.estimate_gains(fit.mode.load + _STEP * column)
        steps.append((displaced - gain) / _STEP)
    change = np.array(steps)  # (10, n, 2)
    total: Array = covariance + np.einsum("kca,kcb->cab", change, change)
    return total
