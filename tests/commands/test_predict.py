"""Predictions are written, compared with what people can show, and not simulated again by a run."""

import json

import numpy as np
import pytest
from helpers.answers import answer
from helpers.changed_files import change_file
from helpers.results_files import read_numbers

from affordance.belief.learner import Learner
from affordance.commands.new_protocol import write_protocol
from affordance.experiments.shared.presented import PresentationExperiment
from affordance.protocols.protocol import find_number_of_observers, find_protocol
from affordance.reporting.learner_predictions import PeopleSpread, contrast_learners, format_predictions, summarise

pytestmark = pytest.mark.usefixtures("unrendered")


@pytest.fixture
def short(tmp_path):
    """A protocol of a few lifts."""
    path, _ = write_protocol("mine", tmp_path)
    fewer = ("repetitions: 10", "repetitions: 2", "repetitions: 20", "repetitions: 8", "number: 50", "number: 3")
    return change_file(path, *fewer)


def call(command, path, tmp_path, *more):
    return answer(command, path, "--jobs", 1, "--out", tmp_path / "out", *more).out


def test_run_simulates_no_observer_that_was_predicted(short, tmp_path, monkeypatch):
    path = tmp_path / "out" / "mine" / "predictions.json"
    assert f"The predictions: {path}" in call("predict", short, tmp_path)
    found = json.loads(path.read_text())
    assert found["repeats"] == 3  # as the protocol says
    assert set(found["numbers"]["end_N"]) == {learner.value for learner in Learner}

    def refuse(*_):
        raise AssertionError("this observer was simulated already")

    monkeypatch.setattr(PresentationExperiment, "run_learner", refuse)
    call("run", short, tmp_path)
    numbers = read_numbers(tmp_path / "out" / "mine")
    assert numbers["repeats"] == 3
    assert numbers["learners"]["kinds_map"]["end_N"] == found["numbers"]["end_N"]["kinds_map"]["mean"]
    with pytest.raises(AssertionError, match="simulated already"):
        call("run", short, tmp_path, "--repeats", "4")


def test_observers_of_one_learner_serve_a_protocol_that_names_none(short, tmp_path, monkeypatch):
    change_file(short, "  learners: [density, kinds_map, kinds_drawn]", "  # learners:")
    change_file(short, "value: \"learners['kinds_map']['learned']\"", 'value: "learned"')
    call("predict", short, tmp_path)
    monkeypatch.setattr(PresentationExperiment, "run_learner", None)
    for learner in Learner:
        call("run", short, tmp_path, "--learner", learner.value)


def test_number_of_observers_is_that_of_the_command_line_then_of_the_protocol(short, tmp_path):
    assert find_number_of_observers(str(short)) == 3
    assert find_number_of_observers("weight") is None
    call("run", short, tmp_path, "--repeats", 2)
    assert read_numbers(tmp_path / "out" / "mine")["repeats"] == 2


def predict(first, second, sd):
    rng = np.random.default_rng(1)
    values = {
        learner: mean + 0.1 * rng.standard_normal(100)
        for learner, mean in zip((Learner.KINDS_MAP, Learner.KINDS_DRAWN), (first, second), strict=True)
    }
    predictions = {"end_N": {learner: summarise(each) for learner, each in values.items()}}
    spreads = {} if sd is None else {"end_N": PeopleSpread(sd, "a paper")}
    contrasts = contrast_learners(predictions, {name: spread.sd for name, spread in spreads.items()})
    return format_predictions({}, predictions, contrasts, spreads)


def test_difference_that_people_could_not_show_is_none():
    """A difference of 0.06 N counts as none for people, who differ by 1.7 N, though observers differ by 0.1 N."""
    text = predict(9.0, 9.06, 1.7)
    assert "kinds_map and kinds_drawn are not distinguished by any of these: they differ most in end_N" in text
    assert "times the spread between people; it would take" in text
    assert "SD between people 1.7 (a paper)" in text
    assert "are distinguished best by end_N" in predict(9.0, 12.0, 1.7)


def test_where_nothing_is_known_of_people_nothing_is_said_of_them():
    text = predict(9.0, 9.06, None)
    assert "times the spread between observers; the spread between people is not given" in text
    assert "people in each group would do" not in text


def test_spread_between_people_is_the_given_one_or_follows_from_published_intervals(short, tmp_path):
    """A 95 % interval of +- 0.945 N over nine people is an SD of 0.945 / 2.306 * 3; an expression's SD follows."""
    text = find_protocol("linear_plus_plus").read_text(encoding="utf-8")
    for many, few in (("repetitions: 30", "repetitions: 1"), ("repetitions: 40", "repetitions: 16"), ("120", "4")):
        text = text.replace(many, few)
    path = tmp_path / "few.yaml"
    path.write_text(text.replace("name: linear_plus_plus", "name: few"), encoding="utf-8")
    call("predict", path, tmp_path, "--repeats", 2)
    found = json.loads((tmp_path / "out" / "few" / "predictions.json").read_text())
    spread = found["spread_between_people"]
    assert spread["first_N"]["sd"] == pytest.approx(0.945 / 2.306 * 3.0, rel=1e-3)
    assert spread["end_N"]["sd"] == pytest.approx(1.59 / 2.306 * 3.0, rel=1e-3)
    assert spread["f"]["sd"] == pytest.approx(0.416, rel=0.02)  # 0.32 / 2.306 * 3
    assert "weight_N" not in spread
    change_file(short, "  first_N: {", "  first_N: {people: {sd: 1.7, unit: N, source: a paper}, ")
    assert "SD between people 1.7 (a paper)" in call("predict", short, tmp_path)
    spread = json.loads((tmp_path / "out" / "mine" / "predictions.json").read_text())["spread_between_people"]
    assert spread["first_N"] == {"sd": 1.7, "source": "a paper"}
    assert spread["end_N"]["sd"] == 1.75
    assert spread["learned"]["source"] == "calculated from the others"
