"""Map of the cheaper grip for hammering, over the demanded force and a property of the object."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from affordance.arrays import Array
from affordance.choice.blow_cost import BlowCost


class HammeringMap(NamedTuple):
    """Work of a blow with each of G grips, over R values of a property of the object and F demanded forces."""

    forces: Array  # demanded peak of the resistance, (F,), [N]
    work: Array  # work of the joints, (G, R, F), [J]
    feasible: NDArray[np.bool_]  # true where the blow is feasible, (G, R, F)


def map_work(costs: Sequence[BlowCost], pi: Sequence[Array], forces: Array) -> HammeringMap:
    """Computes the work of blows planned for each of G grips, at demanded peaks of the resistance, (F,), [N].

    The object's inertial parameters pi in each grip are given for R values of its property, (R, 10).
    """
    found = [
        [planned.compute(parameters, float(force)) for force in forces]
        for planned, parameters in zip(costs, pi, strict=True)
    ]
    work = np.array([[each.work for each in row] for row in found]).swapaxes(1, 2)
    feasible = np.array([[each.feasible for each in row] for row in found]).swapaxes(1, 2)
    return HammeringMap(forces, work, feasible)


def find_crossovers(costs: Mapping[str, BlowCost], pi: Mapping[str, Array], forces: Array) -> list[float]:
    """Finds the forces, [N], at which two grips of an object of known inertia cost the same.

    pi are the object's parameters in each grip, (10,). Increasing forces, (F,), are compared; none is found if one
    grip is cheaper wherever both can be used.
    """
    one, other = costs
    compare = _compare(costs[one], pi[one], costs[other], pi[other])
    differences = [compare(float(force)) for force in forces]
    return [
        float(brentq(compare, low, high, xtol=0.01))
        for low, high, before, after in zip(forces, forces[1:], differences, differences[1:], strict=False)
        if before * after < 0.0
    ]


def pick_forces_around(
    crossovers: Sequence[float], *, forces: Array, feasible: NDArray[np.bool_], least: float, demanded: float
) -> tuple[float, float]:
    """Picks a force on either side of the first crossover, [N], to check that the cheaper grip really changes.

    The force below is the geometric mean of the crossover and the least force, which is below all others. The force
    above is the geometric mean of the crossover and the demanded force, if that is larger and both grips can be used
    up to there; else of the crossover and the last force up to which they can; and always before the next crossover.
    Crossovers, at least one, were found among increasing forces, (F,), with which both grips can be used where
    feasible, (F,).
    """
    first = crossovers[0]
    above = forces > first
    blocked = float(forces[above & ~feasible].min(initial=np.inf))
    last = float(forces[above & (forces < blocked)].max(initial=first))
    end = min([demanded if first < demanded < blocked else last, *crossovers[1:2]])
    return float(np.sqrt(first * least)), float(np.sqrt(first * end))


def _compare(one: BlowCost, pi_one: Array, other: BlowCost, pi_other: Array) -> Callable[[float], float]:
    """Returns the difference of both log works as a function of force; NaN where a blow is infeasible."""

    def compare(force: float) -> float:
        first, second = one.compute(pi_one[None], force), other.compute(pi_other[None], force)
        if not (first.feasible[0] and second.feasible[0]):
            return np.nan
        return float(np.log(first.work[0] / second.work[0]))

    return compare
