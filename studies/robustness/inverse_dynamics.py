"""Joint torques along a motion and their derivatives, computed with automatic differentiation in Drake."""

from typing import Any, NamedTuple

import numpy as np
from pydrake.autodiffutils import AutoDiffXd, ExtractGradient, ExtractValue, InitializeAutoDiff
from pydrake.multibody.tree import MultibodyForces_

from affordance.arrays import Array
from affordance.plant.arm_model import ArmModel


class TorqueGradients(NamedTuple):
    """Joint torques at N states, and their derivatives."""

    tau: Array  # (N, num_joints), [N m]
    by_q: Array  # derivatives with respect to angles, (N, num_joints, num_joints), [N m/rad]
    by_v: Array  # derivatives with respect to velocities, (N, num_joints, num_joints), [N m s/rad]
    by_vdot: Array  # derivatives with respect to accelerations (mass matrices), same shape, [kg m^2]


class InverseDynamics:
    """Inverse dynamics of an arm with a known tool at many states."""

    def __init__(self, model: ArmModel, pi: Array) -> None:
        """Converts the plant to AutoDiff.

        Args:
            model: Model of the arm, whose state and payload are changed by all methods.
            pi: Inertial parameters of the tool about To, expressed in T, (10,).
        """
        self._model = model
        self._pi = pi
        # Any, because the stubs of Drake declare a System.
        self._plant: Any = model.arm.plant.ToAutoDiffXd()
        self._context = self._plant.CreateDefaultContext()
        self._forces = MultibodyForces_[AutoDiffXd](self._plant)
        plain = model.arm.plant.CreateDefaultContext()
        model.arm.set_payload(plain, pi)
        self._context.SetTimeStateAndParametersFrom(plain)

    def compute(self, q: Array, v: Array, vdot: Array) -> Array:
        """Computes joint torques, (N, num_joints), [N m], at N states; q, v and vdot are (N, num_joints)."""
        self._model.set_payload(self._pi)
        tau = np.empty_like(q)
        for i, x in enumerate(np.hstack([q, v])):
            self._model.set_state(x)
            tau[i] = self._model.compute_inverse_dynamics(vdot[i])
        return tau

    def compute_gradients(self, q: Array, v: Array, vdot: Array) -> TorqueGradients:
        """Computes joint torques and their derivatives at N states; q, v and vdot are (N, num_joints)."""
        n = q.shape[1]
        tau, by_vdot = np.empty_like(q), np.empty((*q.shape, n))
        by_x = np.empty((*q.shape, 2 * n))
        self._model.set_payload(self._pi)
        for i, x in enumerate(np.hstack([q, v])):
            self._plant.SetPositionsAndVelocities(self._context, InitializeAutoDiff(x))
            self._plant.CalcForceElementsContribution(self._context, self._forces)
            # Derivatives with respect to accelerations are the mass matrix. Automatic differentiation would take a
            # third longer.
            vdot_i = np.array([AutoDiffXd(value) for value in vdot[i]])
            with_gradient = self._plant.CalcInverseDynamics(self._context, vdot_i, self._forces)
            tau[i], by_x[i] = ExtractValue(with_gradient).ravel(), ExtractGradient(with_gradient)
            self._model.set_state(x)
            by_vdot[i] = self._model.compute_mass_matrix()
        return TorqueGradients(tau, by_x[..., :n], by_x[..., n:], by_vdot)
