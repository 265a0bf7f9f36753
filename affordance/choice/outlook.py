"""Worth of several holds together: the best pair, and what to hold after what.

Worth is not concave: two objects may be worth together what neither is alone.
"""

import itertools
from collections.abc import Mapping, Sequence

from affordance.arrays import Array
from affordance.choice.hold_worth import PricedDecisions, Worth, measure_worth

# Holds beyond which nothing is said before the first is felt.
_MOST_AHEAD = 4


class Outlook:
    """Percepts of all objects that may be held, under the samples by which decisions are priced."""

    def __init__(self, felt: Mapping[str, Array], priced: PricedDecisions) -> None:
        """Stores each object's percept by name, (S, r)."""
        self._felt, self._priced = felt, priced

    def find_best_pair(self, names: Sequence[str]) -> tuple[tuple[str, str] | None, float]:
        """Finds the two objects that are worth most together, and their worth; None if no pair is worth anything."""
        best: tuple[str, str] | None = None
        most = 0.0
        for pair in itertools.combinations(names, 2):
            worth = self._sum(self._measure(pair))
            if worth > most:
                best, most = pair, worth
        return best, most

    def look_ahead(self, names: Sequence[str], certain: float, least: float) -> tuple[tuple[str, ...], Array]:
        """Adds to the next holds, one at a time, the object that makes all of them worth most together.

        It ends when all choices are certain, of that probability of being the best, or a further hold adds less than
        the least worth. Returns the names of all holds in their order, at most a few, and the probability of being
        the best that each choice is expected to have after them, (D,).
        """
        order = list(names)
        worth = self._measure(order)
        while worth.p_best_after.min() < certain and len(order) < _MOST_AHEAD:
            others = {name: self._measure([*order, name]) for name in self._felt if name not in order}
            name = max(others, key=lambda each: self._sum(others[each]), default="")
            if not name or self._sum(others[name]) - self._sum(worth) <= least:
                break
            order.append(name)
            worth = others[name]
        return tuple(order), worth.p_best_after

    def _measure(self, names: Sequence[str]) -> Worth:
        return measure_worth([self._felt[name] for name in names], self._priced)

    def _sum(self, worth: Worth) -> float:
        return float(worth.worths @ self._priced.uses)
