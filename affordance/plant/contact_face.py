"""The surface of a tool near the point that meets a nail, as contact takes it."""

from typing import NamedTuple

import numpy as np
from pydrake.geometry import Cylinder, Shape, Sphere
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RigidBody

from affordance.arrays import Array
from affordance.plant.contact_material import register_surface

# A surface that is flatter than this is taken as flat, [m].
_FLAT = 1.0
# The disc that stands for a flat surface: it reaches as far as a tip may creep on a nail, and as deep as no nail
# enters, [m].
_DISC_RADIUS, _DISC_THICKNESS = 0.03, 0.02


class ContactFace(NamedTuple):
    """The surface of a tool near the point S that strikes: a sphere of the same curvature, a disc where flat.

    Drake knows the contact of a sphere, such as a nail's head, with another sphere or a disc exactly. That with an
    ellipsoid or a mesh it iterates for, and then returns the line between their middles as normal of the contact, so
    that a tool that strikes anywhere but right below its middle is pushed aside (docs/decisions/0013-nail.md).

    Attributes:
        p_TS: The point, shape (3,), [m].
        normal_T: Outward normal there, expressed in T, a unit vector, shape (3,).
        radius: Of curvature; infinite where it is flat, [m].
    """

    p_TS: Array
    normal_T: Array
    radius: float

    def add_to(self, plant: MultibodyPlant, body: RigidBody, name: str) -> None:
        """Gives the tool's body its collision geometry, in a plant that is not finalized."""
        is_flat = self.radius > _FLAT
        depth = 0.5 * _DISC_THICKNESS if is_flat else self.radius
        shape: Shape = Cylinder(_DISC_RADIUS, _DISC_THICKNESS) if is_flat else Sphere(self.radius)
        X_TF = RigidTransform(
            RotationMatrix.MakeFromOneVector(self.normal_T, 2), np.array(self.p_TS) - depth * np.array(self.normal_T)
        )
        register_surface(plant, body, X_TF, shape, name)
