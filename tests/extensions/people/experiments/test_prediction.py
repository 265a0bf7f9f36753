"""Predictions by made-up observers: numbers, entries of lists, spreads between people, and the file."""

import json

import numpy as np
import pytest

from affordance.belief.learners import LEARNERS
from affordance.experiments.shared.observer_numbers import ObserverNumbers, PeopleSpread, measure_learners
from affordance.experiments.shared.observers import Setup
from affordance.extensions.people.experiments.prediction import predict

MAP, DRAWN = "kinds_map", "kinds_drawn"
ONE, OTHER = np.array([1.0, 2.0, 3.0]), np.array([4.0, 5.0, 9.0])
VALUES = {
    MAP: {"end_N": ONE, "drop_m": np.stack([ONE, OTHER], axis=1)},
    DRAWN: {"end_N": OTHER, "drop_m": np.stack([ONE, ONE], axis=1)},
}


def find_spreads(means):
    """The spread of the list is the predicted mean of the other number, over both learners."""
    return {"drop_m": PeopleSpread(means["end_N"], "a paper")}


@pytest.fixture
def predicted(tmp_path):
    setup = Setup(observers=3, seed=7, out=tmp_path / "out")
    return predict("mine", setup, lambda given: ObserverNumbers(VALUES, {"end_N": "force, N"}, find_spreads))


def test_numbers_are_those_of_the_observers_by_hand(predicted):
    assert [*predicted.predictions] == ["end_N", "drop_m[0]", "drop_m[1]"]
    found = predicted.predictions["end_N"][DRAWN]
    assert float(found.mean.mean) == pytest.approx(6.0)
    assert found.sd == pytest.approx(np.std(OTHER, ddof=1))
    np.testing.assert_array_equal(predicted.predictions["drop_m[1]"][MAP].values, OTHER)
    assert predicted.meanings == {"end_N": "force, N"}


def test_spread_between_people_holds_for_every_entry_of_a_list(predicted):
    assert predicted.spreads == {name: PeopleSpread(4.0, "a paper") for name in ("drop_m[0]", "drop_m[1]")}
    assert [each.measure for each in predicted.contrasts] == ["drop_m[1]", "drop_m[0]", "end_N"]  # of people first
    assert [each.is_of_people for each in predicted.contrasts] == [True, True, False]
    assert predicted.contrasts[0].difference == pytest.approx(-4.0)


def test_file_has_everything_and_null_for_what_is_infinite(predicted):
    content = json.loads(predicted.path.read_text(encoding="utf-8"), parse_constant=pytest.fail)
    assert (content["seed"], content["repeats"]) == (7, 3)
    assert content["numbers"]["end_N"]["kinds_map"]["mean"] == 2.0
    assert content["spread_between_people"]["drop_m[0]"] == {"sd": 4.0, "source": "a paper"}
    of_equals = next(each for each in content["contrasts"] if each["number"] == "drop_m[0]")
    assert (of_equals["difference"], of_equals["num_people"]) == (0.0, None)
    assert content["versions"]["numpy"]


def test_every_learner_is_measured_by_its_own_settings():
    found = measure_learners(
        Setup(), lambda setup: {"name": setup.settings.learner.name, "other": 0.0}, {"name": "name of the learner"}
    )
    assert found.values == {name: {"name": name} for name in LEARNERS}
    assert found.find_spreads({}) == {}
