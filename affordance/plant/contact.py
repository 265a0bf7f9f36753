"""Contact of a blow: materials, the tool's surface, and the effective mass.

The effective mass of arm and tool at the striking point S along the blow is 1 / (n^T J M^-1 J^T n).
"""

from typing import NamedTuple

import numpy as np
from pydrake.geometry import AddContactMaterial, Cylinder, ProximityProperties, Shape, Sphere
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import CoulombFriction, MultibodyPlant
from pydrake.multibody.tree import RigidBody

from affordance.arrays import Array
from affordance.objects.inertia import NUM_PARAMETERS
from affordance.plant.arm_model import ArmModel
from affordance.plant.chain_plant import build_chain

# Stiffness k_c of the contact between two such surfaces, [N/m]. Under 500 N they approach by half a millimetre, a
# thirtieth of the nail's travel; the energy stored in the contact lowers the peak force by 1.2 %.
CONTACT_STIFFNESS = 1e6
# Stiffness of each surface, [N/m]. Drake combines the two in series, k_c = k_1 k_2 / (k_1 + k_2). A surface without a
# stiffness would get Drake's default, which halves the contact's.
_SURFACE_STIFFNESS = 2.0 * CONTACT_STIFFNESS
# Dissipation in the Hunt-Crossley model, [s/m]: wood absorbs most of the energy of a contact. Drake uses the mean for
# two equally stiff surfaces.
DISSIPATION = 1.0
# Dry skin or wood on metal (Drake's default is frictionless).
_FRICTION = CoulombFriction(static_friction=0.5, dynamic_friction=0.5)
# Radius of curvature above which a surface is modelled as flat, [m].
_FLAT = 1.0
# Disc that models a flat surface, [m]: its radius exceeds the distance by which a tip creeps on a nail, its thickness
# the depth to which a nail could penetrate.
_DISC_RADIUS, _DISC_THICKNESS = 0.03, 0.02


def register_surface(plant: MultibodyPlant, body: RigidBody, X_BG: RigidTransform, shape: Shape, name: str) -> None:
    """Registers a collision geometry G of this material on body B. The plant is not yet finalized."""
    material = ProximityProperties()
    AddContactMaterial(
        dissipation=DISSIPATION, point_stiffness=_SURFACE_STIFFNESS, friction=_FRICTION, properties=material
    )
    plant.RegisterCollisionGeometry(body, X_BG, shape, name, material)


class ContactFace(NamedTuple):
    """Surface of a tool near the striking point S, as a sphere or disc.

    The sphere has the same curvature; the disc is for a flat face.

    Drake computes the contact of a sphere, such as a nail's head, with another sphere or a disc exactly. Contact with
    an ellipsoid or a mesh is computed iteratively, and its normal is the line between the two centres, so a tool that
    does not strike exactly below its centre would be pushed aside (docs/decisions/0013-nail.md).
    """

    p_TS: Array  # position of S in the tool, shape (3,), [m]
    normal_T: Array  # outward normal at S, expressed in T, a unit vector, shape (3,)
    radius: float  # radius of curvature; infinite for a flat surface, [m]

    def add_to(self, plant: MultibodyPlant, body: RigidBody, name: str) -> None:
        """Adds the collision geometry to the tool's body, before the plant is finalized."""
        is_flat = self.radius > _FLAT
        depth = 0.5 * _DISC_THICKNESS if is_flat else self.radius
        shape: Shape = Cylinder(_DISC_RADIUS, _DISC_THICKNESS) if is_flat else Sphere(self.radius)
        X_TF = RigidTransform(
            RotationMatrix.MakeFromOneVector(self.normal_T, 2), np.array(self.p_TS) - depth * np.array(self.normal_T)
        )
        register_surface(plant, body, X_TF, shape, name)


class EffectiveMass:
    """Effective mass along the blow in one posture, as a function of inertial parameters.

    The mass matrix is linear in these parameters. The payload's columns are payload regressors at unit acceleration
    of one joint, minus the regressor at rest.
    """

    def __init__(self, model: ArmModel, p_TS: Array, direction_W: Array, q: Array) -> None:
        """Computes the mass matrices of arm and payload. The model's state and payload are changed.

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
        """Computes effective masses, (S,), [kg], from parameters pi about To in T, (S, 10)."""
        M = self._M_arm + (pi @ self._M_payload.T).reshape(len(pi), *self._M_arm.shape)
        mass: Array = 1.0 / (np.linalg.solve(M, np.tile(self._along, (len(pi), 1))[..., None])[..., 0] @ self._along)
        return mass
