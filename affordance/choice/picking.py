"""Decision rules that choose an option from costs for samples of a belief."""

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.choice.demand import Criterion
from affordance.choice.motion_cost import Costs

type Chosen = NDArray[np.intp]

# Relative difference below which costs count as equal, because of rounding errors.
TIE = 1e-9
NO_OPTION = -1
# Default for the smallest probability of feasibility with which an option is usable.
MIN_FEASIBILITY = 0.95


def pick_cheapest(costs: Costs, rng: np.random.Generator) -> Chosen:
    """Picks the cheapest feasible option for each sample, (S,), with random choice between ties.

    The result is NO_OPTION for samples without a feasible option.
    """
    cost = np.where(costs.feasible, costs.cost, np.inf)
    least = cost.min(axis=0)
    equal = costs.feasible & (cost <= least * (1.0 + TIE))
    lots = np.where(equal, rng.random(cost.shape), -1.0)
    picked: Chosen = np.where(equal.any(axis=0), lots.argmax(axis=0), NO_OPTION)
    return picked


def find_chosen(cost: Array, feasible: NDArray[np.bool_], criterion: Criterion) -> int:
    """Finds the usable option with the least cost by a criterion; the first wins a tie.

    Args:
        cost: Costs of k options for S samples, (k, S).
        feasible: True where an option is feasible, (k, S).
        criterion: Criterion, which determines whether means or quantiles are compared.

    Returns:
        Index of the option, or NO_OPTION if no option is usable.
    """
    usable = feasible.mean(axis=1) >= MIN_FEASIBILITY
    if not usable.any():
        return NO_OPTION
    finite = np.isfinite(cost).all(axis=1, keepdims=True)
    cost = np.where(finite, cost, 0.0)
    amounts = np.quantile(cost, 0.95, axis=1) if criterion.is_peak else cost.mean(axis=1)
    amounts = np.where(finite[:, 0], amounts, np.inf)
    return int(np.flatnonzero(usable & (amounts <= amounts[usable].min() * (1.0 + TIE)))[0])
