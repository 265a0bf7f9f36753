import numpy as np
import pytest
from helpers.meshes import join, make_box

from affordance.objects.shells import MeshError, find_shells


def list_volumes(found):
    return [shell.solid.volume for shell in found.shells]


def test_bodies_that_touch_along_an_edge_are_parted_in_the_order_of_the_file():
    """Boxes with a common edge of four faces, and with a common face, are parted in the order of the file."""
    corners = ([0, 0, 0], [0.1, 0.1, 0.1]), ([0.1, 0.1, 0], [0.2, 0.3, 0.1]), ([0.2, 0.1, 0], [0.3, 0.3, 0.1])
    found = find_shells(*join(*(make_box(low, high) for low, high in corners)))
    np.testing.assert_allclose(list_volumes(found), [1e-3, 2e-3, 2e-3])
    assert not found.repairs


def test_inner_surface_wound_inwards_is_a_cavity_of_the_body_around_it():
    outer, inner = make_box([0, 0, 0], [0.2, 0.2, 0.2]), make_box([0.05, 0.05, 0.05], [0.1, 0.1, 0.1])
    other = make_box([0.5, 0, 0], [0.6, 0.1, 0.1])
    found = find_shells(*join(outer, (inner[0], inner[1][:, ::-1]), other))
    np.testing.assert_allclose(list_volumes(found), [8e-3 - 0.05**3, 1e-3])
    assert [(shell.number, shell.cavities) for shell in found.shells] == [(0, (1,)), (2, ())]


def test_body_wound_inwards_is_turned_and_that_is_said():
    vertices, faces = make_box([0, 0, 0], [0.1, 0.1, 0.1])
    found = find_shells(vertices, faces[:, ::-1])
    np.testing.assert_allclose(list_volumes(found), [1e-3])
    assert found.repairs == ("shell 0 was wound inwards, and was reversed",)


def test_triangles_without_common_corners_are_joined():
    """Triangles with corners of their own, as in STL files, are joined if corners are less than 0.01 mm apart."""
    vertices, faces = make_box([0, 0, 0], [0.1, 0.1, 0.1])
    soup = vertices[faces].reshape(-1, 3)
    rounded = soup + np.random.default_rng(0).uniform(-4e-6, 4e-6, soup.shape)
    index = np.arange(36).reshape(12, 3)
    assert not find_shells(soup, index).repairs
    (repair,) = find_shells(rounded, index).repairs
    assert "joining corners less than 0.01 mm apart" in repair


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda f: f[:-1], "3 edges that are open"),
        (lambda f: np.vstack([f[:1, ::-1], f[1:]]), "of opposite winding"),
        (lambda f: f[:, [0, 0, 1]], "no face with an area"),
        (lambda f: np.vstack([f[:1], f[:1, ::-1]]), "bounds no volume"),
    ],
)
def test_what_bounds_no_solid_is_refused(change, message):
    vertices, faces = make_box([0, 0, 0], [0.1, 0.1, 0.1])
    with pytest.raises(MeshError, match=message):
        find_shells(vertices, change(faces))
