"""Surface of a tool near the point that strikes a nail, as modelled for contact."""

from typing import NamedTuple

import numpy as np
from pydrake.geometry import Cylinder, Shape, Sphere
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RigidBody

from affordance.arrays import Array
from affordance.plant.contact_material import register_surface

# Radius of curvature above which a surface is modelled as flat, [m].
_FLAT = 1.0
# Disc that models a flat surface: its radius exceeds the creep of a tip on a nail, its thickness the depth to which a
# nail could penetrate, [m].
_DISC_RADIUS, _DISC_THICKNESS = 0.03, 0.02


class ContactFace(NamedTuple):
    """Surface of a tool near the striking point S: a sphere of the same curvature, or a disc where it is flat.

    Drake computes the contact of a sphere, such as a nail's head, with another sphere or a disc exactly. That with an
    ellipsoid or a mesh is found iteratively, and its normal is the line between the two centres, so that a tool that
    strikes anywhere but right below its centre is pushed aside (docs/decisions/0013-nail.md).

    Attributes:
        p_TS: Position of S in the tool, shape (3,), [m].
        normal_T: Outward normal at S, expressed in T, a unit vector, shape (3,).
        radius: Radius of curvature; infinite for a flat surface, [m].
    """

    p_TS: Array
    normal_T: Array
    radius: float

    def add_to(self, plant: MultibodyPlant, body: RigidBody, name: str) -> None:
        """Adds the collision geometry to the tool's body, in a plant that is not yet finalized."""
        is_flat = self.radius > _FLAT
        depth = 0.5 * _DISC_THICKNESS if is_flat else self.radius
        shape: Shape = Cylinder(_DISC_RADIUS, _DISC_THICKNESS) if is_flat else Sphere(self.radius)
        X_TF = RigidTransform(
            RotationMatrix.MakeFromOneVector(self.normal_T, 2), np.array(self.p_TS) - depth * np.array(self.normal_T)
        )
        register_surface(plant, body, X_TF, shape, name)
