"""The catalogue of experiments, commands and learners."""

import json

import pytest
from helpers.refusals import refuse
from helpers.shipped_runs import NAMES

from affordance.belief.learners import LEARNERS
from affordance.choice.blow_cost import BlowCost
from affordance.commands.catalogue import COMPARED, DEFAULT_LEARNER, OF_THE_PAPER, PREDICTED, find_experiment
from affordance.experiments.shared import suite
from affordance.experiments.shared.observers import Setup
from affordance.settings import DEFAULT_SETTINGS


def test_experiment_that_there_is_not_is_refused_with_the_nearest():
    assert "did you mean 'weight'?" in refuse(find_experiment, "wieght")


def test_catalogue_of_experiments():
    found = {name: find_experiment(name) for name in NAMES}
    assert OF_THE_PAPER == suite.OF_THE_PAPER == ("weight", "com", "reach", "hammer")
    assert tuple(name for name, each in found.items() if each.predict is not None) == PREDICTED
    assert {name: each.observers for name, each in found.items() if each.observers != 200} == {
        **dict.fromkeys(("linear_plus", "linear_plus_plus"), 50),
    }
    assert [name for name, each in found.items() if not each.no_memory] == ["weight", "com", "reach", "hammer"]
    assert found["hammer"].needs == ("objects", "blow")
    assert [name for name, each in found.items() if each.every_learner] == [*NAMES[-2:]]


def test_catalogue_of_learners():
    assert tuple(LEARNERS) == COMPARED
    assert DEFAULT_SETTINGS.learner.name == DEFAULT_LEARNER


@pytest.mark.parametrize("name", NAMES)
def test_reading_simulates_nothing_and_finds_the_shipped_files_sound(name, monkeypatch, tmp_path):
    monkeypatch.setattr("affordance.simulation.diagram.TrialDiagram.prepare", None)
    monkeypatch.setattr(BlowCost, "compute", None)
    find_experiment(name).read(Setup(out=tmp_path))
    assert not [*tmp_path.iterdir()]


def test_sections_come_in_an_order_of_their_own(get_shipped):
    orders = [
        json.loads((get_shipped(name).folder / "section.json").read_text(encoding="utf-8"))["order"] for name in NAMES
    ]
    assert len(set(orders)) == len(orders)
    assert orders[:5] == [1, 2, 3, 4, 6]
