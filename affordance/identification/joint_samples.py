"""Samples of joints along a recorded motion, and signals as they were before a controller took something out."""

import numpy as np

from affordance.arrays import Array
from affordance.identification.joint_statistics import ChannelSamples
from affordance.identification.preparation import PreparedRun
from affordance.identification.robot_chain import RobotChain
from affordance.identification.run import Run
from affordance.identification.settings import IdentificationSettings


def build_joint_samples(
    robot: RobotChain,
    prepared: PreparedRun,
    *,
    signal: Array,
    tau_arm: Array | None,
    arm_torque: Array,
    settings: IdentificationSettings,
) -> ChannelSamples:
    """Builds the samples of joints.

    Args:
        robot: The arm.
        prepared: Its motion.
        signal: x, shape (N, n).
        tau_arm: Torque of the arm in the signal, shape (N, n); None if it was subtracted.
        arm_torque: The arm's own torque, for the sign of the load, shape (N, n).
        settings: The least speed at which friction has a direction.
    """
    direction = np.sign(prepared.v)
    return ChannelSamples(
        robot.compute_payload_regressors(prepared.q, prepared.v, prepared.vdot),
        np.zeros_like(signal) if tau_arm is None else tau_arm,
        direction * np.sign(arm_torque),
        direction,
        prepared.v,
        signal,
        np.abs(prepared.v) >= settings.min_speed,
    )


def restore_compensated(robot: RobotChain, run: Run, prepared: PreparedRun, gain: Array) -> Array:
    """Adds to a signal what the controller had taken out of it.

    Args:
        robot: The arm.
        run: Says what that is.
        prepared: The run's even samples.
        gain: Unit of the signal per N m, shape (n,).

    Returns: The signal, shape (N, n).
    """
    description = run.description
    signal = prepared.signal
    motion = (prepared.q, prepared.v, prepared.vdot)
    if description.compensates_arm:
        signal = signal + gain * robot.compute_arm_torques(*motion)
    if description.compensated_payload.any():
        signal = signal + gain * (robot.compute_payload_regressors(*motion) @ description.compensated_payload)
    return signal
