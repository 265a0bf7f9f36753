import numpy as np
import pytest

from affordance.objects.colour import compute_tints, convert_to_lab


@pytest.mark.parametrize(
    ("colour", "lab"),
    [((1, 1, 1), (100.0, 0.0, 0.0)), ((0, 0, 0), (0.0, 0.0, 0.0)), ((1, 0, 0), (53.24, 80.09, 67.20))],
)
def test_coordinates_are_those_of_the_standard(colour, lab):
    """Coordinates are those of CIE 15 by way of IEC 61966-2-1, illuminant D65, to 0.15; red is as published."""
    np.testing.assert_allclose(convert_to_lab(np.array(colour, dtype=float)), lab, atol=0.15)


def test_tints_do_not_depend_on_shade(rng):
    colours = rng.uniform(0.3, 1.0, (50, 3))
    for shade in (0.2, 0.5, 1.0):
        np.testing.assert_allclose(compute_tints(shade * colours), compute_tints(colours), atol=0.1)


def test_tints_of_different_materials_differ():
    beech, steel, brass = compute_tints(np.array([[0.79, 0.56, 0.35], [0.49, 0.54, 0.6], [0.83, 0.63, 0.09]]))
    assert min(np.linalg.norm(beech - steel), np.linalg.norm(beech - brass), np.linalg.norm(steel - brass)) > 20.0
