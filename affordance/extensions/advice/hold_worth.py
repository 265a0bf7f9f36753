"""Expected value of holding an object before choosing a tool.

The worth of a hold is its expected value of sample information. With cost c_i of option i and measured torques y,

    worth = min_i E[c_i] - E_y[min_i E[c_i | y]]

One measurement is simulated for each sample of the belief, and E[c_i | y] is estimated by regressing the costs on the
measurements (Strong, Oakley, Brennan & Breeze 2015, Medical Decision Making 35:570). The regressors are polynomials
in the whitened measurement. Cross-validation keeps noise between nearly equal options from counting as worth: an
option is chosen with a fit to all other folds and priced in the fold that was left out. A poor fit can therefore only
lower the worth. The closed form for normal beliefs and linear costs would be wrong for hammering, because the
effective mass is not linear in the densities.

Holding two objects can be worth more than the sum of their separate worths. Pairs and sequences of holds are
therefore evaluated too.
"""

import itertools
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.objects.inertia import Geometry
from affordance.plant.arm import JointLimits
from affordance.proprioception.static_hold import StaticHold
from affordance.proprioception.torque_noise import NoiseModel

# Largest total degree of monomials in one, two and three variables. Monomials in more variables are left out, so the
# model for several measurements contains the model for each one. With degree 6 in one variable, worths were up to
# 60 % too low; beyond degree 12 they do not increase.
_DEGREES = {1: 12, 2: 6, 3: 3}
# Number of folds for cross-validation, and smallest singular value of an informative direction of the measurement, as
# a fraction of the largest.
_FOLDS, _SEEN = 4, 1e-3
# Cost of an infeasible sample, as a multiple of the mean cost of the most expensive feasible option. If options were
# excluded by a threshold on their feasibility instead, information could have a negative worth.
_FAILURE = 2.0
# Measurements are compressed beyond this many standard deviations, so that tails do not dominate the fit.
_TAIL = 3.0
_TIE = 1e-9
# Largest number of holds in a plan.
_MOST_AHEAD = 4


class PossibleHold(NamedTuple):
    """Object that could be held next, with samples of its densities and geometry errors."""

    name: str
    geometry: Geometry  # in the hand frame, with one column per colour in the memory (M)
    densities: Array  # samples of the object's own densities, (S, M), [kg/m^3]
    # Samples of the geometry errors, in standard deviations, (S, G). If the object is also an option of the choice,
    # both share these samples, so that the hold is informative about its shape.
    errors: Array

    def compute_load(self, static: StaticHold) -> Array:
        """Computes the static joint torques due to the object for each sample, (S, num_joints), [N m]."""
        load: Array = self.geometry.compute_parameters(self.densities, self.errors) @ static.Y.T
        return load

    def compute_probability(self, static: StaticHold, limits: JointLimits) -> float:
        """Computes the probability that the arm holds the object within its torque limits."""
        return float((limits.compute_loads(static.tau_arm + self.compute_load(static)) <= 1.0).all(axis=1).mean())


class Decision(NamedTuple):
    """Choice among k options, with their costs for S samples."""

    name: str
    options: tuple[str, ...]
    cost: Array  # (k, S)
    feasible: NDArray[np.bool_]  # True where an option is feasible, (k, S)
    alike: tuple[tuple[str, ...], ...]  # equivalent grips of each option
    infeasible_reasons: tuple[str, ...]  # why an option is not usable; empty if it is

    def price_failure(self) -> float:
        """Computes the cost of an infeasible sample: twice the mean cost of the most expensive option.

        It is 0 if no option is feasible in any sample.
        """
        usable = self.feasible & np.isfinite(self.cost)
        means = [row[ok].mean() for row, ok in zip(self.cost, usable, strict=True) if ok.any()]
        return _FAILURE * float(max(means, default=0.0))

    def charge(self, failure: float | None = None) -> Array:
        """Computes the costs including penalties for infeasible samples, (k, S).

        Args:
            failure: Smallest cost of an infeasible sample; None for the result of ``price_failure``.
        """
        usable = self.feasible & np.isfinite(self.cost)
        if not usable.any():
            return np.zeros_like(self.cost)
        least = self.price_failure() if failure is None else failure
        return np.where(usable, self.cost, np.maximum(least, np.where(usable, self.cost, 0.0)))

    def mark_best(self) -> Array:
        """Marks the cheapest feasible option of each sample with 1, (k, S). Equally cheap options share the mark."""
        cost = np.where(self.feasible, self.cost, np.inf)
        least = cost.min(axis=0)
        equal = np.isfinite(cost) & (cost <= least + _TIE * np.abs(least))
        marked: Array = equal / np.maximum(equal.sum(axis=0), 1)
        return marked

    def find_best(self) -> int:
        """Finds the option with the least expected cost, including penalties for infeasible samples."""
        return int(self.charge().mean(axis=1).argmin())

    def compute_regret(self, option: int) -> float:
        """Computes the expected regret of an option: its mean cost minus the mean of the least cost per sample."""
        charged = self.charge()
        return float((charged[option] - charged.min(axis=0)).mean())


class Worth(NamedTuple):
    """Expected value of one or several holds before D decisions."""

    worths: Array  # non-negative worth for each decision, (D,), in the unit of the costs
    # Standard error of the total if samples were independent. For evenly spread samples the error is smaller.
    se: float
    total: float  # sum over decisions
    p_best_after: Array  # expected probability that the option chosen after the holds is the cheapest, (D,)


def feel(hold: PossibleHold, static: StaticHold, noise: NoiseModel, sd: Array, rng: np.random.Generator) -> Array:
    """Simulates one torque measurement per sample, and projects it onto directions that are informative of materials.

    Args:
        hold: Object.
        static: Arm at rest in the posture of the hold.
        noise: Noise of the joint torques.
        sd: Standard deviations of the sampled mean densities, (M,), [kg/m^3].
        rng: Random generator.

    Returns: Projected measurements with unit noise variance, (S, r); r is at most the number of the object's
        materials.
    """
    load = hold.compute_load(static)
    total = static.tau_arm + load
    scale = noise.compute_sd(total.mean(axis=0))
    felt = load + noise.compute_sd(total.ravel()).reshape(total.shape) * rng.standard_normal(total.shape)
    regressor = static.Y @ hold.geometry.Phi
    # Covariance of torque noise, geometry errors, and deviations of the object's densities from the material means.
    own = hold.densities - hold.densities.mean(axis=0)
    spread = np.maximum(own.var(axis=0) - sd**2, 0.0)
    covariance = np.diag(scale**2) + regressor * spread @ regressor.T
    covariance += static.Y @ hold.geometry.compute_covariance(hold.densities.mean(axis=0)) @ static.Y.T
    root = np.linalg.cholesky(covariance)
    u, s, _ = np.linalg.svd(np.linalg.solve(root, regressor) * sd, full_matrices=False)
    if not s.size or s[0] == 0.0:
        return np.zeros((len(felt), 0))
    reduced: Array = felt @ np.linalg.solve(root.T, u[:, s > _SEEN * s[0]])
    return reduced


class PricedDecisions:
    """Costs of several decisions, divided into folds for cross-validation, with penalties for infeasible samples."""

    def __init__(self, decisions: Sequence[Decision]) -> None:
        """Prepares the costs of decisions for the same samples."""
        costs = np.concatenate([decision.charge() for decision in decisions]).T
        best = np.concatenate([decision.mark_best() for decision in decisions]).T
        # For each fold: indices of its samples, costs of all K options, (about S / _FOLDS, K), and marks of the
        # cheapest option in each sample.
        self.folds = [np.arange(fold, len(costs), _FOLDS) for fold in range(_FOLDS)]
        self.costs = [np.ascontiguousarray(costs[fold]) for fold in self.folds]
        self.best = [np.ascontiguousarray(best[fold]) for fold in self.folds]
        # Options of decision d have the indices from ends[d] to ends[d + 1], (D + 1,).
        self.ends = np.cumsum([0, *(len(decision.cost) for decision in decisions)])
        sums = np.array([own.sum(axis=0) for own in self.costs])
        others = sums.sum(axis=0) - sums
        # Option with the least mean cost before any hold in all folds except one, (_FOLDS, D).
        self.now = np.array(
            [[a + row[a:b].argmin() for a, b in itertools.pairwise(self.ends)] for row in others], dtype=int
        )


def compute_worth(percepts: Sequence[Array], priced: PricedDecisions) -> Worth:
    """Computes the joint worth of several holds from their simulated measurements, (S, r) each."""
    Q = _orthonormalise(_expand(np.hstack(percepts)))
    owns = [Q[fold] for fold in priced.folds]
    products = np.array([own.T @ cost for own, cost in zip(owns, priced.costs, strict=True)])
    # Least squares on all other folds: the contribution of the left-out fold is subtracted from the total.
    others = np.eye(Q.shape[1]) - np.array([own.T @ own for own in owns])
    inverse = np.linalg.pinv(others, rcond=len(Q) * np.finfo(float).eps, hermitian=True)
    coefficients = inverse @ (products.sum(axis=0) - products)
    falls, certain = np.zeros((2, len(priced.ends) - 1, len(Q)))
    for fold, own, cost, best, fitted, now in zip(
        priced.folds, owns, priced.costs, priced.best, coefficients, priced.now, strict=True
    ):
        fit, rows = own @ fitted, np.arange(len(fold))
        for d, (a, b) in enumerate(itertools.pairwise(priced.ends)):
            picked = a + fit[:, a:b].argmin(axis=1)
            falls[d, fold] = cost[:, now[d]] - cost[rows, picked]
            certain[d, fold] = best[rows, picked]
    se = float(falls.sum(axis=0).std(ddof=1) / np.sqrt(len(Q)))
    worths = np.maximum(falls.mean(axis=1), 0.0)
    return Worth(worths, se, float(worths.sum()), np.clip(certain.mean(axis=1), 0.0, 1.0))


class Outlook:
    """Search for pairs and sequences of holds with the largest joint worth."""

    def __init__(self, felt: Mapping[str, Array], priced: PricedDecisions) -> None:
        """Stores the simulated measurements of each object, (S, r), by name."""
        self._felt, self._priced = felt, priced

    def find_best_pair(self, names: Sequence[str]) -> tuple[tuple[str, str] | None, float]:
        """Finds the two objects with the largest joint worth.

        Returns: Names and joint worth; None and 0 if no pair has a positive worth.
        """
        worths = {pair: self._measure(pair).total for pair in itertools.combinations(names, 2)}
        best = max(worths, key=lambda pair: worths[pair], default=None)
        return (best, worths[best]) if best and worths[best] > 0.0 else (None, 0.0)

    def look_ahead(self, names: Sequence[str], settled: Array, least: float) -> tuple[tuple[str, ...], Array]:
        """Plans a sequence of holds greedily by adding the object with the largest joint worth.

        The plan ends when all choices are settled or no further hold adds enough worth.

        Args:
            names: Names of the first holds.
            settled: Smallest probability of being the best for a settled choice, (D,).
            least: Smallest worth that a further hold must add.

        Returns: Names of the holds in order, at most ``_MOST_AHEAD``, and expected probability after them that each
            choice is the best, (D,).
        """
        order = list(names)
        worth = self._measure(order)
        while (worth.p_best_after < settled).any() and len(order) < _MOST_AHEAD:
            others = {name: self._measure([*order, name]) for name in self._felt if name not in order}
            name = max(others, key=lambda each: others[each].total, default="")
            if not name or others[name].total - worth.total <= least:
                break
            order.append(name)
            worth = others[name]
        return tuple(order), worth.p_best_after

    def _measure(self, names: Sequence[str]) -> Worth:
        return compute_worth([self._felt[name] for name in names], self._priced)


def compute_information(
    hold: PossibleHold, static: StaticHold, noise: NoiseModel, covariance: Array, common: Sequence[int] | None = None
) -> float:
    """Computes the expected information of a hold about mean densities, [nat].

    Args:
        hold: Object.
        static: Arm at rest in the posture of the hold.
        noise: Noise of the joint torques.
        covariance: Covariance of the mean densities, (M, M).
        common: Indices of the densities of interest; None for all.
    """
    rho = hold.densities.mean(axis=0)
    regressor = static.Y @ hold.geometry.Phi
    spread = np.maximum(hold.densities.var(axis=0) - np.diag(covariance), 0.0)
    R = np.diag(noise.compute_sd(static.tau_arm + regressor @ rho) ** 2) + regressor * spread @ regressor.T
    R += static.Y @ hold.geometry.compute_covariance(rho) @ static.Y.T
    chosen = range(len(covariance)) if common is None else common
    # Posterior covariance C - C A^T (A C A^T + R)^-1 A C of the chosen densities.
    shared = covariance[list(chosen)] @ regressor.T
    before = covariance[np.ix_(chosen, chosen)]
    after = before - shared @ np.linalg.solve(regressor @ covariance @ regressor.T + R, shared.T)
    return 0.5 * float(np.linalg.slogdet(before)[1] - np.linalg.slogdet(after)[1])


def _expand(percept: Array) -> Array:
    """Computes monomials in up to three variables of the measurement, (S, r). Returns (S, number of monomials)."""
    centred = percept - percept.mean(axis=0)
    t = np.tanh(centred / np.maximum(percept.std(axis=0), np.finfo(float).tiny) / _TAIL)
    columns = [np.ones(len(t))]
    for number, most in _DEGREES.items():
        for degree in range(number, most + 1):
            for chosen in itertools.combinations_with_replacement(range(t.shape[1]), degree):
                if len(set(chosen)) == number:
                    columns.append(t[:, chosen].prod(axis=1))
    return np.stack(columns, axis=1)


def _orthonormalise(columns: Array) -> Array:
    """Computes an orthonormal basis, (S, rank), of the column space of a matrix, (S, p)."""
    lengths = np.linalg.norm(columns, axis=0)
    Q, R = np.linalg.qr(columns / np.maximum(lengths, np.finfo(float).tiny))
    u, s, _ = np.linalg.svd(R)
    seen = s > len(columns) * np.finfo(float).eps * s[0]
    basis: Array = Q if seen.all() else Q @ u[:, seen]
    return basis
