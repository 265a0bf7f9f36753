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
from affordance.extensions.pixels.rgbd import Picture
from affordance.extensions.pixels.segmentation import segment

BEECH, STEEL, BRASS = (0.79, 0.56, 0.35), (0.49, 0.54, 0.6), (0.83, 0.63, 0.09)
LEFT, RIGHT = (make_ellipsoid([0.05, 0.02, 0.02], [x, 0, STAND - 0.02]) for x in (-0.05, 0.05))


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


ROWS, COLUMNS = np.indices((480, 640))


def fill(x, a, b=None):
    """The pixels of an ellipse of these semi-axes around a column of the middle row."""
    return ((COLUMNS - x) / a) ** 2 + ((ROWS - 240) / (b or a)) ** 2 < 1.0


def fill_bar(end, half_width):
    """The pixels of a bar along the middle row, from column 200."""
    return (np.abs(ROWS - 240) <= half_width) & (COLUMNS >= 200) & (end >= COLUMNS)


def segment_flat(*shapes):
    """Segments a flat thing of one colour, 5 cm above the stand, as a perfect camera sees it."""
    seen = np.any(shapes, axis=0)
    colour = np.where(seen[..., None], np.array([200, 140, 90]), 51).astype(np.uint8)
    return segment(Picture(colour, np.where(seen, STAND - 0.05, STAND)), STAND, PERFECT)


@pytest.mark.parametrize("radius", [20, 40])
@pytest.mark.parametrize(("ratio", "num_parts"), [(0.2, 2), (0.58, 2), (0.72, 1), (0.9, 1)])
def test_bar_between_two_discs_is_a_waist_if_it_is_narrower_than_seven_tenths_of_both(radius, ratio, num_parts):
    """The ratio is that of the bar's width to the smaller disc's; that the other is larger makes no difference."""
    for larger in (radius, 2 * radius):
        one, other = fill(200, larger), fill(220 + 4 * radius, radius)
        assert segment_flat(one, other, fill_bar(220 + 4 * radius, ratio * radius)).num_parts == num_parts


@pytest.mark.parametrize(("ratio", "num_parts"), [(0.65, 2), (0.75, 1)])
def test_waist_is_told_to_a_few_hundredths(ratio, num_parts):
    """Of discs of 40 pixels, of which 27.3 and 31.4 pixels are among the distances from the rim that are tried."""
    assert segment_flat(fill(200, 40), fill(360, 40), fill_bar(360, ratio * 40)).num_parts == num_parts


def test_three_discs_in_a_row_are_three_parts():
    discs = [fill(x, 30) for x in (200, 258, 316)]
    segmentation = segment_flat(*discs)
    assert segmentation.num_parts == 3
    assert len({segmentation.labels[240, x] for x in (200, 258, 316)}) == 3


def draw_one(*ellipsoid):
    return add_noise(draw_picture([make_ellipsoid(*ellipsoid)], [BEECH]))


def spoil(depths):
    """A picture of a part with other depths at some pixels, by row and column."""
    picture = add_noise(draw_picture([LEFT], [BEECH]))
    for place, depth in depths.items():
        picture.depth[place] = depth
    return picture


def make_blank(*shape):
    return Picture(np.zeros((*shape, 3), dtype=np.uint8), np.ones(shape))


NO_SHAPE = r"must be \(height, width, 3\) of uint8 and \(height, width\)"


@pytest.mark.parametrize(
    ("error", "message", "picture"),
    [
        (NothingSeenError, "nothing is nearer than the stand, 0.9 m from the camera", add_noise(EMPTY)),
        (OneColourError, r"all pixels have the colour \(51, 51, 51\)", EMPTY),
        (
            NoDepthError,
            "2 of 307200 depth readings are not finite, all must be finite",
            spoil({(100, 100): np.nan, (3, 4): np.inf}),
        ),
        (NoDepthError, "0 % of the picture has depth, must be at least 50 %", spoil({...: 0.0})),
        (UnusablePictureError, "the picture has 1x1 pixels, must have at least 110", make_blank(1, 1)),
        (UnusablePictureError, "the picture has 0x0 pixels, must have at least 110", make_blank(0, 0)),
        (UnusablePictureError, "the picture has 10x10 pixels, must have at least 110", make_blank(10, 10)),
        (UnusablePictureError, NO_SHAPE, Picture(EMPTY.colour, EMPTY.depth[:-1])),
        (UnusablePictureError, NO_SHAPE, Picture(EMPTY.colour[:, :, :2], EMPTY.depth)),
        (UnusablePictureError, NO_SHAPE, Picture(EMPTY.colour / 255.0, EMPTY.depth)),
        (
            OutOfViewError,
            r"the object covers \d+ pixels of the picture's edge, must cover none",
            draw_one([0.05, 0.02, 0.02], [-0.47, 0, STAND - 0.02]),
        ),
        (TooSmallError, r"covers \d+ pixels, must cover at least 110", draw_one([0.008] * 3, [0, 0, STAND - 0.02])),
        # The stand is mixed into all of it.
        (
            TooSmallError,
            "fewer than 27 connected pixels of one tint .* without the object's rim of 3 pixels",
            draw_one([0.0105] * 3, [0, 0, STAND - 0.02]),
        ),
    ],
)
def test_picture_that_cannot_be_used_is_refused_and_kept_for_inspection(error, message, picture):
    with pytest.raises(error, match=message) as caught:
        segment(picture, STAND, NOISY)
    assert isinstance(caught.value, SeeingError)
    assert caught.value.colour is picture.colour
    assert caught.value.depth is picture.depth


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


def test_perfect_picture_is_segmented_exactly():
    picture = draw_picture([LEFT, RIGHT], [BEECH, STEEL])
    segmentation = segment(picture, STAND, PERFECT)
    truth = picture.depth < STAND - 1e-3
    assert ((segmentation.labels >= 0) != truth).sum() <= 4  # corners that the median rounds off
