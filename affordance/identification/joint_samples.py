"""Samples of joints along a recorded motion, with signals as they were before a controller's compensation."""

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
    """Builds the samples of all joints.

    Args:
        robot: Model of the arm.
        prepared: Motion of the arm.
        signal: Signal x, shape (N, n), in its own unit.
        tau_arm: Torque of the arm in the signal, shape (N, n), [N m]; None if it was subtracted.
        arm_torque: Torque of the arm alone, for the sign of the load, shape (N, n), [N m].
        settings: Identification settings, for the least speed at which friction has a direction.
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
    """Adds the torques that the controller had subtracted back to a signal.

    Args:
        robot: Model of the arm.
        run: Run, whose description states the compensation.
        prepared: Even samples of the run.
        gain: Gain of each joint, shape (n,), [unit of the signal per N m].

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
