"""Things of random sizes: volumes against closed forms, heads around their handles, and hollows that are open."""

import numpy as np
import pytest

from affordance.objects.materials import load_materials
from studies.loop.specimens import draw_things

MATERIALS = load_materials()
# Share of a circle's area that a polygon of 32 corners covers.
POLYGON = 32.0 / (2.0 * np.pi) * np.sin(2.0 * np.pi / 32.0)


class Scripted:
    """Generator whose uniform draws are given."""

    def __init__(self, *values, kind=0):
        self.values, self.kind = list(values), kind

    def uniform(self, low, high):
        value = self.values.pop(0)
        assert low <= value <= high
        return value

    def choice(self, options):
        return options[0]

    def integers(self, count):
        return self.kind


HAMMER, MALLET = (0.3, 0.5, 0.1, 0.012), (0.32, 0.03, 0.1, 0.012)
PAN = (0.1, 0.003, 0.05, 0.2, 0.01)
OTHERS = [(0, (0.04, 0.1, 0.003)), (1, (0.2, 0.012, 0.04, 0.016)), (2, (0.4, 0.03, 0.01))]


@pytest.mark.parametrize(("kind", "values"), OTHERS)
def test_volumes_are_those_of_closed_forms(kind, values):
    hammer, mallet, pan, other = draw_things(Scripted(*HAMMER, *MALLET, *PAN, *values, kind=kind), MATERIALS)
    heads = hammer.components[1].material.name, mallet.components[1].material.name, pan.components[1].material.name
    assert heads == ("cast_steel", "rubber", "stainless_steel")
    bowl = np.pi * (0.1**2 * 0.05 - 0.097**2 * 0.047) * POLYGON
    assert pan.components[1].shape.volume == pytest.approx(bowl, rel=1e-9)
    expected = {
        "beaker": np.pi * (0.04**2 * 0.1 - 0.037**2 * 0.097) * POLYGON,
        "stamper": np.pi * (0.012**2 * 0.2 + (0.04**2 - 0.012**2) * 0.008 + 0.04**2 * 0.008) * POLYGON,
        "rolling pin": np.pi * (0.03**2 * 0.2 + 0.01**2 * 0.2) * POLYGON,
    }
    assert sum(part.shape.volume for part in other.components) == pytest.approx(expected[other.name], rel=1e-9)
    # A head with its end of the handle inside weighs what shops list, but for the hole.
    whole = np.pi * 0.03**2 * 0.1 * POLYGON
    hole = whole - mallet.components[1].shape.volume
    assert 0.0 < hole < np.pi * 0.012**2 * 0.06


def test_things_of_any_seed_are_drawn_and_differ():
    masses = [[thing.mass for thing in draw_things(np.random.default_rng(seed), MATERIALS)] for seed in range(30)]
    assert np.isfinite(masses).all()
    assert (np.ptp(masses, axis=0) > 0.1).all()
    assert 0.05 < np.min(masses) < np.max(masses) < 4.0
