"""One object unlike its look shifts one density for each colour; with kinds it becomes a kind of its own."""

import numpy as np
import pytest

from affordance.belief.learners import DENSITY, KINDS_MAP
from affordance.experiments import weight
from affordance.experiments.shared.observers import Setup
from affordance.objects.tool import list_colours
from affordance.settings import DEFAULT_SETTINGS
from affordance.simulation.trial import Observer, get_runner

DECOYS = 6


@pytest.fixture(scope="module")
def observed():
    """Holds of a second of the rods, six times the decoy, and the first rod: memories and records by learner."""
    *rods, decoy = weight.read(Setup())
    found = {}
    for learner in (DENSITY, KINDS_MAP):
        memory = Setup().change(learner=learner).start_memory(1)
        memory = memory.add_colours(list_colours(rods), DEFAULT_SETTINGS.prior)
        hand = Observer(get_runner(DEFAULT_SETTINGS), memory, duration=1.0)
        memories, records = [memory], []
        for trial, tool in enumerate([*rods, *[decoy] * DECOYS, rods[0]]):
            records.append(hand.hold(tool, (0, 1, trial)))
            memories.append(hand.memory)
        found[learner] = memories, records
    return found


def test_one_decoy_and_six_shift_brass_for_one_learner_only(observed):
    """By quadrature, brass falls to .91 of its density after one decoy and to .78 after six (24 other observers)."""
    medians = {
        learner: [float(memory.belief.compute_percentiles([0.5])[0, 0]) for memory in memories]
        for learner, (memories, _) in observed.items()
    }
    before, one, *_, six, _ = medians[DENSITY][4:]
    assert 0.86 * before < one < 0.96 * before
    assert 0.70 * before < six < 0.86 * before
    kinds = medians[KINDS_MAP][4:-1]
    np.testing.assert_allclose(kinds, kinds[0], rtol=1e-9)


def test_with_kinds_the_next_honest_object_is_held_level(observed):
    excursions = {learner: np.abs(records[-1].height_centre).max() for learner, (_, records) in observed.items()}
    assert excursions[KINDS_MAP] < 0.02 < excursions[DENSITY]


def test_decoys_are_surprising_once_and_then_known(observed):
    _, records = observed[KINDS_MAP]
    p_values = [record.p_value for record in records]
    assert p_values[4] < 1e-6
    assert min(p_values[5:]) > 1e-3


def test_the_decoy_is_remembered_with_a_density_of_its_own(observed):
    memories, _ = observed[KINDS_MAP]
    groups, state = memories[-1].group(), memories[-1].state
    brass, other = np.flatnonzero(groups.colours[0] == 0)
    assert groups.common[0, 0] == brass
    mean, sd = groups.means.mean[0], np.sqrt(np.diag(groups.means.covariance[0]))
    assert mean[brass] == pytest.approx(8500.0, rel=0.2)
    kinds = state["thing_kind"][0, :, 0]
    assert (kinds == brass).sum() == 3
    (decoy,) = np.flatnonzero(kinds == other)
    assert 0.9 < state["probability"][0, decoy, 0] <= 1.0
    assert mean[other] == pytest.approx(720.0, abs=4.0 * sd[other])
