"""Experience of observers, by short holds."""

import dataclasses

import numpy as np
import pytest

from affordance.belief.learner import Learner
from affordance.belief.material_memory import MaterialMemory
from affordance.belief.memory_file import format_memory
from affordance.experiments.protocol_runs import load_hold_experiment
from affordance.experiments.shared.experience import Experience, ExperienceConfig, draw_order
from affordance.experiments.shared.gain_experience import gain_experience, run_trials
from affordance.experiments.shared.recall import recall
from affordance.proprioception.torque_noise import WeberNoise
from affordance.runs.random_streams import Stream
from affordance.settings import DEFAULT_SETTINGS
from affordance.simulation.trial import TrialRunner

FIRST, SECOND, _ = load_hold_experiment("com").tools
BEECH, STEEL = (part.material.colour for part in FIRST.components[1:])


@pytest.mark.parametrize("num_trials", [3, 0, -2])
def test_number_of_trials_must_be_a_multiple_of_that_of_the_objects(num_trials):
    with pytest.raises(ValueError, match=rf"^num_trials is {num_trials}, must be a positive multiple of 2$"):
        ExperienceConfig((FIRST, SECOND), num_trials=num_trials)


def test_looks_are_listed_once_in_the_order_of_the_components():
    wooden = dataclasses.replace(FIRST, components=FIRST.components[:2])
    assert ExperienceConfig((wooden,)).colours == (BEECH,)
    assert ExperienceConfig((wooden, SECOND)).colours == (BEECH, STEEL)
    assert ExperienceConfig((SECOND, wooden)).colours == (STEEL, BEECH)


def test_observers_of_another_seed_hold_the_objects_in_another_order():
    """Fewer than 20 of 40 pairs of orders agree for two seeds; five would by chance, of eight orders."""
    configs = [ExperienceConfig((FIRST, SECOND), seed=seed) for seed in (0, 1)]
    orders = [[draw_order(config, repeat) for repeat in range(40)] for config in configs]
    assert sum(one == other for one, other in zip(*orders, strict=True)) < 20


def test_memory_is_carried_from_trial_to_trial():
    """Memories equal those of a loop written out in the test, to the last bit."""
    config = ExperienceConfig((FIRST, SECOND), seed=3, duration=0.2, num_trials=4)
    gained = gain_experience(config, 1)
    runner, memory = (
        TrialRunner(DEFAULT_SETTINGS),
        MaterialMemory().add_colours([BEECH, STEEL], DEFAULT_SETTINGS.prior),
    )
    for trial in range(4):
        np.testing.assert_array_equal(gained["precision"][trial], memory.belief.precision)
        np.testing.assert_array_equal(gained["information_vector"][trial], memory.belief.information_vector)
        tool = (FIRST, SECOND)[gained["order"][trial]]
        record = runner.run_hold(tool, memory, duration=0.2, seed=(3, 1, trial))
        assert gained["log_evidence"][trial] == record.log_evidence
        memory = record.memory
    np.testing.assert_array_equal(gained["precision"][4], memory.belief.precision)
    np.testing.assert_array_equal(gained["information_vector"][4], memory.belief.information_vector)
    assert gained["order"].tolist() == draw_order(config, 1) != draw_order(config, 0)


@pytest.mark.parametrize("learner", [Learner.KINDS_MAP, Learner.KINDS_DRAWN])
def test_memory_of_a_learner_with_kinds_is_kept_whole(learner):
    settings = dataclasses.replace(DEFAULT_SETTINGS, learner=learner)
    config = ExperienceConfig((FIRST, SECOND), 3, settings, duration=0.2, num_trials=4)
    memories, _ = run_trials(config, 1)
    gained = {name: array[None] for name, array in gain_experience(config, 1).items()}
    experience = Experience(
        config.colours,
        *(gained[name] for name in ("precision", "information_vector", "order")),
        memories=gained["memories"],
    )
    for trial, memory in enumerate(memories):
        assert format_memory(recall(experience, 0, trial)) == format_memory(memory)
    assert len(memories[-1].kinds.objects) == 2
    assert memories[-1].settings.seed == (3, 1, Stream.KINDS)


def test_every_trial_of_every_observer_of_every_seed_has_an_error_of_its_own():
    """Felt densities, ratios of increments of shift and precision, differ in all trials of all observers and seeds.

    The object weighs what the prior says, so that nothing moves, and is as dense as its material.
    """
    rod = dataclasses.replace(SECOND, components=SECOND.components[:1]).with_densities({STEEL: 1000.0})
    exact = dataclasses.replace(DEFAULT_SETTINGS.prior, deviation_sd=0.0)
    noise = WeberNoise(weber_fraction=0.0, threshold=1e-3)
    settings = dataclasses.replace(DEFAULT_SETTINGS, noise=noise, prior=exact)
    felt = []
    for seed in (0, 1):
        config = ExperienceConfig((rod,), seed, settings, duration=0.2, num_trials=3)
        for repeat in range(2):
            gained = gain_experience(config, repeat)
            felt.append(np.diff(gained["information_vector"][:, 0]) / np.diff(gained["precision"][:, 0, 0]))
    errors = np.sort(np.ravel(felt)) - 1000.0
    assert np.diff(errors).min() > 0.01 * errors.std()


def test_memory_recalled_is_that_of_the_observer_after_the_trials():
    number = np.arange(1.0, 7.0).reshape(2, 3)
    precision, shift = number[..., None, None] * np.eye(2), number[..., None] * [10.0, 20.0]
    experience = Experience((STEEL, BEECH), precision, shift, np.zeros((2, 2), dtype=np.intp))
    assert (experience.num_repeats, experience.num_trials) == (2, 2)
    for repeat, num_trials in np.ndindex(2, 3):
        memory = recall(experience, repeat, num_trials)
        expected = 1.0 + 3 * repeat + num_trials
        assert memory.colours == (STEEL, BEECH)
        np.testing.assert_array_equal(memory.belief.precision, expected * np.eye(2))
        np.testing.assert_array_equal(memory.belief.information_vector, [10.0 * expected, 20.0 * expected])
