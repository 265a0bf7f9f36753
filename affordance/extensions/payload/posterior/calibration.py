"""Calibrates gains with a load of known mass.

The load's centre of mass and moments are estimated together with the gains. Without a weighed load, gains are
estimated less accurately from the arm's own weight. A calibration with a weighed load is checked by identifying the
mass in each half of the run with the gains from the other half.
"""

from dataclasses import replace

import numpy as np

from affordance.arrays import Array
from affordance.extensions.payload.evidence.evidence import Evidence, build_evidence
from affordance.extensions.payload.evidence.fitted_arm import build_link_scale
from affordance.extensions.payload.evidence.gains import Gains
from affordance.extensions.payload.evidence.joint_statistics import FRICTION, ChannelSamples
from affordance.extensions.payload.evidence.payload_likelihood import ChannelPrior
from affordance.extensions.payload.evidence.unpaired_runs import WHOLE_FRICTION
from affordance.extensions.payload.posterior.inference import infer
from affordance.extensions.payload.posterior.log_cholesky import compute_jacobian
from affordance.extensions.payload.posterior.payload_belief import HalfCheck
from affordance.extensions.payload.posterior.payload_fit import PayloadFit, fit_payload
from affordance.extensions.payload.posterior.solid_prior import SolidPrior
from affordance.extensions.payload.recording.preparation import PreparedRun
from affordance.extensions.payload.recording.run import Run
from affordance.extensions.payload.settings import IdentificationSettings
from affordance.plant.serial_chain import SerialChain

# Relative error of a kitchen scale.
SCALE_SD = 1e-3
# Prior SD of a gain before calibration, about zero, as a multiple of the typical ratio of signal to torque.
_BROAD = 3.0
# Relative uncertainty above which a gain is unknown.
_NO_GAIN = 10.0
_NUM_PASSES = 3
_FEW = 2000  # number of samples for each half of a run
_STEP = 1e-4  # finite-difference step for derivatives of gains, in standard deviations of the body


def calibrate_gains(evidence: Evidence, reference_mass: float | None, settings: IdentificationSettings) -> Gains:
    """Estimates gain and load friction of each joint from a run with a load of known mass, [kg].

    The mass is None if the load is fully known and included in the evidence's tau_arm. The covariance of the gains
    includes the uncertainty of the load's centre of mass and moments.
    """
    solid = SolidPrior.for_hand()
    if reference_mass is not None:
        solid = solid.with_mass(reference_mass, SCALE_SD * reference_mass)
    signal_prior = settings.get_prior(evidence.kind)
    num = len(evidence.channel_names)
    friction_sd = evidence.list_friction_sds(settings)
    scale = np.full(num, _guess_scale(evidence, reference_mass or 0.0))
    broad = (_BROAD * scale) ** 2
    for _ in range(_NUM_PASSES):
        mean = np.column_stack([np.zeros(num), signal_prior.load_friction * scale])
        covariance = np.zeros((num, 2, 2))
        covariance[:, 0, 0] = broad
        covariance[:, 1, 1] = (signal_prior.load_friction_sd * scale) ** 2
        prior = ChannelPrior(
            mean,
            covariance,
            np.zeros((num, 3)),
            friction_sd,
            evidence.phantom,
            evidence.phantom_covariance,
            not evidence.is_difference,
            *evidence.list_change_sds(scale, settings),
            evidence.list_rotor_sds(),
        )
        fit = fit_payload(evidence, prior, solid, settings)
        found, _ = fit.likelihood.estimate_gains(fit.mode.load)
        scale = found[:, 0]  # the prior of mu g is proportional to the gain
        evidence = fit.evidence  # includes signs of load friction as a start
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


def estimate_gains(robot: SerialChain, run: Run, prepared: PreparedRun, settings: IdentificationSettings) -> Gains:
    """Estimates gains from the arm's own weight, to about 20 %. The gains of a light wrist remain unknown."""
    evidence = build_evidence(
        robot,
        run.source,
        run.description.kind,
        prepared,
        settings,
        analysis="the arm's own weight",
        is_difference=False,
    )
    samples = evidence.samples
    known = samples._replace(Y=np.zeros_like(samples.Y))
    gains = calibrate_gains(replace(evidence, samples=known, friction_scale=WHOLE_FRICTION), None, settings)
    own = np.zeros_like(gains.covariance)
    share = np.maximum(settings.gain_own_sd, _measure_gain_errors(robot, prepared, samples))
    own[:, 0, 0] = (share * gains.mean[:, 0]) ** 2
    source = (
        f"the arm's own weight in {robot.source}: uncertain by {100 * settings.gain_common_sd:g} % in common and by "
    )
    return replace(
        gains,
        covariance=gains.covariance + own,
        common_sd=settings.gain_common_sd,
        is_by_weight=True,
        least_variance=np.zeros(robot.num_joints),
        source=f"{source}{100 * share.min():.0f} to {100 * share.max():.0f} % each; a weighed load would give 2 %",
    )


def check_halves(evidence: Evidence, reference_mass: float, settings: IdentificationSettings) -> HalfCheck:
    """Identifies a weighed load, [kg], from each half of a run, with the gains of the other half."""
    settings = replace(settings, num_samples=min(settings.num_samples, _FEW))
    middle = len(evidence.prepared.times) // 2
    halves = evidence.select(slice(middle)), evidence.select(slice(middle, None))
    beliefs = []
    for half, other in (halves, halves[::-1]):
        gains = calibrate_gains(other, reference_mass, settings).with_drift(settings)
        beliefs.append(infer(half, gains, settings=settings))
    mass = np.array([belief.mass for belief in beliefs])
    intervals = [belief.mass_interval90 for belief in beliefs]
    return HalfCheck(
        mass,
        np.array([belief.mass_sd for belief in beliefs]),
        mass / reference_mass - 1.0,
        np.array([float(low <= reference_mass <= high) for low, high in intervals]),
        np.array([belief.centre_of_mass for belief in beliefs]),
    )


def _estimate_friction_sd(fit: PayloadFit) -> Array:
    """Computes the posterior SDs of friction given load and gains, shape (n, 3)."""
    products = fit.statistics.products[:, FRICTION, FRICTION] / fit.long_run_variance[:, None, None]
    sd = fit.likelihood.prior.friction_sd  # zero for friction terms that are not modelled
    covariance = np.linalg.inv(np.eye(3) + sd[:, :, None] * products * sd[:, None, :])
    return sd * np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))


def _guess_scale(evidence: Evidence, mass: float) -> float:
    """Guesses the ratio of signal to torque, assuming a point mass at the tip, as a median over joints."""
    of_arm = 0.0 if evidence.is_difference else evidence.samples.tau_arm
    torque = of_arm + evidence.samples.Y[..., 0] * mass
    signal = evidence.samples.signal
    by_joint = np.sqrt((signal**2).mean(axis=0)) / np.maximum(np.sqrt((torque**2).mean(axis=0)), 1e-9)
    return float(np.median(by_joint))


def _propagate(fit: PayloadFit) -> Array:
    """Computes the covariance of the gains, including the uncertainty of the body."""
    gain, covariance = fit.likelihood.estimate_gains(fit.mode.load)
    D = compute_jacobian(fit.mode.theta)
    root = D @ np.linalg.cholesky(fit.mode.covariance)  # each column is a displacement of the body by one SD
    steps = []
    for column in root.T:
        displaced, _ = fit.likelihood.estimate_gains(fit.mode.load + _STEP * column)
        steps.append((displaced - gain) / _STEP)
    change = np.array(steps)  # (10, n, 2)
    total: Array = covariance + np.einsum("kca,kcb->cab", change, change)
    return total


def _measure_gain_errors(robot: SerialChain, prepared: PreparedRun, samples: ChannelSamples) -> Array:
    """Computes relative gain errors due to errors of the links' inertial parameters in the file, shape (n,)."""
    W = robot.compute_link_regressors(prepared.q, prepared.v, prepared.vdot)
    torque = samples.tau_arm * samples.used
    square = np.maximum((torque**2).sum(axis=0), np.finfo(float).tiny)
    of_links = np.einsum("nj,njp->jp", torque, W) * build_link_scale(robot)
    share: Array = np.minimum(np.linalg.norm(of_links, axis=1) / square, _NO_GAIN)
    return share
