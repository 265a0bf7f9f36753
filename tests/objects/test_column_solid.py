import numpy as np
import pytest
from helpers.refusals import refuse

from affordance.objects.column_solid import ColumnSolid
from affordance.objects.primitives import Box


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
