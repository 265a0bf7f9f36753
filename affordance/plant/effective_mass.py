"""Effective mass of arm and tool at the striking point S, along the blow: 1 / (n^T J M^-1 J^T n).

J is the translational Jacobian Jv_v_WS and n the blow's direction in W (Khatib 1995, Int. J. Robotics Research
14:19-36, from memory).
"""

import numpy as np

from affordance.arrays import Array
from affordance.objects.inertia import NUM_PARAMETERS
from affordance.plant.arm_model import ArmModel
from affordance.plant.chain_plant import build_chain


class EffectiveMass:
    """Effective mass along the blow in one posture, as a function of the tool's inertial parameters.

    The mass matrix is linear in these parameters. A column of the payload's part is the payload regressor at unit
    acceleration of one joint, minus the regressor at rest.
    """

    def __init__(self, model: ArmModel, p_TS: Array, direction_W: Array, q: Array) -> None:
        """Computes the mass matrices of arm and payload; changes the model's state and payload.

        The tool strikes with its point S, p_TS (3,), [m], along a unit vector, (3,), at joint angles q,
        (num_joints,), [rad].
        """
        n = len(q)
        model.set_payload(np.zeros(NUM_PARAMETERS))
        model.set_posture(q)
        self._M_arm = model.compute_mass_matrix()
        self._along = direction_W @ model.compute_point_jacobian(p_TS)
        vdot = np.vstack([np.zeros(n), np.eye(n)])
        chain = build_chain(model.arm)
        Y = chain.compute_payload_regressors(np.tile(q, (n + 1, 1)), np.zeros((n + 1, n)), vdot)
        self._M_payload = (Y[1:] - Y[0]).reshape(n * n, NUM_PARAMETERS)

    def compute(self, pi: Array) -> Array:
        """Computes effective masses, (S,), [kg], of tools with parameters pi, (S, 10), about To in T."""
        M = self._M_arm + (pi @ self._M_payload.T).reshape(len(pi), *self._M_arm.shape)
        mass: Array = 1.0 / (np.linalg.solve(M, np.tile(self._along, (len(pi), 1))[..., None])[..., 0] @ self._along)
        return mass
