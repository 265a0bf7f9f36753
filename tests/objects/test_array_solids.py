import numpy as np
import pytest
from helpers.meshes import join, make_box
from helpers.refusals import refuse
from pydrake.multibody.tree import CalcSpatialInertia
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from affordance.objects.array_solids import ColumnSolid, TriangleMesh
from affordance.objects.drake_geometry import draw_mesh
from affordance.objects.inertia import parameters_from_pseudo_inertia, spatial_inertia_from_parameters
from affordance.objects.primitives import Box


@pytest.fixture(scope="module")
def stone():
    """The convex hull of points, wound outwards."""
    points = np.random.default_rng(3).standard_normal((40, 3)) * [0.1, 0.05, 0.02] + [0.3, -0.1, 0.05]
    hull = ConvexHull(points)
    faces = hull.simplices.copy()
    normals = np.cross(points[faces[:, 1]] - points[faces[:, 0]], points[faces[:, 2]] - points[faces[:, 0]])
    inward = np.einsum("ij,ij->i", normals, hull.equations[:, :3]) < 0
    faces[inward] = faces[inward][:, ::-1]
    return TriangleMesh(points, faces)


def test_inertia_is_drakes(stone):
    mesh = draw_mesh(stone)
    ours = spatial_inertia_from_parameters(8500.0 * parameters_from_pseudo_inertia(stone.unit_pseudo_inertia()))
    drakes = CalcSpatialInertia(mesh, 8500.0).CopyToFullMatrix6()
    np.testing.assert_allclose(ours.CopyToFullMatrix6(), drakes, rtol=1e-6, atol=1e-6 * np.abs(drakes).max())


def test_volume_and_support_are_those_of_the_convex_hull(stone, rng):
    hull = ConvexHull(stone.vertices)
    assert stone.volume == pytest.approx(hull.volume, rel=1e-12)
    for direction in rng.standard_normal((20, 3)):
        assert direction @ stone.find_support(direction) == pytest.approx(
            (stone.vertices @ direction).max(), abs=1e-6
        )


def test_inertia_moves_with_the_mesh(stone):
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = Rotation.from_rotvec([0.3, -1.0, 2.0]).as_matrix(), [1.0, 2.0, -3.0]
    J = TriangleMesh(stone.vertices @ X[:3, :3].T + X[:3, 3], stone.faces).unit_pseudo_inertia()
    np.testing.assert_allclose(J, X @ stone.unit_pseudo_inertia() @ X.T, rtol=1e-9, atol=1e-15)
    centred, p = stone.centre()
    np.testing.assert_allclose(centred.unit_pseudo_inertia()[:3, 3], 0, atol=1e-15)
    np.testing.assert_allclose(p, stone.unit_pseudo_inertia()[:3, 3] / stone.volume)


def test_cavity_takes_its_volume_away():
    outer, inner = make_box([0, 0, 0], [0.3, 0.2, 0.1]), make_box([0.05, 0.05, 0.02], [0.1, 0.1, 0.05])
    hollow = TriangleMesh(*join(outer, (inner[0], inner[1][:, ::-1])))
    X = np.eye(4)

    def solid(low, high):
        X[:3, 3] = 0.5 * (np.array(low) + high)
        return X @ Box(tuple(np.subtract(high, low))).unit_pseudo_inertia() @ X.T

    expected = solid([0, 0, 0], [0.3, 0.2, 0.1]) - solid([0.05, 0.05, 0.02], [0.1, 0.1, 0.05])
    np.testing.assert_allclose(hollow.unit_pseudo_inertia(), expected, rtol=1e-12, atol=1e-18)
    assert hollow.compute_curvature_radius(np.array([0, 0, 1.0])) == np.inf


def test_equal_meshes_are_one_and_the_same_key(stone):
    again = TriangleMesh(stone.vertices.copy(), stone.faces.copy())
    assert again == stone
    assert hash(again) == hash(stone)
    assert stone.with_sizes(stone.sizes) is stone
    assert stone.with_sizes(2.0 * stone.sizes).volume == pytest.approx(8.0 * stone.volume)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda v, f: (v, f[1:]), "3 open edges"),
        (lambda v, f: (v, f[:, ::-1]), "wound to bound more than 0"),
        (lambda v, f: (v, np.vstack([f[:1, ::-1], f[1:]])), "3 open edges"),
        (lambda v, f: (v, f + 1), "there are 8"),
        (lambda v, f: (v * np.nan, f), "not all finite"),
    ],
)
def test_what_bounds_no_solid_is_refused(change, message):
    with pytest.raises(ValueError, match=message):
        TriangleMesh(*change(*make_box([0, 0, 0], [1, 1, 1])))


@pytest.fixture
def block():
    """Columns that fill a box of 40 x 20 x 10 mm about (0.1, 0, 0.005)."""
    x, y = np.meshgrid(np.arange(0.0805, 0.12, 1e-3), np.arange(-0.0095, 0.01, 1e-3))
    places = np.column_stack([x.ravel(), y.ravel()])
    return ColumnSolid(places, np.full(len(places), 1e-6), np.tile([0.0, 0.01], (len(places), 1)))


def test_columns_that_fill_a_box_are_that_box(block):
    centred, p = block.centre()
    np.testing.assert_allclose(p, [0.1, 0, 0.005], atol=1e-12)
    # Each column's moments about its own axis are those of a line: they add up to h^2 of 1 mm^2 / 12.
    np.testing.assert_allclose(
        centred.unit_pseudo_inertia(), Box((0.04, 0.02, 0.01)).unit_pseudo_inertia(), rtol=1e-9, atol=1e-18
    )
    np.testing.assert_allclose(block.sizes, [0.04, 0.02, 0.01], rtol=1e-9)


def test_support_is_the_middle_of_the_farthest_ends(block):
    np.testing.assert_allclose(block.find_support(np.array([0, 0, 1.0])), [0.1, 0, 0.01], atol=1e-12)
    assert block.find_support(np.array([1.0, 0, 0]))[0] == pytest.approx(0.119, abs=1e-3)
    assert block.compute_curvature_radius(np.array([0, 0, 1.0])) == np.inf


def test_stretching_scales_volume_and_keeps_identity(block):
    assert block.with_sizes(block.sizes) is block
    assert block.with_sizes(block.sizes * [1, 1, 2]).volume == pytest.approx(2.0 * block.volume)
    assert hash(block) == hash(ColumnSolid(block.places, block.areas, block.ends))


def test_columns_without_volume_are_refused():
    with pytest.raises(ValueError, match="must have more than 0"):
        ColumnSolid(np.zeros((1, 2)), np.ones(1), np.zeros((1, 2)))
    assert "must be (N, 2)" in refuse(ColumnSolid, np.zeros((2, 2)), np.ones(1), np.zeros((1, 2)), error=ValueError)
