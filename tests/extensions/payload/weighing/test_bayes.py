"""The regression is Student's t where the prior is wide, and its draws and evidences are those of the posterior."""

import numpy as np
import pytest
import scipy
from numpy.testing import assert_allclose

from affordance.extensions.payload.weighing.bayes import regress

WIDE = 1e3


def make(seed, n=12):
    rng = np.random.default_rng(seed)
    X = np.column_stack([np.ones(n), rng.standard_normal((n, 2))])
    return X, X @ [1.0, -2.0, 0.5] + 0.3 * rng.standard_normal(n)


def test_quantiles_are_those_of_students_t():
    X, y = make(0)
    draws = regress(X, y, np.full((1, 3), WIDE)).draw(100_000, np.random.default_rng(1))
    b, left = np.linalg.lstsq(X, y)[:2]
    freedom = len(y) - 3
    sd = np.sqrt(left[0] / freedom * np.diagonal(np.linalg.inv(X.T @ X)))
    for p in (0.05, 0.25, 0.75, 0.95):
        expected = b + scipy.stats.t.ppf(p, freedom) * sd
        assert_allclose((np.quantile(draws, p, axis=0) - expected) / sd, 0.0, atol=0.04)


def test_evidence_is_the_integral_of_likelihood_times_prior():
    """Against an integral by brute force, for one coefficient."""
    x, y, sd = np.array([1.0, 2.0, -1.0]), np.array([0.9, 2.2, -0.7]), 0.8
    b, log_sigma = np.meshgrid(np.linspace(-4.0, 4.0, 1601), np.linspace(-8.0, 4.0, 1201), indexing="ij")
    sigma = np.exp(log_sigma)
    log = -0.5 * ((y - b[..., None] * x) ** 2).sum(axis=-1) / sigma**2 - 3.0 * log_sigma
    joint = np.exp(log) * np.exp(-0.5 * (b / sd) ** 2) / (sd * np.sqrt(2.0 * np.pi))
    expected = np.log(joint.sum() * 0.005 * 0.01)
    assert regress(x[:, None], y, np.array([[sd]])).log_evidence == pytest.approx(expected, abs=0.02)


def test_a_coefficient_that_nothing_shows_keeps_its_prior():
    X, y = make(2)
    fit = regress(np.column_stack([X, np.zeros(len(y))]), y, np.array([[WIDE, WIDE, WIDE, 0.7]]))
    last = fit.draw(50_000, np.random.default_rng(0))[:, 3]
    assert (last.mean(), last.std()) == (pytest.approx(0.0, abs=0.02), pytest.approx(0.7, rel=0.02))


def test_wide_spreads_gain_weight_where_coefficients_are_large():
    rng = np.random.default_rng(3)
    X = np.kron(np.eye(8), np.ones((6, 1)))
    spreads = np.array([[0.1] * 8, [1.0] * 8])
    for true, wins in ((0.1, 0), (1.0, 1)):
        y = X @ (true * rng.standard_normal(8)) + 0.05 * rng.standard_normal(48)
        fit = regress(X, y, spreads)
        assert fit.weights.reshape(2, -1).sum(axis=1)[wins] > 0.9
