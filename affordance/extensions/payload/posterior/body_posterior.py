"""Samples the posterior of an unseen held body.

Every sample is a physically consistent body. Weights are the exact posterior density, with gains and friction
integrated out, divided by the proposal density.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray
from scipy.special import chdtri, gammaln, ndtri

from affordance.arrays import Array
from affordance.belief.likelihood import Quadratic
from affordance.extensions.payload.evidence.payload_likelihood import BodyLikelihood, PayloadLikelihood
from affordance.extensions.payload.posterior.log_cholesky import (
    compute_jacobian,
    parameters_from_theta,
    theta_from_parameters,
    thicken,
)
from affordance.extensions.payload.posterior.solid_prior import Normals, SolidPrior, add_logs
from affordance.objects.inertia import parameters_from_pseudo_inertia, pseudo_inertia_from_parameters

# Direction numbers for Sobol points from Joe & Kuo (2008, SIAM J. Sci. Comput. 30:2635): inner coefficients of the
# primitive polynomial, and first direction numbers, for each dimension after the first. SciPy draws the same points,
# but its statistics package takes half a second to import.
_POLYNOMIALS = (
    (0, (1,)),
    (1, (1, 3)),
    (1, (1, 3, 1)),
    (2, (1, 1, 1)),
    (1, (1, 1, 3, 3)),
    (4, (1, 3, 5, 13)),
    (2, (1, 1, 5, 5, 17)),
    (4, (1, 1, 5, 5, 5)),
    (7, (1, 1, 7, 11, 19)),
    (11, (1, 1, 5, 1, 1)),
)
MAX_DIMENSION = len(_POLYNOMIALS) + 1
_BITS = 30
_POWERS = 1 << np.arange(_BITS - 1, -1, -1)


def draw_even_points(rng: np.random.Generator, num_points: int, size: int) -> Array:
    """Draws scrambled Sobol points in the open unit cube, shape (num_points, size).

    Each point is uniformly distributed. Binary digits are multiplied by a random triangular matrix and shifted
    (Matousek 1998, J. Complexity 14:527). The number of points must be below 2^30, and ``size`` at most
    ``MAX_DIMENSION``.
    """
    points = np.empty((num_points, size))
    for dimension in range(size):
        matrix = np.tril(rng.integers(0, 2, (_BITS, _BITS)), -1) + np.eye(_BITS, dtype=int)
        digits = np.array(list_directions(dimension))[:, None] // _POWERS % 2
        values = rng.integers(0, 2**_BITS, 1)
        for direction in digits @ matrix.T % 2 @ _POWERS:
            if len(values) >= num_points:
                break
            values = np.concatenate([values, values ^ direction])
        points[:, dimension] = (values[:num_points] + 0.5) / 2.0**_BITS
    return points


def list_directions(dimension: int) -> list[int]:
    """Lists the direction numbers of a dimension (from 0), in multiples of 2^-30."""
    inner, first = _POLYNOMIALS[dimension - 1] if dimension else (0, (1,) * _BITS)
    degree = len(first)
    directions = [m << (_BITS - 1 - i) for i, m in enumerate(first)]
    for i in range(degree, _BITS):
        new = directions[i - degree] ^ (directions[i - degree] >> degree)
        for k in range(1, degree):
            if inner >> (degree - 1 - k) & 1:
                new ^= directions[i - k]
        directions.append(new)
    return directions


# Degrees of freedom of the multivariate t distributions, whose tails are heavier than the posterior's. No single
# sample can then dominate.
_DEGREES_OF_FREEDOM = 8.0
# Share of the samples that are drawn from the prior, and share of the others that is divided equally among kinds.
_DEFENSIVE, _EVEN = 0.05, 0.05
# Number of samples above which Sobol points are used.
_MANY = 4000
_LEAST_UNIFORM = 1e-12  # keeps samples finite
# Least effective number of samples for refitting the distribution of a kind.
_FEWEST = 30.0
# Share of a kind's covariance that a refit retains, so that it does not collapse onto a few heavy samples.
_KEPT = 0.1


@dataclass(frozen=True)
class Proposal:
    """Proposal distribution of bodies: a mixture of the prior and one multivariate t per kind of solid.

    The tails of the t distributions are at least as heavy as the posterior's. The prior has a small weight, which
    bounds the importance weights.
    """

    kinds: Normals  # centre and squared scale of each t distribution
    shares: Array  # share of each t distribution, shape (K,); they sum to one
    prior: SolidPrior  # prior of the body

    @classmethod
    def build(cls, kinds: Normals, log_evidence: Array, prior: SolidPrior) -> "Proposal":
        """Builds the proposal from normal distributions of kinds and their unnormalised log probabilities, (K,)."""
        weights = np.exp(log_evidence - log_evidence.max())
        return cls(kinds, (1.0 - _EVEN) * weights / weights.sum() + _EVEN / len(weights), prior)

    @property
    def covariance(self) -> Array:
        """Mean squared scale of the t distributions, shape (10, 10)."""
        covariance: Array = np.einsum("k,kij->ij", self.shares, self.kinds.covariances)
        return covariance

    def draw(self, rng: np.random.Generator, num_samples: int) -> Array:
        """Draws samples of theta, shape (num_samples, 10)."""
        num_prior = int(_DEFENSIVE * num_samples)
        count, size = num_samples - num_prior, self.kinds.means.shape[1]
        # With Sobol points, interval edges vary half as much between seeds as with independent points, which are
        # drawn in less than a millisecond.
        spread = draw_even_points(rng, count, size + 1) if num_samples > _MANY else rng.random((count, size + 1))
        spread = np.clip(spread, _LEAST_UNIFORM, 1.0 - _LEAST_UNIFORM)
        scale = np.sqrt(_DEGREES_OF_FREEDOM / chdtri(_DEGREES_OF_FREEDOM, spread[:, size]))
        about = ndtri(spread[:, :size]) * scale[:, None]
        ends = np.round(np.cumsum(self.shares) * count).astype(int)
        for k, (start, end) in enumerate(zip([0, *ends[:-1]], ends, strict=True)):
            about[start:end] = self.kinds.means[k] + about[start:end] @ self.kinds.roots[k].T
        return np.concatenate([about, self.prior.draw_theta(rng, num_prior)])

    def compute_log_density(self, theta: Array, prior: Array) -> Array:
        """Computes the log density, (N,), from the prior's log density, (N,), up to a constant."""
        about = add_logs(self._compute_log_densities(theta))
        log_density: Array = np.logaddexp(np.log(1.0 - _DEFENSIVE) + about, np.log(_DEFENSIVE) + prior)
        return log_density

    def refit(self, theta: Array, weights: Array) -> "Proposal":
        """Refits each kind's distribution to weighted posterior samples, (N, 10), with weights, (N,)."""
        log_densities = self._compute_log_densities(theta)
        belongs = np.exp(log_densities - add_logs(log_densities)[:, None]) * weights[:, None]
        means, covariances = self.kinds.means.copy(), self.kinds.covariances.copy()
        for k, share in enumerate(belongs.T):
            total = share.sum()
            if total**2 <= _FEWEST * (share**2).sum():
                continue
            means[k] = share @ theta / total
            away = theta - means[k]
            covariances[k] = (away * share[:, None]).T @ away / total + _KEPT * covariances[k]
        with np.errstate(divide="ignore"):
            log_evidence = np.log(belongs.sum(axis=0))
        return Proposal.build(Normals(means, covariances), log_evidence, self.prior)

    def _compute_log_densities(self, theta: Array) -> Array:
        """Computes the log density of each t distribution times its share, (N, K), up to a common constant."""
        size = self.kinds.means.shape[1]
        half, power = 0.5 * _DEGREES_OF_FREEDOM, 0.5 * (_DEGREES_OF_FREEDOM + size)
        scales = self.kinds.log_scales + gammaln(power) - gammaln(half) - 0.5 * size * np.log(half)
        tails = power * np.log1p(self.kinds.measure_squares(theta) / _DEGREES_OF_FREEDOM)
        log_densities: Array = np.log(self.shares) + scales - tails
        return log_densities


# Sufficient effective sample size as a share of the samples. It is computed from the weights after refits, and for
# the worst parameter at the end.
_ENOUGH = 0.2
# Number of samples for refitting the proposal, largest number of refits, and effective sample size, as a share of
# these samples, at which refitting stops.
_ADAPTING, _MAX_REFITS, _GOOD = 4000, 4, 0.6
# Negligible weight. Bodies with smaller weights may be too thin for the arithmetic.
_FAINT = 1e-100
# Number of random-walk moves per sample in a round, and the optimal step and acceptance rate in ten dimensions: 2.38
# over the square root of 10, and .234 (Roberts, Gelman & Gilks 1997). For curved distributions the step with this
# acceptance rate is smaller.
_NUM_MOVES, _WALK, _ACCEPTED = 6, 0.75, 0.234
# Sufficient number of accepted moves per sample in an intermediate distribution. For the posterior itself, rounds
# continue until samples are nearly independent of their start: largest correlation, and largest number of rounds.
_MOVED, _FORGOTTEN, _MAX_ROUNDS = 3.0, 0.1, 60
# Number of Gauss-Newton steps between linearisations of the likelihood.
_STEPS_A_ROUND = 5
# Increase of the log density at which the search for a mode stops, for a fit and for a proposal.
_TOLERANCE, _ROUGH = 1e-8, 0.1
_LONGEST_STEP = 5.0
# Smallest eigenvalue of a guessed pseudo-inertia, as a share of the largest.
_LEAST_SHARE = 1e-3


class Mode(NamedTuple):
    """Most probable body."""

    theta: Array  # log-Cholesky coordinates, shape (10,)
    covariance: Array  # covariance of theta from the curvature at the mode, shape (10, 10)
    pi: Array  # ten inertial parameters, shape (10,)
    load: Array  # most probable load: pi plus the phantom payload of model errors, shape (10,)


class WeightedBodies(NamedTuple):
    """Weighted posterior samples."""

    pi: Array  # ten parameters of each sample, shape (N, 10)
    weights: Array  # weights of the samples, shape (N,); their sum is one
    # Index of each sample's ancestor, shape (N,); its own index without resampling.
    ancestors: NDArray[np.intp]

    @property
    def effective_size(self) -> float:
        """Effective sample size for the worst of the ten parameters.

        The variance of a weighted mean is estimated from sums over the samples with a common ancestor, which may be
        correlated (Lee & Whiteley 2018, Variance estimation in the particle filter).
        """
        away = (self.pi - self.weights @ self.pi) * self.weights[:, None]
        sums = np.zeros_like(away)
        np.add.at(sums, self.ancestors, away)
        variance = self.weights @ (self.pi - self.weights @ self.pi) ** 2
        # The variance over a few ancestors is unreliable, so the number of ancestors is an upper bound.
        most = float(len(np.unique(self.ancestors)))
        return min(most, float((variance / np.maximum((sums**2).sum(axis=0), np.finfo(float).tiny)).min()))


def improve_mode(likelihood: PayloadLikelihood, prior: SolidPrior, theta: Array, load: Array) -> Mode:
    """Improves theta, (10,), with a quadratic approximation of the likelihood at a load, (10,)."""
    quadratic = likelihood.linearise(load)
    phantom = likelihood.prior.phantom_covariance
    theta, covariance = _climb(quadratic.widen(phantom), prior.mean, prior.precision, theta, _TOLERANCE)
    pi = parameters_from_theta(theta)
    return Mode(theta, covariance, pi, quadratic.find_load(pi, phantom))


def measure_step(step: Array, mode: Mode) -> float:
    """Computes the squared length of a step of theta in posterior standard deviations."""
    return float(step @ np.linalg.solve(mode.covariance, step))


def draw_bodies(
    likelihood: PayloadLikelihood, prior: SolidPrior, mode: Mode, rng: np.random.Generator, num_samples: int
) -> WeightedBodies:
    """Draws weighted samples of the posterior.

    The proposal has a component at the mode for each kind of solid, and is refitted to its own samples while their
    effective size is too small. If a run hardly constrains the body, the posterior is strongly curved and is sampled
    with annealed sequential Monte Carlo: every sample is moved through a sequence of intermediate distributions (Del
    Moral, Doucet & Jasra 2006). Samples whose moves have removed the correlation with their start count as
    independent. The variation between seeds shows that they are worth a third to a half of their number.
    """
    of_body = BodyLikelihood(likelihood, mode.load)

    def compare(proposal: Proposal, theta: Array, normals: Array) -> tuple[Array, Array]:
        """Returns the log proposal density, and the log ratio of posterior to proposal density."""
        log_prior = prior.compute_log_density(theta)
        log_proposals = proposal.compute_log_density(theta, log_prior)
        return log_proposals, of_body.compute(parameters_from_theta(theta), normals) + log_prior - log_proposals

    def weigh(proposal: Proposal, count: int) -> tuple[Array, Array, Array, WeightedBodies]:
        theta = proposal.draw(rng, count)
        normals = of_body.draw_normals(rng, count)
        _, log_ratios = compare(proposal, theta, normals)
        return theta, normals, log_ratios, _weigh(theta, log_ratios)

    proposal = _propose(of_body, prior, mode)
    few = min(num_samples, _ADAPTING)
    for _ in range(_MAX_REFITS):
        theta, _, _, bodies = weigh(proposal, few)
        if num_samples == few and _count(bodies) >= _ENOUGH * few:
            return bodies
        if _count(bodies) >= _GOOD * few:
            break
        proposal = proposal.refit(theta, bodies.weights)
    theta, normals, log_ratios, bodies = weigh(proposal, num_samples)
    for _ in range(_MAX_REFITS):
        # The last draw is used whatever its weights. Choosing the best of several draws would favour draws without
        # the few heavy samples that determine the interval of a single parameter.
        if num_samples == few or bodies.effective_size >= _ENOUGH * num_samples:
            break
        proposal = proposal.refit(theta, bodies.weights)
        theta, normals, log_ratios, bodies = weigh(proposal, num_samples)
    if _count(bodies) >= _ENOUGH * few:
        return bodies
    # Moving many samples takes seconds, so fewer samples are drawn again. The first of the old samples would not be a
    # random subset, because samples are sorted by kind.
    if num_samples > few:
        theta, normals, log_ratios, _ = weigh(proposal, few)
    exponent, ancestors, equal = 0.0, np.arange(few), np.full(few, 1.0 / few)
    walk = _WALK
    while exponent < 1.0:
        step = _find_step(log_ratios, 1.0 - exponent, few)
        exponent += step
        weights = normalise(step * log_ratios)
        chosen = _resample(weights, rng)
        centre = weights @ theta
        root = np.linalg.cholesky((theta - centre).T * weights @ (theta - centre) + 1e-9 * proposal.covariance)
        theta, normals, log_ratios, ancestors = theta[chosen], normals[chosen], log_ratios[chosen], ancestors[chosen]
        log_proposals = proposal.compute_log_density(theta, prior.compute_log_density(theta))
        num_moved, start = 0.0, parameters_from_theta(theta)
        for _ in range(_MAX_ROUNDS):
            for _ in range(_NUM_MOVES):
                moved = theta + walk * rng.standard_normal(theta.shape) @ root.T
                # Phantoms take a step of the same relative size. Independent phantoms would add noise that no small
                # step reduces.
                moved_normals = np.sqrt(1.0 - walk**2) * normals + walk * of_body.draw_normals(rng, few)
                moved_proposals, moved_ratios = compare(proposal, moved, moved_normals)
                gain = moved_proposals - log_proposals + exponent * (moved_ratios - log_ratios)
                accepted = np.log(rng.random(few)) < gain
                theta[accepted], normals[accepted] = moved[accepted], moved_normals[accepted]
                log_ratios[accepted] = moved_ratios[accepted]
                log_proposals[accepted] = moved_proposals[accepted]
                share = float(accepted.mean())
                num_moved += share
                walk = min(walk * np.exp(share - _ACCEPTED), _WALK)
            if _correlate(start, parameters_from_theta(theta)) < _FORGOTTEN:
                ancestors = np.arange(few)
                break
            if exponent < 1.0 and num_moved >= _MOVED:
                break
    return WeightedBodies(parameters_from_theta(theta), equal, ancestors)


def spread_bodies(
    bodies: WeightedBodies,
    likelihoods: Sequence[PayloadLikelihood],
    prior: SolidPrior,
    mode: Mode,
    rng: np.random.Generator,
) -> WeightedBodies:
    """Spreads posterior samples over likelihoods with different error variances.

    Samples are assigned to the likelihoods at random. Each sample is transformed by the map between two normal
    (Laplace) approximations about the mode, from the original likelihood to the assigned one. Quantities that the run
    does not determine remain unchanged.
    """
    theta = theta_from_parameters(thicken(bodies.pi))
    away = np.linalg.solve(np.linalg.cholesky(mode.covariance), (theta - mode.theta).T).T
    group = rng.permutation(np.arange(len(theta)) % len(likelihoods))
    for number, likelihood in enumerate(likelihoods):
        quadratic = likelihood.linearise(mode.load).widen(likelihood.prior.phantom_covariance)
        centre, covariance = _climb(quadratic, prior.mean, prior.precision, mode.theta, _ROUGH)
        rows = group == number
        theta[rows] = centre + away[rows] @ np.linalg.cholesky(covariance).T
    return bodies._replace(pi=thicken(parameters_from_theta(theta)))


def _correlate(before: Array, after: Array) -> float:
    """Computes the largest correlation, over parameters, between values before and after moves, (N, 10) each."""
    away, later = before - before.mean(axis=0), after - after.mean(axis=0)
    scale = np.sqrt((away**2).sum(axis=0) * (later**2).sum(axis=0))
    return float(((away * later).sum(axis=0) / np.maximum(scale, np.finfo(float).tiny)).max())


def _propose(of_body: BodyLikelihood, prior: SolidPrior, mode: Mode) -> Proposal:
    """Builds the proposal with a Laplace approximation for each kind of solid."""
    quadratic = of_body.of_body
    means, precisions = prior.kinds.means, prior.kinds.precisions
    modes = [_climb(quadratic, *kind, mode.theta, _ROUGH) for kind in zip(means, precisions, strict=True)]
    kinds = Normals(*(np.array(each) for each in zip(*modes, strict=True)))
    log_prior = np.diagonal(prior.compute_log_densities(kinds.means))
    log_evidence = quadratic.evaluate(parameters_from_theta(kinds.means)) + log_prior - kinds.log_scales
    return Proposal.build(kinds, log_evidence, prior)


def normalise(log_weights: Array) -> Array:
    """Converts log weights to weights that sum to one."""
    weights = np.exp(log_weights - log_weights.max())
    normalised: Array = weights / weights.sum()
    return normalised


def _count(bodies: WeightedBodies) -> float:
    """Computes the effective sample size from the weights alone."""
    return float(1.0 / np.sum(bodies.weights**2))


def _weigh(theta: Array, log_weights: Array) -> WeightedBodies:
    weights = normalise(log_weights)
    theta = np.where(weights[:, None] < _FAINT, theta[np.argmax(weights)], theta)
    return WeightedBodies(parameters_from_theta(theta), weights, np.arange(len(theta)))


def _find_step(log_ratios: Array, most: float, num_samples: int) -> float:
    """Finds the largest step of the exponent, up to ``most``, that keeps half of the samples effective."""

    def count(step: float) -> float:
        return float(1.0 / np.sum(normalise(step * log_ratios) ** 2)) - 0.5 * num_samples

    return most if count(most) >= 0.0 else float(scipy.optimize.brentq(count, 0.0, most))


def _resample(weights: Array, rng: np.random.Generator) -> NDArray[np.intp]:
    """Draws indices of samples by systematic resampling."""
    positions = (rng.random() + np.arange(len(weights))) / len(weights)
    return np.minimum(np.searchsorted(np.cumsum(weights), positions), len(weights) - 1)


def guess_theta(likelihood: PayloadLikelihood, prior: SolidPrior) -> Array:
    """Guesses theta, (10,), from the mean of a normal posterior, made physically consistent."""
    pi = parameters_from_theta(prior.mean)
    D = compute_jacobian(prior.mean)
    quadratic = likelihood.linearise(pi)
    spread = D @ prior.covariance @ D.T
    quadratic = quadratic.widen(likelihood.prior.phantom_covariance)
    spread[0, 0] += pi[0] ** 2  # the mass may be many times its prior mean, because the prior is log-normal
    pi = np.linalg.solve(
        np.linalg.inv(spread) + quadratic.precision, np.linalg.solve(spread, pi) + quadratic.information
    )
    J = pseudo_inertia_from_parameters(pi)
    values, vectors = np.linalg.eigh(J)
    J = vectors * np.maximum(values, _LEAST_SHARE * np.abs(values).max()) @ vectors.T
    return theta_from_parameters(parameters_from_pseudo_inertia(J))


def _climb(
    quadratic: Quadratic, mean: Array, precision: Array, theta: Array, tolerance: float
) -> tuple[Array, Array]:
    """Finds the most probable theta and its covariance for a quadratic likelihood and a normal prior."""
    H, b = quadratic.precision, quadratic.information

    def evaluate(theta: Array) -> tuple[float, Array]:
        pi, away = parameters_from_theta(theta), theta - mean
        return float(0.5 * pi @ H @ pi - b @ pi + 0.5 * away @ precision @ away), pi

    cost, pi = evaluate(theta)
    damping = 1e-3
    for _ in range(_STEPS_A_ROUND):
        D = compute_jacobian(theta, pi)
        A = D.T @ H @ D + precision
        gradient = D.T @ (H @ pi - b) + precision @ (theta - mean)
        before = cost
        for _ in range(20):
            step = np.linalg.solve(A + np.diag(damping * A.diagonal()), gradient)
            # Longer steps may overflow.
            new_cost, new_pi = evaluate(theta - step) if np.abs(step).max() < _LONGEST_STEP else (np.inf, pi)
            if new_cost <= cost:
                theta, cost, pi, damping = theta - step, new_cost, new_pi, 0.2 * damping
                break
            damping *= 4.0
        if before - cost < tolerance:
            break
    D = compute_jacobian(theta, pi)
    covariance = np.linalg.inv(D.T @ H @ D + precision)
    return theta, 0.5 * (covariance + covariance.T)
