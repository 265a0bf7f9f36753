"""Advice on what to hold next: the worth of holding each object, the current decisions, and when to stop."""

from typing import NamedTuple

# A choice counts as certain if it is right with at least this probability.
CERTAIN = 0.95


class RankedHold(NamedTuple):
    """Object that may be held, and the worth of holding it.

    Attributes:
        name: Name of the object.
        worth: Expected reduction in cost over all tasks and uses, in the unit of the cost.
        worth_se: Standard error of the worth for independent samples; for evenly spread samples it is smaller.
        worths: Worth for each task, for one use.
        information: Information about materials, [nat].
        p_best_after: For each task, the expected probability, after the hold, that the choice is the best.
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
    """Current decision for a task.

    Attributes:
        name: Name of the task.
        best: Name of the option to take now, the first of a ranking; if none is usable, the one most probably
            feasible.
        is_usable: True if that option is usable: feasible with the probability that a ranking requires.
        p_feasible: Probability that it is feasible.
        p_best: Probability that it is the best.
        regret: Expected excess of its cost over that of the best option, in the unit of the cost.
        cost: Expected cost of that option, in the same unit.
        margin: Expected cost of the second best option minus that of the best; None if there is only one.
        p_possible: Probability that at least one option can do the task.
        rests_on: Names of the objects on which a certain choice depends: without any one of them it would be open.
            Computed only before the advice to stop.
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
        """True unless it is certain that no option can do the task, with probability ``CERTAIN``."""
        return self.p_possible > 1.0 - CERTAIN

    @property
    def is_certain(self) -> bool:
        """True if the choice is certain, or if it is certain that no option can do the task."""
        return self.p_best >= CERTAIN or not self.is_possible


class HoldAdvice(NamedTuple):
    """Advice on what to hold next.

    Attributes:
        ranked: Objects that may be held, the most worthwhile first.
        decisions: Current decision for each task.
        stop: Reason to hold nothing more: "impossible", "certain" or "not worth its price"; empty if something should
            be held.
        is_certain: First stopping rule: True if every choice is certain.
        is_below_price: Second stopping rule: True if neither an object nor a pair is worth its price. Pairs are
            considered only while a choice is open.
        price: Price of a hold, in the unit of the cost.
        pair: Names of the two objects that are worth most together, if no single one is worth its price.
        pair_worth: Worth of that pair.
        unit: Unit of costs and worths.
        plan: Names of the objects to hold in turn, starting with the next one, as far as can be planned before it is
            felt: until every choice is expected to be certain, or a further hold is not worth its price. Empty if no
            plan was made, or nothing should be held.
        p_best_planned: For each choice, the expected probability, after the planned holds, that it is the best.
        check: Name of the object to hold as a check because certainty rests on a single object; empty if it does not,
            or if no object that may be held would be informative and worth its price.

    Example:
        >>> from affordance import MODELS, MaterialMemory, Robot, Settings, advise_hold, load_tools
        >>> from affordance.choice.listed_options import list_drawn_options
        >>> from affordance.extensions.advice.next_hold import Question
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
        """Name of the object to hold next, also after a stop: a check, the first of a pair, or the one worth most."""
        return self.check or (self.pair[0] if self.pair else self.ranked[0].name)

    @property
    def rests_on(self) -> tuple[str, ...]:
        """Names of all objects without any one of which some certain choice would be open."""
        return tuple(dict.fromkeys(name for each in self.decisions for name in each.rests_on))
