"""Reasons of a choice: which material's uncertainty decides between two options, and what would change the choice."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.choice.inner_simulation import Draws
from affordance.objects.colour import Colour
from affordance.objects.inertia import DENSITY_MAX

# Densities of one material at which options are compared, evenly spaced by their logarithm, and the least of them:
# the lightest solids are foams, [kg/m^3].
_NUM_DENSITIES, _LIGHTEST = 80, 10.0


class Share(NamedTuple):
    """Share of one material in the uncertainty of the difference of two options' costs.

    Attributes:
        colour: Colour by which the material is known.
        share: Share of the variance that its density explains, [1]; negative where materials act against each other.
    """

    colour: Colour
    share: float


class Turn(NamedTuple):
    """Density of one material from which on another option is the cheapest, all others as expected.

    Attributes:
        colour: Colour by which the material is known.
        density: Density at which the choice changes, [kg/m^3].
        above: True if it changes above this density, false if below.
        probability: Probability of such a density under the belief.
        option: Index of the option that is then the cheapest.
    """

    colour: Colour
    density: float
    above: bool
    probability: float
    option: int


class Reasons(NamedTuple):
    """Reasons of a choice.

    Attributes:
        rival: Index of the option that is most probably the cheapest other than the chosen one.
        shares: Shares of the materials, the largest first.
        rest: Share of all else: errors of shape, and what is not linear in the densities.
        turns: Densities that would change the choice, the most probable first.
    """

    rival: int
    shares: tuple[Share, ...]
    rest: float
    turns: tuple[Turn, ...]


# Function from densities by colour, (S, M), to the costs of all options, infinite where infeasible, (options, S).
type CostOfDensities = Callable[[Array], Array]


def find_reasons(
    draws: Draws, costs: Array, objects: NDArray[np.intp], pair: tuple[int, int], compute_costs: CostOfDensities
) -> Reasons:
    """Finds the reasons of a choice.

    Args:
        draws: Samples of the belief.
        costs: Costs of all options under these samples, (options, S).
        objects: Index of each option's object in the samples, (options,).
        pair: Index of the chosen option, and of its rival.
        compute_costs: Function that computes the costs at given densities.
    """
    best, rival = pair
    shares, rest = _share_variance(
        draws, costs[rival] - costs[best], sorted({int(objects[best]), int(objects[rival])})
    )
    turns = _find_turns(draws, best, int(objects[best]), compute_costs)
    return Reasons(rival, shares, rest, turns)


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


def _find_turns(draws: Draws, best: int, own: int, compute_costs: CostOfDensities) -> tuple[Turn, ...]:
    """Finds for each material the nearest densities below and above the expected one that change the choice."""
    expected = draws.densities.mean(axis=(0, 1))
    columns = np.flatnonzero(draws.used.any(axis=0))
    grid = np.geomspace(_LIGHTEST, DENSITY_MAX, _NUM_DENSITIES)
    rho = np.tile(expected, (len(columns), _NUM_DENSITIES, 1))
    for row, column in enumerate(columns):
        rho[row, :, column] = grid
    costs = compute_costs(rho.reshape(-1, len(expected))).reshape(-1, len(columns), _NUM_DENSITIES)
    turns = []
    for row, column in enumerate(columns):
        changed = costs[best, row] > costs[:, row].min(axis=0)
        start = int(np.searchsorted(grid, expected[column]))
        holder = own if draws.used[own, column] else int(np.flatnonzero(draws.used[:, column])[0])
        believed = draws.densities[:, holder, column]
        for above, places in ((False, range(start - 1, -1, -1)), (True, range(start, _NUM_DENSITIES))):
            first = next((place for place in places if changed[place]), None)
            if first is None:
                continue
            option = int(np.argmin(costs[:, row, first]))
            inside = first + (-1 if above else 1)
            density = _interpolate_tie(grid, costs[option, row], costs[best, row], first, inside)
            probability = float(((believed > density) if above else (believed < density)).mean())
            turns.append(Turn(draws.colours[column], density, above, probability, option))
    return tuple(sorted(turns, key=lambda turn: -turn.probability))


def _interpolate_tie(grid: Array, other: Array, chosen: Array, first: int, inside: int) -> float:
    """Interpolates where two costs are equal between two nodes of the grid; the first node if nowhere."""
    if not 0 <= inside < len(grid) or not np.isfinite([*other[[first, inside]], *chosen[[first, inside]]]).all():
        return float(grid[first])
    out, into = (float(chosen[place] - other[place]) for place in (first, inside))  # positive, and not
    if into > 0.0:
        return float(grid[first])
    share = out / (out - into)
    return float(grid[first] + share * (grid[inside] - grid[first]))
