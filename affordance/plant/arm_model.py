"""Dynamics of an arm with a payload, at one instant or for torques that are held for a control period.

The torques due to a held tool are linear in its inertial parameters pi (from the paper's eq. 2):

    tau = tau_arm(q, v, vdot) + Y(q, v, vdot) pi

``serial_chain.py`` derives Y and computes it along whole trajectories. Frames: W the world, H the hand, T the tool, Q
a point fixed to the tool (plant/arm.py).
"""

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.tree import Frame, JacobianWrtVariable, MultibodyForces

from affordance.arrays import Array
from affordance.plant.arm import Arm
from affordance.plant.serial_chain import compute_wrench_regressor


class ArmModel:
    """Dynamics of an arm with an assumed payload, at the most recently set state.

    An instance is not thread-safe but cheap to create, so each user should have its own.
    """

    def __init__(self, arm: Arm) -> None:
        """Creates a model with an empty hand, at rest in the home posture."""
        self.arm = arm
        self._plant = arm.plant
        self._context = arm.plant.CreateDefaultContext()
        self._forces = MultibodyForces(arm.plant)
        self._world = arm.plant.world_frame()
        self.gravity: Array = arm.plant.gravity_field().gravity_vector()  # in W, shape (3,), [m/s^2]
        self._origin = np.zeros(3)
        self.set_payload(np.zeros(10))

    def set_payload(self, pi: Array) -> None:
        """Sets the assumed inertial parameters of the tool about To, expressed in T, shape (10,)."""
        self.arm.set_payload(self._context, pi)

    def set_state(self, x: Array) -> None:
        """Sets joint angles and velocities, stacked to shape (2 num_joints,), [rad, rad/s]."""
        self._plant.SetPositionsAndVelocities(self._context, x)

    def set_posture(self, q: Array) -> None:
        """Sets joint angles, shape (num_joints,), [rad], and zero velocities."""
        self.set_state(np.concatenate([q, np.zeros(len(q))]))

    def compute_inverse_dynamics(self, vdot: Array) -> Array:
        """Computes the joint torques, (num_joints,), [N m], for joint accelerations vdot (paper, eq. 2)."""
        self._plant.CalcForceElementsContribution(self._context, self._forces)
        return self._plant.CalcInverseDynamics(self._context, vdot, self._forces)

    def compute_held_torque(self, x: Array, vdot: Array) -> Array:
        """Computes the joint torques, (num_joints,), [N m], for joint accelerations at a given state.

        The model remains in this state. ``HeldTorqueModel`` overrides the method.

        Args:
            x: Joint angles and velocities, stacked to shape (2 num_joints,), [rad, rad/s].
            vdot: Joint accelerations, (num_joints,), [rad/s^2].
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
        """Computes the position in W of a point Q fixed to the tool, (3,), [m].

        Args:
            p_TQ: Position of Q in the tool, (3,), [m].
        """
        X_WH = self.compute_hand_pose()
        position: Array = X_WH.translation() + X_WH.rotation().matrix() @ p_TQ
        return position

    def compute_point_jacobian(self, p_TQ: Array) -> Array:
        """Computes the translational Jacobian Jv_v_WQ of a point Q fixed to the tool, shape (3, num_joints).

        Args:
            p_TQ: Position of Q in the tool, (3,), [m].
        """
        return self._plant.CalcJacobianTranslationalVelocity(
            self._context, JacobianWrtVariable.kV, self.arm.hand, p_TQ, self._world, self._world
        )

    def compute_hand_bias_acceleration(self) -> Array:
        """Computes the hand's spatial acceleration at zero joint acceleration, rotation first, (6,)."""
        return self._plant.CalcBiasSpatialAcceleration(
            self._context, JacobianWrtVariable.kV, self.arm.hand, self._origin, self._world, self._world
        ).get_coeffs()


def compute_payload_regressor(model: ArmModel, x: Array, vdot: Array) -> Array:
    """Computes the payload regressor Y, (num_joints, 10), at one state, using Drake's kinematics.

    Args:
        model: Arm model. It remains in state x.
        x: Joint angles and velocities, stacked to shape (2 num_joints,), [rad, rad/s].
        vdot: Joint accelerations, (num_joints,), [rad/s^2].
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
    """Dynamics of an arm whose torques stay constant during each control period.

    All accelerations are means over the period. The kinematics are the same as in ``ArmModel``.

    Gravity and gyroscopic terms change as the arm moves, so they are evaluated in the middle of the period. At its
    start they would be wrong by half of their change during the period, always in the same direction. In two seconds
    of reaching, the forearm, whose angle is not controlled, would drift by 36 degrees
    (docs/decisions/0005-controller.md).

    Damping acts throughout the period. Suppose that torques tau are held for a period h, with damping D, and that the
    mass matrix M and the bias torques do not change during the period. Joint velocities then change from v to

        v + phi(h M^-1 D) M^-1 (tau - bias - D v) h,    phi(x) = (1 - e^-x) / x

    Therefore a mean acceleration vdot requires tau = bias + D v + M phi(h M^-1 D)^-1 vdot. Without damping, phi is 1
    and this is the instantaneous equation. With damping the difference matters: many robot files omit rotor inertias,
    so the time constant of a wrist joint (inertia over damping) is much shorter than the period. Torques from the
    instantaneous equation would move such a joint by only a small fraction of the plan.
    """

    def __init__(self, arm: Arm, period: float) -> None:
        """Creates a model of an arm whose torques are held for a period, [s]."""
        super().__init__(arm)
        actuators = [arm.plant.get_joint_actuator(index) for index in arm.plant.GetJointActuatorIndices()]
        one, half = np.eye(len(actuators)), 0.5 * period
        # Maps [q, v, vdot] at the start of the period to [q, v] in its middle.
        self._to_middle = np.block([[one, half * one, 0.5 * half**2 * one], [0.0 * one, one, half * one]])
        self._damping = period * np.array([actuator.joint().default_damping_vector()[0] for actuator in actuators])
        self.is_damped = bool(self._damping.any())

    def compute_inverse_dynamics(self, vdot: Array) -> Array:
        """Computes the held torques, (num_joints,), [N m], for mean accelerations vdot."""
        if not self.is_damped:
            return super().compute_inverse_dynamics(vdot)
        held: Array = super().compute_inverse_dynamics(np.zeros_like(vdot)) + self.compute_mass_matrix() @ vdot
        return held

    def compute_held_torque(self, x: Array, vdot: Array) -> Array:
        """Computes the held torques, (num_joints,), [N m], for mean accelerations from a given state.

        The model remains in the state at the middle of the period.

        Args:
            x: Joint angles and velocities at the start, stacked to shape (2 num_joints,), [rad, rad/s].
            vdot: Mean joint accelerations, (num_joints,), [rad/s^2].
        """
        self.set_state(self._to_middle.dot(np.concatenate([x, vdot])))
        tau = self.compute_inverse_dynamics(vdot)
        if self.is_damped:  # the mass matrix already includes the damping of the velocity change up to the middle
            tau = tau - 0.5 * self._damping * vdot
        return tau

    def compute_mass_matrix(self) -> Array:
        """Computes the mass matrix for held torques, M phi(h M^-1 D)^-1, (num_joints, num_joints), [kg m^2]."""
        if not self.is_damped:
            return super().compute_mass_matrix()
        L, x, V = self.decompose()
        inverse_phi = np.where(x > 1e-8, x / -np.expm1(-np.maximum(x, 1e-8)), 1.0 + 0.5 * x)
        LV = L @ V
        held: Array = (LV * inverse_phi) @ LV.T
        return held

    def decompose(self) -> tuple[Array, Array, Array]:
        """Diagonalises damping relative to the mass matrix.

        Returns:
            Matrices L, vector x and matrix V, with M = L L^T and L^-1 (h D) L^-T = V diag(x) V^T. The elements of x
            are the eigenvalues of h M^-1 D in increasing order.
        """
        L = np.linalg.cholesky(super().compute_mass_matrix())
        whitened = np.linalg.solve(L, np.diag(np.sqrt(self._damping)))
        x, V = np.linalg.eigh(whitened @ whitened.T)
        return L, x, V


def compute_stiffness(arm: Arm, period: float) -> float:
    """Divides the control period by the shortest damping time constant of the empty arm in its home posture."""
    model = HeldTorqueModel(arm, period)
    model.set_posture(arm.home)
    return float(model.decompose()[1][-1]) if model.is_damped else 0.0
