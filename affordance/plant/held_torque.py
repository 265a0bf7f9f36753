"""Internal model for a controller whose torques are held for a control period.

Gravity and gyroscopic terms change as the arm moves; their values at the middle of the period represent all of it.
Torques computed at its start would err by half of their change over the period, always in the same direction: in two
seconds of reaching, the forearm, whose angle is not controlled, then drifts by 36 degrees
(docs/decisions/0005-controller.md).

Damping acts throughout the period. Under torques tau held for a period h, with damping D, mass matrix M and all else
as at its start, rates change from v to

    v + phi(h M^-1 D) M^-1 (tau - bias - D v) h,    phi(x) = (1 - e^-x) / x

so that a mean acceleration vdot over the period requires tau = bias + D v + M phi(h M^-1 D)^-1 vdot. Where the ratio
of a joint's inertia to its damping is far below the period, as in the wrists of many robot files, which omit the
inertia of rotors, torques of the instantaneous equation would move it by a fraction of the plan: it would seem
locked. Without damping phi is one, and this is the plain model.
"""

import numpy as np

from affordance.arrays import Array
from affordance.plant.arm import Arm
from affordance.plant.arm_model import ArmModel


class HeldTorqueModel(ArmModel):
    """Internal model whose accelerations are means over a control period.

    Inverse dynamics and mass matrix apply to held torques; kinematics are those of the plain model.
    """

    def __init__(self, arm: Arm, period: float) -> None:
        """Stores the arm and the time for which torques are held, [s]."""
        super().__init__(arm)
        actuators = [arm.plant.get_joint_actuator(index) for index in arm.plant.GetJointActuatorIndices()]
        one, half = np.eye(len(actuators)), 0.5 * period
        # From [q, v, vdot] at the period's start to [q, v] in its middle.
        self._to_middle = np.block([[one, half * one, 0.5 * half**2 * one], [0.0 * one, one, half * one]])
        self._damping = period * np.array([actuator.joint().default_damping_vector()[0] for actuator in actuators])
        self._is_damped = bool(self._damping.any())

    def compute_inverse_dynamics(self, vdot: Array) -> Array:
        """Computes the torques that, held for a control period, give mean accelerations, (num_joints,), [N m]."""
        if not self._is_damped:
            return super().compute_inverse_dynamics(vdot)
        held: Array = super().compute_inverse_dynamics(np.zeros_like(vdot)) + self.compute_mass_matrix() @ vdot
        return held

    def compute_held_torque(self, x: Array, vdot: Array) -> Array:
        """Computes the torques that, held for a control period, give mean accelerations.

        The model is left in the state at the middle of the period.

        Args:
            x: Joint angles and velocities at the period's start, (2 num_joints,), [rad, rad/s].
            vdot: Mean accelerations, (num_joints,), [rad/s^2].

        Returns: Torques, (num_joints,), [N m].
        """
        self.set_state(self._to_middle @ np.concatenate([x, vdot]))
        tau = self.compute_inverse_dynamics(vdot)
        if self._is_damped:  # the held mass matrix includes damping of the change of rates
            tau = tau - 0.5 * self._damping * vdot
        return tau

    def compute_fastest_decay(self) -> float:
        """Computes the control period over the shortest time constant, the largest eigenvalue of h M^-1 D, [1]."""
        if not self._is_damped:
            return 0.0
        x, _ = self._decompose()[1:]
        return float(x[-1])

    def compute_mass_matrix(self) -> Array:
        """Computes held torque per mean acceleration, M phi(h M^-1 D)^-1, (num_joints, num_joints), [kg m^2]."""
        if not self._is_damped:
            return super().compute_mass_matrix()
        L, x, V = self._decompose()
        inverse_phi = np.where(x > 1e-8, x / -np.expm1(-np.maximum(x, 1e-8)), 1.0 + 0.5 * x)
        LV = L @ V
        held: Array = (LV * inverse_phi) @ LV.T
        return held

    def _decompose(self) -> tuple[Array, Array, Array]:
        """Computes L, x, V with M = L L^T, L^-1 (h D) L^-T = V diag(x) V^T; x eigenvalues of h M^-1 D, increasing."""
        L = np.linalg.cholesky(super().compute_mass_matrix())
        whitened = np.linalg.solve(L, np.diag(np.sqrt(self._damping)))
        x, V = np.linalg.eigh(whitened @ whitened.T)
        return L, x, V


def compute_stiffness(arm: Arm, period: float) -> float:
    """Computes the control period over the shortest time constant of damping, for the empty arm at home, [1]."""
    model = HeldTorqueModel(arm, period)
    model.set_state(np.concatenate([arm.home, np.zeros(arm.num_joints)]))
    return model.compute_fastest_decay()
