"""Evidence by the arm's file, for lack of a run with an empty hand; and gains from the arm's own weight.

Inertias in files are wrong by some ten per cent, and a wrist a hundred grams heavier than in its file looks like a
load of a hundred grams. This error is carried over: the uncertainty of the links is projected onto the payload.
"""

from dataclasses import replace

import numpy as np

from affordance.arrays import Array
from affordance.identification.calibration import calibrate_gains
from affordance.identification.evidence import Evidence, no_phantom
from affordance.identification.fitted_arm import build_link_scale
from affordance.identification.gains import Gains
from affordance.identification.joint_samples import build_joint_samples, restore_compensated
from affordance.identification.joint_statistics import ChannelSamples
from affordance.identification.model_error import project_link_errors
from affordance.identification.preparation import PreparedRun
from affordance.identification.robot_chain import RobotChain
from affordance.identification.run import Run
from affordance.identification.settings import IdentificationSettings

# Friction scale: the signal contains all of the friction, not only its change between two runs.
_WHOLE_FRICTION = 10.0
# Reflected rotor inertia, which files lack, [kg m^2]: a few tenths to a few on arms for ten kilograms of payload.
_ROTOR_INERTIA = 1.0
# Relative uncertainty at which a gain counts as unknown.
_NO_GAIN = 10.0


def build_file_evidence(
    robot: RobotChain, loaded: Run, prepared: PreparedRun, gains: Gains, settings: IdentificationSettings
) -> Evidence:
    """Builds the evidence of a loaded run without an empty run."""
    gain = gains.mean[:, 0]
    signal = restore_compensated(robot, loaded, prepared, gain)
    arm_torque = robot.compute_arm_torques(prepared.q, prepared.v, prepared.vdot)
    samples = build_joint_samples(
        robot, prepared, signal=signal, tau_arm=arm_torque, arm_torque=arm_torque, settings=settings
    )
    phantom, covariance = no_phantom()
    if settings.floor:
        covariance = project_link_errors(robot, prepared, samples, np.diag(build_link_scale(robot)))
    return Evidence(
        source=loaded.source,
        analysis=f"unpaired: the arm as {robot.source} has it",
        kind=loaded.description.kind,
        channel_names=robot.joint_names,
        times=prepared.times,
        samples=samples,
        motion=prepared.motion,
        arm_torque=arm_torque,
        is_difference=False,
        rate=prepared.rate,
        cutoff=prepared.cutoff,
        least_variance=np.zeros(robot.num_joints),
        phantom=phantom,
        phantom_covariance=covariance,
        friction_scale=_WHOLE_FRICTION,
        notes=(f"the arm's file may err by {1e3 * np.sqrt(covariance[0, 0]):.0f} g at the tip",),
    )


def estimate_gains(robot: RobotChain, run: Run, prepared: PreparedRun, settings: IdentificationSettings) -> Gains:
    """Estimates gains from the arm's own weight, to some 20 %; joints of a light wrist remain undetermined."""
    arm_torque = robot.compute_arm_torques(prepared.q, prepared.v, prepared.vdot)
    samples = build_joint_samples(
        robot, prepared, signal=prepared.signal, tau_arm=arm_torque, arm_torque=arm_torque, settings=settings
    )
    phantom, covariance = no_phantom()
    evidence = Evidence(
        source=run.source,
        analysis="the arm's own weight",
        kind=run.description.kind,
        channel_names=robot.joint_names,
        times=prepared.times,
        samples=samples._replace(Y=np.zeros_like(samples.Y)),
        motion=prepared.motion,
        arm_torque=arm_torque,
        is_difference=False,
        rate=prepared.rate,
        cutoff=prepared.cutoff,
        least_variance=np.zeros(robot.num_joints),
        phantom=phantom,
        phantom_covariance=covariance,
        friction_scale=_WHOLE_FRICTION,
    )
    gains = calibrate_gains(evidence, None, settings)
    own = np.zeros_like(gains.covariance)
    share = np.maximum(settings.gain_own_sd, _measure_gain_errors(robot, prepared, samples))
    own[:, 0, 0] = (share * gains.mean[:, 0]) ** 2
    source = (
        f"the arm's own weight by {robot.source}: all of them {100 * settings.gain_common_sd:g} % uncertain, each "
    )
    return replace(
        gains,
        covariance=gains.covariance + own,
        common_sd=settings.gain_common_sd,
        least_variance=np.zeros(robot.num_joints),
        source=f"{source}{100 * share.min():.0f} to {100 * share.max():.0f} %; a weighed load makes that 2 %",
    )


def _measure_gain_errors(robot: RobotChain, prepared: PreparedRun, samples: ChannelSamples) -> Array:
    """Computes the relative errors of gains due to errors of links and rotors in the file, shape (n,)."""
    W = robot.compute_link_regressors(prepared.q, prepared.v, prepared.vdot) * build_link_scale(robot)
    W = np.concatenate([W, _ROTOR_INERTIA * prepared.vdot[..., None]], axis=2) * samples.used[..., None]
    torque = samples.tau_arm * samples.used
    square = np.maximum((torque**2).sum(axis=0), np.finfo(float).tiny)
    seen_as = np.einsum("nj,njp->jp", torque, W) / square[:, None]
    share: Array = np.minimum(np.sqrt((seen_as**2).sum(axis=1)), _NO_GAIN)
    return share
