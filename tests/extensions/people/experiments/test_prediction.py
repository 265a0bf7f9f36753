"""Predictions by made-up observers: numbers, entries of lists, spreads between people, and the file."""

import json
import math

import numpy as np
import pytest
from scipy.stats import ttest_ind

from affordance.belief.learners import LEARNERS
from affordance.experiments.shared.observer_numbers import ObserverNumbers, PeopleSpread, measure_learners
from affordance.experiments.shared.observers import Setup
from affordance.extensions.people.experiments import prediction
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


def test_contrasts_are_those_of_two_normal_samples():
    rng = np.random.default_rng(5)
    one, other = rng.normal(0.0, 1.0, 1000), rng.normal(1.0, 1.0, 1000)
    predictions = {"m": {"density": prediction.summarise(one), "kinds_map": prediction.summarise(other)}}
    (contrast,) = prediction.contrast_learners(predictions)
    assert contrast.effect == pytest.approx(1.0, abs=0.1)
    assert contrast.superiority == pytest.approx(0.760, abs=0.03)  # Phi(1 / sqrt 2)
    assert contrast.num_people == pytest.approx(23, abs=4)  # 22.02 by the t test
    (wider,) = prediction.contrast_learners(predictions, {"m": math.sqrt(3.0)})
    assert wider.effect == pytest.approx(0.5 * contrast.effect, rel=0.03)
    assert wider.superiority == pytest.approx(0.638, abs=0.03)


@pytest.mark.parametrize(
    ("effect", "power", "count"),
    [(0.2, 0.8, 394), (0.5, 0.8, 64), (0.8, 0.8, 26), (0.5, 0.9, 86), (1.0, 0.9, 23), (3.0, 0.8, 4), (-3.0, 0.8, 4)],
)
def test_participants_are_those_of_cohens_tables(effect, power, count):
    """Cohen (1988), table 2.4.1; those of d = 3 are below its range, and are simulated in the next test."""
    assert prediction.count_people(effect, power) == count


def test_t_tests_of_simulated_groups_have_the_power_asked_for_and_smaller_groups_do_not():
    rng, powers = np.random.default_rng(5), []
    for count in (4, 3, 2):
        first, second = rng.normal(size=(20_000, count)), rng.normal(3.0, size=(20_000, count))
        powers.append(float((ttest_ind(first, second, axis=1).pvalue < 0.05).mean()))
    assert powers == pytest.approx([0.939, 0.783, 0.387], abs=0.012)
    assert prediction.count_people(3.0, 0.8) == 4
    assert prediction.count_people(3.0, 0.78) == 3
    assert prediction.count_people(math.inf) == 2
    assert prediction.count_people(1e-5) > 100_000


def test_learners_that_do_the_same_are_not_told_apart():
    same = {learner: prediction.summarise(np.ones(5)) for learner in ("density", "kinds_map")}
    (contrast,) = prediction.contrast_learners({"first_N": same})
    assert contrast.superiority == 0.5
    assert math.isinf(contrast.num_people)
    text = prediction.format_predictions({}, {"first_N": same}, [contrast])
    assert "density and kinds_map are not distinguished by any of these" in text


def test_measures_without_differences_follow_in_one_line():
    same, other = prediction.summarise(np.full(3, 8500.0)), prediction.summarise(np.array([8000.0, 8100.0, 8300.0]))
    predictions = {"density": {"a": other, "b": other}, "true": {"a": same, "b": same}}
    text = prediction.format_predictions({"true": "true density"}, predictions, [])
    assert text.splitlines()[-1] == "The same for all observers of all learners: true 8500"
    assert text.startswith("density\n")
    assert "8100 to" not in text
    assert "8133" in text
    assert "e+" not in text


def test_rows_of_a_usual_prediction_fit_a_narrow_terminal():
    values = np.array([-0.000105, 0.0302, 0.0544])
    text = prediction.format_predictions({}, {"drop_m": {"kinds_drawn": prediction.summarise(values)}}, [], width=80)
    assert len(text.splitlines()) == 3


def test_learners_that_differ_by_less_than_observers_do_are_not_told_apart():
    drawn = np.random.default_rng(5).normal(0.0, 1.0, 1000)
    alike = {"density": prediction.summarise(drawn), "kinds_map": prediction.summarise(drawn + 0.001)}
    (contrast,) = prediction.contrast_learners({"first_N": alike})
    text = prediction.describe_contrast(contrast)
    assert text.startswith("density and kinds_map are not distinguished by any of these: they differ most in first_N")
    assert "more than 100000 who learn like kinds_map (two-sided t test, .05, power .9) if people differ" in text


def test_entries_of_a_list_have_the_meaning_of_the_list():
    text = prediction.format_predictions(
        {"drop_m": "drop of each rod, m"}, {"drop_m[1]": {"kinds_drawn": prediction.summarise(np.arange(3.0))}}, []
    )
    assert text.splitlines()[0] == "drop_m[1]: drop of each rod, m"
