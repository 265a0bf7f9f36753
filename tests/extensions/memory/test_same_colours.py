"""Colours that count as one: records read with them say what records of one camera alone say."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.refusals import refuse
from helpers.trials import BRASS, STEEL, WOOD, hold, hold_workshop

from affordance.belief.density_belief import Prior
from affordance.belief.learners import LEARNERS
from affordance.exceptions import BadValueError
from affordance.extensions.memory import evidence_sums
from affordance.extensions.memory.evidence_sums import find_material
from affordance.extensions.memory.ledger import open_memory
from affordance.extensions.memory.same_colours import join_colours
from affordance.extensions.memory.summary import recall_felt, recall_with_objects, summarise

_BLUE, _GREEN = (0.1, 0.2, 0.8), (0.1, 0.7, 0.2)


@pytest.fixture(scope="module")
def ledgers(tmp_path_factory):
    """Two ledgers of the same holds: of one camera, and every other hold of a camera that sees wood as blue."""
    folder = tmp_path_factory.mktemp("ledgers")
    one, two = open_memory(folder / "one.sqlite"), open_memory(folder / "two.sqlite")
    for i, trial in enumerate(hold_workshop(9)):
        parts = tuple(part._replace(colour=_BLUE if part.colour == WOOD else part.colour) for part in trial.parts)
        one.append([trial])
        two.append([replace(trial, parts=parts if i % 2 else trial.parts)])
    yield one, two
    one.close()
    two.close()


@pytest.mark.parametrize("first", [WOOD, _BLUE])
@pytest.mark.parametrize("learner", list(LEARNERS.values()))
def test_beliefs_are_those_of_one_camera(ledgers, learner, first):
    """Also objects of one name are one thing again, whichever colour represents both."""
    one, two = ledgers
    pairs = [(first, _BLUE if first == WOOD else WOOD)]
    assert two.sum(Prior()).things.keys() - one.sum(Prior()).things.keys() == {"bar #2", "hammer #2"}
    wanted = recall_with_objects(one, learner, Prior(), 0)
    found = recall_with_objects(two, learner, Prior(), 0, pairs)
    assert found.colours == tuple(first if colour == WOOD else colour for colour in wanted.colours)
    assert np.array_equal(found.belief.precision, wanted.belief.precision)
    assert np.array_equal(found.belief.information_vector, wanted.belief.information_vector)


def test_things_and_summary_are_those_of_one_camera(ledgers):
    one, two = ledgers
    pairs = [(WOOD, _BLUE)]
    assert summarise(two, Prior(), pairs) == summarise(one, Prior())
    assert recall_felt(two, Prior(), pairs).keys() == recall_felt(one, Prior()).keys()


def test_a_measured_colour_is_translated_if_it_is_certain(tmp_path):
    seen = hold("bar", (WOOD,), (600.0,), 0)
    near = seen.parts[0]._replace(colour=(0.71, 0.5, 0.29), colour_sd=2.0)
    with open_memory(tmp_path / "memory.sqlite") as ledger:
        ledger.append([replace(seen, parts=(near,)), hold("plank", (STEEL,), (600.0,), 1)])
        assert ledger.recall(same_colours=[(BRASS, WOOD)]).colours == (BRASS, STEEL)
        assert ledger.recall().colours == (near.colour, STEEL)


@pytest.mark.parametrize("colour_sd", [0.0, 2.0])
@pytest.mark.parametrize("second", [1, 3])
def test_a_measured_colour_of_a_third_material_is_not_translated(tmp_path, colour_sd, second):
    """It would be taken for the pair's second colour if nothing else were known."""
    third, near = (0.8, 0.6, 0.4), (0.79, 0.59, 0.39)
    rod, plank, bar = (hold(name, (WOOD,), (600.0,), i) for i, name in ((0, "rod"), (second, "plank"), (2, "bar")))
    rod, plank, bar = (
        replace(each, parts=(each.parts[0]._replace(colour=colour, colour_sd=sd),))
        for each, colour, sd in ((rod, (0.71, 0.5, 0.29), 2.0), (plank, third, colour_sd), (bar, near, 2.0))
    )
    assert find_material(bar.parts[0], (WOOD,)) == 0
    with open_memory(tmp_path / "memory.sqlite") as ledger:
        ledger.append([rod, plank, bar])
        found = ledger.sum(Prior(), [(BRASS, WOOD)]).things
    assert found["rod"].parts[0].colour == BRASS
    assert [found[name].parts for name in ("plank", "bar")] == [plank.parts, bar.parts]


@pytest.mark.parametrize(
    ("pairs", "at_hand", "joined"),
    [
        ([], {}, []),
        ([(WOOD, _BLUE)], {}, [(WOOD, _BLUE)]),
        ([(WOOD, _BLUE)], {"blue": _BLUE, "steel": STEEL}, [(_BLUE, WOOD)]),
        ([(WOOD, _BLUE), (_BLUE, _GREEN)], {}, [(WOOD, _BLUE), (WOOD, _GREEN)]),
        ([(WOOD, _BLUE), (BRASS, _GREEN), (_BLUE, BRASS)], {}, [(WOOD, _BLUE), (WOOD, BRASS), (WOOD, _GREEN)]),
        ([(WOOD, _BLUE), (_BLUE, _GREEN), (_GREEN, WOOD)], {"green": _GREEN}, [(_GREEN, WOOD), (_GREEN, _BLUE)]),
    ],
)
def test_chains_and_circles_of_pairs_are_joined(pairs, at_hand, joined):
    found = join_colours(pairs, at_hand)
    assert sorted(found) == sorted(joined)
    assert join_colours(found, at_hand) == found


def test_two_materials_at_hand_and_unknown_colours_are_refused(ledgers):
    wanted = "--same-colour: joins wood and brass, must join one material at hand and other colours"
    assert wanted in refuse(join_colours, [(WOOD, _BLUE), (_BLUE, BRASS)], {"wood": WOOD, "brass": BRASS})
    wanted = "--same-colour: joins #b2804c and #b2804c, which already count as one material, must join two different"
    assert wanted in refuse(join_colours, [(WOOD, _BLUE), (WOOD, WOOD)])
    for learner in LEARNERS.values():
        with pytest.raises(BadValueError, match="same colours: name #1ab233, which no part in the memory has; the"):
            ledgers[1].recall(learner, same_colours=[(WOOD, _BLUE), (WOOD, _GREEN)])


def test_materials_are_bounded(tmp_path, monkeypatch):
    monkeypatch.setattr(evidence_sums, "MOST_MATERIALS", 5)
    with open_memory(tmp_path / "memory.sqlite") as ledger:
        ledger.append([hold(f"bar {i}", ((0.1 * i, 0.5, 0.5),), (900.0,), i) for i in range(6)])
        message = "memory.sqlite: colours: are of 6 materials, must be of at most 5"
        for learner in LEARNERS.values():
            assert message in refuse(ledger.recall, learner, same_colours=[(WOOD, (0.0, 0.5, 0.5))])
