"""Experience of observers, by short holds."""

import dataclasses
import logging

import numpy as np
import pytest

from affordance.belief.learners import KINDS_DRAWN, KINDS_MAP
from affordance.belief.material_memory import MaterialMemory
from affordance.belief.memory_file import format_memory
from affordance.experiments.shared import experience
from affordance.experiments.shared.experience import (
    count_events,
    draw_order,
    gain_experience,
    hold,
    recall,
    tabulate_experience,
)
from affordance.experiments.shared.observers import Setup
from affordance.files.model_folder import MODELS
from affordance.objects.load import load_tools
from affordance.proprioception.faults import Faults
from affordance.proprioception.torque_noise import WeberNoise
from affordance.runs.random_streams import Stream
from affordance.settings import DEFAULT_SETTINGS
from affordance.simulation.trial import TrialRunner

FIRST, SECOND, _ = load_tools(MODELS / "tools" / "com.yaml")
TOOLS = (FIRST, SECOND)
BEECH, STEEL = (part.material.colour for part in FIRST.components[1:])


@pytest.fixture(autouse=True)
def _short(monkeypatch):
    monkeypatch.setattr(experience, "DURATION", 0.2)
    monkeypatch.setattr(experience, "REPETITIONS", 2)


@pytest.fixture
def setup(tmp_path):
    return Setup(observers=2, seed=3, out=tmp_path)


def test_blocks_hold_every_object_once_in_random_order():
    orders = [draw_order(Setup(), 2, observer) for observer in range(40)]
    assert all(sorted(order[k : k + 2]) == [0, 1] for order in orders for k in (0, 2))
    assert len({tuple(order) for order in orders}) == 4  # all the orders there are
    assert orders[3] == draw_order(Setup(), 2, 3)


def test_observers_of_another_seed_hold_the_objects_in_another_order():
    """Fewer than 20 of 40 pairs of orders agree for two seeds; ten would by chance, of four orders."""
    orders = [[draw_order(Setup(seed=seed), 2, observer) for observer in range(40)] for seed in (0, 1)]
    assert sum(one == other for one, other in zip(*orders, strict=True)) < 20


def test_memory_is_carried_from_trial_to_trial(setup):
    """Memories equal those of a loop written out in the test, to the last bit."""
    gained = gain_experience(setup, TOOLS)
    runner = TrialRunner(DEFAULT_SETTINGS)
    memory = MaterialMemory().add_colours([BEECH, STEEL], DEFAULT_SETTINGS.prior)
    assert gained.object.values[1].tolist() == draw_order(setup, 2, 1) != draw_order(setup, 2, 0)
    for trial in range(4):
        known = recall(setup, gained, 1, trial)
        assert known.colours == (BEECH, STEEL)
        np.testing.assert_array_equal(known.belief.precision, memory.belief.precision)
        np.testing.assert_array_equal(known.belief.information_vector, memory.belief.information_vector)
        tool = TOOLS[int(gained.object[1, trial])]
        record = runner.run_hold(tool, memory, duration=0.2, seed=(3, 1, trial))
        assert float(gained.log_evidence[1, trial]) == record.log_evidence
        assert float(gained.p_value[1, trial]) == record.p_value
        memory = record.memory
    np.testing.assert_array_equal(recall(setup, gained, 1, 4).belief.precision, memory.belief.precision)


def test_experience_narrows_the_belief_about_both_materials(setup):
    gained = gain_experience(setup, TOOLS)
    determinants = [np.linalg.det(recall(setup, gained, 0, trial).belief.precision) for trial in range(5)]
    assert (np.diff(determinants) > 0.0).all()


@pytest.mark.parametrize("learner", [KINDS_MAP, KINDS_DRAWN])
def test_memory_of_a_learner_with_kinds_is_kept_whole(setup, learner):
    setup = setup.change(learner=learner)
    _, memories, _ = hold(setup, TOOLS, 1)
    gained = gain_experience(setup, TOOLS)
    for trial, memory in enumerate(memories):
        assert format_memory(recall(setup, gained, 1, trial)) == format_memory(memory)
    assert len(memories[-1].things) == 2
    assert memories[-1].seed == (3, 1, Stream.KINDS)


def test_every_trial_of_every_observer_of_every_seed_has_an_error_of_its_own(tmp_path):
    """Felt densities, ratios of increments of shift and precision, differ in all trials of all observers and seeds.

    The object weighs what the prior says, so that nothing moves, and is as dense as its material.
    """
    rod = dataclasses.replace(SECOND, components=SECOND.components[:1]).with_densities({STEEL: 1000.0})
    noise = WeberNoise(weber_fraction=0.0, threshold=1e-3)
    felt = []
    for seed in (0, 1):
        exact = dataclasses.replace(DEFAULT_SETTINGS.prior, deviation=0.0)
        setup = Setup(observers=2, seed=seed, out=tmp_path).change(noise=noise, prior=exact)
        gained = gain_experience(setup, (rod,))
        for observer in range(2):
            beliefs = [recall(setup, gained, observer, trial).belief for trial in range(3)]
            shifts = np.diff([belief.information_vector[0] for belief in beliefs])
            felt.append(shifts / np.diff([belief.precision[0, 0] for belief in beliefs]))
    errors = np.sort(np.ravel(felt)) - 1000.0
    assert len(errors) == 8
    assert np.diff(errors).min() > 0.01 * errors.std()


def test_experience_is_made_once_and_shared(setup):
    gained = gain_experience(setup, TOOLS)
    before = {path: path.stat().st_mtime_ns for path in setup.out.rglob("*.npz")}
    assert len(before) == 2
    assert gain_experience(setup, TOOLS).identical(gained)
    assert {path: path.stat().st_mtime_ns for path in setup.out.rglob("*.npz")} == before


def test_what_was_rejected_is_counted_and_warned_of(setup, caplog):
    caplog.set_level(logging.WARNING)
    gained = gain_experience(setup.change(faults=Faults(drop_probability=1.0)), TOOLS)
    assert count_events(gained) == {"samples_rejected": 2 * 4 * 2, "trials_outlier": 0}
    assert "experience: 16 samples were rejected, and 0 of 8 trials are 5-sigma outliers" in caplog.text
    caplog.clear()
    gain_experience(setup, TOOLS)
    assert not caplog.messages


def test_rows_are_the_holds(setup):
    gained = gain_experience(setup, TOOLS)
    rows = tabulate_experience(gained, TOOLS, "density")
    assert rows["block"].tolist() == ["learning"] * 8
    assert rows["cycle"].tolist() == [1, 1, 2, 2] * 2
    assert rows["object"].tolist() == [TOOLS[index].name for index in gained.object.values.ravel()]
