"""Contact material of a blow, the same for the head of the nail and the face of the tool."""

from pydrake.geometry import AddContactMaterial, ProximityProperties, Shape
from pydrake.math import RigidTransform
from pydrake.multibody.plant import CoulombFriction, MultibodyPlant
from pydrake.multibody.tree import RigidBody

# Stiffness k_c of the contact between two such surfaces. Under 500 N they approach by half a millimetre, a thirtieth
# of the nail's travel; the energy stored in the contact lowers the peak by 1.2 %, [N/m].
CONTACT_STIFFNESS = 1e6
# Drake combines the stiffnesses of the two surfaces in series, k_c = k_1 k_2 / (k_1 + k_2); a surface without one
# would get Drake's default, which halves that of the contact, [N/m].
_SURFACE_STIFFNESS = 2.0 * CONTACT_STIFFNESS
# Dissipation of Hunt and Crossley's model; wood absorbs most of the energy of a contact. For two equally stiff
# surfaces Drake takes the mean, [s/m].
DISSIPATION = 1.0
# Dry skin or wood on metal (Drake's own default is frictionless).
_FRICTION = CoulombFriction(static_friction=0.5, dynamic_friction=0.5)


def register_surface(plant: MultibodyPlant, body: RigidBody, X_BG: RigidTransform, shape: Shape, name: str) -> None:
    """Adds a collision geometry of this material to a body, in a plant that is not yet finalized.

    Args:
        plant: Plant, registered with a scene graph.
        body: Body B that receives the geometry.
        X_BG: Pose of the geometry G in the body's frame.
        shape: Shape of the geometry.
        name: Name of the geometry, unique on the body.
    """
    material = ProximityProperties()
    AddContactMaterial(
        dissipation=DISSIPATION, point_stiffness=_SURFACE_STIFFNESS, friction=_FRICTION, properties=material
    )
    plant.RegisterCollisionGeometry(body, X_BG, shape, name, material)
