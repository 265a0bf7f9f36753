"""Noise structures: n independent samples or one percept, and accelerations that are felt with errors."""

import numpy as np
import pytest
from helpers.density_quadrature import compare_moments, integrate
from helpers.seen_objects import TWO_MATERIALS, detect_parts
from scipy.stats import norm

from affordance.belief.density_belief import Prior
from affordance.plant.arm_model import ArmModel
from affordance.proprioception.estimator import compute_posterior, condition_on_torques
from affordance.proprioception.torque_noise import WeberNoise, WhiteNoise, draw_acceleration_error

PRIOR = Prior(mode=1000.0, sd=4000.0, deviation=0.06)
TRUE = np.array([700.0, 7800.0])
NUM_SAMPLES = 5


@pytest.fixture(scope="module")
def belief():
    return detect_parts(TWO_MATERIALS, PRIOR)


def draw_torques(hold, belief, noise, seed):
    """The samples that ``measure`` draws, one by one, (NUM_SAMPLES, 7)."""
    tau = hold.tau_arm + hold.Y @ belief.compute_parameters(TRUE)
    return np.array([tau + noise.draw_sample_error((*seed, k), tau) for k in range(NUM_SAMPLES)])


def compute_brute_force(hold, belief, noise, samples, axes):
    """Posterior on a grid, of samples one by one, each error with the size that the densities on the grid give it."""
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    predicted = hold.tau_arm + grid @ (hold.Y @ belief.geometry.Phi).T  # (G, 7)
    sd = np.hypot(noise.threshold, noise.weber_fraction * predicted)
    log_posterior = sum(norm.logpdf(sample, predicted, sd).sum(axis=1) for sample in samples)
    centred = grid - belief.densities.untruncated_mean
    log_posterior = log_posterior - 0.5 * np.einsum("gi,ij,gj->g", centred, belief.densities.precision, centred)
    weights = np.exp(log_posterior - log_posterior.max())
    weights /= weights.sum()
    mean = weights @ grid
    return mean, (grid - mean).T @ ((grid - mean) * weights[:, None])


@pytest.mark.parametrize(("weber_fraction", "rtol"), [(0.0, 1e-3), (0.07, 0.05)])
def test_independent_samples_give_exact_bayes(hold, belief, weber_fraction, rtol):
    """Posterior means agree with a grid to 0.01 SD for constant errors, to 0.5 SD for ones growing with torque."""
    noise = WeberNoise(weber_fraction, 0.097, independent_samples=True)
    statistics = hold.measure(belief, TRUE, noise, (3,), num_samples=NUM_SAMPLES)
    densities = compute_posterior(belief, statistics, 7, noise, PRIOR.deviation).posterior.densities
    sds = np.sqrt(np.diag(densities.covariance))
    axes = [mean + sd * np.linspace(-6.0, 6.0, 161) for mean, sd in zip(densities.untruncated_mean, sds, strict=True)]
    samples = draw_torques(hold, belief, noise, (3,))
    mean, covariance = compute_brute_force(hold, belief, noise, samples, axes)
    np.testing.assert_allclose(np.sqrt(np.diag(covariance)), sds, rtol=max(rtol, 2e-3))
    assert (np.abs(mean - densities.untruncated_mean) < (0.01 if weber_fraction == 0.0 else 0.5) * sds).all()
    # The samples taken for one percept give a wider posterior, so that the number of samples is in the result.
    one = WeberNoise(weber_fraction, 0.097)
    wide = compute_posterior(belief, statistics, 7, one, PRIOR.deviation).posterior.densities
    certain = [np.linalg.eigvalsh(found.precision)[-1] for found in (densities, wide)]
    assert certain[0] == pytest.approx(NUM_SAMPLES * certain[1], rel=0.2)


def test_mean_of_independent_samples_scatters_by_the_root_of_their_number(hold, belief):
    noise = WeberNoise(0.07, 0.097, independent_samples=True)
    tau = hold.tau_arm + hold.Y @ belief.compute_parameters(TRUE)
    means = np.array(
        [hold.measure(belief, TRUE, noise, (seed,), num_samples=NUM_SAMPLES).features[:7] for seed in range(1500)]
    )
    np.testing.assert_allclose(means.std(axis=0), noise.compute_sd(tau) / np.sqrt(NUM_SAMPLES), rtol=0.08)
    for lasting in noise.draw_trial_errors((7,), 7):
        assert not lasting.any()


def test_white_samples_give_exact_bayes(hold, belief):
    noise = WhiteNoise(0.7)
    statistics = hold.measure(belief, TRUE, noise, (4,), num_samples=NUM_SAMPLES)
    posterior, likelihood = condition_on_torques(belief, statistics, 7, noise, PRIOR.deviation)
    regressor = np.tile(hold.Y @ belief.geometry.Phi, (NUM_SAMPLES, 1)) / noise.sd
    residual = (draw_torques(hold, belief, noise, (4,)) - hold.tau_arm).ravel() / noise.sd
    np.testing.assert_allclose(likelihood.precision, regressor.T @ regressor, rtol=1e-10)
    np.testing.assert_allclose(likelihood.information_vector, regressor.T @ residual, rtol=1e-9)
    axes = [np.arange(10.0, 16_000.0, 20.0)] * 2
    expected = integrate(
        lambda rho: norm.logpdf(residual, rho @ regressor.T).sum(axis=1),
        axes,
        [PRIOR.mode] * 2,
        [PRIOR.sd] * 2,
        PRIOR.deviation,
    )
    compare_moments(posterior.densities, expected.own_mean, expected.own_covariance)


@pytest.mark.parametrize("noise", [WeberNoise(0.07, 0.097), WhiteNoise(0.7)])
def test_defaults_change_no_bit(hold, belief, noise):
    """Default settings give the single percept of a trial to the last bit, with no error of acceleration."""
    tau = hold.tau_arm + hold.Y @ belief.compute_parameters(TRUE)
    gain, offset = noise.draw_trial_errors((5,), 7)
    expected = noise.compute_features(tau * (1.0 + gain) + offset, hold.tau_arm, hold.Y)
    statistics = hold.measure(belief, TRUE, noise, (5,))
    np.testing.assert_array_equal(statistics.features, expected)
    assert statistics.num_samples == 1
    assert not WeberNoise(0.07, 0.097).independent_samples


def test_misfelt_accelerations_act_through_the_mass_matrices_of_arm_and_object(hold, belief, arm):
    """Errors of acceleration act through Drake's mass matrices of the arm alone and with the object in its hand."""
    noise, seed = WeberNoise(0.0, 0.1), (6,)
    error = draw_acceleration_error(0.3, seed, 7)
    assert error.std() > 0.05
    felt = hold.measure(belief, TRUE, noise, seed, acceleration_sd=0.3).features
    exact = hold.measure(belief, TRUE, noise, seed).features
    np.testing.assert_array_equal(felt[:7], exact[:7])  # torques are felt as they are
    model, pi = ArmModel(arm), belief.compute_parameters(TRUE)
    model.set_payload(np.zeros(10))
    model.set_posture(arm.home)
    alone = model.compute_mass_matrix()
    np.testing.assert_allclose(felt[7:14] - exact[7:14], alone @ error, atol=1e-12)
    model.set_payload(pi)
    model.set_posture(arm.home)
    of_object = model.compute_mass_matrix() - alone
    added = (felt[14:] - exact[14:]).reshape(7, 10) @ pi
    np.testing.assert_allclose(added, of_object @ error, atol=1e-10)
    np.testing.assert_array_equal(draw_acceleration_error(0.0, seed, 7), np.zeros(7))
