import dataclasses

import numpy as np
import pytest
from helpers.seen_objects import BLUE, RED, TWO_MATERIALS, detect_parts, place
from scipy.stats import norm

from affordance.belief.density_belief import Prior
from affordance.belief.holds import compute_log_likelihood
from affordance.belief.normals import Normals
from affordance.objects.inertia import Ellipsoid, build_inertia_map
from affordance.objects.materials import Material
from affordance.objects.tool import Component, Tool
from affordance.plant.arm_model import compute_payload_regressor
from affordance.proprioception.torque_noise import WeberNoise, WhiteNoise
from affordance.vision.eye import measure_features
from affordance.vision.features import VisionError

PRIOR = Prior(mode=1000.0, sd=4000.0, deviation=0.06)


def test_percept_scatters_as_weber_and_threshold_say():
    noise = WeberNoise(weber_fraction=0.07, threshold=0.1)
    tau = np.array([0.0, 20.0, -1.0, 5.0, 0.5, -2.0, 0.1])
    drawn = []
    for seed in range(20_000):
        gain, offset = noise.draw_trial_errors((seed,), 7)
        drawn.append(tau * (1 + gain) + offset)
    errors = (np.array(drawn) - tau) / np.sqrt(0.1**2 + (0.07 * tau) ** 2)
    # Means and correlations are zero to four and a half standard errors.
    np.testing.assert_allclose(errors.mean(axis=0), 0.0, atol=4.5 / np.sqrt(20_000))
    np.testing.assert_allclose(errors.std(axis=0), 1.0, rtol=0.02)
    np.testing.assert_allclose(np.corrcoef(errors.T), np.eye(7), atol=4.5 / np.sqrt(20_000))
    assert noise.draw_sample_error((0,), np.zeros(3)) is None


def test_white_noise_is_new_in_every_sample_and_the_same_for_the_same_seed():
    noise = WhiteNoise(sd=0.3)
    errors = np.array([noise.draw_sample_error((7, k), np.zeros(7)) for k in range(5000)])
    np.testing.assert_allclose(errors.std(axis=0), 0.3, rtol=0.05)
    np.testing.assert_array_equal(errors[3], noise.draw_sample_error((7, 3), np.zeros(7)))
    for lasting in noise.draw_trial_errors((7,), 7):
        assert not lasting.any()


def evaluate(felt, rho):
    """The exact log likelihood of one hold at densities."""
    return compute_log_likelihood(felt.hold, rho[None, None, None]).value.item()


def test_weber_likelihood_is_that_of_a_normal_percept(rng, hold):
    noise = WeberNoise(weber_fraction=0.07, threshold=0.1)
    belief = detect_parts(TWO_MATERIALS, PRIOR)
    tau = hold.tau_arm + rng.normal(size=7)
    felt = noise.describe(noise.compute_features(tau, hold.tau_arm, hold.Y), 5, 7, belief.geometry)
    for _ in range(5):
        rho = rng.uniform(100, 9000, 2)
        predicted = hold.tau_arm + hold.Y @ belief.geometry.Phi @ rho
        expected = norm.logpdf(tau, predicted, np.hypot(0.1, 0.07 * predicted)).sum()
        assert evaluate(felt, rho) == pytest.approx(expected, abs=1e-9)


def test_white_likelihood_is_the_product_over_samples(rng):
    noise = WhiteNoise(sd=0.2)
    belief = detect_parts(TWO_MATERIALS, PRIOR)
    samples = [(rng.normal(size=7), rng.normal(size=7), rng.normal(size=(7, 10))) for _ in range(6)]
    features = np.mean([noise.compute_features(*sample) for sample in samples], axis=0)
    normals = Normals(np.zeros((1, 2)), 1e6 * np.eye(2)[None])
    likelihood = noise.describe(features, 6, 7, belief.geometry).find_likelihood(normals).take(0)
    rho = np.array([700.0, 7800.0])
    expected = 0.0
    for tau, tau_arm, Y in samples:
        residual = tau - tau_arm - Y @ belief.geometry.Phi @ rho
        expected += -0.5 * (residual**2).sum() / 0.2**2 - 3.5 * np.log(2 * np.pi * 0.2**2)
    actual = -0.5 * rho @ likelihood.precision @ rho + likelihood.information_vector @ rho + likelihood.log_constant
    assert actual == pytest.approx(expected, rel=1e-12)
    assert len(features) == noise.num_features(7)


def recover_covariance(noise, geometry, rho, Y, tau_arm):
    """The covariance of the felt torque that a likelihood stands for, by second differences of it in that torque."""
    n = len(tau_arm)

    def compute_log_constant(residual):
        features = noise.compute_features(tau_arm + residual, tau_arm, Y)
        return evaluate(noise.describe(features, 1, n, geometry), rho)

    unit = np.eye(n)
    at = {(i, j): compute_log_constant(unit[i] + unit[j]) for i in range(n) for j in range(i + 1)}
    alone = [compute_log_constant(unit[i]) for i in range(n)]
    zero = compute_log_constant(np.zeros(n))
    precision = [[alone[i] + alone[j] - zero - at[max(i, j), min(i, j)] for j in range(n)] for i in range(n)]
    return np.linalg.inv(precision)


@pytest.mark.parametrize(
    "error",
    [VisionError(size=0.02), VisionError(position=0.002), VisionError(rotation=0.03), VisionError(0.01, 0.001, 0.02)],
)
def test_uncertain_geometry_scatters_the_percept_as_looking_again_does(model, rng, error):
    """The likelihood's covariance agrees with that of torques of 4000 measurements of one tool by the eye."""
    wood, steel = Material("wood", RED, 700.0, 0.0, "test"), Material("steel", BLUE, 7800.0, 0.0, "test")
    tilted = place(0.16)
    tilted[:3, :3] = [[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]]
    handle = Component(Ellipsoid((0.05, 0.025, 0.02)), place(0.05), wood, wood)
    tool = Tool("tool", (handle, Component(Ellipsoid((0.06, 0.02, 0.03)), tilted, steel, steel)))
    rho = np.array([700.0, 7800.0])
    q, v, vdot = rng.normal(size=(3, 7))
    Y, tau_arm = compute_payload_regressor(model, np.concatenate([q, v]), vdot), rng.normal(size=7)
    noise = WeberNoise(weber_fraction=0.07, threshold=0.1)

    measured = [measure_features(tool, error, rng) for _ in range(4000)]
    torques = [
        Y @ build_inertia_map([part.shape for part in parts], [part.X_TE for part in parts], (0, 1), 2) @ rho
        for parts in measured
    ]
    expected = np.cov(np.transpose(torques))
    true = [
        dataclasses.replace(part, size_sd=error.size, position_sd=error.position, rotation_sd=error.rotation)
        for part in measure_features(tool, VisionError(), rng)
    ]
    geometry = detect_parts(true, PRIOR).geometry
    felt = 0.1**2 + (0.07 * (tau_arm + Y @ tool.parameters)) ** 2
    actual = recover_covariance(noise, geometry, rho, Y, tau_arm) - np.diag(felt)

    # Five standard errors of a sample covariance; what is left out is of second order in the eye's error.
    variances = np.diag(expected)
    standard_error = np.sqrt((np.outer(variances, variances) + expected**2) / len(measured))
    assert (np.abs(actual - expected) < 5 * standard_error).all()


@pytest.mark.parametrize("num_samples", [1, 4, 30])
def test_every_independent_sample_counts(num_samples, hold):
    """The mean of n independent samples has an nth of the variance."""
    belief = detect_parts(TWO_MATERIALS, PRIOR)
    statistics = hold.measure(belief, np.array([700.0, 7800.0]), WeberNoise(0.07, 0.1), (1,))
    rho = np.array([800.0, 7000.0])
    predicted = hold.tau_arm + hold.Y @ belief.geometry.Phi @ rho
    for is_independent, count in ((False, 1), (True, num_samples)):
        noise = WeberNoise(0.07, 0.1, independent_samples=is_independent)
        felt = noise.describe(statistics.features, num_samples, 7, belief.geometry)
        sd = np.hypot(0.1, 0.07 * predicted) / np.sqrt(count)
        expected = norm.logpdf(statistics.features[:7], predicted, sd).sum()
        # The densities that a mean of samples tells of, up to a constant of the mean alone.
        other = 1.1 * rho
        predicted_other = hold.tau_arm + hold.Y @ belief.geometry.Phi @ other
        sd_other = np.hypot(0.1, 0.07 * predicted_other) / np.sqrt(count)
        expected -= norm.logpdf(statistics.features[:7], predicted_other, sd_other).sum()
        assert evaluate(felt, rho) - evaluate(felt, other) == pytest.approx(expected, rel=1e-9)
