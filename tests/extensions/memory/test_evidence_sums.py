"""Sums of evidence, against inference from all unknowns at once, and against frequencies."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from helpers.refusals import refuse
from helpers.summed_trials import sum_trials
from helpers.trials import BRASS, PLAIN, STEEL, TAU_ARM, WOOD, build_geometry, get_regressor, hold

from affordance.belief.density_belief import EMPTY_BELIEF, Prior
from affordance.extensions.memory import evidence_sums
from affordance.extensions.memory.evidence_sums import find_material, measure_bodies
from affordance.extensions.memory.trial_evidence import BODY
from affordance.objects.appearance import PartAppearance
from affordance.proprioception.fixed_point import find_fixed_point
from affordance.proprioception.torque_noise import WeberNoise, WhiteNoise

# Hardly restricted, so that the reference need not restrict it.
PRIOR = Prior(mode=1000.0, sd=4000.0, deviation=0.06)


def _infer_all(objects):
    """Infers the means of wood and steel from all unknowns at once: two means, and each object's deviations.

    An object's deviations are relative to the densities that fit its own trials, and hardly a common density, best.
    """
    unknowns = 2 + sum(len(of) for of, _ in objects)
    sds = []
    for materials, trials in objects:
        A = get_regressor() @ build_geometry(len(materials)).Phi / PLAIN.threshold
        rows = np.vstack([A] * len(trials))
        torques = np.concatenate([each.features[:7] - TAU_ARM for each in trials]) / PLAIN.threshold
        alike = rows.sum(axis=1)
        common = alike @ torques / (alike @ alike)
        rms = np.sqrt(common**2 + 1.0 / (alike @ alike))
        rows = np.vstack([rows, np.eye(len(materials)) / rms])
        torques = np.append(torques, np.full(len(materials), common / rms))
        sds += list(PRIOR.deviation * np.linalg.lstsq(rows, torques)[0])
    precision = np.diag([PRIOR.sd**-2.0] * 2 + [sd**-2.0 for sd in sds])
    information = np.zeros(unknowns)
    information[:2] = PRIOR.mode / PRIOR.sd**2
    begin = 2
    for materials, trials in objects:
        selection = np.zeros((len(materials), unknowns))
        selection[np.arange(len(materials)), materials] = 1.0
        selection[np.arange(len(materials)), begin + np.arange(len(materials))] = 1.0
        begin += len(materials)
        A = get_regressor() @ build_geometry(len(materials)).Phi @ selection / PLAIN.threshold
        for trial in trials:
            precision += A.T @ A
            information += A.T @ (trial.features[:7] - TAU_ARM) / PLAIN.threshold
    covariance = np.linalg.inv(precision)
    return (covariance @ information)[:2], covariance[:2, :2]


def test_sums_are_inference_from_all_unknowns_at_once():
    bar = [hold("bar", (WOOD,), (600.0,), seed) for seed in range(4)]
    hammer = [hold("hammer", (WOOD, STEEL), (750.0, 7700.0), seed) for seed in range(4, 7)]
    belief = sum_trials([*bar, *hammer], PRIOR).build_belief()
    mean, covariance = _infer_all([((0,), bar), ((0, 1), hammer)])
    np.testing.assert_allclose(belief.untruncated_mean, mean, rtol=1e-9)
    np.testing.assert_allclose(belief.covariance, covariance, rtol=1e-9)


@pytest.mark.parametrize("model", [PLAIN, WeberNoise(), WhiteNoise(sd=0.3)])
def test_repeated_holds_tell_little_more_about_a_material(model):
    noise = []  # variance that noise gives the object's own density: without the prior and the deviation
    for count in (1, 16, 256):
        trials = [hold("bar", (WOOD,), (600.0,), seed, model=model) for seed in range(count)]
        sums = sum_trials(trials, PRIOR)
        (own,) = sums.things["bar"].evidence.compute_own_likelihood(PRIOR).estimate_densities()
        variance = sums.build_belief().covariance[0, 0]
        noise.append(1.0 / (1.0 / variance - PRIOR.sd**-2) - (PRIOR.deviation * own) ** 2)
    assert noise[0] / noise[1] == pytest.approx(16.0, rel=0.3)
    assert noise[1] / noise[2] == pytest.approx(16.0, rel=0.3)
    others = [hold(f"bar {i}", (WOOD,), (600.0,), i, model=model) for i in range(256)]
    of_many = np.sqrt(sum_trials(others, PRIOR).build_belief().covariance[0, 0])
    assert of_many == pytest.approx(np.sqrt((noise[0] + (PRIOR.deviation * 600.0) ** 2) / 256.0), rel=0.1)


def test_a_size_that_is_seen_wrongly_does_not_average_out():
    """A size that errs by a tenth leaves an SD of 9 % of the density or more, after one hold as after 64."""
    for count in (1, 64):
        trials = [hold("bar", (BRASS,), (8500.0,), seed, num_errors=1) for seed in range(count)]
        belief = sum_trials(trials, PRIOR).build_belief()
        assert np.sqrt(belief.covariance[0, 0]) > 0.09 * 8500.0


def test_beliefs_after_repeated_holds_are_as_wide_as_their_errors():
    """Errors of the mean over their stated SDs have a root mean square of 1, after one hold and after eight."""
    rng = np.random.default_rng(5)
    for count in (1, 8):
        errors = []
        for observer in range(150):
            rho = 2000.0 * (1.0 + PRIOR.deviation * rng.standard_normal())
            seeds = range(8 * observer, 8 * observer + count)
            trials = [hold("bar", (WOOD,), (rho,), seed, model=WeberNoise()) for seed in seeds]
            belief = sum_trials(trials, PRIOR).build_belief()
            errors.append((belief.untruncated_mean[0] - 2000.0) / np.sqrt(belief.covariance[0, 0]))
        assert 0.85 < np.sqrt(np.mean(np.square(errors))) < 1.2  # 1 +- .06 by chance


def test_body_of_a_trial_does_not_depend_on_others():
    trial = hold("hammer", (WOOD, STEEL), (650.0, 7700.0), 3, model=WeberNoise())
    other = hold("bar", (STEEL, WOOD), (7700.0, 600.0), 4, model=WeberNoise())
    (found,) = measure_bodies([trial], [(0, 1)], PRIOR)
    assert np.linalg.matrix_rank(found.precision) == 7
    assert np.array_equal(found.precision, measure_bodies([other, trial], [(0, 1), (4, 9)], PRIOR)[1].precision)


@pytest.mark.parametrize("model", [WeberNoise(), WeberNoise(independent_samples=True)])
@pytest.mark.parametrize("num_errors", [0, 3])
def test_trials_together_give_what_each_gives_alone(model, num_errors):
    """Of each, errors are evaluated where the trial's own fixed point is."""
    trials = [hold("hammer", (WOOD, STEEL), (650.0, 7700.0), i, model=model, num_errors=num_errors) for i in range(9)]
    trials = [replace(trial, num_samples=1 + i) for i, trial in enumerate(trials)]
    broad = EMPTY_BELIEF.extend(PRIOR, 2).add_object_variation(PRIOR.deviation)
    for trial, found in zip(trials, measure_bodies(trials, [(0, 1)] * 9, PRIOR), strict=True):
        likelihood = find_fixed_point(broad, partial(trial.compute_likelihood, trial.geometry))
        rho = broad.condition(likelihood).untruncated_mean
        wanted = trial.compute_likelihood(BODY, trial.geometry.Phi @ rho)
        np.testing.assert_allclose(found.precision, wanted.precision, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(found.information, wanted.information_vector, rtol=1e-9)


def test_materials_are_found_by_colour():
    exact = PartAppearance(WOOD, (0.1,), (0.0, 0.0, 0.0))
    assert find_material(exact, (STEEL, WOOD)) == 1
    assert find_material(exact, (STEEL, BRASS)) is None
    measured = exact._replace(colour=(0.71, 0.5, 0.29), colour_sd=2.0)
    assert find_material(measured, (STEEL, WOOD)) == 1
    assert find_material(measured._replace(colour=(0.1, 0.2, 0.9)), (STEEL, WOOD)) is None


def test_things_have_names_of_their_own():
    """Also if an object is called as another one's second look would be."""
    seen = {"one": (WOOD,), "two": (STEEL,), "three": (BRASS,)}
    trials = [
        hold(name, seen[look], (900.0,), i)
        for i, (name, look) in enumerate(
            [
                ("bar", "one"),
                ("bar #2", "one"),
                ("bar", "two"),
                ("bar #2", "three"),
                ("bar #2", "one"),
                ("bar", "two"),
            ]
        )
    ]
    things = sum_trials(trials, PRIOR).things
    assert {name: (thing.trials, thing.parts[0].colour) for name, thing in things.items()} == {
        "bar": (1, WOOD),
        "bar #2": (2, WOOD),
        "bar #3": (2, STEEL),
        "bar #2 #2": (1, BRASS),
    }


def test_materials_and_looks_are_bounded(monkeypatch):
    """Each object has a colour of its own, and those of one name."""
    monkeypatch.setattr(evidence_sums, "MOST_MATERIALS", 5)
    monkeypatch.setattr(evidence_sums, "MOST_LOOKS", 3)
    colours = [(0.1 * i, 0.5, 0.5) for i in range(6)]
    trials = [hold(f"bar {i}", (colour,), (900.0,), i) for i, colour in enumerate(colours)]
    assert len(sum_trials(trials[:5], PRIOR).colours) == 5
    assert refuse(sum_trials, trials, PRIOR) == "colours: are of 6 materials, must be of at most 5"
    same = [hold("bar", (colour,), (900.0,), i) for i, colour in enumerate(colours)]
    assert list(sum_trials(same[:3], PRIOR).things) == ["bar", "bar #2", "bar #3"]
    assert "object: is 'bar', the name of 3 different objects already, must be another name" in refuse(
        sum_trials, same, PRIOR
    )
