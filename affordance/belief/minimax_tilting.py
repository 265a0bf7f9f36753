"""Draws samples x ~ N(mean, L L^T) given x > 0.

Coordinates are drawn sequentially (Geweke, Hajivassiliou & Keane). Each has a normal distribution given the previous
coordinates, truncated at zero. With x = mean + L z, z_k must exceed a bound l_k, which depends on the previous
coordinates. Its excess over the bound is e_k = x_k / L_kk. Far in a tail, few such draws would be compatible with the
later bounds, so z_k is drawn from N(mu_k, 1) with a tilt mu_k. The weight of a point is its true density divided by
its proposal density:

    log w = sum_k [log Phi(t_k) + (t_k^2 - l_k^2) / 2 - mu_k e_k],    t_k = mu_k - l_k

The tilt minimises the largest weight (Z. I. Botev, "The normal law under linear restrictions: simulation and
estimation via minimax tilting", J. R. Stat. Soc. B 79, 2017). This weight is an upper bound of P(x > 0). With the
tilt, a large fraction of proposals is accepted.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray
from scipy.special import erfcx, log_ndtr, ndtri_exp

from affordance.arrays import Array

# Argument below which asymptotic expansions, whose error is 1e-10, are more accurate than differences.
_FAR_TAIL = -100.0
# Newton's method takes two or three steps; a dozen for correlations of 1 - 1e-8 and means 50 SDs beyond the bounds.
_MAX_STEPS = 50
_TOLERANCE = 1e-9
_STEP_LENGTHS = 0.5 ** np.arange(15)


class TiltedProposal(NamedTuple):
    """Distribution of proposed points, with coordinates in the order of drawing."""

    order: NDArray[np.intp]  # index of each coordinate in the caller's order, shape (M,)
    mean: Array  # mean of the unrestricted distribution, shape (M,)
    root: Array  # Cholesky factor L of the covariance, shape (M, M)
    tilt: Array  # mu, shape (M,)
    log_bound: float  # largest possible log weight


def compute_mean_excess(t: Array) -> Array:
    """Computes the mean of e ~ N(t, 1) given e > 0."""
    u = 1.0 / np.minimum(t, _FAR_TAIL) ** 2
    far = np.sqrt(u) * (1.0 - u * (2.0 - u * (10.0 - 74.0 * u)))
    mean: Array = np.where(t < _FAR_TAIL, far, t + compute_hazard(t))
    return mean


def compute_excess(t: Array, log_upper: Array) -> Array:
    """Computes the excess e ~ N(t, 1), e > 0, that is exceeded with the probability exp(log_upper)."""
    excess: Array = np.maximum(t - ndtri_exp(log_ndtr(t) + log_upper), 0.0)
    if (t < _FAR_TAIL).any():
        # Far below zero, log P(> e) is nearly t e - e^2 / 2. The solution for e is refined by one Newton step.
        d = np.maximum(-t, -_FAR_TAIL)
        guess = -2.0 * log_upper / (np.sqrt(d**2 - 2.0 * log_upper) + d)
        rest = np.log(compute_hazard(-d) / compute_hazard(-d - guess))
        excess = np.where(t < _FAR_TAIL, guess + rest / compute_hazard(-d - guess), excess)
    return excess


def build_proposal(mean: Array, covariance: Array) -> TiltedProposal:
    """Builds the proposal with Botev's tilt.

    At Botev's saddle point, each excess equals the mean of its proposal. With hazards h = phi(t) / Phi(t), pivots
    d = diag(L), and rows of L divided by the pivots, U = L / d, the saddle point is the root of

        mean / d + U U^T h(t) - t - h(t) = 0,    mu = U^T h - h

    The function is monotone, so Newton's method with step halving finds the root. The search starts from the mode,
    mean + L L^T forces, where either the force on a coordinate or its excess is zero.
    """
    root = np.linalg.cholesky(covariance)
    forces = scipy.optimize.nnls(root.T, -np.linalg.solve(root, mean))[0]
    # Coordinates with a mode of zero come first, by increasing mean. Later coordinates then rarely conflict with
    # them.
    order = np.lexsort((mean / np.sqrt(np.diag(covariance)), forces == 0.0))
    mean, root = mean[order], np.linalg.cholesky(covariance[np.ix_(order, order)])
    pivots = np.diag(root)
    U = root / pivots[:, None]
    h = forces[order] * pivots
    t = np.where(h > 0.0, -h, np.maximum(mean / pivots + U @ (U.T @ h), 0.0))
    h = _solve_saddle_point(mean / pivots, U, t)
    proposal = TiltedProposal(order, mean, root, U.T @ h - h, 0.0)
    # The bound is the weight at the saddle point. It is computed like other weights to have the same rounding errors.
    return proposal._replace(log_bound=float(_draw(proposal, 1, lambda _, t: compute_mean_excess(t))[1][0]))


def propose(proposal: TiltedProposal, uniforms: Array) -> tuple[Array, Array]:
    """Proposes points, and computes their log weights.

    Args:
        proposal: Distribution of proposed points.
        uniforms: Random numbers in (0, 1], (N, M).

    Returns:
        Points in the caller's order of coordinates, (N, M), and log weights minus the largest possible log weight,
        (N,).
    """
    log_uniforms = np.log(uniforms)
    excesses, log_weights = _draw(proposal, len(uniforms), lambda k, t: compute_excess(t, log_uniforms[:, k]))
    points = np.empty_like(excesses)
    points[:, proposal.order] = np.maximum(np.diag(proposal.root) * excesses, np.finfo(float).tiny)
    return points, log_weights - proposal.log_bound


def _solve_saddle_point(a: Array, U: Array, t: Array) -> Array:
    """Solves the equations of ``build_proposal``, starting from t. Returns the hazards h, (M,)."""
    for _ in range(_MAX_STEPS):
        h, e, residual = _compute_residual(a, U, t)
        slopes = -h * e  # dh/dt
        step = np.linalg.solve(np.diag(1.0 + slopes) - U @ (U.T * slopes), U @ residual)
        if (np.abs(step) < _TOLERANCE * (1.0 + np.abs(t))).all():
            break
        for length in _STEP_LENGTHS:
            if np.abs(_compute_residual(a, U, t + length * step)[2]).max() <= np.abs(residual).max():
                break
        t = t + length * step
    return h


def _compute_residual(a: Array, U: Array, t: Array) -> tuple[Array, Array, Array]:
    """Computes hazards, mean excesses, and the residual of the equations times U^-1, which balances its scales."""
    h, e = compute_hazard(t), compute_mean_excess(t)
    return h, e, np.linalg.solve(U, a - e) + U.T @ h


def _draw(proposal: TiltedProposal, num_points: int, choose: Callable[[int, Array], Array]) -> tuple[Array, Array]:
    """Sets coordinates sequentially with ``choose``. Returns excesses, (N, M), and log weights, (N,)."""
    z, excesses = np.empty((2, num_points, len(proposal.mean)))
    log_weights = np.zeros(num_points)
    for k, (mean, row, tilt) in enumerate(zip(proposal.mean, proposal.root, proposal.tilt, strict=True)):
        lower = -(mean + z[:, :k] @ row[:k]) / row[k]
        excesses[:, k] = choose(k, tilt - lower)
        z[:, k] = lower + excesses[:, k]
        log_weights += _compute_log_weight(tilt, lower) - tilt * excesses[:, k]
    return excesses, log_weights


def _compute_log_weight(tilt: float, lower: Array) -> Array:
    """Computes log Phi(t) + (t^2 - l^2) / 2 without cancellation, with one formula for each sign of t."""
    t = tilt - lower
    below = np.log(0.5 * erfcx(-np.minimum(t, 0.0) / np.sqrt(2.0))) - 0.5 * lower**2
    above = log_ndtr(t) + 0.5 * tilt * (t - lower)
    log_weight: Array = np.where(t < 0.0, below, above)
    return log_weight


def compute_hazard(t: Array) -> Array:
    """Computes the hazard phi(t) / Phi(t).

    The function erfcx is accurate even if numerator and denominator underflow.
    """
    hazard: Array = np.sqrt(2.0 / np.pi) / erfcx(-t / np.sqrt(2.0))
    return hazard
