"""Pictures of objects, against the projection of many points on their surfaces."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.patches import Circle, Ellipse, Polygon
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from affordance.files.model_folder import MODELS
from affordance.objects.inertia import Ellipsoid
from affordance.objects.load import load_tools
from affordance.objects.materials import Material
from affordance.objects.primitives import Box, Capsule, Cylinder
from affordance.objects.tool import Component, Grip, Tool
from affordance.reporting.object_drawings import Drawing, draw_objects

WOOD = Material("wood", (0.8, 0.5, 0.3), 700.0, 50.0, "made up")
STEEL = Material("steel", (0.5, 0.5, 0.6), 7800.0, 80.0, "made up")
# A net of one degree over the sphere: no direction is farther from a knot than half a degree in both angles, 12 mrad,
# and the knot's point on an ellipsoid then reaches less far along that direction by 1 - cos(12 mrad) at most.
_latitude, _longitude = np.radians(np.mgrid[-90:91, 0:360]).reshape(2, -1)
KNOTS = np.column_stack(
    [np.cos(_latitude) * np.cos(_longitude), np.cos(_latitude) * np.sin(_longitude), np.sin(_latitude)]
)
RESOLUTION = 1e-4


def place(semi_axes, position, rpy_deg=(0.0, 0.0, 0.0), looks_like=STEEL):
    X_TE = np.eye(4)
    X_TE[:3, :3] = Rotation.from_euler("xyz", rpy_deg, degrees=True).as_matrix()
    X_TE[:3, 3] = position
    return Component(Ellipsoid(semi_axes), X_TE, WOOD, looks_like)


def project(part):
    """Points on a component's surface as seen along Tz, (N, 2), [cm]."""
    points = part.X_TE[:3, 3] + (KNOTS * part.shape.sizes) @ part.X_TE[:3, :3].T
    return 100.0 * points[:, :2]


@pytest.mark.parametrize(
    "rpy_deg", [(0, 0, 0), (0, 0, 90), (0, 0, 30), (0, 0, -30), (0, 70, 0), (50, 0, 20), (-40, 65, 110)]
)
def test_ellipse_is_the_outline_of_the_rotated_ellipsoid(rpy_deg):
    """Points of the surface lie within the ellipse, and some of them at its edge in each of 24 directions."""
    part = place((0.12, 0.02, 0.05), (0.1, -0.03, 0.07), rpy_deg)
    (axes,) = draw_objects([Drawing(Tool("one", (part,)), "one")]).axes
    (ellipse,) = (patch for patch in axes.patches if type(patch) is Ellipse)
    points = project(part) - np.array(ellipse.center)
    angle = np.radians(ellipse.angle)
    along = points @ [np.cos(angle), np.sin(angle)] / (0.5 * ellipse.width)
    across = points @ [-np.sin(angle), np.cos(angle)] / (0.5 * ellipse.height)
    assert np.hypot(along, across).max() <= 1.0 + 1e-12
    for turn in np.linspace(0.0, 2.0 * np.pi, 24):
        assert (along * np.cos(turn) + across * np.sin(turn)).max() == pytest.approx(1.0, abs=RESOLUTION)


@pytest.mark.parametrize("turn_deg", [0.0, 90.0])
def test_limits_contain_all_of_a_tool_with_a_tilted_head_and_a_grip_in_the_middle(turn_deg):
    """Limits contain every point of the tool, with a margin between 0 and 3 cm on each side."""
    handle = place((0.15, 0.015, 0.015), (0.15, 0.0, 0.0))
    head = place((0.09, 0.07, 0.03), (0.31, 0.03, 0.01), (20.0, -30.0, 50.0))
    knob = place((0.06, 0.01, 0.02), (-0.02, -0.02, 0.0), (0.0, 0.0, 40.0))
    middle = Grip("middle", place((1.0, 1.0, 1.0), (0.16, 0.0, 0.0), (0.0, 0.0, turn_deg)).X_TE)
    tool = Tool("mallet", (handle, head, knob), (middle,)).gripped_by(middle)
    (axes,) = draw_objects([Drawing(tool, "mallet")]).axes
    points = np.concatenate([project(part) for part in tool.components])
    low, high = np.transpose([axes.get_xlim(), axes.get_ylim()])
    for room in (points.min(axis=0) - low, high - points.max(axis=0)):
        assert (room > 0.0).all()
        assert (room < 3.0).all()


def test_objects_side_by_side_share_limits_that_contain_them_all():
    tools = [Tool("one", (place((0.05, 0.02, 0.02), (x, y, 0.0)),)) for x, y in ((0.3, -0.1), (0.1, 0.2))]
    first, second = draw_objects([Drawing(tool, tool.name) for tool in tools], columns=2).axes
    assert (first.get_xlim(), first.get_ylim()) == (second.get_xlim(), second.get_ylim())
    assert first.get_xlim()[1] > 35.0
    assert first.get_ylim()[0] < -12.0
    assert first.get_ylim()[1] > 22.0


def test_limits_contain_the_hand_of_a_tool_smaller_than_it():
    bead = place((0.005, 0.005, 0.005), (0.005, 0.0, 0.0))
    (axes,) = draw_objects([Drawing(Tool("bead", (bead,)), "bead")]).axes
    (hand,) = (patch for patch in axes.patches if isinstance(patch, Circle))
    (x, y), radius = hand.center, hand.radius
    assert x + radius == pytest.approx(0.0)  # it ends where the tool begins
    assert axes.get_xlim()[0] < x - radius
    assert axes.get_ylim()[0] < y - radius
    assert axes.get_ylim()[1] > y + radius


def test_object_is_drawn_as_it_looks_or_as_it_is_made():
    tool = Tool("decoy", (place((0.05, 0.02, 0.02), (0.05, 0.0, 0.0)),))
    looks, made = draw_objects([Drawing(tool, "looks"), Drawing(tool, "made", as_made=True)]).axes
    assert looks.patches[0].get_facecolor()[:3] == STEEL.colour
    assert made.patches[0].get_facecolor()[:3] == WOOD.colour


def test_a_decoy_shows_where_its_centre_of_mass_is_and_where_it_seems_to_be():
    """Two equal parts of wood and steel, exchanged: the centres mirror each other in the middle of the two."""
    sizes = (0.05, 0.02, 0.02)
    near, far = place(sizes, (0.05, 0.0, 0.0)), place(sizes, (0.15, 0.0, 0.0))  # wood that looks like steel
    decoy = Tool("decoy", (near, replace(far, material=STEEL, looks_like=WOOD)))
    honest = Tool("honest", (replace(near, material=STEEL), replace(far, looks_like=WOOD)))
    first, second = draw_objects([Drawing(honest, "honest"), Drawing(decoy, "decoy")]).axes
    true = {(*line.get_xdata(), *line.get_ydata()) for line in second.get_lines() if line.get_marker() == "x"}
    seeming = {(*line.get_xdata(), *line.get_ydata()) for line in second.get_lines() if line.get_marker() == "o"}
    x = (5.0 * 700.0 + 15.0 * 7800.0) / 8500.0
    assert any(np.allclose(each, (x, 0.0)) for each in true if each)
    assert any(np.allclose(each, (20.0 - x, 0.0)) for each in seeming if each)
    assert not any(line.get_marker() == "o" for line in first.get_lines())


def draw_part(shape, X_TE):
    part = Component(shape, X_TE, WOOD, STEEL)
    (axes,) = draw_objects([Drawing(Tool("one", (part,)), "one")]).axes
    return axes


def list_meshes():
    return [
        (tool.name, part)
        for file in ("tools", "uncommon")
        for tool in load_tools(MODELS / "workshop" / f"{file}.yaml")
        for part in tool.components
    ]


@pytest.mark.parametrize(("name", "part"), list_meshes())
def test_mesh_is_drawn_as_its_triangles_within_the_limits(name, part):
    axes = draw_part(part.shape, part.X_TE)
    fill, outline = axes.collections
    corners = 100.0 * (part.shape.vertices @ part.X_TE[:3, :3].T + part.X_TE[:3, 3])[:, :2]
    drawn = np.concatenate([path.vertices for path in fill.get_paths()])
    np.testing.assert_allclose(drawn.min(axis=0), corners[np.unique(part.shape.faces)].min(axis=0))
    np.testing.assert_allclose(drawn.max(axis=0), corners[np.unique(part.shape.faces)].max(axis=0))
    low, high = np.transpose([axes.get_xlim(), axes.get_ylim()])
    assert (drawn > low).all()
    assert (drawn < high).all()
    edges = np.concatenate([path.vertices for path in outline.get_paths()])
    np.testing.assert_allclose(edges.max(axis=0), drawn.max(axis=0))
    assert [type(patch) for patch in axes.patches] == [Circle]  # the hand


def test_dent_of_a_mesh_is_not_filled():
    """A drawn claw hammer's head fills less than 90 % of its convex hull, which covers the gap below the claw."""
    head = next(part for name, part in list_meshes() if name == "claw hammer" and part.material.name == "cast_steel")
    (fill, _) = draw_part(head.shape, head.X_TE).collections
    triangles = np.array([path.vertices[:3] for path in fill.get_paths()])
    points = triangles.reshape(-1, 2)
    hull = ConvexHull(points)
    net = points.min(axis=0) + np.random.default_rng(0).random((1000, 2)) * np.ptp(points, axis=0)
    in_hull = (hull.equations[:, :2] @ net.T + hull.equations[:, 2:] <= 0.0).all(axis=0)
    in_drawing = np.array([any(path.contains_point(point) for path in fill.get_paths()) for point in net[in_hull]])
    assert in_drawing.mean() < 0.9


@pytest.mark.parametrize(
    ("shape", "area"),
    [
        (Box((0.2, 0.1, 0.04)), 200.0),
        (Cylinder(0.03, 0.2), np.pi * 9.0),
        (Capsule(0.03, 0.2), np.pi * 9.0),
    ],
)
def test_outline_of_a_solid_has_its_area(shape, area):
    (outline,) = (patch for patch in draw_part(shape, np.eye(4)).patches if isinstance(patch, Polygon))
    assert ConvexHull(outline.get_xy()).volume == pytest.approx(area, rel=2e-3)


def test_outline_of_a_turned_box_is_its_turned_rectangle():
    X_TE = place((1.0, 1.0, 1.0), (0.1, 0.0, 0.0), (0.0, 0.0, 30.0)).X_TE
    (outline,) = (patch for patch in draw_part(Box((0.2, 0.1, 0.04)), X_TE).patches if isinstance(patch, Polygon))
    corners = np.array([[x, y, z] for x in (-0.1, 0.1) for y in (-0.05, 0.05) for z in (-0.02, 0.02)])
    expected = 100.0 * (corners @ X_TE[:3, :3].T + X_TE[:3, 3])[:, :2]
    np.testing.assert_allclose(outline.get_xy().max(axis=0), expected.max(axis=0), rtol=1e-6)
    assert ConvexHull(outline.get_xy()).volume == pytest.approx(200.0, rel=1e-6)
