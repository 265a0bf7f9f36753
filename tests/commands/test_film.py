"""``affordance film``: the film of an experiment, and its messages for bad input."""

from types import SimpleNamespace

import pytest
from helpers.answers import answer
from helpers.refusals import refuse_command

from affordance.commands import film
from affordance.experiments.shared.drawings import replay_holds
from affordance.simulation.trial import TrialRunner


@pytest.mark.usefixtures("fine")
def test_a_film_of_one_observer_is_written(tmp_path, monkeypatch, weight):
    """The observer has the seed of the command line, and nothing but the film is written."""
    seen = []

    def run(setup):
        seen.append((setup.observers, setup.seed))
        runner = TrialRunner(setup.settings)
        held = weight.tools[-1:]
        records = [runner.run_hold(held[0], runner.start_memory(), duration=0.2)]
        return SimpleNamespace(replay=replay_holds(held, records, setup.settings, "one hold"))

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(film, "find_experiment", lambda name: SimpleNamespace(run=run))
    said = answer("film", "weight", "out.gif", "--seed", "3", "--seconds", "0.1")
    assert seen == [(1, 3)]
    assert said.lines[-1].startswith("out.gif: ")
    assert [each.name for each in tmp_path.iterdir()] == ["out.gif"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("weight", "out.avi"), "FILE: suffix: is '.avi', must be one of .gif, .webm, .mp4"),
        (("weihgt", "out.gif"), "did you mean 'weight'?"),
        (("vision", "out.gif"), "must be one of weight, com, reach, hammer"),
        (("weight",), "file: is missing"),
        (("weight", "out.gif", "--slower", "0"), "--slower: is 0.0, must be from 0.1 to 100"),
        (("weight", "out.gif", "--seconds", "nan"), "--seconds: is nan"),
    ],
)
def test_what_cannot_be_filmed_is_refused_first(words, said):
    assert said in refuse_command("film", *words)
