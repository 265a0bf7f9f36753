"""Arm dynamics with a payload: torques at one instant, or held for a control period.

Torques due to a held tool are linear in its inertial parameters:

    tau = tau_arm(q, v, vdot) + Y(q, v, vdot) pi          (from the paper's eq. 2)

The equations are in wrench_regressor.py, which computes Y along whole trajectories. Frames: W the world, H the hand,
T the tool, Q a point fixed to it (plant/arm.py).
"""

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.tree import Frame, JacobianWrtVariable, MultibodyForces

from affordance.arrays import Array
from affordance.plant.arm import Arm
from affordance.plant.serial_chain import compute_wrench_regressor


class ArmModel:
    """Dynamics of an arm with a believed payload, at the state that was last set.

    The model is not thread-safe but cheap to create, so every user should have its own instance.
    """

    def __init__(self, arm: Arm) -> None:
        """Creates a model with an empty hand, in the zero state."""
        self.arm = arm
        self._plant = arm.plant
        self._context = arm.plant.CreateDefaultContext()
        self._forces = MultibodyForces(arm.plant)
        self._world = arm.plant.world_frame()
        self.gravity: Array = arm.plant.gravity_field().gravity_vector()  # in W, shape (3,), [m/s^2]
        self._origin = np.zeros(3)
        self.set_payload(np.zeros(10))

    def set_payload(self, pi: Array) -> None:
        """Sets the believed inertial parameters of the tool about To, expressed in T, shape (10,)."""
        self.arm.set_payload(self._context, pi)

    def set_state(self, x: Array) -> None:
        """Sets joint angles and velocities, stacked to shape (2 num_joints,), [rad, rad/s]."""
        self._plant.SetPositionsAndVelocities(self._context, x)

    def set_posture(self, q: Array) -> None:
        """Sets joint angles, shape (num_joints,), [rad], at rest."""
        self.set_state(np.concatenate([q, np.zeros(len(q))]))

    def compute_inverse_dynamics(self, vdot: Array) -> Array:
        """Computes the torques for given joint accelerations, shape (num_joints,), [N m] (paper, eq. 2)."""
        self._plant.CalcForceElementsContribution(self._context, self._forces)
        return self._plant.CalcInverseDynamics(self._context, vdot, self._forces)

    def compute_held_torque(self, x: Array, vdot: Array) -> Array:
        """Computes the torques for joint accelerations at state x, (num_joints,), [N m].

        This changes the state of the model.

        Models that hold torques for a control period override this.
        """
        self.set_state(x)
        return self.compute_inverse_dynamics(vdot)

    def compute_mass_matrix(self) -> Array:
        """Computes the mass matrix M, shape (num_joints, num_joints), [kg m^2]."""
        return self._plant.CalcMassMatrix(self._context)

    def compute_hand_pose(self) -> RigidTransform:
        """Computes the pose of the hand, X_WH."""
        return self.arm.hand.CalcPoseInWorld(self._context)

    def compute_frame_position(self, frame: Frame) -> Array:
        """Computes the position of a frame's origin in W, shape (3,), [m]."""
        return frame.CalcPoseInWorld(self._context).translation()

    def compute_hand_jacobian(self) -> Array:
        """Computes the Jacobian Jv_V_WH of the hand's spatial velocity, rotation first, shape (6, num_joints)."""
        return self._plant.CalcJacobianSpatialVelocity(
            self._context, JacobianWrtVariable.kV, self.arm.hand, self._origin, self._world, self._world
        )

    def compute_point_position(self, p_TQ: Array) -> Array:
        """Computes the position p_WQ of a tool point Q from p_TQ, (3,) each, [m]."""
        X_WH = self.compute_hand_pose()
        position: Array = X_WH.translation() + X_WH.rotation().matrix() @ p_TQ
        return position

    def compute_point_jacobian(self, p_TQ: Array) -> Array:
        """Computes the Jacobian Jv_v_WQ of a tool point Q, shape (3, num_joints).

        The point is given by p_TQ, (3,), [m].
        """
        return self._plant.CalcJacobianTranslationalVelocity(
            self._context, JacobianWrtVariable.kV, self.arm.hand, p_TQ, self._world, self._world
        )

    def compute_hand_bias_acceleration(self) -> Array:
        """Computes the hand's spatial acceleration at zero vdot, shape (6,).

        The result is A_WH - J vdot, with the rotation first.
        """
        return self._plant.CalcBiasSpatialAcceleration(
            self._context, JacobianWrtVariable.kV, self.arm.hand, self._origin, self._world, self._world
        ).get_coeffs()


def compute_payload_regressor(model: ArmModel, x: Array, vdot: Array) -> Array:
    """Computes the payload regressor Y at one state with Drake's kinematics.

    The state x is angles and rates, (2 num_joints,), [rad, rad/s]; vdot is (num_joints,), [rad/s^2], and Y is
    (num_joints, 10).
    """
    model.set_state(x)
    J = model.compute_hand_jacobian()
    A_WT = J @ vdot + model.compute_hand_bias_acceleration()
    R_WT = model.compute_hand_pose().rotation().matrix()
    motion_W = np.array([A_WT[3:] - model.gravity, A_WT[:3], J[:3] @ x[len(vdot) :]])
    wrench = compute_wrench_regressor(motion_W @ R_WT)
    Y: Array = J[:3].T @ (R_WT @ wrench[:3]) + J[3:].T @ (R_WT @ wrench[3:])
    return Y


class HeldTorqueModel(ArmModel):
    """Arm dynamics for torques that are held for a control period. Accelerations are means over the period.

    Gravity and gyroscopic terms change as the arm moves; they are evaluated at the middle of the period. If they were
    evaluated at its start, torques would err by half of the terms' change over the period, always in the same
    direction: in two seconds of reaching, the forearm, whose angle is not controlled, would drift by 36 degrees
    (docs/decisions/0005-controller.md).

    Damping acts throughout the period. If torques tau are held for a period h, with damping D, mass matrix M and
    everything else as at its start, rates change from v to

        v + phi(h M^-1 D) M^-1 (tau - bias - D v) h,    phi(x) = (1 - e^-x) / x

    so a mean acceleration vdot over the period requires tau = bias + D v + M phi(h M^-1 D)^-1 vdot. In many robot
    files, which omit rotor inertias, the ratio of a wrist joint's inertia to its damping is far below the period.
    Torques from the instantaneous equation would then move the joint by only a fraction of the plan, as if it were
    locked. Without damping phi is one, and the dynamics are the plain model's. Kinematics are always the plain
    model's.
    """

    def __init__(self, arm: Arm, period: float) -> None:
        """Creates a model of the arm with torques that are held for a period, [s]."""
        super().__init__(arm)
        actuators = [arm.plant.get_joint_actuator(index) for index in arm.plant.GetJointActuatorIndices()]
        one, half = np.eye(len(actuators)), 0.5 * period
        # From [q, v, vdot] at the period's start to [q, v] in its middle.
        self._to_middle = np.block([[one, half * one, 0.5 * half**2 * one], [0.0 * one, one, half * one]])
        self._damping = period * np.array([actuator.joint().default_damping_vector()[0] for actuator in actuators])
        self.is_damped = bool(self._damping.any())

    def compute_inverse_dynamics(self, vdot: Array) -> Array:
        """Computes held torques for given mean accelerations, (num_joints,), [N m]."""
        if not self.is_damped:
            return super().compute_inverse_dynamics(vdot)
        held: Array = super().compute_inverse_dynamics(np.zeros_like(vdot)) + self.compute_mass_matrix() @ vdot
        return held

    def compute_held_torque(self, x: Array, vdot: Array) -> Array:
        """Computes held torques for mean accelerations from state x, (num_joints,), [N m].

        The model is left in the state at the middle of the period.
        """
        self.set_state(self._to_middle @ np.concatenate([x, vdot]))
        tau = self.compute_inverse_dynamics(vdot)
        if self.is_damped:  # the held mass matrix includes the damping of velocity changes
            tau = tau - 0.5 * self._damping * vdot
        return tau

    def compute_mass_matrix(self) -> Array:
        """Computes the mass matrix for held torques, (num_joints, num_joints), [kg m^2].

        The result is M phi(h M^-1 D)^-1.
        """
        if not self.is_damped:
            return super().compute_mass_matrix()
        L, x, V = self.decompose()
        inverse_phi = np.where(x > 1e-8, x / -np.expm1(-np.maximum(x, 1e-8)), 1.0 + 0.5 * x)
        LV = L @ V
        held: Array = (LV * inverse_phi) @ LV.T
        return held

    def decompose(self) -> tuple[Array, Array, Array]:
        """Diagonalises the damping relative to the mass matrix.

        Returns L, x, V with M = L L^T and L^-1 (h D) L^-T = V diag(x) V^T. The eigenvalues x of h M^-1 D increase.
        """
        L = np.linalg.cholesky(super().compute_mass_matrix())
        whitened = np.linalg.solve(L, np.diag(np.sqrt(self._damping)))
        x, V = np.linalg.eigh(whitened @ whitened.T)
        return L, x, V


def compute_stiffness(arm: Arm, period: float) -> float:
    """Computes the ratio of control period to shortest damping time constant.

    The ratio applies to the empty arm in the home posture.
    """
    model = HeldTorqueModel(arm, period)
    model.set_posture(arm.home)
    return float(model.decompose()[1][-1]) if model.is_damped else 0.0
