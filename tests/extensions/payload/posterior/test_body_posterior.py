import numpy as np
import pytest
from helpers.generated_runs import build_likelihood
from numpy.testing import assert_allclose
from scipy.stats import kstest, multivariate_normal, multivariate_t
from scipy.stats.qmc import Sobol, discrepancy

from affordance.extensions.payload.evidence.joint_statistics import ChannelSamples, compute_statistics
from affordance.extensions.payload.evidence.payload_likelihood import BodyLikelihood, PayloadLikelihood
from affordance.extensions.payload.posterior import body_posterior
from affordance.extensions.payload.posterior.body_posterior import (
    MAX_DIMENSION,
    Mode,
    Proposal,
    WeightedBodies,
    draw_bodies,
    draw_even_points,
    guess_theta,
    improve_mode,
    list_directions,
    measure_step,
)
from affordance.extensions.payload.posterior.log_cholesky import parameters_from_theta, theta_from_parameters
from affordance.extensions.payload.posterior.payload_belief import describe_bodies, summarise
from affordance.extensions.payload.posterior.solid_prior import Normals, SolidPrior

_VARIANCE = 0.2


def _hold(
    pi: np.ndarray, rng: np.random.Generator, rows: int = 60, gain_sd: float = 0.01, variance: float = _VARIANCE
) -> PayloadLikelihood:
    """Torques of two joints along a random motion."""
    Y = rng.standard_normal((rows, 2, 10)) * np.array([9.0, *[6.0] * 3, *[2.0] * 6])
    gain = 1.0 + gain_sd * rng.standard_normal(2)
    signal = gain * (Y @ pi) + np.sqrt(variance) * rng.standard_normal((rows, 2))
    return build_likelihood(Y, signal, variance, gain_sd)


def _find_mode(likelihood: PayloadLikelihood, prior: SolidPrior) -> Mode:
    """The most probable body, by Gauss-Newton iteration."""
    theta = guess_theta(likelihood, prior)
    load = parameters_from_theta(theta)
    for _ in range(60):
        mode = improve_mode(likelihood, prior, theta, load)
        step, theta, load = mode.theta - theta, mode.theta, mode.load
        if measure_step(step, mode) < 1e-8:
            break
    return mode


def test_posterior_agrees_with_a_random_walk(rng):
    solid = SolidPrior.for_hand()
    likelihood = _hold(solid.draw_parameters(rng, 1)[0], rng, rows=4)
    mode = _find_mode(likelihood, solid)
    bodies = draw_bodies(likelihood, solid, mode, rng, 4000)
    ours = summarise(describe_bodies(bodies.pi), bodies.weights)
    # Metropolis from many starts: slow, but another way to the same posterior.
    theta = solid.draw_theta(rng, 400)
    theta[:] = mode.theta + 0.1 * (theta - mode.theta)
    root = np.linalg.cholesky(mode.covariance)

    def evaluate(theta):
        return likelihood.compute_log_likelihood(parameters_from_theta(theta)) + solid.compute_log_density(theta)

    value, kept = evaluate(theta), []
    for step in range(1200):
        moved = theta + 0.6 * 0.5 ** (step % 3) * rng.standard_normal(theta.shape) @ root.T
        new = evaluate(moved)
        accepted = np.log(rng.random(len(theta))) < new - value
        theta[accepted], value[accepted] = moved[accepted], new[accepted]
        if step >= 500 and step % 20 == 0:
            kept.append(theta.copy())
    walked = describe_bodies(parameters_from_theta(np.concatenate(kept)))
    for i in range(7):
        low, high = np.quantile(walked[:, i], [0.05, 0.95])
        assert_allclose([ours.low90[i], ours.high90[i]], [low, high], atol=0.12 * (high - low))


def test_kinds_are_proposed_as_probable_as_they_are():
    """Laplace's shares of kinds differ from those of samples by less than 0.15, in the mean over bodies."""
    rng, solid, apart = np.random.default_rng(2), SolidPrior.for_hand(), []
    for _ in range(12):
        likelihood = _hold(solid.draw_parameters(rng, 1)[0], rng, rows=20, variance=0.02)
        mode = _find_mode(likelihood, solid)
        proposed = body_posterior._propose(BodyLikelihood(likelihood, mode.load), solid, mode).shares
        bodies = draw_bodies(likelihood, solid, mode, rng, 4000)
        count = bodies.weights > 1e-9  # others may be too thin for rounding
        belongs = np.exp(solid.compute_log_densities(theta_from_parameters(bodies.pi[count])))
        found = bodies.weights[count] @ (belongs / belongs.sum(axis=1, keepdims=True))
        apart.append(0.5 * np.abs(proposed - found).sum())
    assert np.mean(apart) < 0.15


def test_intervals_hold_truths_drawn_from_the_prior(rng):
    solid = SolidPrior.for_hand()
    inside = []
    for _ in range(60):
        pi = solid.draw_parameters(rng, 1)[0]
        likelihood = _hold(pi, rng, rows=20)
        bodies = draw_bodies(likelihood, solid, _find_mode(likelihood, solid), rng, 500)
        marginals, truth = summarise(describe_bodies(bodies.pi), bodies.weights), describe_bodies(pi[None])[0]
        inside.append((marginals.low90 <= truth) & (truth <= marginals.high90))
    # Ten numbers of each of 60 bodies: 90 % within four standard errors of independent bodies.
    assert np.mean(inside) == pytest.approx(0.9, abs=4.0 * np.sqrt(0.09 / 60) / np.sqrt(3))


def test_without_data_the_posterior_is_the_prior(rng):
    solid = SolidPrior.for_hand()
    likelihood = _hold(np.zeros(10), rng, rows=1)
    likelihood = PayloadLikelihood(compute_statistics(_empty_samples(), 10), likelihood.prior, np.full(2, _VARIANCE))
    bodies = draw_bodies(likelihood, solid, _find_mode(likelihood, solid), rng, 2000)
    after = np.log(bodies.pi[:, 0])
    assert_allclose(bodies.weights @ after, solid.mean[0], atol=0.15)
    sd = np.sqrt(bodies.weights @ (after - solid.mean[0]) ** 2)
    assert_allclose(sd, np.sqrt(solid.covariance[0, 0]), rtol=0.1)


def _empty_samples() -> ChannelSamples:
    zero = np.zeros((3, 2))
    return ChannelSamples(np.zeros((3, 2, 10)), zero, zero, zero, zero, zero, zero, np.zeros((3, 2), dtype=bool))


def test_effective_size_is_what_the_scatter_over_seeds_says(monkeypatch):
    """Effective size is within a factor of 3 of that by scatter over seeds, below 250 of 500 equal weights."""
    monkeypatch.setattr(body_posterior, "_MAX_REFITS", 1)  # more of them, and hardly a run is annealed
    rng, solid = np.random.default_rng([1, 1]), SolidPrior.for_hand()
    likelihood = _hold(solid.draw_parameters(rng, 1)[0], rng, rows=1, variance=0.002)
    mode = _find_mode(likelihood, solid)
    drawn = [draw_bodies(likelihood, solid, mode, np.random.default_rng(seed), 500) for seed in range(30)]
    runs = [bodies for bodies in drawn if np.all(bodies.weights == bodies.weights[0])]
    assert len(runs) > 12  # annealed
    means = np.array([bodies.weights @ bodies.pi for bodies in runs])
    spread = np.concatenate([bodies.pi for bodies in runs]).var(axis=0)
    independent = np.min(spread / means.var(axis=0, ddof=1))
    reported = np.median([bodies.effective_size for bodies in runs])
    assert independent < 250.0
    assert independent / 3.0 < reported < 3.0 * independent


def test_annealing_begins_with_samples_of_every_kind(monkeypatch):
    """Annealing keeps shares of 0.4 and 0.6 of two kinds that no move connects; of 4000 samples it moves 1000."""
    for name, value in (("_ENOUGH", 9.0), ("_ADAPTING", 1000), ("_MAX_REFITS", 1), ("_MAX_ROUNDS", 2)):
        monkeypatch.setattr(body_posterior, name, value)  # never enough by weights
    kinds = SolidPrior.for_hand().kinds
    means = kinds.means[:2].copy()
    means[:, 0] = np.log([0.1, 10.0])
    solid = SolidPrior(Normals(means, 0.01 * kinds.covariances[:2]), np.array([0.4, 0.6]))
    nothing = PayloadLikelihood(
        compute_statistics(_empty_samples(), 10), _hold(np.zeros(10), np.random.default_rng(0)).prior, np.ones(2)
    )
    for num_samples in (1000, 4000):
        bodies = draw_bodies(
            nothing, solid, _find_mode(nothing, solid), np.random.default_rng(num_samples), num_samples
        )
        assert bodies.pi.shape == (1000, 10)
        assert np.mean(bodies.pi[:, 0] > 1.0) == pytest.approx(0.6, abs=0.08)  # five standard errors


def test_effective_size_of_equal_independent_samples_is_their_number(rng):
    pi = rng.standard_normal((400, 10))
    bodies = WeightedBodies(pi, np.full(400, 1.0 / 400), np.arange(400))
    assert bodies.effective_size == pytest.approx(400.0)
    # Each of 40 samples ten times over is 40 samples.
    again = WeightedBodies(np.repeat(pi[:40], 10, axis=0), bodies.weights, np.repeat(np.arange(40), 10))
    assert again.effective_size == pytest.approx(40.0)


def test_direction_numbers_are_those_of_scipy() -> None:
    points = Sobol(MAX_DIMENSION, scramble=False, bits=30).random_base2(9)
    for dimension in range(MAX_DIMENSION):
        values = np.zeros(1, dtype=int)
        for direction in list_directions(dimension)[:9]:
            values = np.concatenate([values, values ^ direction])
        np.testing.assert_array_equal(np.sort(values / 2.0**30), np.sort(points[:, dimension]))
    # Pairs of coordinates, too: SciPy has the same points in another order.
    own = np.array([_list_plain(dimension, 9) for dimension in range(MAX_DIMENSION)]).T
    assert {tuple(row) for row in own} == {tuple(row) for row in points}


def _list_plain(dimension: int, levels: int) -> np.ndarray:
    values = np.zeros(1, dtype=int)
    for direction in list_directions(dimension)[:levels]:
        values = np.concatenate([values, values ^ direction])
    return values / 2.0**30


def test_every_beginning_is_as_even_as_those_of_scipy_and_evener_than_chance() -> None:
    for num_points in (256, 300):
        ours = np.mean([discrepancy(draw_even_points(np.random.default_rng(s), num_points, 5)) for s in range(8)])
        theirs = np.mean([discrepancy(Sobol(5, rng=s).random_base2(9)[:num_points]) for s in range(8)])
        chance = np.mean([discrepancy(np.random.default_rng(s).random((num_points, 5))) for s in range(8)])
        assert ours < 1.5 * theirs
        assert ours < 0.5 * chance


@pytest.mark.parametrize("row", [0, 5])
def test_a_point_is_uniformly_distributed_over_seeds(row: int) -> None:
    drawn = np.array([draw_even_points(np.random.default_rng(seed), 6, 2)[row] for seed in range(600)])
    assert drawn.min() > 0.0
    assert drawn.max() < 1.0
    for column in drawn.T:
        assert kstest(column, "uniform").pvalue > 1e-4


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
