import numpy as np
import pytest

from affordance.metrics import compute_drop, compute_excursion, compute_lift, estimate_mean


def test_drop_lift_and_excursion_of_exact_cases():
    heights = np.array([[0.0, -0.3, 0.1], [0.0, 0.2, 0.1], [0.0, 0.0, 0.0], [0.0, 0.1, -0.1]])
    np.testing.assert_array_equal(compute_drop(heights), [0.3, 0.0, 0.0, 0.1])
    np.testing.assert_array_equal(compute_lift(heights), [0.1, 0.2, 0.0, 0.1])
    np.testing.assert_array_equal(compute_excursion(heights), [-0.3, 0.2, 0.0, 0.1])


def test_excursion_works_over_any_leading_axes():
    heights = np.zeros((2, 3, 5))
    heights[1, 2, 4] = -0.5
    expected = np.zeros((2, 3))
    expected[1, 2] = -0.5
    np.testing.assert_array_equal(compute_excursion(heights), expected)


def test_interval_is_students(rng):
    values = np.array([[1.0, 10.0], [2.0, 10.0], [3.0, 10.0]])
    estimate = estimate_mean(values)
    np.testing.assert_allclose(estimate.mean, [2, 10])
    # t(0.975, 2) = 4.302653, standard error 1 / sqrt(3).
    np.testing.assert_allclose(estimate.high - estimate.mean, [4.302653 / np.sqrt(3), 0.0], atol=1e-6)
    np.testing.assert_array_equal(estimate.ci95[0], [estimate.low[0], estimate.high[0]])


def test_interval_covers_the_mean_as_often_as_it_says(rng):
    samples = rng.normal(3.0, 2.0, (8, 4000))
    estimate = estimate_mean(samples)
    assert np.mean((estimate.low <= 3.0) & (estimate.high >= 3.0)) == pytest.approx(0.95, abs=0.012)


def test_single_repeat_has_an_interval_of_its_value():
    estimate = estimate_mean(np.array([[1.0, 2.0]]))
    np.testing.assert_array_equal(estimate.ci95, [[1.0, 1.0], [2.0, 2.0]])
