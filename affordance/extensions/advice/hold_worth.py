"""Worth of a hold before a choice: expected reduction of the least expected cost.

If c_i is the cost of option i and y the measurement of the object,

    worth = min_i E[c_i] - E_y[min_i E[c_i | y]]

E[c_i | y] is estimated by regressing the costs on the measurement, with one simulated measurement per sample of the
belief (Strong, Oakley, Brennan & Breeze 2015, Medical Decision Making 35:570). The regressors are polynomials in the
whitened percept. The samples are divided into folds: an option is chosen with a fit to the other folds, and its cost
is taken from its own fold, because noise between nearly equal options would otherwise count as worth. A poor fit can
therefore lower a worth but never raise it. Closed forms for normal beliefs and linear costs are wrong for hammering,
because the effective mass is not linear in densities.

Worth is not concave: two objects together can be worth more than the sum of both, so pairs and sequences of holds are
evaluated too.
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

# Largest total degree of products of one, two and three variables; products of more are left out. The fit to one
# percept is thus part of the fit to several. With degree 6 in one variable, worths were up to 60 % too low; from
# degree 12 on they no longer grow.
_DEGREES = {1: 12, 2: 6, 3: 3}
# Number of folds of the samples. A direction of the percept whose singular value is below this fraction of the
# largest one is taken to carry no information about materials.
_FOLDS, _SEEN = 4, 1e-3
# A sample for which an option is infeasible costs this many times the mean cost of the most expensive feasible
# option. With a probability threshold instead, information could have a negative worth.
_FAILURE = 2.0
# Percepts are compressed beyond this many standard deviations, so that tails do not dominate the fit.
_TAIL = 3.0
_TIE = 1e-9
# Largest number of holds that are planned before the first one is felt.
_MOST_AHEAD = 4


class PossibleHold(NamedTuple):
    """Object that may be held still, with samples of its densities and geometry errors."""

    name: str
    geometry: Geometry  # in the hand, with one column per colour of the memory (M)
    densities: Array  # samples of its own densities, (S, M), [kg/m^3]
    # Samples of its geometry errors, in standard deviations, (S, G). An object that is also an option shares them
    # with the option, so that a hold is informative about its shape.
    errors: Array

    def compute_load(self, static: StaticHold) -> Array:
        """Computes the joint torques of the resting object for each sample, (S, num_joints), [N m]."""
        load: Array = self.geometry.compute_parameters(self.densities, self.errors) @ static.Y.T
        return load

    def compute_probability(self, static: StaticHold, limits: JointLimits) -> float:
        """Computes the probability that the arm can hold the object. Torque limits decide."""
        return float((limits.compute_loads(static.tau_arm + self.compute_load(static)) <= 1.0).all(axis=1).mean())


class Decision(NamedTuple):
    """Choice among k options with their costs for S samples."""

    name: str
    options: tuple[str, ...]
    cost: Array  # (k, S)
    feasible: NDArray[np.bool_]  # True where an option is feasible, (k, S)
    alike: tuple[tuple[str, ...], ...]  # equivalent grips of each option
    infeasible_reasons: tuple[str, ...]  # why an option is not usable; empty if it is

    def price_failure(self) -> float:
        """Computes the cost of an infeasible sample. The cost is twice the mean cost of the most expensive option.

        The cost is 0 if no option is feasible in any sample.
        """
        usable = self.feasible & np.isfinite(self.cost)
        means = [row[ok].mean() for row, ok in zip(self.cost, usable, strict=True) if ok.any()]
        return _FAILURE * float(max(means, default=0.0))

    def charge(self, failure: float | None = None) -> Array:
        """Computes the costs, (k, S), with a least cost ``failure`` of infeasible samples.

        None stands for the result of ``price_failure``.
        """
        usable = self.feasible & np.isfinite(self.cost)
        if not usable.any():
            return np.zeros_like(self.cost)
        least = self.price_failure() if failure is None else failure
        return np.where(usable, self.cost, np.maximum(least, np.where(usable, self.cost, 0.0)))

    def mark_best(self) -> Array:
        """Marks the cheapest feasible option of each sample with 1, (k, S). Ties are divided equally."""
        cost = np.where(self.feasible, self.cost, np.inf)
        least = cost.min(axis=0)
        equal = np.isfinite(cost) & (cost <= least + _TIE * np.abs(least))
        marked: Array = equal / np.maximum(equal.sum(axis=0), 1)
        return marked

    def find_best(self) -> int:
        """Finds the option of least expected cost, which is the reference of worth.

        Infeasible samples are included.
        """
        return int(self.charge().mean(axis=1).argmin())

    def compute_regret(self, option: int) -> float:
        """Computes the expected regret of an option.

        The regret is the mean cost minus the mean of each sample's least cost.
        """
        charged = self.charge()
        return float((charged[option] - charged.min(axis=0)).mean())


class Worth(NamedTuple):
    """Worth of making some holds before choosing."""

    worths: Array  # worth for each decision, at least 0, (D,), in the unit of its cost
    # Standard error of the total for independent samples; for evenly spread samples it is smaller.
    se: float
    total: float  # sum over decisions
    p_best_after: Array  # expected probability, after the holds, that the chosen option is the cheapest, (D,)


def feel(hold: PossibleHold, static: StaticHold, noise: NoiseModel, sd: Array, rng: np.random.Generator) -> Array:
    """Simulates an object's measurement for each sample.

    The measurement is reduced to its information about materials.

    Args:
        hold: Object.
        static: Arm at rest in the posture of the hold.
        noise: Noise of the joint torques.
        sd: Standard deviations of the samples of mean densities, (M,), [kg/m^3].
        rng: Random generator.

    Returns: Numbers of unit variance, (S, r), where r is at most the number of the object's materials.
    """
    load = hold.compute_load(static)
    total = static.tau_arm + load
    scale = noise.compute_sd(total.mean(axis=0))
    felt = load + noise.compute_sd(total.ravel()).reshape(total.shape) * rng.standard_normal(total.shape)
    regressor = static.Y @ hold.geometry.Phi
    # Everything except the materials' means: errors of torque and geometry, and the object's own deviation.
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
    """Decisions with costs, prepared for computing worths.

    Infeasible samples are priced, and samples are in folds.
    """

    def __init__(self, decisions: Sequence[Decision]) -> None:
        """Prepares the costs of decisions, which must have the same samples."""
        costs = np.concatenate([decision.charge() for decision in decisions]).T
        best = np.concatenate([decision.mark_best() for decision in decisions]).T
        # For each fold: indices of its samples, costs of all options, (about S / _FOLDS, K), and shares with which
        # each option is the cheapest of a sample.
        self.folds = [np.arange(fold, len(costs), _FOLDS) for fold in range(_FOLDS)]
        self.costs = [np.ascontiguousarray(costs[fold]) for fold in self.folds]
        self.best = [np.ascontiguousarray(best[fold]) for fold in self.folds]
        # Indices at which the options of each decision begin and end, (D + 1,).
        self.ends = np.cumsum([0, *(len(decision.cost) for decision in decisions)])
        sums = np.array([own.sum(axis=0) for own in self.costs])
        others = sums.sum(axis=0) - sums
        # Index of the option that each decision would choose now, given all folds except one, (_FOLDS, D).
        self.now = np.array(
            [[a + row[a:b].argmin() for a, b in itertools.pairwise(self.ends)] for row in others], dtype=int
        )


def compute_worth(percepts: Sequence[Array], priced: PricedDecisions) -> Worth:
    """Computes the worth of several holds before a choice. The holds' percepts are (S, r) each."""
    Q = _orthonormalise(_expand(np.hstack(percepts)))
    owns = [Q[fold] for fold in priced.folds]
    products = np.array([own.T @ cost for own, cost in zip(owns, priced.costs, strict=True)])
    # Least squares over all other folds: the contribution of a fold is subtracted from the sums over all.
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
    """Percepts of all possible holds, for the samples that price decisions."""

    def __init__(self, felt: Mapping[str, Array], priced: PricedDecisions) -> None:
        """Stores each object's percept, (S, r), by name."""
        self._felt, self._priced = felt, priced

    def find_best_pair(self, names: Sequence[str]) -> tuple[tuple[str, str] | None, float]:
        """Finds the two objects with the largest joint worth.

        Returns them with their worth, or None if no pair has a worth.
        """
        worths = {pair: self._measure(pair).total for pair in itertools.combinations(names, 2)}
        best = max(worths, key=lambda pair: worths[pair], default=None)
        return (best, worths[best]) if best and worths[best] > 0.0 else (None, 0.0)

    def look_ahead(self, names: Sequence[str], settled: Array, least: float) -> tuple[tuple[str, ...], Array]:
        """Plans a sequence of holds greedily. Each step adds the object with the largest joint worth.

        Args:
            names: Names of the first holds.
            settled: Probability from which each choice counts as settled, (D,); the plan ends when all are.
            least: Least worth that a further hold must add.

        Returns: Names of the holds in order, at most a few, and the expected probability, after them, that each
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
    """Computes a hold's information about materials, [nat].

    ``covariance`` belongs to the mean densities, (M, M). ``common`` selects its columns; None selects all.
    """
    rho = hold.densities.mean(axis=0)
    regressor = static.Y @ hold.geometry.Phi
    spread = np.maximum(hold.densities.var(axis=0) - np.diag(covariance), 0.0)
    R = np.diag(noise.compute_sd(static.tau_arm + regressor @ rho) ** 2) + regressor * spread @ regressor.T
    R += static.Y @ hold.geometry.compute_covariance(rho) @ static.Y.T
    chosen = range(len(covariance)) if common is None else common
    # Posterior covariance C - C A^T (A C A^T + R)^-1 A C of the selected columns.
    shared = covariance[list(chosen)] @ regressor.T
    before = covariance[np.ix_(chosen, chosen)]
    after = before - shared @ np.linalg.solve(regressor @ covariance @ regressor.T + R, shared.T)
    return 0.5 * float(np.linalg.slogdet(before)[1] - np.linalg.slogdet(after)[1])


def _expand(percept: Array) -> Array:
    """Computes products of up to three percept variables, (S, r). Returns (S, number of products)."""
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
    """Computes an orthonormal basis, (S, r), of the span of columns, (S, p). The rank is r."""
    lengths = np.linalg.norm(columns, axis=0)
    Q, R = np.linalg.qr(columns / np.maximum(lengths, np.finfo(float).tiny))
    u, s, _ = np.linalg.svd(R)
    seen = s > len(columns) * np.finfo(float).eps * s[0]
    basis: Array = Q if seen.all() else Q @ u[:, seen]
    return basis
