"""Tempered sequential Monte Carlo for posteriors with a standard normal prior.

The sampler moves draws from the prior to the posterior through increasing powers of the likelihood. Each power is the
largest for which the effective sample size is at least half. After each stage, draws are resampled and moved with
Metropolis random walks that are scaled to their covariance. Gradients are not used, because the likelihood involves
discrete hypotheses. The likelihood is estimated with common random numbers, so it is a deterministic function.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import scipy  # not scipy.stats, which takes half a second to import: it is imported on first use
from scipy.special import logsumexp

from affordance.arrays import Array

_SHARE = 0.5  # smallest effective sample size at each stage, as a fraction of the number of draws
_MOST_STAGES = 100


class Draws(NamedTuple):
    """Draws from a posterior.

    Attributes:
        normal: Draws in standard normal coordinates, (D, F).
        log_likelihoods: Terms of the log likelihood of each draw, (D, ...).
        powers: Power of the likelihood after each stage, (chains, stages), up to 1 and then padded with NaN.
        acceptance: Acceptance rate of the random walks in each stage, (chains, stages).
        log_evidence: Log marginal likelihood.
        prior_normal: Prior draws with which the sampler started, (D, F).
        prior_log_likelihoods: Terms of the log likelihood of each prior draw, (D, ...).
    """

    normal: Array
    log_likelihoods: Array
    powers: Array
    acceptance: Array
    log_evidence: float
    prior_normal: Array
    prior_log_likelihoods: Array


def draw_prior(count: int, size: int, seed: int) -> Array:
    """Draws standard normal numbers from a scrambled Sobol sequence, (count, size)."""
    sobol = scipy.stats.qmc.Sobol(size, rng=np.random.default_rng(seed))
    points = sobol.random_base2(int(np.ceil(np.log2(count))))[:count]
    numbers: Array = scipy.stats.norm.ppf(np.clip(points, 1e-9, 1.0 - 1e-9))
    return numbers


def sample(compute: Callable[[Array], Array], size: int, *, count: int, moves: int, seed: int) -> Draws:
    """Samples the posterior of F parameters.

    Args:
        compute: Function that computes the terms of the log likelihood, (D, ...), for D parameter vectors, (D, F).
        size: Number F of parameters.
        count: Number D of draws.
        moves: Number of random-walk steps after each stage.
        seed: Seed of the random numbers.
    """
    rng = np.random.default_rng([seed, 1])
    start = normal = draw_prior(count, size, seed)
    first = parts = compute(normal)
    power, log_evidence = 0.0, 0.0
    powers: list[float] = []
    acceptance: list[float] = []
    while power < 1.0 and len(powers) < _MOST_STAGES:
        total = _sum(parts)
        step = _find_step(total, 1.0 - power)
        weights = step * total
        log_evidence += float(logsumexp(weights)) - np.log(count)
        power = 1.0 if step >= 1.0 - power else power + step
        normalised = np.exp(weights - logsumexp(weights))
        places = np.searchsorted(np.cumsum(normalised), (rng.random() + np.arange(count)) / count)
        chosen = np.minimum(places, count - 1)
        normal, parts = normal[chosen], parts[chosen]
        accepted = 0.0
        scale = 2.38 / np.sqrt(size)
        for _ in range(moves):
            root = np.linalg.cholesky(np.atleast_2d(np.cov(normal.T)) + 1e-6 * np.eye(size))
            proposed = normal + scale * rng.standard_normal((count, size)) @ root.T
            found = compute(proposed)
            log_prior = 0.5 * ((normal**2).sum(axis=1) - (proposed**2).sum(axis=1))
            is_taken = np.log(rng.random(count)) < power * (_sum(found) - _sum(parts)) + log_prior
            normal = np.where(is_taken[:, None], proposed, normal)
            parts = np.where(is_taken.reshape(-1, *[1] * (parts.ndim - 1)), found, parts)
            accepted += float(is_taken.mean()) / moves
        powers.append(power)
        acceptance.append(accepted)
    return Draws(normal, parts, np.array([powers]), np.array([acceptance]), log_evidence, start, first)


def merge(chains: Sequence[Draws]) -> Draws:
    """Concatenates the draws of independent samplers, and averages their evidence."""
    stages = max(each.powers.shape[1] for each in chains)
    powers, acceptance = (
        np.vstack([np.pad(each, ((0, 0), (0, stages - each.shape[1])), constant_values=np.nan) for each in parts])
        for parts in ([each.powers for each in chains], [each.acceptance for each in chains])
    )
    evidence = float(logsumexp([each.log_evidence for each in chains])) - np.log(len(chains))
    normal, parts, start, first = (
        np.concatenate([getattr(each, name) for each in chains])
        for name in ("normal", "log_likelihoods", "prior_normal", "prior_log_likelihoods")
    )
    return Draws(normal, parts, powers, acceptance, evidence, start, first)


def _sum(parts: Array) -> Array:
    total: Array = parts.reshape(len(parts), -1).sum(axis=1)
    return total


def _find_step(total: Array, most: float) -> float:
    """Finds the largest increase in power, up to ``most``, with enough effective draws, using bisection."""

    def count(step: float) -> float:
        weights = np.exp(step * (total - total.max()))
        return float(weights.sum() ** 2 / (weights**2).sum())

    wanted = _SHARE * len(total)
    if count(most) >= wanted:
        return most
    low, high = 0.0, most
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if count(middle) >= wanted else (low, middle)
    return max(low, 1e-9 * most)
