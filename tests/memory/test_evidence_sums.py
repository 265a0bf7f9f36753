"""Sums of evidence, against inference from all unknowns at once, and against frequencies."""

import numpy as np
import pytest
from helpers.trials import BRASS, PLAIN, STEEL, TAU_ARM, WOOD, build_geometry, get_regressor, hold, hold_workshop

from affordance.belief.density_belief import Prior
from affordance.memory.evidence_sums import MaterialSum, ObjectSum, find_material, measure_body, sum_objects
from affordance.objects.appearance import PartAppearance
from affordance.proprioception.torque_noise import WeberNoise, WhiteNoise

# Hardly restricted, so that the reference need not restrict it.
PRIOR = Prior(mode=1000.0, sd=4000.0, deviation_sd=100.0)


def _infer_all(objects):
    """Infers the means of wood and steel from all unknowns at once: two means, and each object's deviations."""
    unknowns = 2 + sum(len(of) for of, _ in objects)
    precision = np.diag([PRIOR.sd**-2.0] * 2 + [PRIOR.deviation_sd**-2.0] * (unknowns - 2))
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
    belief = sum_objects([bar, hammer], PRIOR).build_belief()
    mean, covariance = _infer_all([((0,), bar), ((0, 1), hammer)])
    np.testing.assert_allclose(belief.untruncated_mean, mean, rtol=1e-9)
    np.testing.assert_allclose(belief.covariance, covariance, rtol=1e-9)


@pytest.mark.parametrize("model", [PLAIN, WeberNoise(), WhiteNoise(sd=0.3)])
def test_repeated_holds_tell_little_more_about_a_material(model):
    sds = []
    for count in (1, 16, 256):
        trials = [hold("bar", (WOOD,), (600.0,), seed, model=model) for seed in range(count)]
        sds.append(float(np.sqrt(sum_objects([trials], PRIOR).build_belief().covariance[0, 0])))
    # The variance that noise gives the object's own density: without the prior and the deviation.
    noise = 1.0 / (np.array(sds) ** -2 - PRIOR.sd**-2) - PRIOR.deviation_sd**2
    assert noise[0] / noise[1] == pytest.approx(16.0, rel=0.3)
    assert noise[1] / noise[2] == pytest.approx(16.0, rel=0.3)
    others = [[hold(f"bar {i}", (WOOD,), (600.0,), i, model=model)] for i in range(256)]
    assert np.sqrt(sum_objects(others, PRIOR).build_belief().covariance[0, 0]) < 0.3 * PRIOR.deviation_sd


def test_a_size_that_is_seen_wrongly_does_not_average_out():
    """A size that errs by a tenth leaves an SD of 9 % of the density or more, after one hold as after 64."""
    for count in (1, 64):
        trials = [hold("bar", (BRASS,), (8500.0,), seed, num_errors=1) for seed in range(count)]
        belief = sum_objects([trials], PRIOR).build_belief()
        assert np.sqrt(belief.covariance[0, 0]) > 0.09 * 8500.0


def test_beliefs_after_repeated_holds_are_as_wide_as_their_errors():
    """Errors of the mean over their stated SDs have a root mean square of 1, after one hold and after eight."""
    rng = np.random.default_rng(5)
    for count in (1, 8):
        errors = []
        for observer in range(150):
            rho = 2000.0 + PRIOR.deviation_sd * rng.standard_normal()
            seeds = range(8 * observer, 8 * observer + count)
            trials = [hold("bar", (WOOD,), (rho,), seed, model=WeberNoise()) for seed in seeds]
            belief = sum_objects([trials], PRIOR).build_belief()
            errors.append((belief.untruncated_mean[0] - 2000.0) / np.sqrt(belief.covariance[0, 0]))
        assert 0.85 < np.sqrt(np.mean(np.square(errors))) < 1.2  # 1 +- .06 by chance


def test_removing_an_object_leaves_the_sum_without_it():
    trials = hold_workshop(9)
    total = MaterialSum(PRIOR)
    sums = []
    for thing in range(3):
        of_object = ObjectSum.start(trials[thing], total.recognise(trials[thing].parts))
        for trial in trials[thing::3]:
            of_object = of_object.add(trial, PRIOR)
        sums.append(of_object)
        total.add(of_object)
    total.add(sums[2], -1.0)
    without = sum_objects([trials[0::3], trials[1::3]], PRIOR)
    np.testing.assert_allclose(total.precision, without.precision, rtol=1e-9, atol=1e-18)
    np.testing.assert_allclose(total.information, without.information, rtol=1e-9)


def test_body_of_a_trial_does_not_depend_on_others():
    trial = hold("hammer", (WOOD, STEEL), (650.0, 7700.0), 3, model=WeberNoise())
    found = measure_body(trial, (0, 1), PRIOR)
    assert np.linalg.matrix_rank(found.precision) == 7
    assert np.array_equal(found.precision, measure_body(trial, (4, 9), PRIOR).precision)


def test_materials_are_found_by_colour():
    exact = PartAppearance(WOOD, (0.1,), (0.0, 0.0, 0.0))
    assert find_material(exact, (STEEL, WOOD)) == 1
    assert find_material(exact, (STEEL, BRASS)) is None
    measured = exact._replace(colour=(0.71, 0.5, 0.29), colour_sd=2.0)
    assert find_material(measured, (STEEL, WOOD)) == 1
    assert find_material(measured._replace(colour=(0.1, 0.2, 0.9)), (STEEL, WOOD)) is None
