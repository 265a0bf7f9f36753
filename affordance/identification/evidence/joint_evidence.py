"""Evidence by the torques of joints along a recorded motion, whatever the treatment of the empty arm.

Signals are restored to those before a controller's compensation.
"""

import numpy as np

from affordance.arrays import Array
from affordance.identification.evidence.evidence import Evidence
from affordance.identification.evidence.joint_statistics import ChannelSamples
from affordance.identification.recording.preparation import PreparedRun
from affordance.identification.recording.robot_chain import RobotChain
from affordance.identification.recording.run import Run
from affordance.identification.settings import IdentificationSettings


def build_joint_evidence(
    robot: RobotChain,
    run: Run,
    prepared: PreparedRun,
    signal: Array,
    settings: IdentificationSettings,
    *,
    analysis: str,
    is_difference: bool,
    lag: float = 0.0,
) -> Evidence:
    """Builds the evidence of all joints, before the errors of an analysis.

    Args:
        robot: Model of the arm.
        run: Loaded run.
        prepared: Motion of the arm.
        signal: Signal x, shape (N, n), in its own unit.
        settings: Identification settings, for the least speed at which friction has a direction.
        analysis: Treatment of the empty arm, in words.
        is_difference: True if the arm's torque was subtracted from the signal.
        lag: Lag of the run's clock behind the times of the motion, [s].
    """
    arm_torque = robot.compute_arm_torques(*prepared.motion)
    samples = ChannelSamples.of_joints(
        robot.compute_payload_regressors(*prepared.motion),
        prepared.v,
        signal,
        tau_arm=np.zeros_like(signal) if is_difference else arm_torque,
        arm_torque=arm_torque,
        min_speed=settings.min_speed,
    )
    return Evidence.from_run(
        run,
        prepared,
        samples,
        robot.joint_names,
        analysis=analysis,
        arm_torque=arm_torque,
        is_difference=is_difference,
        lag=lag,
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
    motion = prepared.motion
    if description.compensates_arm:
        signal = signal + gain * robot.compute_arm_torques(*motion)
    if description.compensated_payload.any():
        signal = signal + gain * (robot.compute_payload_regressors(*motion) @ description.compensated_payload)
    return signal
