"""Simulated trials as evidence: a lasting memory learns from them as the memory of the trial does."""

from dataclasses import replace

import numpy as np
import pytest

from affordance.belief.learner import Learner
from affordance.belief.memory_file import format_memory
from affordance.exceptions import BadArgumentError
from affordance.files.model_folder import MODELS
from affordance.memory.evidence_sums import sum_trials
from affordance.memory.ledger import open_memory
from affordance.objects.load import load_tools
from affordance.proprioception.torque_noise import WhiteNoise
from affordance.settings import DEFAULT_SETTINGS
from affordance.simulation.trial import TrialRunner

_ROD, *_, _DECOY = load_tools(MODELS / "tools" / "weight.yaml")


def _hold(settings, tool=_ROD, seed=1):
    runner = TrialRunner(settings)
    return runner.run_hold(tool, runner.start_memory(), duration=0.5, seed=seed)


@pytest.mark.parametrize("noise", [DEFAULT_SETTINGS.noise, WhiteNoise()])
def test_evidence_of_one_hold_gives_the_belief_of_the_trial(noise):
    settings = replace(DEFAULT_SETTINGS, noise=noise)
    record = _hold(settings)
    assert record.evidence.num_samples == record.samples.accepted
    assert record.evidence.robot == "the paper's arm"
    recalled = sum_trials([record.evidence], settings.prior).build_belief()
    np.testing.assert_allclose(recalled.precision, record.memory.belief.precision, rtol=1e-6)
    np.testing.assert_allclose(recalled.information_vector, record.memory.belief.information_vector, rtol=1e-6)


def test_trials_are_appended_and_the_next_observer_begins_with_them(tmp_path):
    place = str(tmp_path / "memory.sqlite")
    for learner in (Learner.DENSITY, Learner.KINDS_MAP):
        settings = replace(DEFAULT_SETTINGS, ledger=place, learner=learner)
        _hold(settings, seed=2)
        _hold(settings, seed=2)  # the same trial
        with open_memory(place) as ledger:
            assert len(ledger) == 1
            known = ledger.recall(learner, settings.prior)
            assert ledger.verify() == []
        runner = TrialRunner(replace(settings, known=format_memory(known)))
        begun = runner.start_memory()
        assert begun.colours == known.colours
        assert np.array_equal(begun.belief.precision, known.belief.precision)


def test_evidence_of_a_noise_model_of_ones_own_is_none():
    class MyNoise(type(DEFAULT_SETTINGS.noise)):
        pass

    assert _hold(replace(DEFAULT_SETTINGS, noise=MyNoise())).evidence is None


def test_known_memory_of_another_learner_is_refused():
    known = format_memory(TrialRunner().start_memory())
    with pytest.raises(BadArgumentError, match="known: is the memory of another learner, must be that of kinds_map"):
        TrialRunner(replace(DEFAULT_SETTINGS, known=known, learner=Learner.KINDS_MAP)).start_memory()
