import numpy as np
import pytest
from helpers.rendered_labels import render_labels
from scipy.spatial.transform import Rotation

from affordance.extensions.pixels.ellipsoid_fit import SeenEllipsoid, trace_rays
from affordance.extensions.pixels.rig import DEFAULT_RIG, LAMPS, build_rig_diagram, compute_shading, render
from affordance.objects.inertia import Ellipsoid
from affordance.objects.materials import Material
from affordance.objects.tool import Component, Tool, find_box

RED = Material("red", (0.8, 0.2, 0.1), 1000.0, 0.0, "made up")
BLUE = Material("blue", (0.1, 0.3, 0.9), 2000.0, 0.0, "made up")


def make_part(semi_axes, position, material=RED, R_TE=None):
    X_TE = np.eye(4)
    X_TE[:3, 3] = position
    X_TE[:3, :3] = np.eye(3) if R_TE is None else R_TE
    return Component(Ellipsoid(semi_axes), X_TE, material, material)


EGG = Tool(
    "egg", (make_part((0.14, 0.09, 0.06), (0.3, 0.1, 0), RED, Rotation.from_rotvec([0.3, 0.4, 0.5]).as_matrix()),)
)
PAIR = Tool("pair", (make_part((0.05, 0.02, 0.02), (0.05, 0, 0)), make_part((0.05, 0.02, 0.02), (0.15, 0, 0), BLUE)))


@pytest.fixture(scope="module")
def pair():
    return render(PAIR)


@pytest.fixture(scope="module")
def labels():
    return render_labels(PAIR)


def see_from_camera(tool, number=0) -> SeenEllipsoid:
    X_CT = np.linalg.inv(DEFAULT_RIG.compute_camera_pose(tool))
    part = tool.components[number]
    R_CE = X_CT[:3, :3] @ part.X_TE[:3, :3]
    return SeenEllipsoid((X_CT @ part.X_TE)[:3, 3], (R_CE * part.shape.sizes**2) @ R_CE.T)


def test_object_lies_on_the_stand_in_the_middle_of_the_picture():
    low, high = find_box(EGG.components)
    X_WT = DEFAULT_RIG.place(EGG)
    np.testing.assert_allclose((X_WT[:3, :3] @ (0.5 * (low + high)) + X_WT[:3, 3])[:2], 0.0, atol=1e-12)
    assert X_WT[2, 3] + low[2] == pytest.approx(0.0, abs=1e-12)


def test_pixels_are_where_the_camera_says(labels):
    """The centroid of a symmetric object's pixels is the optical axis to 0.1 pixels."""
    rows, columns = np.nonzero(labels >= 0)
    np.testing.assert_allclose([columns.mean(), rows.mean()], DEFAULT_RIG.camera.centre, atol=0.1)


def test_renderer_draws_ellipsoids_of_the_right_size_at_the_right_depth():
    """Area agrees to 0.1 % and depth to 0.5 mm with the pinhole camera, as facets cancel in the mean."""
    camera = DEFAULT_RIG.camera
    rows, columns = np.indices((camera.height, camera.width))
    rays = camera.compute_rays(np.column_stack([columns.ravel(), rows.ravel()]).astype(float))
    exact = trace_rays(see_from_camera(EGG), rays, camera.focal_length)
    inside = (exact.outline_distance > 0.0).reshape(camera.height, camera.width)
    rendered = render(EGG)
    assert (render_labels(EGG) == 0).sum() / inside.sum() == pytest.approx(1.0, abs=0.001)
    deep = (exact.outline_distance > 5.0).reshape(camera.height, camera.width)
    difference = rendered.depth[deep] - exact.depth.reshape(camera.height, camera.width)[deep]
    assert abs(difference.mean()) < 1e-4
    assert np.abs(difference).max() < 5e-4


def test_labels_depth_and_colour_agree(pair, labels):
    depth, colour = pair.depth, pair.colour
    assert depth[labels < 0] == pytest.approx(DEFAULT_RIG.height, abs=1e-4)
    assert (depth[labels >= 0] < DEFAULT_RIG.height - 0.015).all()
    for number, part in enumerate(PAIR.components):
        rows, columns = np.nonzero(labels == number)
        brightest = colour[round(rows.mean()), round(columns.mean())] / 255.0
        top = compute_shading(np.array([[0.0, 0.0, -1.0]]))[0]
        np.testing.assert_allclose(brightest, top * np.array(part.looks_like.colour), atol=1.5 / 255)


def test_shading_is_what_the_renderer_does():
    rendered, ellipsoid, camera = render(EGG), see_from_camera(EGG), DEFAULT_RIG.camera
    rows, columns = np.nonzero(render_labels(EGG) == 0)
    rays = camera.compute_rays(np.column_stack([columns, rows]).astype(float))
    seen = trace_rays(ellipsoid, rays, camera.focal_length)
    deep = seen.outline_distance > 3.0
    normals = seen.normals / np.linalg.norm(seen.normals, axis=1, keepdims=True)
    expected = compute_shading(normals)[deep, None] * np.array(RED.colour)
    np.testing.assert_allclose(rendered.colour[rows[deep], columns[deep]] / 255.0, expected, atol=0.02)


def test_lamps_do_not_saturate_white():
    normals = np.random.default_rng(0).standard_normal((1000, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    assert compute_shading(normals).max() <= 1.0
    facing = compute_shading(normals[normals[:, 2] < 0.0])
    assert facing.min() > 0.1  # no side that the camera sees is dark
    assert np.allclose([np.linalg.norm(lamp.direction_C) for lamp in LAMPS], 1.0)


def test_pictures_of_one_object_are_equal(pair):
    again = render(PAIR)
    np.testing.assert_array_equal(again.colour, pair.colour)
    np.testing.assert_array_equal(again.depth, pair.depth)


def test_part_that_drake_cannot_draw_is_refused():
    class Cube:
        sizes, volume = np.ones(3), 1.0
        with_sizes = unit_pseudo_inertia = compute_curvature_radius = pytest.fail

        def find_support(self, direction_E):
            return np.sign(direction_E)

    tool = Tool("cube", (Component(Cube(), np.eye(4), RED, RED),))
    with pytest.raises(NotImplementedError, match="no Drake geometry for Cube"):
        build_rig_diagram(tool)
