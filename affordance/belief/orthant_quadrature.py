"""Integrates a normal distribution over positive values by nested quadrature, for a few coordinates.

P(x > 0) is an integral over the first coordinate: its density times the probability that all other coordinates are
positive given its value. This probability is again such an integral. All integrals are evaluated in logs and over a
window around the integrand's maximum. Probabilities of exp(-1000) and correlations of 0.999999 are therefore
accurate.
"""

from functools import cache

import numpy as np
from scipy.special import log_ndtr

from affordance.arrays import Array

# Log ratio of an integrand's maximum to its value at the ends of the window; the rest is below rounding errors.
_LOG_DROP = 40.0
# Nodes in each of the three parts of an interval: around the start of the window, inside it, and around its end.
_NODES_A_PART = 12
# Largest number of searches for the ends of a window. Each reduces the uncertainty of the ends by a factor of eleven.
_MAX_SEARCHES = 20
# Smallest and largest number of nodes. For log masses, the number is doubled until every second node gives the same
# result within the tolerance. Doubling squares the error of the rule, so the result is then exact. Tables of
# marginals use the largest number.
_NUM_NODES = 129
_MAX_NODES = 1025
_AGREEMENT = 1e-8


def compute_log_mass(mean: Array, covariance: Array) -> float:
    """Computes log P(x > 0) for x ~ N(mean, covariance)."""
    return float(_compute_log_masses(mean[None], np.linalg.cholesky(covariance))[0])


def tabulate_marginal(mean: Array, covariance: Array, i: int) -> tuple[Array, Array]:
    """Tabulates the marginal of coordinate i given x > 0 for x ~ N(mean, covariance).

    Returns:
        Increasing nodes and their shares of the probability, (K,) each, up to a factor. As a function of the node's
        index, the share is smooth and vanishes at both ends.
    """
    order = np.append(i, np.delete(np.arange(len(mean)), i))
    root = np.linalg.cholesky(covariance[np.ix_(order, order)])
    nodes, log_shares = _place_nodes(mean[None, order], root, _MAX_NODES)
    return nodes[0], np.exp(log_shares[0] - log_shares.max())


def _compute_log_masses(means: Array, root: Array, num_nodes: int = _NUM_NODES) -> Array:
    """Computes log P(x > 0), (N,), for N means, (N, M), and one covariance L L^T."""
    if means.shape[1] == 1:
        log_mass: Array = log_ndtr(means[:, 0] / root[0, 0])
        return log_mass
    _, log_shares = _place_nodes(means, root, num_nodes)
    largest = log_shares.max(axis=1)
    shares = np.exp(log_shares - largest[:, None])
    log_masses: Array = largest + np.log(shares.sum(axis=1))
    if num_nodes < _MAX_NODES:
        rough = np.abs(2.0 * shares[:, ::2].sum(axis=1) / shares.sum(axis=1) - 1.0) > _AGREEMENT
        if rough.any():
            log_masses[rough] = _compute_log_masses(means[rough], root, 2 * num_nodes - 1)
    return log_masses


def _place_nodes(means: Array, root: Array, num_nodes: int) -> tuple[Array, Array]:
    """Places quadrature nodes along the first coordinate.

    The integrand is log-concave, so it falls off quickly wherever its curvature is large. Narrow features are
    therefore at the ends of its window, where the double-exponential rule has most of its nodes.

    Returns:
        Nodes, and the log of each node's share of P(x > 0), (N, K) each.
    """
    lower, upper = _find_windows(means, root)
    positions, weights = _build_rule(num_nodes)
    nodes = lower + (upper - lower) * positions
    return nodes, _compute_log_marginal(nodes, means, root) + np.log(weights * (upper - lower))


def _find_windows(means: Array, root: Array) -> tuple[Array, Array]:
    """Finds the interval of the first coordinate that contributes to the integral.

    A concave function exceeds a level on one interval. Nodes are added around both ends of this interval until the
    function at the ends is below its maximum by at most twice the required drop.

    Returns:
        Lower and upper ends of the window, (N, 1) each.
    """
    even = np.linspace(0.0, 1.0, _NODES_A_PART)
    nodes = (np.maximum(means[:, :1], 0.0) + 12.0 * root[0, 0]) * _build_rule(3 * _NODES_A_PART)[0]
    nodes[:, 0] = 0.0
    lower, upper = np.empty((2, len(means), 1))
    unsettled = np.arange(len(means))
    for _ in range(_MAX_SEARCHES):
        log_density = _compute_log_marginal(nodes, means[unsettled], root)
        fall = log_density.max(axis=1, keepdims=True) - log_density
        first = (fall < _LOG_DROP).argmax(axis=1)
        last = nodes.shape[1] - 1 - (fall < _LOG_DROP)[:, ::-1].argmax(axis=1)
        # Correlated coordinates can shift the maximum far above the mean of this coordinate.
        is_open = last == nodes.shape[1] - 1
        before, after = np.maximum(first - 1, 0), np.where(is_open, last, last + 1)
        rows = np.arange(len(nodes))
        ends = np.where(is_open, 8.0 * nodes[:, -1], nodes[rows, after])
        parts = np.stack([nodes[rows, before], nodes[rows, first], nodes[rows, last], ends])[:, :, None]  # (4, N, 1)
        lower[unsettled], upper[unsettled] = parts[0], parts[3]
        is_far = is_open | (np.maximum(fall[rows, before], fall[rows, after]) > 2.0 * _LOG_DROP)
        if not is_far.any():
            break
        unsettled, parts = unsettled[is_far], parts[:, is_far]
        nodes = np.concatenate(parts[:-1] + np.diff(parts, axis=0) * even, axis=1)
    return lower, upper


def _compute_log_marginal(nodes: Array, means: Array, root: Array) -> Array:
    """Computes the log of p(x_1) P(x_2, ..., x_M > 0 | x_1) at nodes x_1, (N, K)."""
    z = (nodes - means[:, :1]) / root[0, 0]
    conditional_means = means[:, None, 1:] + z[..., None] * root[1:, 0]  # (N, K, M - 1)
    log_others = _compute_log_masses(conditional_means.reshape(-1, len(root) - 1), root[1:, 1:]).reshape(z.shape)
    log_marginal: Array = log_others - 0.5 * z**2 - np.log(root[0, 0] * np.sqrt(2.0 * np.pi))
    return log_marginal


@cache
def _build_rule(num_nodes: int) -> tuple[Array, Array]:
    """Returns positions and weights, (K,) each, of the double-exponential rule on (0, 1) (Takahasi & Mori 1974)."""
    # Beyond |t| = 3.2 the weights are below rounding error.
    t, step = np.linspace(-3.2, 3.2, num_nodes, retstep=True)
    positions = 1.0 / (1.0 + np.exp(-np.pi * np.sinh(t)))
    return positions, step * np.pi * np.cosh(t) * positions * positions[::-1]
