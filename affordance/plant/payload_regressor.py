"""Payload regressor Y: torques due to a held tool are linear in its inertial parameters.

    tau = tau_arm(q, v, vdot) + Y(q, v, vdot) pi          (from the paper's eq. 2)

The equations are in wrench_regressor.py, which computes Y along whole trajectories.
"""

import numpy as np

from affordance.arrays import Array
from affordance.plant.arm_model import ArmModel
from affordance.plant.wrench_regressor import compute_payload_regressors, compute_wrench_regressor

__all__ = ["compute_payload_regressor", "compute_payload_regressors"]


def compute_payload_regressor(model: ArmModel, x: Array, vdot: Array) -> Array:
    """Computes Y at one state, with Drake's kinematics.

    Args:
        model: Model of the arm; its state is set to x.
        x: Joint angles and rates, shape (2 num_joints,), [rad, rad/s].
        vdot: Joint accelerations, shape (num_joints,), [rad/s^2].

    Returns: Regressor Y, shape (num_joints, 10).
    """
    model.set_state(x)
    J = model.compute_hand_jacobian()
    A_WT = J @ vdot + model.compute_hand_bias_acceleration()
    R_WT = model.compute_hand_pose().rotation().matrix()
    motion_W = np.array([A_WT[3:] - model.gravity, A_WT[:3], J[:3] @ x[len(vdot) :]])
    wrench = compute_wrench_regressor(motion_W @ R_WT)
    Y: Array = J[:3].T @ (R_WT @ wrench[:3]) + J[3:].T @ (R_WT @ wrench[3:])
    return Y
