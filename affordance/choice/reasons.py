"""Reasons of a choice: which material's uncertainty decides between two options, and what would change the choice."""

import itertools
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.choice.inner_simulation import Draws
from affordance.choice.picking import MIN_FEASIBILITY
from affordance.objects.colour import Colour

# Samples to a bin of densities, and numbers of bins: conditional costs are those of the samples of a bin.
_PER_BIN, _FEWEST, _MOST = 250, 4, 40
# Differences that do not count: within two standard errors of a mean, and 2 % of a quantile.
_ERRORS, _SHARE = 2.0, 0.02
# Level at which peaks are compared.
_PEAK = 0.95


class Share(NamedTuple):
    """Fraction of the uncertainty in the cost difference between two options that is due to one material."""

    colour: Colour  # colour by which the material is known
    # Share of the variance that its density explains, [1]; negative where materials act against each other.
    share: float


class Turn(NamedTuple):
    """Density of one material from which on another option would be chosen, all others being as believed."""

    colour: Colour  # colour by which the material is known
    density: float  # density at which the choice changes, [kg/m^3]
    above: bool  # True if it changes above this density, false if below
    probability: float  # probability of such a density under the belief
    option: int  # index of the option that would then be chosen


class Reasons(NamedTuple):
    """Reasons of a choice."""

    rival: int  # index of the option that is most probably the cheapest other than the chosen one
    shares: tuple[Share, ...]  # of the materials, the largest first
    rest: float  # share of all else: errors of shape, and what is not linear in the densities
    turns: tuple[Turn, ...]  # densities that would change the choice, the most probable first


def find_reasons(
    draws: Draws,
    costs: Array,
    feasible: NDArray[np.bool_],
    objects: NDArray[np.intp],
    pair: tuple[int, int],
    *,
    is_peak: bool,
) -> Reasons:
    """Finds the reasons of the choice of the first option of a pair rather than the second.

    Costs and feasibility are those of all options under the samples, (options, S); objects are the options' places
    among the objects of the samples, (options,).
    """
    best, rival = pair
    held = sorted({int(objects[best]), int(objects[rival])})
    shares, rest = _share_variance(draws, costs[rival] - costs[best], held)
    turns = []
    for column in np.flatnonzero(draws.used.any(axis=0)):
        with_it = objects[best] if draws.used[objects[best], column] else np.flatnonzero(draws.used[:, column])[0]
        density = draws.densities[:, with_it, column]
        turns += _find_turns(draws.colours[column], density, costs, feasible, best, is_peak)
    return Reasons(rival, shares, rest, tuple(sorted(turns, key=lambda turn: -turn.probability)))


def _share_variance(draws: Draws, difference: Array, objects: list[int]) -> tuple[tuple[Share, ...], float]:
    """Divides the variance of a difference among materials, by the covariance with their terms in a linear fit."""
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
    """Finds the densities, from the lightest and from the heaviest on, with which another option would be chosen."""
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
    """Chooses the option under some samples; another one than the best only if it is better beyond chance."""
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
