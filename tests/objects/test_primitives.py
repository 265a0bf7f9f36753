import numpy as np
import pytest
from helpers.refusals import refuse
from pydrake.geometry import Box as DrakeBox
from pydrake.geometry import Capsule as DrakeCapsule
from pydrake.geometry import Cylinder as DrakeCylinder
from pydrake.multibody.tree import CalcSpatialInertia

from affordance.exceptions import BadArgumentError
from affordance.objects.inertia import Ellipsoid, parameters_from_pseudo_inertia, spatial_inertia_from_parameters
from affordance.objects.primitives import Box, Capsule, Cylinder

SOLIDS = [
    (Box((0.1, 0.03, 0.02)), DrakeBox(0.1, 0.03, 0.02)),
    (Cylinder(0.02, 0.3), DrakeCylinder(0.02, 0.3)),
    (Capsule(0.03, 0.1), DrakeCapsule(0.03, 0.1)),
]


@pytest.mark.parametrize(("solid", "drake"), SOLIDS)
def test_inertia_is_drakes(solid, drake):
    ours = spatial_inertia_from_parameters(7800.0 * parameters_from_pseudo_inertia(solid.unit_pseudo_inertia()))
    np.testing.assert_allclose(
        ours.CopyToFullMatrix6(), CalcSpatialInertia(drake, 7800.0).CopyToFullMatrix6(), rtol=1e-12, atol=1e-12
    )
    assert solid.volume == pytest.approx(solid.unit_pseudo_inertia()[3, 3], rel=1e-14)


@pytest.mark.parametrize("solid", [pair[0] for pair in SOLIDS])
def test_support_lies_on_the_solid_and_nothing_of_it_lies_farther(solid, rng):
    # Points of the solid by brute force: of the box around it, those that are within.
    x = rng.uniform(-0.2, 0.2, (200_000, 3))
    match solid:
        case Box():
            within = (np.abs(x) <= 0.5 * solid.sizes).all(axis=1)
        case Cylinder():
            within = (np.hypot(x[:, 0], x[:, 1]) <= solid.radius) & (np.abs(x[:, 2]) <= 0.5 * solid.length)
        case Capsule():
            beyond = np.maximum(np.abs(x[:, 2]) - 0.5 * solid.length, 0.0)
            within = np.linalg.norm(np.column_stack([x[:, :2], beyond]), axis=1) <= solid.radius
    points = x[within]
    for direction in rng.standard_normal((20, 3)):
        direction /= np.linalg.norm(direction)
        reach = direction @ solid.find_support(direction)
        assert (points @ direction).max() <= reach + 1e-12
        assert (points @ direction).max() >= reach - 0.02


def test_support_of_a_flat_face_is_its_middle_and_flat():
    box, cylinder, capsule = (pair[0] for pair in SOLIDS)
    np.testing.assert_allclose(box.find_support(np.array([0, 1.0, 1e-12])), [0, 0.015, 0])
    np.testing.assert_allclose(cylinder.find_support(np.array([0, 0, -1.0])), [0, 0, -0.15])
    assert box.compute_curvature_radius(np.array([0, 1.0, 0])) == np.inf
    assert cylinder.compute_curvature_radius(np.array([0, 0, 1.0])) == np.inf
    assert capsule.compute_curvature_radius(np.array([0, 0, 1.0])) == 0.03
    assert capsule.compute_curvature_radius(np.array([0, 1.0, 0])) == np.inf


@pytest.mark.parametrize("solid", [pair[0] for pair in SOLIDS])
def test_other_sizes_give_another_solid_of_the_kind(solid):
    twice = solid.with_sizes(2.0 * solid.sizes)
    assert type(twice) is type(solid)
    assert twice.volume == pytest.approx(8.0 * solid.volume)
    assert solid.with_sizes(solid.sizes) == solid


@pytest.mark.parametrize(
    ("kind", "sizes"),
    [(Box, (0.1, 0, 0.1)), (Cylinder, (-1.0, 1.0)), (Capsule, (1.0, np.inf)), (Ellipsoid, (0.1, np.nan, 0.1))],
)
def test_impossible_sizes_are_refused(kind, sizes):
    said = refuse(kind.from_sizes, sizes, error=ValueError)
    assert said.startswith(f"{kind.__name__}: ")
    assert "must be finite and greater than 0" in said


@pytest.mark.parametrize("kind", [Box, Cylinder, Capsule, Ellipsoid])
@pytest.mark.parametrize("num_lengths", [1, 4])
def test_another_number_of_sizes_is_refused(kind, num_lengths):
    said = refuse(kind.from_sizes, [0.1] * num_lengths, error=BadArgumentError)
    wanted = 3 if kind in (Box, Ellipsoid) else 2
    assert f"{num_lengths} lengths" in said
    assert said.endswith(str(wanted))
