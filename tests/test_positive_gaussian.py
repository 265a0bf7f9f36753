import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.stats import kstest, multivariate_normal, truncnorm

from affordance import positive_gaussian

# Pairs and a triple with their mass near, across and far from the bounds.
CASES = {
    "well inside": ([600.0, 7800.0], [[150.0**2, -0.6 * 150 * 400], [-0.6 * 150 * 400, 400.0**2]]),
    "one at its bound": ([100.0, 7800.0], [[300.0**2, -0.8 * 300 * 400], [-0.8 * 300 * 400, 400.0**2]]),
    "one beyond its bound": ([-300.0, 500.0], [[200.0**2, 0.7 * 200 * 300], [0.7 * 200 * 300, 300.0**2]]),
    "broad": ([1000.0, 1000.0], [[4000.0**2, -0.3 * 4000**2], [-0.3 * 4000**2, 4000.0**2]]),
}


@pytest.fixture(params=CASES, ids=list(CASES))
def pair(request):
    mean, covariance = CASES[request.param]
    return np.array(mean), np.array(covariance)


def integrate_on_grid(mean, covariance, num=1201):
    """Brute force: the restricted density of a pair on a fine grid, normalised."""
    spread = 9 * np.sqrt(np.diag(covariance))
    axes = [np.linspace(0, max(m, 0) + s, num) for m, s in zip(mean, spread, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    density = multivariate_normal(mean, covariance).pdf(points)
    # Trapezoidal weights: the density does not vanish at zero.
    for dimension in range(2):
        edge = [slice(None)] * 2
        for end in (0, -1):
            edge[dimension] = end
            density[tuple(edge)] *= 0.5
    cell = np.prod([axis[1] - axis[0] for axis in axes])
    return axes, density, density.sum() * cell


def test_mass_mean_and_percentiles_of_a_pair_agree_with_brute_force(pair):
    mean, covariance = pair
    axes, density, mass = integrate_on_grid(mean, covariance)
    assert positive_gaussian.compute_log_mass(mean, covariance) == pytest.approx(np.log(mass), abs=2e-4)
    fractions = np.array([0.05, 0.25, 0.5, 0.75, 0.95])
    percentiles = positive_gaussian.compute_percentiles(mean, covariance, fractions)
    means = positive_gaussian.compute_mean(mean, covariance)
    for i, axis in enumerate(axes):
        marginal = density.sum(axis=1 - i)
        marginal /= marginal.sum()
        sd = np.sqrt(covariance[i, i])
        assert means[i] == pytest.approx(marginal @ axis, abs=1e-3 * sd)
        cumulative = np.cumsum(marginal) - 0.5 * marginal
        expected = np.interp(fractions, cumulative, axis)
        np.testing.assert_allclose(percentiles[:, i], expected, atol=2e-3 * sd)


def test_percentiles_of_independent_coordinates_are_those_of_truncated_normals():
    mean, sds = np.array([1000.0, -200.0]), np.array([4000.0, 100.0])
    fractions = np.array([0.25, 0.5, 0.75])
    percentiles = positive_gaussian.compute_percentiles(mean, np.diag(sds**2), fractions)
    for i in range(2):
        expected = truncnorm(-mean[i] / sds[i], np.inf, loc=mean[i], scale=sds[i])
        np.testing.assert_allclose(percentiles[:, i], expected.ppf(fractions), rtol=1e-12)


def test_percentile_by_quadrature_agrees_with_the_exact_one_where_correlation_is_tiny():
    mean, sd = np.array([100.0, 9000.0]), np.array([300.0, 100.0])
    correlation = 1e-9
    covariance = np.outer(sd, sd) * np.array([[1, correlation], [correlation, 1]])
    fractions = np.array([0.01, 0.25, 0.5, 0.75, 0.99])
    by_quadrature = positive_gaussian.compute_percentiles(mean, covariance, fractions)[:, 0]
    exact = positive_gaussian.compute_percentiles(mean, np.diag(sd**2), fractions)[:, 0]
    np.testing.assert_allclose(by_quadrature, exact, atol=1e-6 * sd[0])


def test_samples_are_positive_and_distributed_as_they_should(pair, rng):
    mean, covariance = pair
    samples = positive_gaussian.draw_samples(mean, covariance, rng, 20_000)
    assert samples.shape == (20_000, 2)
    assert (samples > 0).all()
    axes, density, _ = integrate_on_grid(mean, covariance)
    for i, axis in enumerate(axes):
        marginal = density.sum(axis=1 - i)
        cumulative = np.cumsum(marginal / marginal.sum())
        assert kstest(samples[:, i], lambda x, a=axis, c=cumulative: np.interp(x, a, c)).pvalue > 1e-4


def test_samples_far_in_the_tail_are_still_found(rng):
    mean, covariance = np.array([-3000.0]), np.array([[300.0**2]])
    samples = positive_gaussian.draw_samples(mean, covariance, rng, 5000)
    assert (samples > 0).all()
    expected = truncnorm(10.0, np.inf, loc=-3000.0, scale=300.0)
    assert kstest(samples[:, 0], expected.cdf).pvalue > 1e-4


def test_three_coordinates_agree_with_rejection_by_brute_force(rng):
    mean = np.array([200.0, 500.0, -100.0])
    root = np.array([[300.0, 0, 0], [-150.0, 250.0, 0], [100.0, -120.0, 200.0]])
    covariance = root @ root.T
    brute = rng.multivariate_normal(mean, covariance, 1_000_000)
    brute = brute[(brute > 0).all(axis=1)]
    log_mass = positive_gaussian.compute_log_mass(mean, covariance)
    assert np.exp(log_mass) == pytest.approx(len(brute) / 1e6, rel=0.01)
    fractions = np.array([0.25, 0.5, 0.75])
    percentiles = positive_gaussian.compute_percentiles(mean, covariance, fractions)
    np.testing.assert_allclose(percentiles, np.quantile(brute, fractions, axis=0), atol=4.0)
    np.testing.assert_allclose(positive_gaussian.compute_mean(mean, covariance), brute.mean(axis=0), atol=3.0)
    samples = positive_gaussian.draw_samples(mean, covariance, rng, 100_000)
    np.testing.assert_allclose(
        np.quantile(samples, fractions, axis=0), np.quantile(brute, fractions, axis=0), atol=5.0
    )
    np.testing.assert_allclose(np.cov(samples.T), np.cov(brute.T), rtol=0.05, atol=500.0)


def test_mode_is_the_constrained_maximum(pair):
    mean, covariance = pair
    precision = np.linalg.inv(covariance)
    floor = 10.0
    mode = positive_gaussian.compute_mode(mean, precision, floor)
    scale = np.sqrt(np.diag(covariance))
    found = minimize(
        lambda z: 0.5 * (floor + z * scale - mean) @ precision @ (floor + z * scale - mean),
        np.ones(2),
        bounds=[(0, None)] * 2,
        tol=1e-14,
    )
    np.testing.assert_allclose(mode, floor + found.x * scale, atol=1e-3 * scale.max())
    assert (mode >= floor).all()


def test_mode_is_the_mean_where_the_mean_is_allowed(rng):
    mean = np.array([600.0, 7800.0])
    np.testing.assert_array_equal(positive_gaussian.compute_mode(mean, np.eye(2), 10.0), mean)
