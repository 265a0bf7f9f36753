"""Explains choices by the uncertainties that matter most and the densities that would change the choice."""

import itertools
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.choice.inner_simulation import Draws
from affordance.choice.picking import MIN_FEASIBILITY
from affordance.objects.colour import Colour

# Samples per density bin, and smallest and largest number of bins. The samples of a bin give the cost at its density.
_PER_BIN, _FEWEST, _MOST = 250, 4, 40
# Largest differences between costs that are ignored: two standard errors for means, and 2 % for quantiles.
_ERRORS, _SHARE = 2.0, 0.02
# Quantile by which peak loads are compared.
_PEAK = 0.95


class Share(NamedTuple):
    """Share of one material in the uncertainty of a cost difference between two options."""

    colour: Colour  # colour that identifies the material
    # Fraction of the variance that its density explains, [1]; may be negative if effects of materials cancel.
    share: float


class Turn(NamedTuple):
    """Density of one material beyond which another option would be chosen, with all other beliefs unchanged."""

    colour: Colour  # colour that identifies the material
    density: float  # density at which the choice changes, [kg/m^3]
    above: bool  # True if the choice changes above this density, False if below
    probability: float  # probability under the belief that the density is beyond this value
    option: int  # index of the option that would be chosen


class Reasons(NamedTuple):
    """Reasons for a choice."""

    shares: tuple[Share, ...]  # shares of the materials, the largest first
    rest: float  # remaining share: errors of shape, and nonlinear effects of the densities
    turns: tuple[Turn, ...]  # densities that would change the choice, the most probable first


def find_reasons(
    draws: Draws,
    costs: Array,
    feasible: NDArray[np.bool_],
    objects: NDArray[np.intp],
    *,
    is_peak: bool,
) -> Reasons:
    """Explains why the first option is preferred to the second option.

    Args:
        draws: Samples of the belief.
        costs: Costs of all options for these samples, (options, S).
        feasible: True where an option is feasible, (options, S).
        objects: Index of each option's object among the objects of the samples, (options,).
        is_peak: True if costs are compared by their 95 % quantile instead of their mean.
    """
    best = 0
    held = sorted({int(each) for each in objects[:2]})
    shares, rest = _share_variance(draws, costs[1] - costs[best], held)
    turns = []
    for column in np.flatnonzero(draws.used.any(axis=0)):
        with_it = objects[best] if draws.used[objects[best], column] else np.flatnonzero(draws.used[:, column])[0]
        density = draws.densities[:, with_it, column]
        turns += _find_turns(draws.colours[column], density, costs, feasible, best, is_peak)
    return Reasons(shares, rest, tuple(sorted(turns, key=lambda turn: -turn.probability)))


def _share_variance(draws: Draws, difference: Array, objects: list[int]) -> tuple[tuple[Share, ...], float]:
    """Attributes the variance of a cost difference to materials.

    A material's share is the covariance of the difference with the material's terms in a linear fit.

    Returns:
        Shares of the materials, and the remaining share.
    """
    places = [(each, int(column)) for each in objects for column in np.flatnonzero(draws.used[each])]
    densities = np.column_stack([draws.densities[:, each, column] for each, column in places])
    densities = densities - densities.mean(axis=0)
    deviation = difference - difference.mean()
    variance = float(deviation @ deviation)
    if not variance > 0.0:
        return (), 0.0
    slopes, *_ = np.linalg.lstsq(densities, deviation, rcond=None)
    parts = slopes * (densities.T @ deviation) / variance
    by_column: dict[int, float] = {}
    for (_, column), part in zip(places, parts, strict=True):
        by_column[column] = by_column.get(column, 0.0) + float(part)
    shares = [Share(draws.colours[column], share) for column, share in by_column.items()]
    return tuple(sorted(shares, key=lambda each: -each.share)), 1.0 - sum(by_column.values())


def _find_turns(
    colour: Colour, density: Array, costs: Array, feasible: NDArray[np.bool_], best: int, is_peak: bool
) -> list[Turn]:
    """Finds the density below which, and the density above which, another option would be chosen."""
    num_bins = int(np.clip(len(density) // _PER_BIN, _FEWEST, _MOST))
    bins = np.array_split(np.argsort(density), num_bins)
    chosen = [_choose(costs[:, each], feasible[:, each], best, is_peak) for each in bins]
    turns = []
    for above, order in ((False, range(num_bins)), (True, range(num_bins - 1, -1, -1))):
        run = list(itertools.takewhile(lambda each: chosen[each] != best, order))
        if not run or len(run) == num_bins:
            continue
        edge = bins[run[-1]][0 if above else -1]
        probability = sum(len(bins[each]) for each in run) / len(density)
        turns.append(Turn(colour, float(density[edge]), above, probability, chosen[run[-1]]))
    return turns


def _choose(costs: Array, feasible: NDArray[np.bool_], best: int, is_peak: bool) -> int:
    """Chooses an option for some samples: ``best`` unless another option is significantly better."""
    usable = feasible.mean(axis=1) >= MIN_FEASIBILITY
    values = np.quantile(costs, _PEAK, axis=1) if is_peak else costs.mean(axis=1)
    values = np.where(usable, values, np.inf)
    option = int(np.argmin(values))
    if not usable[option] or option == best or not usable[best]:
        return option if usable[option] else best
    if is_peak:
        return option if values[option] < (1.0 - _SHARE) * values[best] else best
    difference = costs[best] - costs[option]
    error = difference.std() / np.sqrt(len(difference))
    return option if difference.mean() > _ERRORS * error else best
