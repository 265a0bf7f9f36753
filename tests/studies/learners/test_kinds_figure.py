import numpy as np
import pytest

from affordance.belief.density_belief import Prior
from affordance.belief.kind_memory import KindMemory, count_kinds, find_kind
from affordance.belief.kinds_gate import GateSettings, KindSettings
from affordance.belief.likelihood import Likelihood
from affordance.belief.material_memory import MaterialMemory
from affordance.objects.appearance import PartAppearance
from studies.learners.kinds_figure import summarise_kinds

PRIOR = Prior(mode=1000.0, sd=4000.0, deviation_sd=100.0)
BRASS, STEEL = (0.8, 0.6, 0.1), (0.5, 0.5, 0.6)
# Length and colour, and what it weighs: one brass thing is hollow.
OBJECTS = [(0.05, BRASS, 5000.0), (0.10, BRASS, 5000.0), (0.15, BRASS, 700.0), (0.05, STEEL, 3000.0)]


def show(length, colour):
    return [PartAppearance(colour, (length, 0.02, 0.02), (0.0, 0.0, 0.0))]


@pytest.fixture(scope="module")
def memory():
    """Memory after three lifts of each object, each felt to 150 kg/m^3."""
    memory = KindMemory(KindSettings(GateSettings(0.25)))
    for length, colour, density in OBJECTS * 3:
        felt = Likelihood(np.array([[150.0**-2]]), np.array([density * 150.0**-2]), 0.0)
        recalled = memory.recall(show(length, colour), PRIOR)
        memory = recalled.memory.learn(recalled.densities, lambda _, felt=felt: felt, PRIOR.deviation_sd).memory
    return memory


def test_kinds_are_listed_colour_by_colour_with_their_objects(memory):
    brass, hollow, steel = summarise_kinds(memory)
    assert (brass.colour, hollow.colour, steel.colour) == (BRASS, BRASS, STEEL)
    assert [len(kind.objects) for kind in (brass, hollow, steel)] == [2, 1, 1]
    assert [kind.is_most_populous for kind in (brass, hollow, steel)] == [True, False, True]
    np.testing.assert_allclose([brass.density, hollow.density, steel.density], [5000.0, 700.0, 3000.0], rtol=0.05)
    (odd,) = hollow.objects
    assert odd.has_own
    # The object's own three lifts are all the evidence; it is surer of itself than by a kind, whose members scatter.
    assert odd.sd < hollow.sd
    assert odd.density == pytest.approx(700.0, rel=0.05)
    assert not any(each.has_own for each in (*brass.objects, *steel.objects))
    assert brass.objects[0][3:5] == (brass.density, brass.sd)


def test_kinds_are_counted_and_found_by_what_an_object_looks_like(memory):
    assert count_kinds(memory) == 3
    assert [find_kind(memory, show(length, colour)) for length, colour, _ in OBJECTS] == [1, 1, 2, 1]
    assert find_kind(memory, show(0.3, BRASS)) == 0  # never lifted
    assert find_kind(MaterialMemory(), show(0.05, BRASS)) == 0
    assert count_kinds(MaterialMemory()) == 0
