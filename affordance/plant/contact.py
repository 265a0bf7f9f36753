"""Contact between a tool and a nail: material constants, striking surface and effective mass.

The effective mass of arm and tool, at the striking point S and along the blow n, is 1 / (n^T J M^-1 J^T n).
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

# Stiffness k_c of the contact between two such surfaces, [N/m]. A force of 500 N compresses it by half a millimetre,
# a thirtieth of the nail's travel. The energy stored in the contact lowers the peak force by 1.2 %.
CONTACT_STIFFNESS = 1e6
# Stiffness of each surface, [N/m]. Drake combines the two in series, k_c = k_1 k_2 / (k_1 + k_2). Both surfaces need
# a value, because Drake's default would halve k_c.
_SURFACE_STIFFNESS = 2.0 * CONTACT_STIFFNESS
# Dissipation in the Hunt-Crossley model, [s/m]. Wood absorbs most of the energy of a contact. For two equally stiff
# surfaces, Drake uses the mean of their values.
DISSIPATION = 1.0
# Friction of dry skin or wood on metal. Drake's default is no friction.
_FRICTION = CoulombFriction(static_friction=0.5, dynamic_friction=0.5)
# Radius of curvature above which a surface is modelled as flat, [m].
_FLAT = 1.0
# Size of the disc that models a flat surface, [m]. Its radius exceeds the distance by which a tip slides on a nail,
# and its thickness exceeds the depth to which a nail could penetrate it.
_DISC_RADIUS, _DISC_THICKNESS = 0.03, 0.02


def register_surface(plant: MultibodyPlant, body: RigidBody, X_BG: RigidTransform, shape: Shape, name: str) -> None:
    """Registers a collision geometry G on body B of a plant that is not yet finalized.

    All surfaces have the same material.
    """
    material = ProximityProperties()
    AddContactMaterial(
        dissipation=DISSIPATION, point_stiffness=_SURFACE_STIFFNESS, friction=_FRICTION, properties=material
    )
    plant.RegisterCollisionGeometry(body, X_BG, shape, name, material)


class ContactFace(NamedTuple):
    """Surface of a tool near the striking point S, modelled as a sphere of equal curvature, or as a disc if flat.

    Drake computes the contact of a sphere, such as a nail's head, with another sphere or a disc exactly. For an
    ellipsoid or a mesh, it iterates and uses the line between the two centres as the normal. A tool that does not
    strike exactly below its centre would then be pushed aside (docs/decisions/0013-nail.md).
    """

    p_TS: Array  # position of S in the tool, shape (3,), [m]
    normal_T: Array  # outward normal at S, expressed in T, a unit vector, shape (3,)
    radius: float  # radius of curvature; infinite for a flat surface, [m]

    def add_to(self, plant: MultibodyPlant, body: RigidBody, name: str) -> None:
        """Adds the collision geometry to the tool's body. The plant is not yet finalized."""
        is_flat = self.radius > _FLAT
        depth = 0.5 * _DISC_THICKNESS if is_flat else self.radius
        shape: Shape = Cylinder(_DISC_RADIUS, _DISC_THICKNESS) if is_flat else Sphere(self.radius)
        X_TF = RigidTransform(
            RotationMatrix.MakeFromOneVector(self.normal_T, 2), np.array(self.p_TS) - depth * np.array(self.normal_T)
        )
        register_surface(plant, body, X_TF, shape, name)


class EffectiveMass:
    """Effective mass along the blow, in one posture, as a function of the payload's inertial parameters.

    The mass matrix is linear in these parameters. Each joint's column of the payload's part is the payload regressor
    at unit acceleration of this joint, minus the regressor at rest.
    """

    def __init__(self, model: ArmModel, p_TS: Array, direction_W: Array, q: Array) -> None:
        """Computes the mass matrix of the arm, and its change per inertial parameter of the payload.

        Args:
            model: Arm model. Its state and payload are changed.
            p_TS: Striking point S of the tool, (3,), [m].
            direction_W: Direction of the blow, a unit vector, (3,).
            q: Joint angles, (num_joints,), [rad].
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
        """Computes effective masses, (S,), [kg], for inertial parameters pi about To in T, (S, 10)."""
        M = self._M_arm + (pi @ self._M_payload.T).reshape(len(pi), *self._M_arm.shape)
        mass: Array = 1.0 / (np.linalg.solve(M, np.tile(self._along, (len(pi), 1))[..., None])[..., 0] @ self._along)
        return mass
