import itertools
from functools import partial
from math import factorial

import numpy as np
import pytest
from scipy.optimize import brentq, minimize
from scipy.special import log_ndtr
from scipy.stats import ks_2samp, kstest, multivariate_normal, norm, truncnorm

from affordance.belief import minimax_tilting as tilting
from affordance.belief.normals import compute_mode
from affordance.belief.truncated_normal import (
    compute_log_mass,
    compute_mean,
    compute_percentiles,
    draw_samples,
)
from affordance.exceptions import AffordanceError

# Pairs with their mass near, across and far from the bounds.
CASES = {
    "well inside": ([600.0, 7800.0], [[150.0**2, -0.6 * 150 * 400], [-0.6 * 150 * 400, 400.0**2]]),
    "one at its bound": ([100.0, 7800.0], [[300.0**2, -0.8 * 300 * 400], [-0.8 * 300 * 400, 400.0**2]]),
    "one beyond its bound": ([-300.0, 500.0], [[200.0**2, 0.7 * 200 * 300], [0.7 * 200 * 300, 300.0**2]]),
    "broad": ([1000.0, 1000.0], [[4000.0**2, -0.3 * 4000**2], [-0.3 * 4000**2, 4000.0**2]]),
}
FRACTIONS = np.array([0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99])
# More fractions, far into either tail.
LOW_FRACTIONS = np.array([1e-9, 1e-6, 1e-4, 0.001, 0.01, 0.05, 0.1, 0.2, 0.3, 0.4])
MANY_FRACTIONS = np.concatenate([LOW_FRACTIONS, [0.5], 1 - LOW_FRACTIONS[::-1]])


@pytest.fixture(params=CASES, ids=list(CASES))
def pair(request):
    mean, covariance = CASES[request.param]
    return np.array(mean), np.array(covariance)


def correlate(sds, correlation):
    """The covariance of coordinates that all correlate alike."""
    scales = np.asarray(sds, dtype=float)
    return np.outer(scales, scales) * (correlation + (1 - correlation) * np.eye(len(scales)))


def draw_distribution(rng, size, *, narrowest, farthest):
    """A random mean and covariance; narrowest: smallest SD there is in any direction; farthest: means in SDs."""
    axes = np.linalg.qr(rng.normal(size=(size, size)))[0]
    covariance = axes @ np.diag(10.0 ** rng.uniform(2 * np.log10(narrowest), 0, size)) @ axes.T
    scales = 10.0 ** rng.uniform(0, 3, size)
    covariance = 0.5 * (covariance + covariance.T) * np.outer(scales, scales)
    return rng.uniform(-farthest, farthest, size) * np.sqrt(np.diag(covariance)), covariance


GAUSS_NODES, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(300)


def place_gauss_nodes(lower, upper):
    half = 0.5 * (upper - lower)
    return lower + half * (1 + GAUSS_NODES), half * GAUSS_WEIGHTS


def integrate_over_box(mean, covariance, box):
    """Brute force over a box, for pairs: the log of the mass and the mean."""
    (x, x_weights), (y, y_weights) = (place_gauss_nodes(*ends) for ends in box)
    precision = np.linalg.inv(covariance)
    dx, dy = x[:, None] - mean[0], y - mean[1]
    squares = precision[0, 0] * dx**2 + 2 * precision[0, 1] * dx * dy + precision[1, 1] * dy**2
    least = squares.min()
    shares = np.exp(-0.5 * (squares - least)) * np.outer(x_weights, y_weights)
    log_mass = np.log(shares.sum()) - 0.5 * least - 0.5 * np.linalg.slogdet(2 * np.pi * covariance)[1]
    return float(log_mass), np.array([shares.sum(axis=1) @ x, shares.sum(axis=0) @ y]) / shares.sum()


def bracket_far_tail(mean, covariance):
    """Rigorous bounds of log P(x > 0) where all components of rates = -covariance^-1 mean are positive.

    The density is phi(0) exp(-rates.x - y), y = x.precision.x / 2 >= 0. Its integral is phi(0) / prod(rates) times
    the expectation of exp(-y) for independent exponentially distributed x, and 1 - y <= exp(-y) <= 1 - y + y^2 / 2.

    Returns: Lower bound, upper bound, and the expectation of y.
    """
    precision = np.linalg.inv(covariance)
    rates = -precision @ mean
    assert (rates > 0).all()
    indices = range(len(mean))

    def expect(*which):
        """Expectation of the product of some of x."""
        return float(np.prod([factorial(which.count(i)) / rates[i] ** which.count(i) for i in indices]))

    y = sum(0.5 * precision[i, j] * expect(i, j) for i, j in itertools.product(indices, repeat=2))
    y_squared = sum(
        0.25 * precision[i, j] * precision[k, m] * expect(i, j, k, m)
        for i, j, k, m in itertools.product(indices, repeat=4)
    )
    log_scale = multivariate_normal(mean, covariance).logpdf(np.zeros(len(mean))) - np.log(rates).sum()
    return log_scale + np.log1p(-y), log_scale + np.log1p(-y + 0.5 * y_squared), y


class Contest:
    """x_i = s_i (z_i - z_0), z independent standard normal: all x > 0 means that z_0 is the least of M + 1."""

    def __init__(self, sds):
        self.sds = np.asarray(sds, dtype=float)
        self.mean = np.zeros(len(self.sds))
        self.covariance = np.outer(self.sds, self.sds) * (1 + np.eye(len(self.sds)))
        self.z = np.linspace(-10, 10, 20_001)

    def exceed(self, x):
        """P(x_i / s_i > x given all positive). Of such functions trapezoidal sums are exact to rounding."""
        count = len(self.sds)
        integrand = norm.pdf(self.z) * norm.sf(self.z + x) * norm.sf(self.z) ** (count - 1)
        return float((count + 1) * np.trapezoid(integrand, self.z))

    def compute_percentiles(self, fractions):
        roots = [brentq(lambda x, f=f: self.exceed(x) - (1 - f), 0, 20, xtol=1e-13) for f in fractions]
        return np.outer(roots, self.sds)

    def compute_mean(self):
        x, weights = place_gauss_nodes(0, 20)
        return self.sds * float(np.array([self.exceed(value) for value in x]) @ weights)


def test_mass_of_pairs_of_zero_mean_is_sheppards():
    for correlation in (-0.999999, -0.999, -0.5, 0.3, 0.999, 0.999999):
        log_mass = compute_log_mass(np.zeros(2), correlate([3.0, 700.0], correlation))
        assert log_mass == pytest.approx(np.log(np.arccos(-correlation) / (2 * np.pi)), abs=1e-9)


def test_mass_of_triples_of_zero_mean_is_known(rng):
    """The mass is 1/8 + (sum of the arcsines of the correlations) / 4 pi, to 1e-11."""
    chain = np.array([[1.0, 0.6, 0.0], [0.6, 1.0, -0.7], [0.0, -0.7, 1.0]])
    for covariance in [chain] + [draw_distribution(rng, 3, narrowest=0.03, farthest=0.0)[1] for _ in range(10)]:
        sds = np.sqrt(np.diag(covariance))
        angles = np.arcsin((covariance / np.outer(sds, sds))[np.triu_indices(3, 1)])
        log_mass = compute_log_mass(np.zeros(3), covariance)
        assert np.exp(log_mass) == pytest.approx(1 / 8 + angles.sum() / (4 * np.pi), abs=1e-11)


@pytest.mark.parametrize("size", [2, 3, 4, 6])
def test_of_a_contest_everything_is_known(size):
    contest = Contest(10.0 ** np.linspace(0, 3, size))
    # Two or three coordinates by quadrature, more by averaging over points.
    log_mass_error, error = (1e-10, 1e-6) if size <= 3 else (1e-4, 1e-3)
    log_mass = compute_log_mass(contest.mean, contest.covariance)
    assert log_mass == pytest.approx(-np.log(size + 1), abs=log_mass_error)
    percentiles = compute_percentiles(contest.mean, contest.covariance, FRACTIONS)
    expected = contest.compute_percentiles(FRACTIONS)
    np.testing.assert_allclose(percentiles / contest.sds, expected / contest.sds, rtol=0, atol=error)
    means = compute_mean(contest.mean, contest.covariance)
    np.testing.assert_allclose(means / contest.sds, contest.compute_mean() / contest.sds, rtol=0, atol=error)


def test_mass_mean_and_percentiles_of_a_pair_agree_with_brute_force(pair):
    mean, covariance = pair
    sds = np.sqrt(np.diag(covariance))
    box = [(max(m - 9 * s, 0.0), max(m, 0.0) + 9 * s) for m, s in zip(mean, sds, strict=True)]
    log_mass, means = integrate_over_box(mean, covariance, box)
    assert compute_log_mass(mean, covariance) == pytest.approx(log_mass, abs=1e-10)
    np.testing.assert_allclose(compute_mean(mean, covariance), means, rtol=0, atol=1e-9 * sds.min())
    percentiles = compute_percentiles(mean, covariance, FRACTIONS)
    for i, f in itertools.product(range(2), range(len(FRACTIONS))):
        x = percentiles[f, i]
        below, _ = integrate_over_box(mean, covariance, [*box[:i], (box[i][0], x), *box[i + 1 :]])
        # The density there: the mass of a thin slice over its thickness.
        thickness = 1e-3 * sds[i]
        slice_there, _ = integrate_over_box(mean, covariance, [*box[:i], (x, x + thickness), *box[i + 1 :]])
        density = np.exp(slice_there - log_mass) / thickness
        assert abs(np.exp(below - log_mass) - FRACTIONS[f]) / density < 1e-6 * sds[i]


def test_percentiles_of_independent_coordinates_are_those_of_truncated_normals():
    mean, sds = np.array([1000.0, -200.0]), np.array([4000.0, 100.0])
    percentiles = compute_percentiles(mean, np.diag(sds**2), FRACTIONS)
    means = compute_mean(mean, np.diag(sds**2))
    for i in range(2):
        expected = truncnorm(-mean[i] / sds[i], np.inf, loc=mean[i], scale=sds[i])
        np.testing.assert_allclose(percentiles[:, i], expected.ppf(FRACTIONS), rtol=1e-12)
        assert means[i] == pytest.approx(expected.mean(), rel=1e-12)


@pytest.mark.parametrize("distance", [40.0, 95.0, 105.0, 1e4, 1e6])
def test_mean_and_percentiles_far_in_the_tail_obey_laplaces_continued_fraction(distance):
    """Mills' ratio, sf / pdf at d, is 1 / (d + 1 / (d + 2 / (d + 3 / ...)))."""

    def compute_fraction(d, first):
        value = d
        for numerator in range(60, first - 1, -1):
            value = d + numerator / value
        return 1 / value

    mean, covariance = np.array([-7.0 * distance]), np.array([[49.0]])
    # The mean's excess over the bound is 1 / ratio - d.
    expected = 7.0 * compute_fraction(np.array([distance]), 2)
    np.testing.assert_allclose(compute_mean(mean, covariance), expected, rtol=1e-10)
    excesses = compute_percentiles(mean, covariance, FRACTIONS)[:, 0] / 7.0
    ratios = compute_fraction(distance + excesses, 1) / compute_fraction(np.array([distance]), 1)
    above = np.exp(-excesses * (distance + 0.5 * excesses)) * ratios
    np.testing.assert_allclose(above, 1 - FRACTIONS, rtol=0, atol=2e-10)


def test_what_covaries_through_others_is_treated_together_and_the_rest_apart():
    covariance = np.diag([4.0, 9.0, 1.0, 25.0])
    covariance[0, 2] = covariance[2, 0] = 1.2
    covariance[2, 3] = covariance[3, 2] = -2.0
    mean = np.array([-1.0, 2.0, 0.3, 4.0])
    together = np.array([0, 2, 3])
    block = mean[together], covariance[np.ix_(together, together)]
    percentiles = compute_percentiles(mean, covariance, FRACTIONS)
    np.testing.assert_array_equal(percentiles[:, together], compute_percentiles(*block, FRACTIONS))
    np.testing.assert_allclose(percentiles[:, 1], truncnorm(-2 / 3, np.inf, 2, 3).ppf(FRACTIONS), rtol=1e-12)
    log_mass = compute_log_mass(mean, covariance)
    assert log_mass == pytest.approx(compute_log_mass(*block) + log_ndtr(2 / 3), abs=1e-12)


def test_nothing_is_certain_about_nothing(rng):
    mean, covariance = np.zeros(0), np.zeros((0, 0))
    assert compute_log_mass(mean, covariance) == 0.0
    assert compute_percentiles(mean, covariance, FRACTIONS).shape == (len(FRACTIONS), 0)
    assert draw_samples(mean, covariance, rng, 3).shape == (3, 0)


@pytest.mark.parametrize("size", [2, 3])
def test_percentiles_by_quadrature_agree_with_the_exact_ones_where_correlation_is_tiny(size):
    mean, sds = np.array([100.0, 9000.0, -500.0])[:size], np.array([300.0, 100.0, 50.0])[:size]
    by_quadrature = compute_percentiles(mean, correlate(sds, 1e-9), FRACTIONS)
    exact = compute_percentiles(mean, np.diag(sds**2), FRACTIONS)
    np.testing.assert_allclose(by_quadrature / sds, exact / sds, rtol=0, atol=1e-6)


def test_percentiles_of_fractions_beyond_rounding_error_stay_in_order(pair):
    fractions = np.array([1e-300, 1e-30, 1e-12, 0.5, 1 - 1e-12, 1 - 1e-16])
    percentiles = compute_percentiles(*pair, fractions)
    assert (percentiles > 0).all()
    assert (np.diff(percentiles, axis=0) >= 0).all()
    # Normal tails: 1e-16 is 8.3 SDs.
    mean, covariance = pair
    assert (percentiles <= np.maximum(mean, 0) + 15 * np.sqrt(np.diag(covariance))).all()


@pytest.mark.parametrize("size", [2, 3])
@pytest.mark.parametrize("distance", [30.0, 40.0, 1000.0])
@pytest.mark.parametrize("correlation", [-0.49, 0.5, 0.9])
def test_mass_far_in_the_tail_is_within_rigorous_bounds(size, distance, correlation):
    mean, covariance = np.full(size, -distance), correlate(np.ones(size), correlation)
    lower, upper, _ = bracket_far_tail(mean, covariance)
    log_mass = compute_log_mass(mean, covariance)
    rounding = 1e-14 * abs(lower)
    assert lower - rounding <= log_mass <= upper + rounding


@pytest.mark.parametrize("correlation", [-0.999, -0.999999])
def test_a_pair_in_the_tail_with_opposed_coordinates_is_exponentially_distributed(correlation, rng):
    mean, sds = np.array([-4000.0, -80.0]), np.array([100.0, 2.0])
    covariance = correlate(sds, correlation)
    lower, _, y = bracket_far_tail(mean, covariance)
    assert y < 1e-6
    log_mass = compute_log_mass(mean, covariance)
    # A correlation so near one is rounded by 1e-16 / (1 - correlation) of what matters of it.
    assert log_mass == pytest.approx(lower, rel=1e-9)
    rates = -np.linalg.solve(covariance, mean)
    percentiles = compute_percentiles(mean, covariance, FRACTIONS)
    # Weights within [1 - y, 1] change a probability by 2 y at most, and this one's density is rate (1 - f).
    shift = 2 * y / (1 - FRACTIONS)
    assert (np.abs(percentiles * rates + np.log1p(-FRACTIONS)[:, None]) <= shift[:, None] + 1e-6).all()
    samples = draw_samples(mean, covariance, rng, 20_000)
    assert (samples > 0).all()
    for i in range(2):
        assert kstest(samples[:, i] * rates[i], "expon").pvalue > 1e-4
    # Independent: the product of their deviations averages zero, with a standard error of 0.007.
    assert abs((samples * rates - 1).prod(axis=1).mean()) < 5 * 0.007


def test_a_pair_in_the_tail_with_coordinates_alike_agrees_with_brute_force(rng):
    mean, covariance = np.array([-40.0, -40.0]), correlate([1.0, 1.0], 0.999)
    log_mass, means = integrate_over_box(mean, covariance, [(0.0, 1.5)] * 2)
    assert compute_log_mass(mean, covariance) == pytest.approx(log_mass, abs=1e-9)
    np.testing.assert_allclose(compute_mean(mean, covariance), means, rtol=1e-8)
    percentiles = compute_percentiles(mean, covariance, FRACTIONS)

    def cumulate(x):
        return float(np.exp(integrate_over_box(mean, covariance, [(0.0, x), (0.0, 1.5)])[0] - log_mass))

    np.testing.assert_allclose([cumulate(x) for x in percentiles[:, 0]], FRACTIONS, rtol=0, atol=1e-7)
    np.testing.assert_allclose(percentiles[:, 1], percentiles[:, 0], rtol=1e-12)
    samples = draw_samples(mean, covariance, rng, 20_000)
    axis = np.linspace(1e-9, 0.5, 100)
    cumulative = np.array([cumulate(x) for x in axis])
    for i in range(2):
        assert kstest(samples[:, i], partial(np.interp, xp=axis, fp=cumulative)).pvalue > 1e-4


def test_one_bound_decides_where_coordinates_are_all_but_equal():
    mean, sds = np.array([-1000.0, 300.0]), np.array([500.0, 200.0])
    covariance = correlate(sds, 1 - 1e-10)
    assert compute_log_mass(mean, covariance) == pytest.approx(log_ndtr(-2.0), abs=1e-8)
    percentiles = compute_percentiles(mean, covariance, FRACTIONS)
    alone = truncnorm(2.0, np.inf).ppf(FRACTIONS)
    # Given one coordinate the other has an SD of 1.4e-5.
    np.testing.assert_allclose((percentiles - mean) / sds, np.column_stack([alone, alone]), rtol=0, atol=1e-6)


def test_both_bounds_decide_where_coordinates_are_all_but_opposed():
    """Mass and percentiles agree with a truncated normal on the line on which the sum of two coordinates is fixed."""
    mean, sds = np.array([300.0, 500.0]), np.array([400.0, 400.0])
    covariance = correlate(sds, -(1 - 1e-10))
    low, high = -mean[0] / sds[0], mean[1] / sds[1]
    expected = np.log(norm.cdf(high) - norm.cdf(low))
    # The bounds are blurred by an SD of 1.4e-5, which cancels to first order.
    assert compute_log_mass(mean, covariance) == pytest.approx(expected, abs=1e-8)
    percentiles = compute_percentiles(mean, covariance, FRACTIONS)
    first = truncnorm(low, high).ppf(FRACTIONS)
    second = -truncnorm(low, high).ppf(1 - FRACTIONS)
    np.testing.assert_allclose((percentiles - mean) / sds, np.column_stack([first, second]), rtol=0, atol=1e-6)


def test_mass_does_not_depend_on_the_order_of_coordinates(rng):
    for _ in range(10):
        mean, covariance = draw_distribution(rng, 3, narrowest=1e-3, farthest=20.0)
        masses = []
        for order in itertools.permutations(range(3)):
            chosen = np.array(order)
            masses.append(compute_log_mass(mean[chosen], covariance[np.ix_(chosen, chosen)]))
        np.testing.assert_allclose(masses, masses[0], rtol=1e-9, atol=1e-8)


def test_three_coordinates_agree_with_rejection_by_brute_force(rng):
    mean = np.array([200.0, 500.0, -100.0])
    root = np.array([[300.0, 0, 0], [-150.0, 250.0, 0], [100.0, -120.0, 200.0]])
    covariance = root @ root.T
    brute = rng.multivariate_normal(mean, covariance, 1_000_000)
    brute = brute[(brute > 0).all(axis=1)]
    log_mass = compute_log_mass(mean, covariance)
    assert np.exp(log_mass) == pytest.approx(len(brute) / 1e6, rel=0.01)
    fractions = np.array([0.25, 0.5, 0.75])
    percentiles = compute_percentiles(mean, covariance, fractions)
    np.testing.assert_allclose(percentiles, np.quantile(brute, fractions, axis=0), atol=4.0)
    np.testing.assert_allclose(compute_mean(mean, covariance), brute.mean(axis=0), atol=3.0)
    samples = draw_samples(mean, covariance, rng, 100_000)
    np.testing.assert_allclose(
        np.quantile(samples, fractions, axis=0), np.quantile(brute, fractions, axis=0), atol=5.0
    )
    np.testing.assert_allclose(np.cov(samples.T), np.cov(brute.T), rtol=0.05, atol=500.0)


def test_samples_are_positive_and_distributed_as_they_should(pair, rng):
    mean, covariance = pair
    samples = draw_samples(mean, covariance, rng, 20_000)
    assert samples.shape == (20_000, 2)
    assert (samples > 0).all()
    sds = np.sqrt(np.diag(covariance))
    axes = [np.linspace(0, max(m, 0) + 9 * s, 1201) for m, s in zip(mean, sds, strict=True)]
    density = multivariate_normal(mean, covariance).pdf(np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1))
    for i, axis in enumerate(axes):
        marginal = np.trapezoid(density, axes[1 - i], axis=1 - i)
        cumulative = np.append(0, np.cumsum(marginal[1:] + marginal[:-1]))
        cumulative /= cumulative[-1]
        assert kstest(samples[:, i], partial(np.interp, xp=axis, fp=cumulative)).pvalue > 1e-4


def test_samples_of_a_contest_of_five_are_distributed_as_they_should(rng):
    contest = Contest([1.0, 30.0, 5.0, 1000.0])
    samples = draw_samples(contest.mean, contest.covariance, rng, 20_000)
    axis = np.linspace(0, 12, 600)
    cumulative = np.array([1 - contest.exceed(x) for x in axis])
    for i in range(4):
        assert kstest(samples[:, i] / contest.sds[i], partial(np.interp, xp=axis, fp=cumulative)).pvalue > 1e-4


@pytest.mark.parametrize("distance", [10.0, 40.0, 1e4, 1e8])
def test_samples_however_far_in_the_tail_are_found(distance, rng):
    mean, covariance = np.array([-300.0 * distance]), np.array([[300.0**2]])
    excesses = draw_samples(mean, covariance, rng, 5000)[:, 0] / 300.0 * distance
    assert (excesses > 0).all()
    # Where truncnorm's own digits end the distribution is exponential, up to 1 / distance^2.
    expected = truncnorm(distance, np.inf, loc=-(distance**2), scale=distance).cdf if distance < 1e3 else "expon"
    assert kstest(excesses, expected).pvalue > 1e-4


@pytest.mark.parametrize("name", CASES)
def test_even_samples_have_the_distribution_of_independent_ones(name, rng):
    """Samples of two correlated coordinates and an independent one pass Kolmogorov and Smirnov's test at 0.001."""
    mean, covariance = np.array([*CASES[name][0], 2000.0]), np.zeros((3, 3))
    covariance[:2, :2], covariance[2, 2] = CASES[name][1], 3000.0**2
    samples = draw_samples(mean, covariance, rng, 3000, is_even=True)
    assert (samples > 0.0).all()
    independent = draw_samples(mean, covariance, rng, 20_000)
    for i in range(3):
        assert ks_2samp(samples[:, i], independent[:, i]).pvalue > 1e-3
    assert np.corrcoef(samples.T) == pytest.approx(np.corrcoef(independent.T), abs=0.06)


def test_means_of_even_samples_are_far_more_accurate_and_their_order_is_random(rng):
    mean, covariance = np.array([1000.0, 3000.0]), np.diag([4000.0**2, 1000.0**2])
    samples = draw_samples(mean, covariance, rng, 3000, is_even=True)
    error = samples.std(axis=0) / np.sqrt(3000)
    assert (np.abs(samples.mean(axis=0) - compute_mean(mean, covariance)) < 0.1 * error).all()
    # A product of both, too.
    product = np.prod(compute_mean(mean, covariance))
    assert abs(samples.prod(axis=1).mean() - product) < 0.2 * samples.prod(axis=1).std() / np.sqrt(3000)
    # Every second one is as far off as any half of them would be, and not one half of what is believed.
    for part in (samples[::2], samples[::4], samples[1::4]):
        off = np.abs(part.mean(axis=0) - samples.mean(axis=0)) / samples.std(axis=0) * np.sqrt(len(part))
        assert (off < 4.0).all()
        assert (off > 1e-3).all()


def test_samples_depend_on_nothing_but_the_seed():
    mean, covariance = np.array([-40.0, -40.0]), correlate([1.0, 1.0], 0.999)
    first, second = (draw_samples(mean, covariance, np.random.default_rng(3), 100) for _ in range(2))
    np.testing.assert_array_equal(first, second)
    assert (first != draw_samples(mean, covariance, np.random.default_rng(4), 100)).all()


def test_weights_of_proposals_are_bounded_and_their_mean_is_the_mass(rng):
    contest = Contest([1.0, 30.0, 5.0, 1000.0])
    proposal = tilting.build_proposal(contest.mean, contest.covariance)
    _, log_weights = tilting.propose(proposal, 1 - rng.random((100_000, 4)))
    assert log_weights.max() <= 1e-9
    weights = np.exp(log_weights + proposal.log_bound)
    standard_error = weights.std() / np.sqrt(len(weights))
    assert abs(weights.mean() - 1 / 5) < 5 * standard_error
    assert standard_error < 1e-3


@pytest.mark.parametrize("size", [2, 3])
def test_a_quarter_of_the_proposals_is_accepted_whatever_the_distribution(size, rng):
    for _ in range(100):
        mean, covariance = draw_distribution(rng, size, narrowest=1e-4, farthest=10.0 ** rng.uniform(-1, 2))
        _, log_weights = tilting.propose(tilting.build_proposal(mean, covariance), 1 - rng.random((4000, size)))
        assert log_weights.max() < 1e-3
        # The standard error of the mean of 4000 weights within [0, 1] is 0.008 at most.
        assert np.exp(log_weights).mean() > 0.25 - 3 * 0.008


def test_too_few_accepted_proposals_are_reported(rng, monkeypatch):
    monkeypatch.setattr("affordance.belief.truncated_normal._MAX_BATCHES", 1)
    mean, covariance = np.array([-40.0, -40.0]), correlate([1.0, 1.0], 0.999)
    with pytest.raises(
        AffordanceError, match=r"of 1000 proposals for 2 coordinates .* were accepted, 1000 were wanted"
    ):
        draw_samples(mean, covariance, rng, 1000)


@pytest.mark.parametrize("seed", range(8))
def test_everything_is_finite_positive_and_consistent_for_random_distributions(seed):
    rng = np.random.default_rng(seed)
    for size in (1, 2, 2, 2, 3, 4):
        farthest = 10.0 ** rng.uniform(-1, np.log10(40))
        mean, covariance = draw_distribution(rng, size, narrowest=3e-4, farthest=farthest)
        log_mass = compute_log_mass(mean, covariance)
        assert np.isfinite(log_mass)
        assert log_mass < 1e-9
        percentiles = compute_percentiles(mean, covariance, MANY_FRACTIONS)
        assert np.isfinite(percentiles).all()
        assert (percentiles > 0).all()
        assert (np.diff(percentiles, axis=0) > 0).all()
        samples = draw_samples(mean, covariance, rng, 4000)
        assert np.isfinite(samples).all()
        assert (samples > 0).all()
        standard_errors = samples.std(axis=0) / np.sqrt(4000)
        assert (np.abs(samples.mean(axis=0) - compute_mean(mean, covariance)) < 5 * standard_errors).all()
        # Of 4000 samples 2000 are expected below, with a standard error of 32.
        medians = percentiles[MANY_FRACTIONS == 0.5]
        assert (np.abs((samples < medians).sum(axis=0) - 2000) < 5 * 32).all()


def test_mode_is_the_constrained_maximum(pair):
    mean, covariance = pair
    precision = np.linalg.inv(covariance)
    floor = 10.0
    mode = compute_mode(mean, precision, floor)
    scale = np.sqrt(np.diag(covariance))

    def compute_cost(z):
        deviation = floor + z * scale - mean
        return float(0.5 * deviation @ precision @ deviation)

    found = minimize(compute_cost, np.ones(2), bounds=[(0, None)] * 2, tol=1e-14)
    np.testing.assert_allclose(mode, floor + found.x * scale, atol=1e-3 * scale.max())
    assert (mode >= floor).all()
