import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.stats import multivariate_normal, multivariate_t

from affordance.extensions.payload.posterior.body_proposal import Proposal
from affordance.extensions.payload.posterior.solid_prior import Normals, SolidPrior


@pytest.fixture
def proposal(rng):
    solid = SolidPrior.for_hand()
    kinds = Normals(solid.kinds.means + 0.1, 0.1 * solid.kinds.covariances)
    return Proposal.build(kinds, np.array([0.0, -1.0, 1.0, -50.0]), solid)


def _compute_log_density(proposal, theta):
    return proposal.compute_log_density(theta, proposal.prior.compute_log_density(theta))


def test_density_is_that_of_the_t_distributions_and_the_prior(proposal):
    theta = proposal.draw(np.random.default_rng(1), 40)
    about = sum(
        share * multivariate_t(mean, shape, df=8.0).pdf(theta)
        for share, mean, shape in zip(proposal.shares, proposal.kinds.means, proposal.kinds.covariances, strict=True)
    )
    kinds = proposal.prior.kinds
    prior = np.mean([multivariate_normal(*k).pdf(theta) for k in zip(kinds.means, kinds.covariances, strict=True)], 0)
    log_density = _compute_log_density(proposal, theta) - 5.0 * np.log(2.0 * np.pi)
    assert_allclose(log_density, np.log(0.95 * about + 0.05 * prior), rtol=1e-8)


@pytest.mark.parametrize("num", [4000, 8000])
def test_samples_are_those_of_the_density(proposal, num):
    """Samples weighted by the prior's density over their own have the prior's moments, by either way to draw them."""
    theta = proposal.draw(np.random.default_rng(2), num)
    weights = np.exp(proposal.prior.compute_log_density(theta) - _compute_log_density(proposal, theta))
    assert theta.shape == (num, 10)
    assert np.mean(weights) == pytest.approx(1.0, abs=5.0 * weights.std() / np.sqrt(num))
    sd = np.sqrt(np.diag(proposal.prior.covariance))
    error = (weights[:, None] * (theta - proposal.prior.mean) / sd).std(axis=0) / np.sqrt(num)
    assert (np.abs(weights @ (theta - proposal.prior.mean) / num / sd) < 5.0 * error).all()
    assert weights.max() < 21.0  # the prior's share bounds them


def test_refit_moves_to_the_samples_kind_by_kind(proposal):
    rng, solid = np.random.default_rng(3), proposal.prior
    target = Normals(proposal.kinds.means, 0.05 * solid.kinds.covariances)
    theta = np.concatenate(
        [
            target.means[k] + rng.standard_normal((count, 10)) @ target.roots[k].T
            for k, count in ((0, 3000), (2, 1000))
        ]
    )
    weights = np.full(4000, 1.0 / 4000)
    refitted = proposal.refit(theta, weights)
    far = _compute_log_density(proposal, theta).mean()
    assert _compute_log_density(refitted, theta).mean() > far
    assert refitted.shares[0] > 0.5 > refitted.shares[2] > 0.15
    assert_allclose(refitted.shares.sum(), 1.0)
    assert (np.linalg.eigvalsh(refitted.kinds.covariances) > 0.0).all()
    few = proposal.refit(theta, np.where(np.arange(4000) < 20, 0.05, 0.0))
    assert_allclose(few.kinds.means, proposal.kinds.means)
    assert few.shares[0] > 0.5
