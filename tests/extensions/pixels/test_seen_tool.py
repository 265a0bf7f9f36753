"""Tools of any form, from pictures."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.mallet import STAND, TOOL, make_tool, weigh

from affordance.exceptions import NothingSeenError, OutOfViewError
from affordance.extensions.pixels.camera_sensor import find_presented_pose, needs_turning
from affordance.extensions.pixels.looks import find_looks
from affordance.extensions.pixels.seen_tool import ERROR, detect_tool, observe_tool
from affordance.extensions.pixels.surface import find_silhouette, measure_surface
from affordance.objects.inertia import Ellipsoid
from affordance.objects.tool import Grip, Tool

FACE_DOWN = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])


@pytest.fixture(scope="module")
def features():
    """The mallet as it is seen."""
    return observe_tool(TOOL, STAND, np.random.default_rng(20261120))


def test_views_find_volume_place_and_materials_of_each_part(features):
    assert len(features) == 2
    seen, true = weigh(features), TOOL.parameters
    # Walls are drawn half a pixel thicker on every side.
    assert abs(np.log(seen[0] / true[0])) < ERROR.log_volume_sd
    np.testing.assert_allclose(seen[1:4] / seen[0], true[1:4] / true[0], atol=2e-3)
    np.testing.assert_allclose(seen[4:7], true[4:7], rtol=0.2)
    # The striking face, which is handed to the eye, is that of the head.
    (head,) = [part for part in features if part.strikes]
    assert head.X_TE[0, 3] > 0.1
    p_TQ, normal_T = head.strikes[0].express(head.X_TE)
    np.testing.assert_allclose(p_TQ, [0.145, 0.05, 0], atol=1e-9)
    np.testing.assert_allclose(normal_T, [0, 1, 0], atol=1e-9)


def test_deformations_are_the_error_that_is_stated(features):
    """The first deformation changes the volume by its SD with a fixed centroid; others move it by less than 2 cm."""
    (part, *_) = features
    X = part.X_TE
    thicker = part.deformations[0]
    assert np.trace(thicker[:3, :3]) == pytest.approx(ERROR.log_volume_sd)
    np.testing.assert_allclose(thicker[:3, :3] @ X[:3, 3] + thicker[:3, 3], 0, atol=1e-12)
    for moved in part.deformations[1:]:
        assert np.abs(moved[:3, :3]).max() < 1e-12
        assert 0 < np.linalg.norm(moved[:3, 3]) < 0.02


def test_slim_objects_and_small_parts_are_seen(rng):
    """A ruler 1 mm thick is seen to 5 mm of its length, and a rivet of 5 mm causes no error."""
    ruler = make_tool(((0.3, 0.03, 0.001), (0, 0, 0), "aluminium"))
    (part,) = observe_tool(ruler, STAND, rng)
    assert part.shape.sizes[0] == pytest.approx(0.3, abs=5e-3)
    riveted = make_tool(((0.2, 0.03, 0.02), (0, 0, 0), "oak"), ((0.005, 0.005, 0.022), (0, 0, 0), "brass"))
    seen = detect_tool(STAND.take_pictures(riveted, rng), STAND.rig, STAND.noise)
    assert 1 <= len(seen.compute_features(np.eye(4))) <= 2


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
    # The stand at every pixel, some of which differ by one step of colour.
    picture.colour[:, :], picture.depth[:, :] = picture.colour[20, 20], picture.depth[20, 20]
    picture.colour[::7, ::5] += 1
    with pytest.raises(NothingSeenError, match="nothing differs from the stand"):
        find_silhouette(picture, STAND.rig.height, STAND.noise)
    long = make_tool(((0.9, 0.04, 0.03), (0, 0, 0), "oak"))
    with pytest.raises(OutOfViewError, match="pixels of the picture's edge, must cover none"):
        detect_tool(STAND.take_pictures(long, rng), STAND.rig, STAND.noise)


def test_only_what_is_no_ellipsoid_is_turned_over():
    assert needs_turning(TOOL)
    egg = replace(TOOL.components[0], shape=Ellipsoid((0.1, 0.05, 0.05)))
    assert not needs_turning(Tool("egg", (egg,)))


def test_a_hollow_that_is_open_to_one_end_is_seen_from_there_only(rng):
    """A cup of walls of 4 mm is a block of over three times the volume unless it is seen from its open end."""
    walls = [((0.1, 0.06, 0.004), (0, 0, z)) for z in (-0.026, 0.026)]
    walls += [((0.1, 0.004, 0.048), (0, y, 0)) for y in (-0.028, 0.028)]
    walls += [((0.004, 0.052, 0.048), (-0.048, 0, 0))]
    cup = make_tool(*((*wall, "brass") for wall in walls))
    true = sum(part.shape.volume for part in cup.components)
    block = detect_tool(STAND.take_pictures(cup, rng), STAND.rig, STAND.noise).compute_features(np.eye(4))
    assert sum(part.shape.volume for part in block) > 3.0 * true
    volume = sum(part.shape.volume for part in observe_tool(cup, STAND, rng))
    assert abs(np.log(volume / true)) < 1.645 * ERROR.log_volume_sd


def test_objects_lie_flat_whatever_the_first_grip():
    """The hammer lies on its side although the first grip of its handle has the face down."""
    turned = replace(TOOL, grips=(Grip("handle", FACE_DOWN),))
    np.testing.assert_allclose(np.abs(find_presented_pose(turned)[:3, 2]), [0, 0, 1], atol=1e-12)
    np.testing.assert_allclose(find_presented_pose(TOOL), np.eye(4))
