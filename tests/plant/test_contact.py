"""The surface of a tool where it meets a nail."""

import numpy as np
import pytest
from pydrake.geometry import Cylinder, Sphere
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialVelocity
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, ContactModel
from pydrake.multibody.tree import SpatialInertia
from pydrake.systems.framework import DiagramBuilder

from affordance.objects.inertia import Ellipsoid
from affordance.plant.contact import CONTACT_STIFFNESS, DISSIPATION, ContactFace
from affordance.plant.nail import NailPlacement, add_nail

UPRIGHT = np.array([0.0, 0.0, 1.0])


def measure_curvature_radius(semi_axes, support, normal):
    """Radius of curvature from heights of the surface under its tangent plane, by second differences."""
    A = np.diag(1.0 / np.square(semi_axes))
    along = np.linalg.svd(normal[None])[2][1:]
    step = 1e-3 * min(semi_axes)

    def find_height(u, v):
        """The depth z for which support + u a + v b - z n lies on the ellipsoid."""
        foot = support + u * along[0] + v * along[1]
        a, b, c = normal @ A @ normal, -2.0 * normal @ A @ foot, foot @ A @ foot - 1.0
        return (-b - np.sqrt(b**2 - 4.0 * a * c)) / (2.0 * a)

    h = step
    uu = (find_height(h, 0) + find_height(-h, 0) - 2 * find_height(0, 0)) / h**2
    vv = (find_height(0, h) + find_height(0, -h) - 2 * find_height(0, 0)) / h**2
    uv = (find_height(h, h) - find_height(h, -h) - find_height(-h, h) + find_height(-h, -h)) / (4 * h**2)
    return 1.0 / np.sqrt(uu * vv - uv**2)


@pytest.mark.parametrize("semi_axes", [(0.075, 0.015, 0.015), (0.02, 0.05, 0.03), (0.04, 0.04, 0.04)])
def test_radius_is_that_of_the_surface(rng, semi_axes):
    ellipsoid = Ellipsoid(semi_axes)
    normals = rng.standard_normal((8, 3))
    for normal in [*(normals / np.linalg.norm(normals, axis=1)[:, None]), *np.eye(3)]:
        expected = measure_curvature_radius(semi_axes, ellipsoid.find_support(normal), normal)
        assert ellipsoid.compute_curvature_radius(normal) == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize(("radius", "shape"), [(0.075, Sphere), (np.inf, Cylinder)])
def test_face_touches_at_its_point_and_nowhere_before(rng, radius, shape):
    """The collision shape is upright on the face, and ends at its point to 1e-12 m along the normal."""
    normal = rng.standard_normal(3)
    normal /= np.linalg.norm(normal)
    face = ContactFace(rng.standard_normal(3), normal, radius)
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
    body = plant.AddRigidBody("tool", plant.AddModelInstance("tool"), SpatialInertia.SolidCubeWithDensity(1.0, 0.1))
    face.add_to(plant, body, "face")
    plant.Finalize()
    (geometry,) = plant.GetCollisionGeometriesForBody(body)
    inspector = scene_graph.model_inspector()
    found, X_TF = inspector.GetShape(geometry), inspector.GetPoseInFrame(geometry)
    assert type(found) is shape
    reach = found.radius() if shape is Sphere else 0.5 * found.length()
    np.testing.assert_allclose(X_TF.translation() + reach * normal, face.p_TS, atol=1e-12)
    np.testing.assert_allclose(X_TF.rotation().matrix() @ UPRIGHT, normal, atol=1e-12)


@pytest.mark.parametrize("radius", [0.05, np.inf])
@pytest.mark.parametrize("depth", [1e-5, 3e-4])
@pytest.mark.parametrize("speed", [0.0, 0.2, 3.0])
def test_force_is_that_of_the_stated_stiffness_and_dissipation(hammer, radius, depth, speed):
    """Force is Hunt and Crossley's k x (1 + d v), in a plant with tool and nail, by Drake's own contact results."""
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.0)
    tool = plant.AddRigidBody("tool", plant.AddModelInstance("tool"), SpatialInertia.SolidCubeWithDensity(1.0, 0.1))
    ContactFace(np.zeros(3), -UPRIGHT, radius).add_to(plant, tool, "face")
    add_nail(plant, NailPlacement(hammer.nail, np.zeros(3), -UPRIGHT))
    plant.set_contact_model(ContactModel.kPoint)
    plant.Finalize()
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    plant_context = plant.GetMyMutableContextFromRoot(context)
    plant.SetFreeBodyPose(plant_context, tool, RigidTransform([0.0, 0.0, -depth]))
    plant.SetFreeBodySpatialVelocity(plant_context, tool, SpatialVelocity(np.zeros(3), -speed * UPRIGHT))
    results = plant.get_contact_results_output_port().Eval(plant_context)
    assert results.num_point_pair_contacts() == 1
    force = np.linalg.norm(results.point_pair_contact_info(0).contact_force())
    assert force == pytest.approx(CONTACT_STIFFNESS * depth * (1.0 + DISSIPATION * speed), rel=1e-6)
