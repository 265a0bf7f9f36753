"""Advice on what to hold next: objects by what holding them is worth, decisions as they stand, and stopping."""

from typing import NamedTuple

# Probability from which a choice counts as certain, as elsewhere.
CERTAIN = 0.95


class RankedHold(NamedTuple):
    """Object that may be held, and what that is worth.

    Attributes:
        name: Name of the object.
        worth: Expected fall of the cost over all tasks and uses, in the unit of the cost.
        worth_se: Standard error of the worth, as of independent samples; of evenly spread ones it is less.
        worths: Worth for each task, once.
        information: Information about materials, [nat].
        p_best_after: Probability of being the best that each task's choice is expected to have then.
        p_held: Probability that the arm can hold the object still within its torque limits.
    """

    name: str
    worth: float
    worth_se: float
    worths: tuple[float, ...]
    information: float
    p_best_after: tuple[float, ...]
    p_held: float


class OpenDecision(NamedTuple):
    """Decision as it stands.

    Attributes:
        name: Name of the task.
        best: Name of the option to take now, the first of a ranking; where none is usable, the likeliest to be
            feasible.
        is_usable: True if that option is usable: feasible with the probability that a ranking requires.
        p_feasible: Probability that it is feasible.
        p_best: Probability that it is the best.
        regret: Expected cost in excess of the best, in the unit of the cost.
        cost: Expected cost of the option to take, in that unit.
        margin: Expected cost of the next best option less that of the option to take; None if there is only one.
        p_possible: Probability that any option can do the task.
        rests_on: Names of the objects without any one of which a choice that is certain would be open; looked at only
            before it is advised to stop.
    """

    name: str
    best: str
    is_usable: bool
    p_feasible: float
    p_best: float
    regret: float
    cost: float
    margin: float | None
    p_possible: float
    rests_on: tuple[str, ...] = ()

    @property
    def is_possible(self) -> bool:
        """True unless it is certain that no option can do the task."""
        return self.p_possible > 1.0 - CERTAIN

    @property
    def is_certain(self) -> bool:
        """True if the choice is certain, or it is certain that there is none."""
        return self.p_best >= CERTAIN or not self.is_possible


class HoldAdvice(NamedTuple):
    """Advice on what to hold next.

    Attributes:
        ranked: Objects that may be held, the one of greatest worth first.
        decisions: Decisions as they stand.
        stop: Reason to hold nothing more: "impossible", "certain" or "not worth its price"; empty if something should
            be held.
        is_certain: First rule of stopping: True if every choice is certain.
        is_below_price: Second rule of stopping: True if no object is worth its price, nor a pair; pairs are
            looked at while a choice is open.
        price: Price of a hold, in the unit of the cost.
        pair: Names of the two objects that are worth most together, if no single one is worth its price.
        pair_worth: Worth of that pair.
        unit: Unit of costs and worths.
        plan: Names of the objects to hold one after the other, the next one first, as far as can be said before it is
            felt: until every choice is expected to be certain, or a further hold is not worth its price; empty if
            that was not looked at, or nothing is to be held.
        p_best_planned: Probability of being the best that each choice is expected to have after these holds.
        check: Name of the object to hold as certainty rests on a single one; empty if it does not, or if nothing that
            may be held would tell and is worth its price.

    Example:
        >>> from affordance import MODELS, MaterialMemory, Robot, Settings, advise_hold, load_tools
        >>> from affordance.choice.listed_options import list_drawn_options
        >>> from affordance.choice.next_hold import Question
        >>> from affordance.choice.pricing import plan_options
        >>> options = list_drawn_options(load_tools(MODELS / "workshop" / "tools.yaml")[:1])
        >>> reach = Question("reach", plan_options(options, Robot().load_task("reach"), Settings()))
        >>> stock = load_tools(MODELS / "workshop" / "blanks.yaml")
        >>> advice = advise_hold(stock, [reach], MaterialMemory(), Settings(), num_samples=500)
        >>> advice.ranked[0].name
        'bar of oak'
    """

    ranked: tuple[RankedHold, ...]
    decisions: tuple[OpenDecision, ...]
    stop: str
    is_certain: bool
    is_below_price: bool
    price: float
    pair: tuple[str, str] | None
    pair_worth: float
    unit: str
    plan: tuple[str, ...] = ()
    p_best_planned: tuple[float, ...] = ()
    check: str = ""

    @property
    def next_name(self) -> str:
        """Name of the object to hold next: a check, the first of a pair, or what is worth most; even after a stop."""
        return self.check or (self.pair[0] if self.pair else self.ranked[0].name)

    @property
    def rests_on(self) -> tuple[str, ...]:
        """Names of the objects on a single one of which a choice that is certain rests."""
        return tuple(dict.fromkeys(name for each in self.decisions for name in each.rests_on))
