"""Photographs: every object is where a pinhole camera would see it, in its own hue."""

import colorsys

import numpy as np
import pytest

from affordance.choice.hammer import load_hammer
from affordance.files.model_folder import MODELS
from affordance.objects.load import load_tools
from affordance.plant.arm import ARM
from affordance.plant.load import load_arm
from affordance.plant.nail import NailPlacement
from affordance.reporting import renderings as photographs
from affordance.reporting.renderings import Pose, render_close_ups, render_poses

WIDTH, HEIGHT = 160, 80
DOWN = np.array([0.0, 0.0, -1.0])
BEECH, ICE = "#c98f5a", "#b2d6ed"


@pytest.fixture(scope="module")
def poses():
    """A stick held out by its wood, above a nail that has not moved, and with its tip on it after some way."""
    stick = load_tools(MODELS / "tools" / "novel.yaml")[0]
    held = stick.gripped_by(stick.grips[0])
    nail = load_hammer(MODELS / "nail.yaml").nail
    home = load_arm().home
    low = NailPlacement(nail, np.array([0.85, 0.0, 1.30]), DOWN)
    near = NailPlacement(nail, np.array([0.85, 0.0, 1.425]), DOWN)
    return [Pose(held, low, home), Pose(held, near, home, travel=0.01)]


@pytest.fixture(scope="module")
def whole(poses):
    return render_poses(ARM, poses, width=WIDTH, height=HEIGHT)


def find_hue(colour):
    """Function that marks pixels, (..., 3), whose hue and saturation are about those of a colour."""
    wanted = colorsys.rgb_to_hsv(*(int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)))

    def matches(pixel):
        hue, saturation, _ = colorsys.rgb_to_hsv(*(pixel / 255))
        return abs(hue - wanted[0]) < 0.03 and abs(saturation - wanted[1]) < 0.15

    return lambda picture: np.apply_along_axis(matches, -1, picture)


def test_pictures_show_arm_tool_and_block_on_white_with_nothing_cut_off(whole):
    for picture in whole:
        assert picture.shape == (HEIGHT, WIDTH, 3)
        assert picture.dtype == np.uint8
        edge = np.concatenate([picture[0], picture[-1], picture[:, 0], picture[:, -1]])
        assert (edge == 255).all()
        # The arm fills most of the width; from shoulder to tip come bright ice, wood, and dark steel.
        arm = picture[: HEIGHT // 2]
        columns = np.flatnonzero((arm < 255).any(axis=(0, 2)))
        assert np.ptp(columns) > 0.8 * WIDTH
        wood = np.nonzero(find_hue(BEECH)(arm))[1]
        assert wood.max() < columns[-1] - 15
        assert (find_hue(ICE)(arm) & (arm[..., 2] > 220)).nonzero()[1].max() < wood.min()
        steel = arm[:, wood.max() + 3 : columns[-1] - 2]
        assert steel.min(axis=0).max() < 170
        assert np.ptp(steel.astype(int), axis=2).max() < 50  # grey
        # The block stands below the middle, and the thin nail on it above.
        assert (picture[HEIGHT // 2 :] < 255).any()


def test_one_camera_takes_all_poses(whole):
    """Pixels of the arm, which has not moved, are the same in all poses, and others change."""
    ice = find_hue(ICE)
    left = np.s_[: HEIGHT // 2, : WIDTH // 2]
    np.testing.assert_array_equal(ice(whole[0])[left], ice(whole[1])[left])
    assert (whole[0] != whole[1]).any()


def test_nail_is_seen_in_the_middle_of_a_close_up_and_shortens_as_it_goes_in(poses):
    untouched, driven = render_close_ups(
        ARM, [poses[1]._replace(travel=0.0), poses[1]._replace(travel=0.02)], width=HEIGHT, height=HEIGHT
    )
    # Looked at straight from the side, one pixel is this long; a little more for the camera looks from above.
    pixel = (photographs._ABOVE + photographs._BELOW) / (1.0 - photographs._MARGIN) / HEIGHT
    # Highlights, which move with what they are on, change less.
    changes = (np.abs(untouched.astype(int) - driven) > 60).any(axis=2)
    rows, columns = (np.flatnonzero(changes.any(axis=axis)) for axis in (1, 0))
    head = HEIGHT * (0.5 + (0.5 - photographs._BELOW / (photographs._ABOVE + photographs._BELOW)))
    # The head was at its place, and what changed reaches from there down to where it is now.
    assert rows[0] == pytest.approx(head, abs=3.0)
    assert np.ptp(rows) * pixel == pytest.approx(0.02 + 2 * poses[1].placement.nail.head_radius, abs=3 * pixel)
    assert abs(columns.mean() - 0.5 * HEIGHT) < 2.0
    # The shank is grey, before white.
    shank = untouched[int(head + 0.02 / pixel), HEIGHT // 2]
    assert shank.max() < 180
    assert np.ptp(shank.astype(int)) < 40


def test_arm_alone_can_be_taken(poses):
    (picture,) = render_poses(ARM, [poses[0]._replace(placement=None)], width=WIDTH, height=HEIGHT)
    assert find_hue(BEECH)(picture).any()


def test_no_close_up_without_a_nail(poses):
    with pytest.raises(ValueError, match="a close-up needs a nail, but the pose with stick has none"):
        render_close_ups(ARM, [poses[0]._replace(placement=None)], width=WIDTH, height=HEIGHT)
