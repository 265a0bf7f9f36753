import numpy as np
import pytest
from helpers.synthetic_pictures import CAMERA, EMPTY, NOISY, PERFECT, STAND, draw_picture, make_ellipsoid

from affordance.exceptions import (
    NoDepthError,
    NothingSeenError,
    OneColourError,
    OutOfViewError,
    SeeingError,
    TooSmallError,
    UnusablePictureError,
)
from affordance.vision.pixels.rgbd import Picture
from affordance.vision.pixels.segmentation import segment

BEECH, STEEL, BRASS = (0.79, 0.56, 0.35), (0.49, 0.54, 0.6), (0.83, 0.63, 0.09)
LEFT, RIGHT = (
    make_ellipsoid([0.05, 0.02, 0.02], [-0.05, 0, STAND - 0.02]),
    make_ellipsoid([0.05, 0.02, 0.02], [0.05, 0, STAND - 0.02]),
)


def add_noise(picture, seed=0):
    return NOISY.add_to(picture, CAMERA, np.random.default_rng(seed))


@pytest.mark.parametrize("colours", [(BEECH, STEEL), (STEEL, BRASS), (BRASS, BEECH), (BEECH, BEECH), (STEEL, STEEL)])
def test_parts_are_told_apart_by_colour_or_by_their_waist(colours):
    picture = draw_picture([LEFT, RIGHT], colours)
    segmentation = segment(add_noise(picture), STAND, NOISY)
    assert segmentation.num_parts == 2
    columns = [np.nonzero(segmentation.labels == number)[1] for number in (0, 1)]
    assert {tuple(np.sign([values.mean() - 319.5])) for values in columns} == {(-1.0,), (1.0,)}
    truth = picture.depth < STAND
    assert ((segmentation.labels >= 0) != truth).sum() < 0.15 * truth.sum()


@pytest.mark.parametrize("colour", [BEECH, STEEL, BRASS, (0.15, 0.1, 0.2), (0.95, 0.95, 0.95), (0.2, 0.2, 0.2)])
def test_one_part_is_one_part_whatever_its_colour_and_shade(colour):
    for semi_axes in ([0.1, 0.08, 0.1], [0.12, 0.016, 0.016]):
        picture = draw_picture([make_ellipsoid(semi_axes, [0.02, 0.03, STAND - semi_axes[2]])], [colour])
        assert segment(add_noise(picture), STAND, NOISY).num_parts == 1


def test_touching_ellipsoids_of_one_colour_and_unequal_size_are_two():
    handle = make_ellipsoid([0.09, 0.016, 0.016], [-0.09, 0, STAND - 0.03])
    head = make_ellipsoid([0.03, 0.05, 0.03], [0.03, 0, STAND - 0.03])
    segmentation = segment(add_noise(draw_picture([handle, head], [BEECH, BEECH])), STAND, NOISY)
    assert segmentation.num_parts == 2


def refuse(error, message, picture):
    with pytest.raises(error, match=message) as caught:
        segment(picture, STAND, NOISY)
    assert isinstance(caught.value, SeeingError)
    assert caught.value.colour is picture.colour  # for inspection
    assert caught.value.depth is picture.depth


def test_empty_stand_is_said_to_be_empty():
    refuse(NothingSeenError, "nothing is nearer than the stand, 0.9 m from the camera", add_noise(EMPTY))


def test_picture_of_one_colour_is_refused():
    refuse(OneColourError, r"all pixels have the colour \(51, 51, 51\)", EMPTY)


def test_depth_that_is_no_number_is_refused():
    picture = add_noise(draw_picture([LEFT], [BEECH]))
    picture.depth[100, 100] = np.nan
    picture.depth[3, 4] = np.inf
    refuse(NoDepthError, "2 of 307200 depth readings are not finite, all must be", picture)


def test_picture_without_depth_is_refused():
    picture = add_noise(draw_picture([LEFT], [BEECH]))
    picture.depth[:] = 0.0
    refuse(NoDepthError, "0 % of the picture has depth, must be at least 50 %", picture)


@pytest.mark.parametrize("shape", [(1, 1), (0, 0), (10, 10)])
def test_picture_of_a_few_pixels_is_refused(shape):
    picture = Picture(np.zeros((*shape, 3), dtype=np.uint8), np.ones(shape))
    refuse(UnusablePictureError, rf"the picture has {shape[1]}x{shape[0]} pixels, must have at least 110", picture)


def test_colour_and_depth_must_fit_together():
    for picture in (
        Picture(EMPTY.colour, EMPTY.depth[:-1]),
        Picture(EMPTY.colour[:, :, :2], EMPTY.depth),
        Picture(EMPTY.colour / 255.0, EMPTY.depth),  # type: ignore[arg-type]
    ):
        refuse(UnusablePictureError, r"must be \(height, width, 3\) of uint8 and \(height, width\)", picture)


def test_object_at_the_edge_is_out_of_view():
    picture = add_noise(draw_picture([make_ellipsoid([0.05, 0.02, 0.02], [-0.47, 0, STAND - 0.02])], [BEECH]))
    refuse(OutOfViewError, r"the object covers \d+ pixels of the picture's edge, must cover none", picture)


def test_object_that_is_too_small_is_said_to_be():
    picture = add_noise(draw_picture([make_ellipsoid([0.008] * 3, [0, 0, STAND - 0.02])], [BEECH]))
    refuse(TooSmallError, r"covers \d+ pixels, must cover at least 110", picture)


@pytest.mark.parametrize("length", [None, 0.02, 0.1])
@pytest.mark.parametrize("width", [0.002, 0.004, 0.005, 0.007, 0.008, 0.0092, 0.0096, 0.01, 0.011, 0.0115, 0.012])
def test_whatever_the_width_there_is_a_part_or_an_error_with_a_name(length, width):
    """Balls and rods of any width are seen, or refused by an error with a name if below 12 mm."""
    ellipsoid = make_ellipsoid([length or width, width, width], [0.02, 0.01, STAND - width - 0.005])
    picture = add_noise(draw_picture([ellipsoid], [BEECH]))
    try:
        seen = segment(picture, STAND, NOISY).num_parts
    except (TooSmallError, NothingSeenError):
        seen = None
    assert seen != 0
    assert seen is not None or width < 0.012


def test_object_into_all_of_which_the_stand_is_mixed_is_too_small():
    picture = add_noise(draw_picture([make_ellipsoid([0.0105] * 3, [0, 0, STAND - 0.02])], [BEECH]))
    refuse(TooSmallError, "no 27 pixels of one tint lie together .* apart from its rim of 3 pixels", picture)


def test_perfect_picture_is_segmented_exactly():
    picture = draw_picture([LEFT, RIGHT], [BEECH, STEEL])
    segmentation = segment(picture, STAND, PERFECT)
    truth = picture.depth < STAND - 1e-3
    assert ((segmentation.labels >= 0) != truth).sum() <= 4  # corners that the median rounds off
