import numpy as np
import pytest
from helpers.seen_objects import ONE_MATERIAL, TWO_MATERIALS, detect_parts
from scipy.special import logsumexp
from scipy.stats import multivariate_normal, norm, truncnorm

from affordance.belief.density_belief import DensityBelief, Prior
from affordance.belief.likelihood import Likelihood
from affordance.belief.material_memory import MaterialMemory
from affordance.plant.arm_model import ArmModel
from affordance.proprioception.estimator import TorqueStatistics, compute_posterior
from affordance.proprioception.torque_noise import WeberNoise, WhiteNoise

PRIOR = Prior(mode=1000.0, sd=4000.0, deviation=0.06)
FIXED = WeberNoise(weber_fraction=0.0, threshold=0.3)  # a percept of errors that do not depend on torque
FRACTIONS = (0.05, 0.25, 0.5, 0.75, 0.95)


def learn(belief, statistics, noise, num_joints=7, deviation=PRIOR.deviation):
    return compute_posterior(belief, statistics, num_joints, noise, deviation)


def test_recursive_estimator_equals_the_batch_posterior_over_samples(chain, arm, rng):
    """Recursion over 300 samples of white noise agrees to 1e-9 with one least-squares problem and a Kalman filter."""
    noise = WhiteNoise(sd=0.5)
    belief = detect_parts(TWO_MATERIALS, PRIOR)
    q, v, vdot = rng.normal(size=(3, 300, 7))
    Y = chain.compute_payload_regressors(q, v, vdot)
    model = ArmModel(arm)
    A = Y @ belief.geometry.Phi
    true = np.array([720.0, 7850.0])
    residuals = A @ true + 0.5 * rng.standard_normal((300, 7))
    statistics = TorqueStatistics(np.zeros(noise.num_features(7)), 0)
    mean, covariance = belief.densities.untruncated_mean, belief.densities.covariance
    for k in range(300):
        model.set_state(np.concatenate([q[k], v[k]]))
        tau_arm = model.compute_inverse_dynamics(vdot[k])
        statistics = statistics.add(noise.compute_features(tau_arm + residuals[k], tau_arm, Y[k]))
        gain = covariance @ A[k].T @ np.linalg.inv(A[k] @ covariance @ A[k].T + 0.25 * np.eye(7))
        mean = mean + gain @ (residuals[k] - A[k] @ mean)
        covariance = (np.eye(2) - gain @ A[k]) @ covariance
    recursive = learn(belief, statistics, noise).posterior.densities

    stacked = A.reshape(-1, 2)
    precision = belief.densities.precision + stacked.T @ stacked / 0.25
    batch = np.linalg.solve(precision, belief.densities.information_vector + stacked.T @ residuals.ravel() / 0.25)
    np.testing.assert_allclose(recursive.untruncated_mean, batch, rtol=1e-9)
    np.testing.assert_allclose(recursive.precision, precision, rtol=1e-9)
    np.testing.assert_allclose(recursive.untruncated_mean, mean, rtol=1e-9)
    np.testing.assert_allclose(recursive.covariance, covariance, rtol=1e-6)


def test_recursive_estimator_equals_the_batch_posterior_over_trials(hold, rng):
    """Recursion over five trials agrees to 1e-9 with one system of the materials' means and the own deviations."""
    memory = MaterialMemory()
    rows, targets = [], []
    true = np.array([720.0, 7850.0]) + 100 * rng.standard_normal(2)
    for trial in range(5):
        belief = detect_parts(TWO_MATERIALS, PRIOR, memory)
        statistics = hold.measure(belief, true, FIXED, (trial,))
        memory = learn(belief, statistics, FIXED).posterior.memory
        A = hold.Y @ belief.geometry.Phi
        rows.append(np.hstack([A, A]) / FIXED.threshold)
        targets.append((statistics.features[:7] - hold.tau_arm) / FIXED.threshold)
    stacked = np.vstack(rows)
    # The object's own densities scatter in proportion to what its own trials tell of them.
    own = Likelihood(stacked[:, :2].T @ stacked[:, :2], stacked[:, :2].T @ np.concatenate(targets), 0.0)
    prior_sd = np.array([PRIOR.sd, PRIOR.sd, *PRIOR.deviation * own.estimate_densities()])
    prior_mean = np.array([PRIOR.mode] * 2 + [0.0] * 2)
    precision = np.diag(prior_sd**-2.0) + stacked.T @ stacked
    batch = np.linalg.solve(precision, prior_mean / prior_sd**2 + stacked.T @ np.concatenate(targets))
    np.testing.assert_allclose(memory.belief.untruncated_mean, batch[:2], rtol=1e-9)
    np.testing.assert_allclose(memory.belief.covariance, np.linalg.inv(precision)[:2, :2], rtol=1e-9)


def grid_posterior(hold, belief, statistics, noise, axes, deviation=0.0):
    """Brute-force Bayes: the posterior of the densities on a grid, errors evaluated at every point's own torque."""
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))
    tau = hold.tau_arm + points @ (hold.Y @ belief.geometry.Phi).T
    sd = np.sqrt(noise.threshold**2 + (noise.weber_fraction * tau) ** 2)
    logs = norm.logpdf(statistics.features[:7], tau, sd).sum(axis=1)
    scale = np.sqrt(PRIOR.sd**2 + deviation**2 * (PRIOR.mode**2 + PRIOR.sd**2))
    logs += norm.logpdf(points, PRIOR.mode, scale).sum(axis=1)
    weights = np.exp(logs - logs.max())
    return (weights / weights.sum()).reshape([len(axis) for axis in axes])


def grid_percentiles(weights, axes):
    columns = []
    for i, axis in enumerate(axes):
        marginal = weights.sum(axis=tuple(j for j in range(len(axes)) if j != i))
        columns.append(np.interp(FRACTIONS, np.cumsum(marginal) - 0.5 * marginal, axis))
    return np.stack(columns, axis=1)


@pytest.mark.parametrize("true", [150.0, 1000.0, 7850.0])
def test_posterior_of_one_material_equals_brute_force_bayes_at_fixed_noise(hold, true):
    belief = detect_parts(ONE_MATERIAL, PRIOR)
    statistics = hold.measure(belief, np.array([true]), FIXED, (3,))
    axis = np.linspace(0, 20_000, 200_001)[1:]
    weights = grid_posterior(hold, belief, statistics, FIXED, [axis], PRIOR.deviation)
    actual = learn(belief, statistics, FIXED).posterior.densities.compute_percentiles(FRACTIONS)
    np.testing.assert_allclose(actual, grid_percentiles(weights, [axis]), atol=0.5)


@pytest.mark.parametrize("true", [(150.0, 7850.0), (720.0, 2700.0), (4000.0, 100.0)])
def test_posterior_of_two_materials_equals_brute_force_bayes_at_fixed_noise(hold, true):
    belief = detect_parts(TWO_MATERIALS, PRIOR)
    statistics = hold.measure(belief, np.array(true), FIXED, (4,))
    axis = np.arange(10.0, 16_000.0, 20.0)  # middles of cells, so that nothing is lost at zero
    weights = grid_posterior(hold, belief, statistics, FIXED, [axis, axis], PRIOR.deviation)
    actual = learn(belief, statistics, FIXED).posterior.densities.compute_percentiles(FRACTIONS)
    np.testing.assert_allclose(actual, grid_percentiles(weights, [axis, axis]), atol=6.0)


def test_material_means_equal_brute_force_bayes_with_the_deviation_integrated(hold):
    """Percentiles of a material's mean agree to 5 kg/m^3 with a grid of mean and deviation, marginalised."""
    belief = detect_parts(ONE_MATERIAL, PRIOR)
    statistics = hold.measure(belief, np.array([5000.0]), FIXED, (5,))
    mu, delta = np.linspace(0, 16_000, 3201), np.linspace(-4000, 4000, 401)
    A = hold.Y @ belief.geometry.Phi[:, 0]
    sd = 0.16 * A @ (statistics.features[:7] - hold.tau_arm) / (A @ A)  # of what the object itself tells
    tau = hold.tau_arm + (mu[:, None] + delta)[..., None] * A
    logs = norm.logpdf(statistics.features[:7], tau, FIXED.threshold).sum(axis=-1)
    logs += norm.logpdf(mu, PRIOR.mode, PRIOR.sd)[:, None] + norm.logpdf(delta, 0, sd)
    weights = np.exp(logs - logs.max()).sum(axis=1)
    expected = grid_percentiles(weights / weights.sum(), [mu])
    posterior = learn(belief, statistics, FIXED, deviation=0.16).posterior
    actual = posterior.memory.belief.compute_percentiles(FRACTIONS)
    np.testing.assert_allclose(actual, expected, atol=5.0)


def draw_from_prior(rng, count):
    sd = np.hypot(PRIOR.sd, PRIOR.deviation * np.hypot(PRIOR.mode, PRIOR.sd))
    return truncnorm(-PRIOR.mode / sd, np.inf, loc=PRIOR.mode, scale=sd).rvs(count, random_state=rng)


def test_density_dependent_noise_stays_close_to_brute_force_bayes(hold, rng):
    """Percentiles by plug-in differ from a grid by 0.15 SD at most in the mean (docs/decisions/0004-noise.md)."""
    noise = WeberNoise(weber_fraction=0.07, threshold=0.097)
    axis = np.linspace(0, 40_000, 20_001)[1:]
    offsets = []
    for seed, true in enumerate(draw_from_prior(rng, 100)):
        belief = detect_parts(ONE_MATERIAL, PRIOR)
        statistics = hold.measure(belief, np.array([true]), noise, (seed,))
        weights = grid_posterior(hold, belief, statistics, noise, [axis], PRIOR.deviation)
        posterior = learn(belief, statistics, noise).posterior.densities
        sd = np.sqrt(posterior.covariance[0, 0])
        offsets.append((posterior.compute_percentiles(FRACTIONS) - grid_percentiles(weights, [axis]))[:, 0] / sd)
    # In units of the posterior's own standard deviation.
    assert np.abs(offsets).mean() < 0.15
    assert abs(np.mean(offsets, axis=0)[2]) < 0.1


def test_intervals_cover_the_truth_as_often_as_they_say(hold, rng):
    noise = WeberNoise(weber_fraction=0.07, threshold=0.097)
    covered = []
    for seed, true in enumerate(draw_from_prior(rng, 400)):
        belief = detect_parts(ONE_MATERIAL, PRIOR)
        statistics = hold.measure(belief, np.array([true]), noise, (seed,))
        densities = learn(belief, statistics, noise).posterior.densities
        p5, p25, _, p75, p95 = densities.compute_percentiles(FRACTIONS)[:, 0]
        covered.append([p25 <= true <= p75, p5 <= true <= p95])
    inner, outer = np.mean(covered, axis=0)
    # Three standard deviations of a binomial proportion of 400.
    assert abs(inner - 0.5) < 0.075
    assert abs(outer - 0.9) < 0.045


@pytest.mark.parametrize("correlation", [-0.8, 0.0, 0.6])
@pytest.mark.parametrize("noise", [FIXED, WeberNoise(weber_fraction=0.07, threshold=0.097)])
def test_log_evidence_of_two_materials_is_the_integral_of_likelihood_times_truncated_prior(hold, correlation, noise):
    """Log evidence agrees to 1e-4 with a grid of both densities, with errors sized at the posterior mean."""
    mean, sd = np.array([1000.0, 3000.0]), np.array([1500.0, 2500.0])
    covariance = np.outer(sd, sd) * np.array([[1.0, correlation], [correlation, 1.0]])
    variances = (sd**2 - (PRIOR.deviation * mean) ** 2) / (1.0 + PRIOR.deviation**2)  # of the materials
    means = DensityBelief.from_moments(mean, covariance + np.diag(variances - sd**2))
    colours = detect_parts(TWO_MATERIALS, PRIOR).memory.colours
    belief = detect_parts(TWO_MATERIALS, PRIOR, MaterialMemory.from_belief(colours, means))
    np.testing.assert_allclose(belief.densities.covariance, covariance, rtol=1e-9)
    statistics = hold.measure(belief, np.array([400.0, 3500.0]), noise, (8,))
    inference = learn(belief, statistics, noise)

    A = hold.Y @ belief.geometry.Phi
    tau = hold.tau_arm + A @ inference.posterior.densities.untruncated_mean
    errors = np.sqrt(noise.threshold**2 + (noise.weber_fraction * tau) ** 2)
    axis = np.arange(0.0, 20_000.0, 20.0) + 10.0
    points = np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=-1)
    log_prior = multivariate_normal.logpdf(points, mean, covariance)
    log_likelihood = sum(
        norm.logpdf(statistics.features[j] - hold.tau_arm[j], points @ A[j], errors[j]) for j in range(7)
    )
    expected = logsumexp(log_prior + log_likelihood) - logsumexp(log_prior)
    assert inference.log_evidence == pytest.approx(expected, abs=1e-4)
