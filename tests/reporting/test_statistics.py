import numpy as np
import pytest

from affordance.reporting.statistics import estimate_mean, estimate_proportion


def test_interval_is_students():
    values = np.array([[1.0, 10.0], [2.0, 10.0], [3.0, 10.0]])
    estimate = estimate_mean(values)
    np.testing.assert_allclose(estimate.mean, [2, 10])
    # t(0.975, 2) = 4.302653, standard error 1 / sqrt(3).
    half = [4.302653 / np.sqrt(3), 0.0]
    np.testing.assert_allclose(estimate.high - estimate.mean, half, atol=1e-6)
    np.testing.assert_allclose(estimate.mean - estimate.low, half, atol=1e-6)
    np.testing.assert_array_equal(estimate.ci95[0], [estimate.low[0], estimate.high[0]])


def test_interval_covers_the_mean_as_often_as_it_says(rng):
    samples = rng.normal(3.0, 2.0, (8, 4000))
    estimate = estimate_mean(samples)
    assert np.mean((estimate.low <= 3.0) & (estimate.high >= 3.0)) == pytest.approx(0.95, abs=0.012)


def test_single_repeat_has_an_interval_of_its_value():
    estimate = estimate_mean(np.array([[1.0, 2.0]]))
    np.testing.assert_array_equal(estimate.ci95, [[1.0, 1.0], [2.0, 2.0]])


def test_wilsons_interval_of_a_published_case():
    """Wilson's interval of 4 of 10 is 0.1682 to 0.6873, by Brown, Cai & DasGupta's form and in Newcombe 1998."""
    estimate = estimate_proportion(np.array(4.0), 10)
    assert estimate.low == pytest.approx(0.1682, abs=1e-4)
    assert estimate.high == pytest.approx(0.6873, abs=1e-4)


def test_wilsons_interval_stays_between_nought_and_one():
    estimate = estimate_proportion(np.array([0.0, 20.0]), 20)
    np.testing.assert_allclose([estimate.low[0], estimate.high[1]], [0.0, 1.0], atol=1e-15)
    assert estimate.high[0] == pytest.approx(1.959964**2 / (20 + 1.959964**2), rel=1e-6)
