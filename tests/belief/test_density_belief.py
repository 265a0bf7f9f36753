import numpy as np
import pytest
from helpers.refusals import refuse
from scipy.stats import chi2, f

from affordance.belief.density_belief import DENSITY_FLOOR, EMPTY_BELIEF, DensityBelief, PointEstimate, Prior
from affordance.belief.likelihood import Likelihood

PRIOR = Prior(mode=1000.0, sd=4000.0, deviation=0.06)


@pytest.fixture
def pair():
    return DensityBelief.from_moments(np.array([700.0, 7800.0]), np.array([[200.0**2, -3e4], [-3e4, 500.0**2]]))


def test_material_never_felt_gets_the_prior_and_leaves_others_alone(pair):
    extended = pair.extend(PRIOR, 2)
    np.testing.assert_allclose(extended.untruncated_mean, [700, 7800, 1000, 1000], rtol=1e-10)
    np.testing.assert_allclose(extended.covariance[:2, :2], pair.covariance, rtol=1e-10)
    np.testing.assert_allclose(extended.covariance[2:, 2:], 4000.0**2 * np.eye(2), rtol=1e-10)
    np.testing.assert_allclose(EMPTY_BELIEF.extend(PRIOR, 1).untruncated_mean, [1000.0])


def test_some_of_the_densities_are_believed_as_within_all(pair):
    swapped = pair.select([1, 0])
    np.testing.assert_allclose(swapped.untruncated_mean, [7800, 700], rtol=1e-12)
    np.testing.assert_allclose(swapped.covariance, [[500.0**2, -3e4], [-3e4, 200.0**2]], rtol=1e-12)
    assert pair.select([1]).covariance[0, 0] == pytest.approx(500.0**2)  # the precision alone would say less
    assert pair.select([]).size == 0
    assert pair.select([0, 1]) is pair


def test_one_object_is_less_certain_than_its_material(pair):
    """The variance of a product of independent variables, mu and 1 + delta, by its definition."""
    of_objects = pair.add_object_variation(0.2)
    squares = np.array([700.0**2 + 200.0**2, 7800.0**2 + 500.0**2])
    np.testing.assert_allclose(of_objects.covariance, pair.covariance + np.diag(0.04 * squares), rtol=1e-10)
    np.testing.assert_allclose(of_objects.untruncated_mean, pair.untruncated_mean, rtol=1e-10)


def test_log_evidence_agrees_with_brute_force(rng):
    belief = DensityBelief.from_moments(np.array([1000.0]), np.array([[4000.0**2]]))
    a, r, sd = np.array([2e-4, 1e-4]), np.array([1.7, 0.7]), 0.1
    likelihood = Likelihood(
        np.array([[a @ a]]) / sd**2, np.array([a @ r]) / sd**2, -0.5 * r @ r / sd**2 - np.log(2 * np.pi * sd**2)
    )
    rho = np.linspace(0, 40_000, 2_000_001)
    prior = np.exp(-0.5 * ((rho - 1000) / 4000) ** 2)
    prior /= np.trapezoid(prior, rho)
    squares = sum(((r[i] - a[i] * rho) / sd) ** 2 for i in range(2))
    evidence = np.trapezoid(prior * np.exp(-0.5 * squares) / (2 * np.pi * sd**2), rho)
    assert belief.compute_log_evidence(likelihood) == pytest.approx(np.log(evidence), abs=1e-8)


def test_no_point_of_a_belief_is_below_the_floor(rng):
    belief = DensityBelief.from_moments(np.array([-500.0]), np.array([[100.0**2]]))
    for point_estimate in PointEstimate:
        assert belief.compute_point_estimate(point_estimate, rng)[0] >= DENSITY_FLOOR


def test_points_of_a_broad_prior_differ_as_expected(rng):
    belief = EMPTY_BELIEF.extend(PRIOR, 1)
    mode, mean, median = (
        belief.compute_point_estimate(point_estimate, rng)[0]
        for point_estimate in (PointEstimate.MODE, PointEstimate.MEAN, PointEstimate.MEDIAN)
    )
    assert mode == 1000.0
    assert 2500 < median < mean < 4500
    samples = {belief.compute_point_estimate(PointEstimate.SAMPLE, rng)[0] for _ in range(5)}
    assert len(samples) == 5


def test_beliefs_that_are_no_distribution_are_refused():
    assert "must be finite" in refuse(DensityBelief, np.array([[np.nan]]), np.array([1.0]), error=ValueError)
    assert "positive definite" in refuse(DensityBelief, np.array([[0.0]]), np.array([1.0]), error=ValueError)


def test_belief_cannot_be_changed_in_place(pair):
    with pytest.raises(ValueError, match="read-only"):
        pair.information_vector[0] = 0.0
    with pytest.raises(ValueError, match="read-only"):
        pair.precision[0, 0] = 1.0


@pytest.mark.parametrize("distance", [0.5, 3.0, 6.0])
def test_p_value_is_that_of_the_chi_squared_distance_of_what_was_measured(pair, rng, distance):
    """The p-value of y = R rho + e is that of Mahalanobis' distance of y from R m, of covariance R C R^T + V."""
    R, V = 1e-3 * rng.normal(size=(4, 2)), np.diag([0.1, 0.2, 0.3, 0.4])
    covariance = R @ pair.covariance @ R.T + V
    off = np.linalg.cholesky(covariance) @ np.array([0.6, 0.0, 0.8, 0.0]) * distance
    y, weights = R @ pair.untruncated_mean + off, np.linalg.inv(V)
    log_peak = -0.5 * np.linalg.slogdet(2.0 * np.pi * V)[1]
    log_constant = log_peak - 0.5 * y @ weights @ y
    likelihood = Likelihood(R.T @ weights @ R, R.T @ weights @ y, log_constant, log_peak, 4)
    assert pair.compute_p_value(likelihood) == pytest.approx(chi2.sf(distance**2, 4), rel=1e-6)
    assert pair.compute_p_value(likelihood, 7.0) == pytest.approx(f.sf(distance**2 / 4, 4, 7), rel=1e-6)


@pytest.mark.parametrize(("size", "shown"), [(1, 1), (8, 8), (9, 7), (20, 7)])
def test_a_line_shows_at_most_eight_densities_or_seven_and_how_many_there_are(size, shown):
    text = DensityBelief.from_moments(np.full(size, 5000.0), np.eye(size)).describe()
    assert text.count("5000 ± 1") == shown
    assert (f"{size} in all" in text) == (size > shown)
