"""Tempered SMC: posteriors and evidence of normal distributions in closed form."""

import numpy as np
import pytest
from scipy.stats import norm

from affordance.extensions.people.tempered_smc import draw_prior, sample


def test_posterior_and_evidence_of_a_normal_likelihood():
    """Prior N(0, 1), data 1.5 with SD .2: posterior N(1.5 / 1.04, .04 / 1.04), evidence N(1.5; 0, 1.04)."""
    draws = sample(lambda z: norm.logpdf(1.5, z, 0.2), 1, count=2000, moves=3, seed=0)
    assert draws.normal.mean() == pytest.approx(1.5 / 1.04, abs=0.02)
    assert draws.normal.std() == pytest.approx(np.sqrt(0.04 / 1.04), rel=0.05)
    assert draws.log_evidence == pytest.approx(norm.logpdf(1.5, 0.0, np.sqrt(1.04)), abs=0.1)
    assert draws.powers[0, -1] == 1.0
    assert (np.diff(draws.powers) > 0.0).all()
    assert ((draws.acceptance > 0.1) & (draws.acceptance < 0.9)).all()
    np.testing.assert_allclose(draws.log_likelihoods, norm.logpdf(1.5, draws.normal, 0.2))
    np.testing.assert_allclose(draws.prior_log_likelihoods, norm.logpdf(1.5, draws.prior_normal, 0.2))


def test_parts_of_a_likelihood_are_kept_and_their_sum_counts():
    """Two parameters, each measured in a part of its own, and correlated by a third part about their sum."""

    def compute(z):
        return np.column_stack([norm.logpdf(1.0, z[:, 0], 0.5), norm.logpdf(0.0, z.sum(axis=1), 0.1)])

    draws = sample(compute, 2, count=2000, moves=3, seed=1)
    precision = np.eye(2) + np.diag([4.0, 0.0]) + 100.0 * np.ones((2, 2))
    mean = np.linalg.solve(precision, [4.0, 0.0])
    np.testing.assert_allclose(draws.normal.mean(axis=0), mean, atol=0.05)
    np.testing.assert_allclose(np.cov(draws.normal.T), np.linalg.inv(precision), atol=0.05)
    assert draws.log_likelihoods.shape == (2000, 2)


def test_a_flat_likelihood_leaves_the_prior():
    draws = sample(lambda z: np.zeros(len(z)), 1, count=512, moves=1, seed=0)
    assert draws.powers.tolist() == [[1.0]]
    assert draws.log_evidence == pytest.approx(0.0)
    assert (draws.normal.mean(), draws.normal.std()) == pytest.approx((0.0, 1.0), abs=0.1)


def test_draws_of_the_prior_fill_it_evenly():
    drawn = draw_prior(64, 2, 0)
    assert drawn.shape == (64, 2)
    counts = np.histogram(norm.cdf(drawn[:, 0]), bins=np.linspace(0, 1, 9))[0]
    assert counts.tolist() == [8] * 8
