"""Internal model of an arm with a believed payload, and its payload regressor Y.

Torques due to a held tool are linear in its inertial parameters:

    tau = tau_arm(q, v, vdot) + Y(q, v, vdot) pi          (from the paper's eq. 2)

The equations are in wrench_regressor.py, which computes Y along whole trajectories.
"""

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.tree import (
    JacobianWrtVariable,
    MultibodyForces,
)

from affordance.arrays import Array
from affordance.plant.arm import Arm
from affordance.plant.wrench_regressor import compute_wrench_regressor


class ArmModel:
    """Internal model: an arm with a believed payload, at the state last set.

    Not thread-safe and cheap to create; every owner has an instance of its own, so that no owner sees another's
    state.

    Attributes:
        arm: Modelled arm.
        gravity: Gravitational acceleration in W, shape (3,), [m/s^2].
    """

    def __init__(self, arm: Arm) -> None:
        """Creates a model with an empty hand at the zero state."""
        self.arm = arm
        self._plant = arm.plant
        self._context = arm.plant.CreateDefaultContext()
        self._forces = MultibodyForces(arm.plant)
        self._world = arm.plant.world_frame()
        self.gravity: Array = arm.plant.gravity_field().gravity_vector()
        self._origin = np.zeros(3)
        self.set_payload(np.zeros(10))

    def set_payload(self, pi: Array) -> None:
        """Sets the believed inertial parameters of the tool about To, expressed in T, shape (10,)."""
        self.arm.set_payload(self._context, pi)

    def set_state(self, x: Array) -> None:
        """Sets joint angles and velocities, stacked to shape (2 num_joints,), [rad, rad/s]."""
        self._plant.SetPositionsAndVelocities(self._context, x)

    def compute_inverse_dynamics(self, vdot: Array) -> Array:
        """Computes the torques for given joint accelerations, shape (num_joints,), [N m] (paper, eq. 2)."""
        self._plant.CalcForceElementsContribution(self._context, self._forces)
        return self._plant.CalcInverseDynamics(self._context, vdot, self._forces)

    def compute_held_torque(self, x: Array, vdot: Array) -> Array:
        """Computes the torques for joint accelerations at state x, shape (num_joints,), [N m]; the state is changed.

        A model whose torques are held for a control period overrides this.
        """
        self.set_state(x)
        return self.compute_inverse_dynamics(vdot)

    def compute_mass_matrix(self) -> Array:
        """Computes the mass matrix M, shape (num_joints, num_joints), [kg m^2]."""
        return self._plant.CalcMassMatrix(self._context)

    def compute_hand_pose(self) -> RigidTransform:
        """Computes the pose of the hand, X_WH."""
        return self.arm.hand.CalcPoseInWorld(self._context)

    def compute_hand_jacobian(self) -> Array:
        """Computes the Jacobian Jv_V_WH of the hand's spatial velocity, rotation first, shape (6, num_joints)."""
        return self._plant.CalcJacobianSpatialVelocity(
            self._context, JacobianWrtVariable.kV, self.arm.hand, self._origin, self._world, self._world
        )

    def compute_point_position(self, p_TQ: Array) -> Array:
        """Computes the position p_WQ of a point Q fixed to the tool, shape (3,), [m]; p_TQ (3,), [m]."""
        X_WH = self.compute_hand_pose()
        position: Array = X_WH.translation() + X_WH.rotation().matrix() @ p_TQ
        return position

    def compute_point_jacobian(self, p_TQ: Array) -> Array:
        """Computes the Jacobian Jv_v_WQ of a point Q fixed to the tool, shape (3, num_joints); p_TQ (3,), [m]."""
        return self._plant.CalcJacobianTranslationalVelocity(
            self._context, JacobianWrtVariable.kV, self.arm.hand, p_TQ, self._world, self._world
        )

    def compute_hand_bias_acceleration(self) -> Array:
        """Computes the hand's spatial acceleration at zero vdot, A_WH - J vdot, rotation first, shape (6,)."""
        return self._plant.CalcBiasSpatialAcceleration(
            self._context, JacobianWrtVariable.kV, self.arm.hand, self._origin, self._world, self._world
        ).get_coeffs()


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
