"""Defaults of an experiment: a class needs no more than its own steps."""

import dataclasses
from pathlib import Path

import pytest

from affordance.experiments.definition import Experiment, Outputs
from affordance.settings import DEFAULT_SETTINGS, Settings


@dataclasses.dataclass(frozen=True)
class Bare(Experiment):
    settings: Settings = DEFAULT_SETTINGS

    name = "bare"
    section = Path("bare.yaml")
    seed = 0

    def run_observer(self, shared, experience, repeat):
        return {}

    def compute_metrics(self, plan, experience, arrays):
        return {}

    def list_facts(self, plan, numbers):
        return {}

    def show(self, plan, experience, arrays, numbers):
        return Outputs({})


def test_observers_share_nothing_learn_nothing_and_are_a_repeat_each(tmp_path):
    bare = Bare()
    assert bare.plan(1) is None
    assert bare.select_shared(None) is None
    assert bare.gain_experience(tmp_path, repeats=2, jobs=1) is None
    assert bare.count_repeats(7) == 7
    assert bare.split() == [("", bare)]
    assert (bare.unit, bare.report, bare.tools_observed, bare.files_read) == ("observer", None, (), ())


def test_experiment_without_its_own_steps_is_none():
    class Unfinished(Experiment):
        pass

    with pytest.raises(TypeError, match="abstract"):
        Unfinished()
