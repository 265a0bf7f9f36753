"""Where holding one end for hammering is cheaper, and where the other."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from affordance.arrays import Array
from affordance.choice.blow_cost import BlowCost


class HammeringMap(NamedTuple):
    """Work of a blow with each of G grips, over R values of a property of the object and F demanded forces.

    Attributes:
        forces: Demanded peak of the resistance, (F,), [N].
        work: (G, R, F), [J].
        feasible: Whether it can be done, (G, R, F).
    """

    forces: Array
    work: Array
    feasible: NDArray[np.bool_]


def map_work(costs: Sequence[BlowCost], pi: Sequence[Array], forces: Array) -> HammeringMap:
    """Computes the work of blows.

    Args:
        costs: The blows planned for each of G grips.
        pi: Inertial parameters of the object in each grip, for R values of its property, (R, 10) each.
        forces: Demanded peaks of the resistance, (F,), [N].
    """
    found = [
        [planned.compute(parameters, float(force)) for force in forces]
        for planned, parameters in zip(costs, pi, strict=True)
    ]
    work = np.array([[each.work for each in row] for row in found]).swapaxes(1, 2)
    feasible = np.array([[each.feasible for each in row] for row in found]).swapaxes(1, 2)
    return HammeringMap(forces, work, feasible)


def find_crossovers(costs: Mapping[str, BlowCost], pi: Mapping[str, Array], forces: Array) -> list[float]:
    """Finds the forces at which two grips of an object of known inertia cost the same.

    Args:
        costs: The blows planned for each of two grips.
        pi: Inertial parameters of the object in each grip, (10,) each.
        forces: Where changes of the cheaper grip are looked for, rising, (F,), [N].

    Returns: Rising forces, [N]; empty if one grip is the cheaper one wherever both can be used.
    """
    one, other = costs
    compare = _compare(costs[one], pi[one], costs[other], pi[other])
    differences = [compare(float(force)) for force in forces]
    return [
        float(brentq(compare, low, high, xtol=0.01))
        for low, high, before, after in zip(forces, forces[1:], differences, differences[1:], strict=False)
        if before * after < 0.0
    ]


def pick_forces_beside(
    crossovers: Sequence[float], *, forces: Array, feasible: NDArray[np.bool_], least: float, demanded: float
) -> tuple[float, float]:
    """Picks a force on either side of the first of some crossovers, to see whether the cheaper grip really changes.

    Below it half way, in proportion, to the least force. Above it half way to the demanded one, if that is where it
    lies and both grips can be used up to there; else to the last force up to which they can; and in any case before
    the next crossover.

    Args:
        crossovers: Forces at which both grips cost the same, rising, at least one, [N].
        forces: Where they were looked for, rising, (F,), [N].
        feasible: Whether both grips can be used there, (F,).
        least: Below all forces, [N].
        demanded: A force at which both grips can be used, [N].

    Returns: The force below and the one above, [N].
    """
    first = crossovers[0]
    above = forces > first
    blocked = float(forces[above & ~feasible].min(initial=np.inf))
    last = float(forces[above & (forces < blocked)].max(initial=first))
    end = min([demanded if first < demanded < blocked else last, *crossovers[1:2]])
    return float(np.sqrt(first * least)), float(np.sqrt(first * end))


def _compare(one: BlowCost, pi_one: Array, other: BlowCost, pi_other: Array) -> Callable[[float], float]:
    """Difference of the logarithms of both works as a function of force; not a number where one cannot be done."""

    def compare(force: float) -> float:
        first, second = one.compute(pi_one[None], force), other.compute(pi_other[None], force)
        if not (first.feasible[0] and second.feasible[0]):
            return np.nan
        return float(np.log(first.work[0] / second.work[0]))

    return compare
