"""Evidence by repetition: the same motion without and with the load, one run subtracted from the other.

All that both runs share cancels, friction included; no model of the arm is needed.
"""

import numpy as np

from affordance.identification.alignment import align
from affordance.identification.evidence import Evidence, no_phantom
from affordance.identification.joint_samples import build_joint_samples, restore_compensated
from affordance.identification.preparation import find_cutoff, prepare
from affordance.identification.robot_chain import RobotChain
from affordance.identification.run import Run
from affordance.identification.settings import IdentificationSettings


def pair_runs(robot: RobotChain, empty: Run, loaded: Run, settings: IdentificationSettings) -> Evidence:
    """Subtracts an empty run from a loaded one.

    Args:
        robot: Model of the arm, with gravity as in the runs.
        empty: Run with an empty hand.
        loaded: Run of the same motion with the load.
        settings: Identification settings, for filters and tolerance.

    Raises:
        BadValueError: The loaded run does not repeat the empty one.
    """
    alignment = align(empty, loaded, settings.repeat_tolerance)
    step = max(1.0 / empty.rate, 1.0 / loaded.rate)
    times = np.arange(alignment.start, alignment.end, step)
    cutoff = max(find_cutoff(empty, settings), find_cutoff(loaded, settings))
    before = prepare(empty, settings, cutoff=cutoff, times=times)
    after = prepare(loaded, settings, cutoff=cutoff, times=times + alignment.lag)
    # The mean of both motions: they differ by a ten-thousandth of a radian.
    motion = before._replace(
        q=0.5 * (before.q + after.q), v=0.5 * (before.v + after.v), vdot=0.5 * (before.vdot + after.vdot)
    )
    nominal = np.ones(robot.num_joints)
    signal = restore_compensated(robot, loaded, after, nominal) - restore_compensated(robot, empty, before, nominal)
    arm_torque = robot.compute_arm_torques(motion.q, motion.v, motion.vdot)
    phantom, phantom_covariance = no_phantom()
    return Evidence(
        source=loaded.source,
        analysis=f"paired with {empty.source}, {alignment.lag:.3f} s earlier by its clock",
        kind=loaded.description.kind,
        channel_names=robot.joint_names,
        times=motion.times + alignment.lag,
        samples=build_joint_samples(
            robot, motion, signal=signal, tau_arm=None, arm_torque=arm_torque, settings=settings
        ),
        motion=motion.motion,
        arm_torque=arm_torque,
        is_difference=True,
        rate=motion.rate,
        cutoff=cutoff,
        least_variance=np.zeros(robot.num_joints),
        phantom=phantom,
        phantom_covariance=phantom_covariance,
        notes=(f"joint angles of both runs agree to {1e3 * alignment.difference:.2g} mrad",),
    )
