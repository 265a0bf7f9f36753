"""Fixed point of the likelihood of torques whose errors depend on the unknown densities.

Errors with a Weber fraction scale with the torque that the posterior mean predicts. With V(rho) the covariance of
these errors, P = R^T V^-1 R and q = R^T V^-1 y, the posterior mean is a zero of

    g(rho) = (Lambda + P(rho)) rho - (eta + q(rho)) = Lambda (rho - m) - R^T V(rho)^-1 (y - R rho)

The plain iteration rho <- (Lambda + P)^-1 (eta + q) equals rho - (Lambda + P)^-1 g(rho). For most measurements it
converges in tens of steps; for very surprising ones it may take hundreds of steps, or never converge.
"""

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.belief.density_belief import DensityBelief
from affordance.belief.likelihood import Likelihood
from affordance.belief.normals import Normals
from affordance.exceptions import AffordanceError

# Relative change of the densities below which the iteration has converged.
TOLERANCE = 1e-12
# Number of plain steps before descent takes over. Measurements of a hold take tens.
_PLAIN_STEPS = 100
# Largest number of descent steps; 20 000 random measurements, some wrong by up to a factor of a thousand, took at
# most 69.
_DESCENT_STEPS = 300
# Least decrease by a step as a share of the decrease that the slope predicts, and the shortest step (Armijo 1966).
_ARMIJO, _SHORTEST_STEP = 1e-3, 2.0**-40
# Bounds of a Newton step relative to the plain step: its descent is at least, and its length at most, this multiple.
_GRADIENT_RELATED, _LONGEST_NEWTON = 0.1, 1e6
# Squared length of a step, in posterior standard deviations, that counts as rounding error.
_NEGLIGIBLE = 1e-18
# Finite-difference step of g, as a fraction of the densities.
_DIFFERENCE = 1e-6
# Gauss-Legendre nodes and weights on [0, 1], for the potential along a step.
_NODES, _WEIGHTS = (0.5 * values for values in np.polynomial.legendre.leggauss(6))
_NODES = _NODES + 0.5

type ComputeLikelihood = Callable[[Array], Likelihood]
# Function of densities, (N, M), and of the observer of each row, (N,).
type ComputeLikelihoods = Callable[[Array, NDArray[np.intp]], Likelihood]


def find_fixed_point(belief: DensityBelief, compute_likelihood: ComputeLikelihood) -> Likelihood:
    """Finds the likelihood whose errors are evaluated at the posterior mean, (M,), [kg/m^3], that results from it.

    If there are several fixed points, the plain iteration from the mean of the belief selects one, provided it
    converges.

    Raises:
        AffordanceError: The descent does not converge, which is possible only for several densities with errors that
            are dependent between joints.
    """
    rho = belief.untruncated_mean
    for _ in range(_PLAIN_STEPS):
        likelihood = compute_likelihood(rho)
        previous, rho = rho, _compute_mean(belief, likelihood)
        if np.abs(rho - previous).max() <= TOLERANCE * np.abs(rho).max():
            return likelihood
    return descend(belief, compute_likelihood)


def find_fixed_points(
    beliefs: Normals, observers: NDArray[np.intp], compute_likelihoods: ComputeLikelihoods
) -> Likelihood:
    """Finds the likelihood of each of N beliefs as ``find_fixed_point`` does; ``observers`` has shape (N,).

    All are iterated together; no result depends on the others.
    """
    rho, start = beliefs.mean.copy(), beliefs.mean
    evaluated, left = rho.copy(), np.arange(len(rho))
    for _ in range(_PLAIN_STEPS):
        likelihood = compute_likelihoods(rho[left], observers[left])
        A = beliefs.precision[left] + likelihood.precision
        b = beliefs.information_vector[left] + likelihood.information_vector
        evaluated[left] = previous = rho[left]
        rho[left] = following = b / A[:, 0] if b.shape[1] == 1 else np.linalg.solve(A, b[..., None])[..., 0]
        left = left[np.abs(following - previous).max(axis=1) > TOLERANCE * np.abs(following).max(axis=1)]
        if not len(left):
            return compute_likelihoods(evaluated, observers)
    descended = []
    for row in left:
        belief = DensityBelief.from_moments(start[row], beliefs.covariance[row])
        descended.append(descend(belief, partial(_compute_one, compute_likelihoods, observers[[row]])))
    return compute_likelihoods(evaluated, observers).put(left, Likelihood.stack(descended))


def _compute_one(compute_likelihoods: ComputeLikelihoods, observer: NDArray[np.intp], rho: Array) -> Likelihood:
    return compute_likelihoods(rho[None], observer).take(0)


def descend(belief: DensityBelief, compute_likelihood: ComputeLikelihood) -> Likelihood:
    """Finds the fixed point by descent from the mean of the belief, where the plain iteration does not converge.

    If errors are independent between joints, V is diagonal and V_j depends on u_j = (R rho)_j alone, so that g is the
    gradient of

        Phi(rho) = (rho - m)^T Lambda (rho - m) / 2 + sum_j integral from y_j to u_j of (t - y_j) / V_j(t) dt

    which is the negative log posterior of Wedderburn's quasi-likelihood (1974, Biometrika 61:439). Every integral is
    non-negative, so Phi grows without bound in all directions and its level sets are compact. The plain step is -g
    times the inverse of a positive definite matrix between Lambda and Lambda + R^T R / threshold^2; a Newton step is
    taken only if its angle with -g is similarly bounded. Halving steps until Phi decreases enough (Armijo) therefore
    drives g to zero from any start (Bertsekas 1999, Nonlinear Programming, proposition 1.2.1), so every measurement
    has a solution. A single density has such a potential whatever V is. Differences of Phi are integrals of g along
    the step, computed by quadrature. For several densities with uncertain geometry convergence is not proven; of 6000
    random cases, 316 needed the descent, and all converged.

    Arguments and errors are those of find_fixed_point.
    """

    def compute_gradient(rho: Array) -> Array:
        likelihood = compute_likelihood(rho)
        gradient: Array = belief.precision @ (rho - belief.untruncated_mean)
        gradient += likelihood.precision @ rho - likelihood.information_vector
        return gradient

    rho = belief.untruncated_mean
    for _ in range(_DESCENT_STEPS):
        likelihood = compute_likelihood(rho)
        step = _compute_mean(belief, likelihood) - rho
        g = compute_gradient(rho)
        if np.abs(step).max() <= TOLERANCE * np.abs(rho + step).max() or -g @ step <= _NEGLIGIBLE:
            return likelihood
        step = _try_newton(compute_gradient, rho, g, step)
        length = _find_length(compute_gradient, rho, step, float(g @ step))
        if length == 0.0:  # g is zero to rounding
            return likelihood
        rho = rho + length * step
    raise AffordanceError(
        f"the estimator found no fixed point in {_PLAIN_STEPS} plain and {_DESCENT_STEPS} descent steps; the last "
        f"one changed a density by {np.abs(length * step).max():.3g} kg/m^3"
    )


def _compute_mean(belief: DensityBelief, likelihood: Likelihood) -> Array:
    """Computes the posterior mean, shape (M,)."""
    A = belief.precision + likelihood.precision
    b = belief.information_vector + likelihood.information_vector
    return b / A[0] if len(b) == 1 else np.linalg.solve(A, b)


def _try_newton(compute_gradient: Callable[[Array], Array], rho: Array, g: Array, plain: Array) -> Array:
    """Returns the Newton step towards g = 0 if it descends enough, else the plain step, shape (M,)."""
    shifts = _DIFFERENCE * max(float(np.abs(rho).max()), 1.0) * np.eye(len(rho))
    columns = [compute_gradient(rho + shift) - compute_gradient(rho - shift) for shift in shifts]
    try:
        newton = np.linalg.solve(np.array(columns).T / (2.0 * shifts[0, 0]), -g)
    except np.linalg.LinAlgError:
        return plain
    descends = g @ newton <= _GRADIENT_RELATED * (g @ plain)
    return newton if descends and np.linalg.norm(newton) <= _LONGEST_NEWTON * np.linalg.norm(plain) else plain


def _find_length(compute_gradient: Callable[[Array], Array], rho: Array, step: Array, slope: float) -> float:
    """Finds the largest of 1, 1/2, 1/4, ... that decreases Phi enough; 0 if no decrease exceeds rounding."""
    length = 1.0
    while length >= _SHORTEST_STEP and slope < 0.0:
        slopes = [step @ compute_gradient(rho + length * t * step) for t in _NODES]
        if float(_WEIGHTS @ slopes) <= _ARMIJO * slope:
            return length
        length *= 0.5
    return 0.0
