"""Predictions are written, compared with what people can show, and not simulated again by a run."""

import json

import numpy as np
import pytest
from helpers.answers import answer
from helpers.refusals import refuse_command
from helpers.results_files import read_numbers

from affordance.belief.learners import LEARNERS
from affordance.experiments.shared.observer_numbers import PeopleSpread
from affordance.extensions.people.experiments import linear
from affordance.extensions.people.experiments.prediction import (
    contrast_learners,
    count_people,
    format_predictions,
    summarise,
)

pytestmark = pytest.mark.usefixtures("unrendered")


@pytest.fixture
def few(monkeypatch):
    """Experiments of a few lifts."""
    monkeypatch.setattr(linear, "FAMILIAR", 2)
    monkeypatch.setattr(linear, "MIXED", 16)


def call(command, name, tmp_path, *more):
    return answer(command, name, "--jobs", 1, "--out", tmp_path / "out", *more).out


def read_predictions(tmp_path, name):
    return json.loads((tmp_path / "out" / name / "predictions.json").read_text(encoding="utf-8"))


@pytest.mark.usefixtures("few")
def test_run_simulates_no_observer_that_was_predicted(tmp_path, monkeypatch):
    path = tmp_path / "out" / "linear_plus" / "predictions.json"
    assert f"The predictions: {path}" in call("predict", "linear_plus", tmp_path, "--repeats", 3)
    found = read_predictions(tmp_path, "linear_plus")
    assert found["repeats"] == 3
    assert set(found["numbers"]["end_N"]) == {learner.name for learner in LEARNERS.values()}

    def refuse(*_):
        raise AssertionError("this observer was simulated already")

    monkeypatch.setattr("affordance.runs.repeats._keep", refuse)
    call("run", "linear_plus", tmp_path, "--repeats", 3)
    numbers = read_numbers(tmp_path / "out" / "linear_plus")
    assert numbers["repeats"] == 3
    assert numbers["learners"]["kinds_map"]["end_N"] == found["numbers"]["end_N"]["kinds_map"]["mean"]
    with pytest.raises(AssertionError, match="simulated already"):
        call("run", "linear_plus", tmp_path, "--repeats", 4)


def test_observers_of_each_learner_serve_a_run_of_one(tmp_path, monkeypatch):
    """Simulation I is run with one learner at a time; observers of all are there once it was predicted."""
    monkeypatch.setattr("affordance.experiments.weight.DURATION", 0.1)
    call("predict", "weight", tmp_path, "--repeats", 2)
    monkeypatch.setattr("affordance.runs.repeats._keep", None)
    for learner in LEARNERS.values():
        call("run", "weight", tmp_path, "--repeats", 2, "--learner", learner.name)


@pytest.mark.usefixtures("few")
def test_number_of_observers_is_that_of_the_command_line_then_of_the_experiment(tmp_path, monkeypatch):
    call("predict", "linear_plus", tmp_path, "--repeats", 2)
    assert read_predictions(tmp_path, "linear_plus")["repeats"] == 2
    monkeypatch.setattr(linear, "LINEAR_PLUS", linear.LINEAR_PLUS._replace(observers=3))
    for command in ("predict", "run"):
        call(command, "linear_plus", tmp_path)
    assert read_predictions(tmp_path, "linear_plus")["repeats"] == 3
    assert read_numbers(tmp_path / "out" / "linear_plus")["repeats"] == 3


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["vision"], "experiment: is 'vision', which uses one learner for all observers; use run once per --learner"),
        (["linear_plus", "--repeats", 1], "--repeats: is 1, must be at least 2"),
        (["linear_plus", "--set", "learner=density"], "--learner: has no effect on predict, which always simulates"),
    ],
)
def test_what_cannot_be_predicted_is_refused(words, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert said in refuse_command("predict", *words)


def format_contrast(first, second, sd):
    rng = np.random.default_rng(1)
    values = {
        learner: mean + 0.1 * rng.standard_normal(100)
        for learner, mean in zip(("kinds_map", "kinds_drawn"), (first, second), strict=True)
    }
    predictions = {"end_N": {learner: summarise(each) for learner, each in values.items()}}
    spreads = {} if sd is None else {"end_N": PeopleSpread(sd, "a paper")}
    contrasts = contrast_learners(predictions, {name: spread.sd for name, spread in spreads.items()})
    return format_predictions({}, predictions, contrasts, spreads)


def test_difference_that_people_could_not_show_is_none():
    """A difference of 0.06 N counts as none for people, who differ by 1.7 N, though observers differ by 0.1 N."""
    text = format_contrast(9.0, 9.06, 1.7)
    assert "kinds_map and kinds_drawn are not distinguished by any of these: they differ most in end_N" in text
    assert "Cohen's d = 0.035 (spread between people); it would take" in text
    assert "SD between people 1.7 (a paper)" in text
    assert "are distinguished best by end_N" in format_contrast(9.0, 12.0, 1.7)


def test_where_nothing_is_known_of_people_nothing_is_said_of_them():
    text = format_contrast(9.0, 9.06, None)
    assert "(spread between observers); " in text
    assert (
        "suffice (two-sided t test, .05, power .9) if people differ no more than observers, which is not known"
        in text
    )


@pytest.mark.usefixtures("few")
def test_best_measure_is_said_to_be_picked(tmp_path):
    text = call("predict", "linear_plus_plus", tmp_path, "--repeats", 2)
    assert len(text.splitlines()) < 12
    assert "picked after they were simulated" in " ".join(text.split())


def test_participants_are_those_of_the_power_that_is_asked_for():
    """Of a standardised difference of 0.5, 86 participants a group at a power of .9, and 64 at .8 (t tests)."""
    assert [count_people(0.5, power) for power in (0.9, 0.8)] == [86, 64]


@pytest.mark.usefixtures("few")
def test_spread_between_people_is_the_given_one_or_follows_from_published_intervals(tmp_path):
    """A 95 % interval of +- 0.945 N over nine people is an SD of 0.945 / 2.306 * 3; that of f follows."""
    assert "SD between people 1.2 (Cesanek" in call(
        "predict", "linear_plus_plus", tmp_path, "--repeats", 2, "--details"
    )
    spread = read_predictions(tmp_path, "linear_plus_plus")["spread_between_people"]
    assert spread["first_N"]["sd"] == pytest.approx(0.945 / 2.306 * 3.0, rel=1e-3)
    assert spread["end_N"]["sd"] == pytest.approx(1.59 / 2.306 * 3.0, rel=1e-3)
    assert spread["f"]["sd"] == pytest.approx(0.416, rel=0.02)  # 0.32 / 2.306 * 3
    assert "weight_N" not in spread
