import numpy as np
import pytest
from helpers.density_quadrature import compare_moments, integrate, weigh_density
from helpers.seen_objects import ONE_MATERIAL, TWO_MATERIALS, detect_parts
from scipy.optimize import minimize
from scipy.special import logsumexp
from scipy.stats import multivariate_normal, norm, truncnorm

from affordance.belief.density_belief import DensityBelief, Prior
from affordance.belief.material_memory import MaterialMemory
from affordance.plant.arm_model import ArmModel
from affordance.proprioception.estimator import TorqueStatistics, compute_posterior, condition_on_torques
from affordance.proprioception.torque_noise import WeberNoise, WhiteNoise

PRIOR = Prior(mode=1000.0, sd=4000.0, deviation=0.06)
FIXED = WeberNoise(weber_fraction=0.0, threshold=0.3)  # a percept of errors that do not depend on torque
WEBER = WeberNoise(weber_fraction=0.07, threshold=0.097)
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
    posterior, likelihood = condition_on_torques(belief, statistics, 7, noise, PRIOR.deviation)

    stacked = A.reshape(-1, 2)
    information, vector = stacked.T @ stacked / 0.25, stacked.T @ residuals.ravel() / 0.25
    np.testing.assert_allclose(likelihood.precision, information, rtol=1e-9)
    np.testing.assert_allclose(likelihood.information_vector, vector, rtol=1e-9)
    precision = belief.densities.precision + likelihood.precision
    batch = np.linalg.solve(precision, belief.densities.information_vector + likelihood.information_vector)
    np.testing.assert_allclose(batch, mean, rtol=1e-9)
    np.testing.assert_allclose(np.linalg.inv(precision), covariance, rtol=1e-6)
    axes = [m + sd * np.linspace(-7.0, 7.0, 281) for m, sd in zip(mean, np.sqrt(np.diag(covariance)), strict=True)]
    peak = vector @ np.linalg.solve(information, vector)

    def compute_log_likelihood(rho):
        return rho @ vector - 0.5 * ((rho @ information) * rho).sum(axis=1) - 0.5 * peak

    exact = integrate(compute_log_likelihood, axes, [PRIOR.mode] * 2, [PRIOR.sd] * 2, PRIOR.deviation)
    compare_moments(posterior.densities, exact.own_mean, exact.own_covariance)


def test_recursive_estimator_equals_the_batch_posterior_over_trials(hold, rng):
    """Recursion over five trials agrees with one integral over the materials' means and the own densities."""
    memory = MaterialMemory()
    targets = []
    true = np.array([720.0, 7850.0]) + 100 * rng.standard_normal(2)
    for trial in range(5):
        belief = detect_parts(TWO_MATERIALS, PRIOR, memory)
        statistics = hold.measure(belief, true, FIXED, (trial,))
        memory = learn(belief, statistics, FIXED).posterior.memory
        targets.append(statistics.features[:7] - hold.tau_arm)
    A = hold.Y @ belief.geometry.Phi

    def compute_log_likelihood(rho):
        return sum(norm.logpdf(target, rho @ A.T, FIXED.threshold).sum(axis=1) for target in targets)

    axes = [np.arange(10.0, 16_000.0, 20.0)] * 2
    expected = integrate(compute_log_likelihood, axes, [PRIOR.mode] * 2, [PRIOR.sd] * 2, PRIOR.deviation)
    # Of two colours, means are up to 2.2 % and SDs up to 4 % off (docs/decisions/0035-exact-belief.md).
    compare_moments(memory.belief, expected.mean, expected.covariance, of_mean=0.022, of_sd=0.04)


def judge(hold, belief, statistics, noise):
    """The log likelihood of densities, (N, C), with errors evaluated at every density's own torque."""

    def compute_log_likelihood(rho):
        tau = hold.tau_arm + rho @ (hold.Y @ belief.geometry.Phi).T
        sd = np.sqrt(noise.threshold**2 + (noise.weber_fraction * tau) ** 2)
        return norm.logpdf(statistics.features[:7], tau, sd).sum(axis=1)

    return compute_log_likelihood


def find_percentiles(hold, belief, statistics, noise, axis):
    """Brute-force Bayes: percentiles of the posterior of one density on a grid."""
    logs = judge(hold, belief, statistics, noise)(axis[:, None])
    weights = np.exp(logs - logs.max()) * weigh_density(axis, PRIOR.mode, PRIOR.sd, PRIOR.deviation)[0]
    weights /= weights.sum()
    return np.interp(FRACTIONS, np.cumsum(weights) - 0.5 * weights, axis)


@pytest.mark.parametrize("true", [150.0, 1000.0, 7850.0])
@pytest.mark.parametrize("noise", [FIXED, WEBER])
def test_posterior_of_one_material_equals_brute_force_bayes(hold, true, noise):
    belief = detect_parts(ONE_MATERIAL, PRIOR)
    statistics = hold.measure(belief, np.array([true]), noise, (3,))
    log_likelihood = judge(hold, belief, statistics, noise)
    axis = np.arange(0.5, 20_000.0)
    expected = integrate(log_likelihood, [axis], [PRIOR.mode], [PRIOR.sd], PRIOR.deviation)
    posterior = learn(belief, statistics, noise).posterior
    compare_moments(posterior.densities, expected.own_mean, expected.own_covariance)
    compare_moments(posterior.memory.belief, expected.mean, expected.covariance)


@pytest.mark.parametrize("true", [(150.0, 7850.0), (720.0, 2700.0), (4000.0, 100.0)])
def test_posterior_of_two_materials_equals_brute_force_bayes_at_fixed_noise(hold, true):
    belief = detect_parts(TWO_MATERIALS, PRIOR)
    statistics = hold.measure(belief, np.array(true), FIXED, (4,))
    axes = [np.arange(10.0, 16_000.0, 20.0)] * 2  # middles of cells, so that nothing is lost at zero
    log_likelihood = judge(hold, belief, statistics, FIXED)
    expected = integrate(log_likelihood, axes, [PRIOR.mode] * 2, [PRIOR.sd] * 2, PRIOR.deviation)
    posterior = learn(belief, statistics, FIXED).posterior
    compare_moments(posterior.densities, expected.own_mean, expected.own_covariance)
    # Of two colours, means are up to 2.2 % and SDs up to 4 % off (docs/decisions/0035-exact-belief.md).
    compare_moments(posterior.memory.belief, expected.mean, expected.covariance, of_mean=0.022, of_sd=0.04)


def test_material_means_equal_brute_force_bayes_with_the_deviation_integrated(hold):
    """Mean and SD of a material's mean are those of a grid of mean and deviation, marginalised."""
    belief = detect_parts(ONE_MATERIAL, PRIOR)
    statistics = hold.measure(belief, np.array([5000.0]), FIXED, (5,))
    mu, delta = np.linspace(5.0, 16_000.0, 3200), np.linspace(-6.0, 6.0, 401)
    rho = mu[:, None] * (1.0 + 0.16 * delta)
    logs = judge(hold, belief, statistics, FIXED)(rho.reshape(-1, 1)).reshape(rho.shape)
    logs += norm.logpdf(mu, PRIOR.mode, PRIOR.sd)[:, None] + norm.logpdf(delta)
    weights = np.exp(logs - logs.max()).sum(axis=1)
    weights /= weights.sum()
    mean = weights @ mu
    posterior = learn(belief, statistics, FIXED, deviation=0.16).posterior
    compare_moments(posterior.memory.belief, [mean], [[weights @ (mu - mean) ** 2]])


def draw_from_prior(rng, count):
    sd = np.hypot(PRIOR.sd, PRIOR.deviation * np.hypot(PRIOR.mode, PRIOR.sd))
    return truncnorm(-PRIOR.mode / sd, np.inf, loc=PRIOR.mode, scale=sd).rvs(count, random_state=rng)


def test_density_dependent_noise_stays_close_to_brute_force_bayes(hold, rng):
    """Percentiles differ from a grid by 0.15 SD at most in the mean (docs/decisions/0004-noise.md)."""
    axis = np.linspace(0, 40_000, 20_001)[1:]
    offsets = []
    for seed, true in enumerate(draw_from_prior(rng, 100)):
        belief = detect_parts(ONE_MATERIAL, PRIOR)
        statistics = hold.measure(belief, np.array([true]), WEBER, (seed,))
        expected = find_percentiles(hold, belief, statistics, WEBER, axis)
        posterior = learn(belief, statistics, WEBER).posterior.densities
        sd = np.sqrt(posterior.covariance[0, 0])
        offsets.append((posterior.compute_percentiles(FRACTIONS)[:, 0] - expected) / sd)
    # In units of the posterior's own standard deviation.
    assert np.abs(offsets).mean() < 0.15
    assert abs(np.mean(offsets, axis=0)[2]) < 0.1


def test_intervals_cover_the_truth_as_often_as_they_say(hold, rng):
    covered = []
    for seed, true in enumerate(draw_from_prior(rng, 400)):
        belief = detect_parts(ONE_MATERIAL, PRIOR)
        statistics = hold.measure(belief, np.array([true]), WEBER, (seed,))
        densities = learn(belief, statistics, WEBER).posterior.densities
        p5, p25, _, p75, p95 = densities.compute_percentiles(FRACTIONS)[:, 0]
        covered.append([p25 <= true <= p75, p5 <= true <= p95])
    inner, outer = np.mean(covered, axis=0)
    # Three standard deviations of a binomial proportion of 400.
    assert abs(inner - 0.5) < 0.075
    assert abs(outer - 0.9) < 0.045


@pytest.mark.parametrize("correlation", [-0.8, 0.0, 0.6])
@pytest.mark.parametrize("noise", [FIXED, WEBER])
def test_log_evidence_of_two_materials_is_the_integral_of_likelihood_times_truncated_prior(hold, correlation, noise):
    """Log evidence agrees to 1e-4 with a grid of both densities, with the likelihood expanded at the mode.

    With the likelihood as it is, it agrees to 0.05, a bound that was chosen after the differences had been seen.
    """
    mean, sd = np.array([1000.0, 3000.0]), np.array([1500.0, 2500.0])
    covariance = np.outer(sd, sd) * np.array([[1.0, correlation], [correlation, 1.0]])
    variances = (sd**2 - (PRIOR.deviation * mean) ** 2) / (1.0 + PRIOR.deviation**2)  # of the materials
    means = DensityBelief.from_moments(mean, covariance + np.diag(variances - sd**2))
    colours = detect_parts(TWO_MATERIALS, PRIOR).memory.colours
    belief = detect_parts(TWO_MATERIALS, PRIOR, MaterialMemory.from_belief(colours, means))
    np.testing.assert_allclose(belief.densities.covariance, covariance, rtol=1e-9)
    statistics = hold.measure(belief, np.array([400.0, 3500.0]), noise, (8,))
    inference = learn(belief, statistics, noise)

    compute = judge(hold, belief, statistics, noise)
    log_prior = multivariate_normal(mean, covariance).logpdf
    mode = minimize(lambda rho: -compute(rho[None])[0] - log_prior(rho), mean, method="Nelder-Mead", tol=1e-8).x
    steps = np.eye(2)
    at = compute(mode[None])[0]
    ahead, behind = compute(mode + steps), compute(mode - steps)
    gradient = (ahead - behind) / 2.0
    bend = compute(mode + steps.sum(axis=0)[None])[0] + compute(mode - steps.sum(axis=0)[None])[0]
    mixed = (bend - ahead.sum() - behind.sum() + 2.0 * at) / 2.0
    hessian = np.diag(ahead - 2.0 * at + behind) + mixed * (1.0 - np.eye(2))
    axis = np.arange(0.0, 20_000.0, 20.0) + 10.0
    points = np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=-1).reshape(-1, 2)
    away, prior = points - mode, log_prior(points)
    quadratic = at + away @ gradient + 0.5 * ((away @ hessian) * away).sum(axis=1)
    expected, exact = (logsumexp(prior + each) - logsumexp(prior) for each in (quadratic, compute(points)))
    assert inference.log_evidence == pytest.approx(expected, abs=1e-4)
    assert inference.log_evidence == pytest.approx(exact, abs=0.05)
