"""Tools of any form, from two pictures, one, or as ellipsoids."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.workshop import MATERIALS

from affordance.exceptions import NothingSeenError, OutOfViewError
from affordance.objects.inertia import Ellipsoid, build_inertia_map
from affordance.objects.primitives import Box
from affordance.objects.striking_face import StrikingFace
from affordance.objects.tool import Component, Grip, Tool
from affordance.vision.pixels.camera_sensor import TURNING_RIG, CameraSensor, find_presented_pose, needs_turning
from affordance.vision.pixels.looks import find_looks
from affordance.vision.pixels.seen_tool import (
    ERRORS,
    Method,
    detect_tool,
    find_equal_ellipsoid,
    observe_tool,
    place_at,
)
from affordance.vision.pixels.surface import find_silhouette, measure_surface

STAND = CameraSensor(TURNING_RIG)


def make_tool(*parts):
    """A tool of boxes: lengths, position and material of each."""
    components = []
    for lengths, position, name in parts:
        components.append(Component(Box(lengths), place_at(np.array(position)), MATERIALS[name], MATERIALS[name]))
    return Tool("made up", tuple(components))


def weigh(features):
    """Ten parameters by the true densities of the nearest colours."""
    densities = []
    for part in features:
        gaps = {m.density: np.abs(np.subtract(m.colour, part.colour)).sum() for m in MATERIALS.values()}
        densities.append(min(gaps, key=gaps.get))
    shapes, poses = [part.shape for part in features], [part.X_TE for part in features]
    return build_inertia_map(shapes, poses, range(len(features)), len(features)) @ densities


# A handle beside a head: nothing is hidden.
FACE = StrikingFace("face", np.array([0.0, 0.04, 0.0]), np.array([0.0, 1.0, 0.0]))
HANDLE, HEAD = make_tool(
    ((0.2, 0.024, 0.02), (0.03, 0, 0), "oak"), ((0.03, 0.08, 0.03), (0.145, 0.01, 0), "brass")
).components
TOOL = Tool("mallet", (HANDLE, HEAD.with_strike(FACE)))
FACE_DOWN = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])


def test_views_find_volume_place_and_materials_of_each_part(rng):
    features = observe_tool(TOOL, STAND, rng)
    assert len(features) == 2
    seen, true = weigh(features), TOOL.parameters
    # Walls are drawn half a pixel thicker on every side.
    assert abs(np.log(seen[0] / true[0])) < ERRORS[Method.SIX_VIEWS].log_volume_sd
    np.testing.assert_allclose(seen[1:4] / seen[0], true[1:4] / true[0], atol=2e-3)
    np.testing.assert_allclose(seen[4:7], true[4:7], rtol=0.2)
    # The face that strikes, which the eye is told, is that of the head.
    (head,) = [part for part in features if part.strikes]
    assert head.X_TE[0, 3] > 0.1
    p_TQ, normal_T = head.strikes[0].express(head.X_TE)
    np.testing.assert_allclose(p_TQ, [0.145, 0.05, 0], atol=1e-9)
    np.testing.assert_allclose(normal_T, [0, 1, 0], atol=1e-9)


def test_one_view_is_worse_and_ellipsoids_are_worst_and_say_so(rng):
    photographs = STAND.take_pictures(TOOL, rng)
    errors = []
    for method in Method:
        used = photographs if method in (Method.SIX_VIEWS, Method.TWO_VIEWS) else photographs[:1]
        features = detect_tool(used, STAND.rig, STAND.noise).compute_features(method, np.eye(4))
        errors.append(abs(np.log(weigh(features)[0] * np.exp(ERRORS[method].bias) / TOOL.parameters[0])))
    assert errors == sorted(errors)
    sds = [ERRORS[method].log_volume_sd for method in Method]
    assert sds == sorted(sds)


def test_deformations_are_the_error_that_is_stated(rng):
    """To first order: volume changes by its standard deviation, the centroid stays; then it moves."""
    (part, *_) = observe_tool(TOOL, STAND, rng)
    error = ERRORS[Method.SIX_VIEWS]
    X = part.X_TE
    thicker = part.deformations[0]
    assert np.trace(thicker[:3, :3]) == pytest.approx(error.log_volume_sd)
    np.testing.assert_allclose(thicker[:3, :3] @ X[:3, 3] + thicker[:3, 3], 0, atol=1e-12)
    for moved in part.deformations[1:]:
        assert np.abs(moved[:3, :3]).max() < 1e-12
        assert 0 < np.linalg.norm(moved[:3, 3]) < 0.02


def test_slim_objects_and_small_parts_are_seen(rng):
    """A ruler of a millimetre, and a rivet of 5 mm that is no region of its own."""
    ruler = make_tool(((0.3, 0.03, 0.001), (0, 0, 0), "aluminium"))
    (part,) = observe_tool(ruler, STAND, rng)
    assert part.shape.sizes[0] == pytest.approx(0.3, abs=5e-3)
    riveted = make_tool(((0.2, 0.03, 0.02), (0, 0, 0), "oak"), ((0.005, 0.005, 0.022), (0, 0, 0), "brass"))
    assert 1 <= len(observe_tool(riveted, STAND, rng)) <= 2


def test_greys_are_parted_by_lightness(rng):
    tool = make_tool(((0.1, 0.04, 0.03), (0, 0, 0), "rubber"), ((0.1, 0.04, 0.03), (0.1, 0, 0), "aluminium"))
    photographs = STAND.take_pictures(tool, rng)
    surfaces = [
        measure_surface(picture, find_silhouette(picture, STAND.rig.height, STAND.noise), STAND.rig.camera)
        for picture, *_ in photographs
    ]
    assert len(find_looks(surfaces).looks) == 2


def test_what_cannot_be_seen_is_said(rng):
    picture = STAND.take_pictures(TOOL, rng)[0].picture
    empty = replace_all(picture)
    with pytest.raises(NothingSeenError, match="nothing differs from the stand"):
        find_silhouette(empty, STAND.rig.height, STAND.noise)
    long = make_tool(((0.9, 0.04, 0.03), (0, 0, 0), "oak"))
    with pytest.raises(OutOfViewError, match="pixels of the picture's edge, must cover none"):
        observe_tool(long, STAND, rng)


def replace_all(picture):
    """The picture with the stand everywhere."""
    colour, depth = picture.colour.copy(), picture.depth.copy()
    colour[:, :], depth[:, :] = colour[20, 20], depth[20, 20]
    colour[::7, ::5] += 1
    return picture._replace(colour=colour, depth=depth)


def test_equal_ellipsoid_has_the_same_second_moments(rng):
    (part, *_) = observe_tool(TOOL, STAND, rng)
    ellipsoid, X_PE = find_equal_ellipsoid(part.shape, np.zeros(3))
    J, K = part.shape.unit_pseudo_inertia(), X_PE @ ellipsoid.unit_pseudo_inertia() @ X_PE.T
    np.testing.assert_allclose(K[:3, :3] / K[3, 3], J[:3, :3] / J[3, 3], rtol=1e-6, atol=1e-9)
    assert np.linalg.det(X_PE[:3, :3]) == pytest.approx(1.0)


def test_only_what_is_no_ellipsoid_is_turned_over():
    assert needs_turning(TOOL)
    egg = replace(TOOL.components[0], shape=Ellipsoid((0.1, 0.05, 0.05)))
    assert not needs_turning(Tool("egg", (egg,)))


def test_a_hollow_that_is_open_to_one_end_is_seen_from_there_only(rng):
    """A cup of five walls, 4 mm thick: from both sides it is a block of four times the volume."""
    walls = [((0.1, 0.06, 0.004), (0, 0, z)) for z in (-0.026, 0.026)]
    walls += [((0.1, 0.004, 0.048), (0, y, 0)) for y in (-0.028, 0.028)]
    walls += [((0.004, 0.052, 0.048), (-0.048, 0, 0))]
    cup = make_tool(*((*wall, "brass") for wall in walls))
    true = sum(part.shape.volume for part in cup.components)
    volumes = {
        method: sum(part.shape.volume for part in observe_tool(cup, STAND, rng, method))
        for method in (Method.SIX_VIEWS, Method.TWO_VIEWS)
    }
    assert volumes[Method.TWO_VIEWS] > 3.0 * true
    assert abs(np.log(volumes[Method.SIX_VIEWS] / true)) < 1.645 * ERRORS[Method.SIX_VIEWS].log_volume_sd


def test_objects_lie_flat_whatever_the_first_grip():
    """The handle of a hammer is gripped with its face down, and it lies on its side all the same."""
    turned = replace(TOOL, grips=(Grip("handle", FACE_DOWN),))
    np.testing.assert_allclose(np.abs(find_presented_pose(turned)[:3, 2]), [0, 0, 1], atol=1e-12)
    np.testing.assert_allclose(find_presented_pose(TOOL), np.eye(4))
