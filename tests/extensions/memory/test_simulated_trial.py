"""Simulated trials as evidence: a lasting memory learns from them as the memory of the trial does."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.trials import WOOD, hold

from affordance.belief.learners import DENSITY, KINDS_MAP
from affordance.belief.material_memory import start_memory
from affordance.belief.memory_file import format_memory
from affordance.experiments import weight
from affordance.experiments.shared.observers import Setup
from affordance.extensions.memory.ledger import open_memory, replay
from affordance.extensions.memory.simulated_trial import describe_trial, remember_in
from affordance.files.model_folder import MODELS
from affordance.objects.load import load_tools
from affordance.proprioception.torque_noise import WhiteNoise
from affordance.settings import DEFAULT_SETTINGS
from affordance.simulation.trial import Observer, TrialRunner

_ROD, *_, _DECOY = load_tools(MODELS / "tools" / "weight.yaml")


def _hold(settings, tool=_ROD, seed=1):
    runner = TrialRunner(settings)
    return runner.run_hold(tool, runner.start_memory(), duration=0.5, seed=seed)


@pytest.mark.parametrize("noise", [DEFAULT_SETTINGS.noise, WhiteNoise()])
def test_evidence_of_one_hold_gives_the_belief_of_the_trial(noise):
    settings = replace(DEFAULT_SETTINGS, noise=noise)
    record = _hold(settings)
    trial = describe_trial(record)
    assert trial.num_samples == record.samples.accepted
    assert trial.robot == "the paper's arm"
    recalled = replay([trial], start_memory(), settings.prior).belief
    np.testing.assert_allclose(recalled.precision, record.memory.belief.precision, rtol=1e-6)
    np.testing.assert_allclose(recalled.information_vector, record.memory.belief.information_vector, rtol=1e-6)


def test_trial_that_is_appended_is_what_the_next_observer_begins_with(tmp_path):
    place = tmp_path / "memory.sqlite"
    for learner in (DENSITY, KINDS_MAP):
        settings = replace(DEFAULT_SETTINGS, learner=learner)
        trial = describe_trial(_hold(settings, seed=2))
        with open_memory(place) as ledger:
            ledger.append([trial, describe_trial(_hold(settings, seed=2))])  # the same trial
            assert len(ledger) == 1
            assert ledger.verify() == []
            known = ledger.recall(learner, settings.prior)
        begun = Setup(settings=settings, known=format_memory(known)).start_memory(0)
        assert begun.colours == known.colours
        assert np.array_equal(begun.belief.precision, known.belief.precision)


def test_evidence_of_a_noise_model_of_ones_own_is_none():
    class MyNoise(type(DEFAULT_SETTINGS.noise)):
        pass

    assert describe_trial(_hold(replace(DEFAULT_SETTINGS, noise=MyNoise()))) is None


def test_evidence_of_nothing_felt_is_none():
    assert describe_trial(_hold(DEFAULT_SETTINGS)._replace(percept=None)) is None


def test_observer_begins_with_what_is_remembered_and_a_seed_of_its_own(tmp_path):
    place = tmp_path / "memory.sqlite"
    novice = remember_in(Setup(observers=1, seed=4), place)
    assert novice.seed == 4
    assert novice.start_memory(0).colours == ()
    with open_memory(place) as ledger:
        ledger.append([hold("bar", (WOOD,), (600.0,), second) for second in range(3)])
        known = ledger.recall()
    begun = remember_in(Setup(observers=1, seed=4), place)
    assert begun.seed == 7
    assert begun.start_memory(0).colours == known.colours
    assert begun.start_memory(0).belief.compute_mode() == pytest.approx(known.belief.compute_mode())
    assert remember_in(Setup(observers=1, seed=2**32 - 1), place).seed == 2


def test_each_trial_is_appended_when_it_is_over(tmp_path, monkeypatch):
    monkeypatch.setattr(weight, "DURATION", 0.1)
    place = tmp_path / "memory.sqlite"
    setup = remember_in(Setup(observers=1), place)
    tools = weight.read(setup)
    lengths, hold_one = [], Observer.hold

    def hold_noted(self, *arguments, **words):
        with open_memory(place) as ledger:
            lengths.append(len(ledger))
        return hold_one(self, *arguments, **words)

    monkeypatch.setattr(Observer, "hold", hold_noted)
    weight.hold(setup, tools, 0)
    assert lengths == [0, 1, 2, 3, 4]
