"""Recommendation of the object to hold next before choosing tools, and stopping rules."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from affordance.arguments import check_kind, check_number, check_whole
from affordance.arrays import Array
from affordance.belief.material_memory import MaterialMemory
from affordance.choice.demand import Criterion
from affordance.choice.inner_simulation import Choice
from affordance.choice.picking import MIN_FEASIBILITY, NO_OPTION, find_chosen
from affordance.choice.pricing import GripBounds, explain_excess, price_options
from affordance.exceptions import AffordanceError
from affordance.extensions.advice.hold_samples import HoldSamples, Suspicion
from affordance.extensions.advice.hold_worth import (
    Decision,
    Outlook,
    PossibleHold,
    PricedDecisions,
    compute_information,
    compute_worth,
    feel,
)
from affordance.files.constraints import Whole
from affordance.objects.appearance import PartAppearance
from affordance.objects.tool import Tool
from affordance.plant.load import load_arm
from affordance.proprioception.static_hold import StaticHold
from affordance.settings import Settings
from affordance.vision.eye import measure_drawing

# Smallest probability of being the best for an option that counts as a settled choice.
SETTLED = 0.95


class RankedHold(NamedTuple):
    """Worth of holding an object before choosing tools.

    Attributes:
        name: Name of the object.
        worth: Expected reduction in cost, summed over all tasks, in the unit of the cost.
        worth_se: Standard error of the worth if samples were independent; it is smaller for evenly spread samples.
        worths: Worth for each task.
        information: Information about material densities, [nat].
        p_best_after: Expected probability for each task that the option chosen after the hold is the best.
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
    """Decision for a task, given the current belief.

    Attributes:
        name: Name of the task.
        best: Name of the chosen option; if no option is usable, the option with the highest feasibility.
        is_usable: True if the chosen option is feasible with a high enough probability.
        p_feasible: Probability that the chosen option is feasible.
        p_best: Probability that the chosen option is the best.
        regret: Expected regret of the chosen option, in the unit of the cost.
        cost: Expected cost of the chosen option, in the same unit.
        margin: Expected cost of the next best option minus that of the chosen option; None if there is only one.
        p_possible: Probability that at least one option can do the task.
        alike: Names of grips of the same tool that are equivalent to the chosen grip by symmetry.
        infeasible_reason: Reason why the chosen option is not usable; empty if it is usable.
        rests_on: Names of held objects on which a settled choice depends: without the evidence of any one of them, it
            would be open. They are computed only if nothing more should be held.
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
    alike: tuple[str, ...] = ()
    infeasible_reason: str = ""
    rests_on: tuple[str, ...] = ()

    @property
    def is_possible(self) -> bool:
        """False if all options are infeasible with a probability of at least ``SETTLED``."""
        return self.p_possible > 1.0 - SETTLED

    @property
    def is_settled(self) -> bool:
        """True if the choice is settled or no option can do the task."""
        return self.p_best >= SETTLED or not self.is_possible


class HoldAdvice(NamedTuple):
    """Advice on what to hold next.

    Attributes:
        ranked: Objects that could be held, by decreasing worth.
        decisions: Current decision for each task.
        stop: Reason to hold nothing more: "impossible", "settled" or "not worth its price"; empty if something should
            be held.
        is_settled: First stopping rule: True if every choice is settled.
        is_below_price: Second stopping rule: True if no object and no pair of objects is worth its price. Pairs are
            considered only while a choice is open.
        price: Price of a hold, in the unit of the cost.
        pair: Names of the two objects with the largest joint worth, if no single object is worth its price.
        pair_worth: Worth of that pair.
        unit: Unit of costs and worths.
        plan: Names of the objects to hold in turn, until every choice is expected to be settled or a further hold is
            not worth its price; at most a few. It is empty if no plan was made or nothing should be held.
        p_best_planned: Expected probability for each task that the option chosen after the plan is the best.
        check: Name of an object to hold as a check, because a settled choice depends on a single held object; empty
            if no check is needed or none is worth its price.

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
    is_settled: bool
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
        """Name of the object to hold next, even if the advice is to stop.

        It is the check, the first object of the pair, or the object with the largest worth, in this order.
        """
        return self.check or (self.pair[0] if self.pair else self.ranked[0].name)

    @property
    def rests_on(self) -> tuple[str, ...]:
        """Names of all held objects on which a settled choice depends."""
        return tuple(dict.fromkeys(name for each in self.decisions for name in each.rests_on))


# Number of best candidates, by worth and then by information, whose pairs are evaluated before advising to stop.
_MOST_PAIRED = 12
# Smallest probability that the arm can hold an object that is recommended.
_HOLDABLE = 0.05
# Smaller worths, as a fraction of the expected cost, are numerical noise.
_NEGLIGIBLE = 1e-4
# Number of samples for repeating a choice without the evidence of one object.
_NUM_DOUBTED = 500
_SAMPLES = Whole(100, 100_000)


class Question(NamedTuple):
    """Future task and its options."""

    name: str
    choice: Choice


def advise_hold(
    candidates: Sequence[Tool],
    questions: Sequence[Question],
    memory: MaterialMemory,
    settings: Settings,
    *,
    criterion: Criterion = Criterion.WORK,
    bounds: GripBounds | None = None,
    price: float = 0.0,
    looks: Mapping[str, Sequence[PartAppearance]] | None = None,
    looks_ahead: bool = False,
    num_samples: int = 4000,
    seed: int = 0,
) -> HoldAdvice:
    """Recommends the object whose hold improves the choice of tools most.

    Each candidate is assumed to be held still in the home posture with its first grip or, without grips, at the
    origin of its frame. All candidates are compared with the same samples and random numbers. A candidate that the
    arm can hardly hold has zero worth.

    Args:
        candidates: Objects that could be held, at least one.
        questions: Tasks and options, at least one. If a candidate is also an option, its shape is as seen there.
        memory: Belief about materials, with the objects that were held.
        settings: Settings of arm, noise and prior.
        criterion: Criterion for comparing options, which sets the unit of worths.
        bounds: Largest wrench that the gripper can hold; None for no bounds.
        price: Price of a hold, in the unit of the criterion.
        looks: Names and appearances of the objects that were held. At most one of them is assumed to be odd: made of
            another material than it looks like.
        looks_ahead: True to plan several holds ahead.
        num_samples: Number of samples of the belief.
        seed: Seed of the samples.

    Raises:
        BadArgumentError: An argument has the wrong type or is out of bounds.
        AffordanceError: There is no object to hold, two have the same name, or there is no task.
    """
    check_kind("memory", memory, MaterialMemory)
    check_number("price", price, 0.0)
    check_whole("num_samples", num_samples, _SAMPLES)
    names = [tool.name for tool in candidates]
    if not names or len(set(names)) < len(names):
        raise AffordanceError(f"objects to hold are {names}, must be at least one, with different names")
    if not questions:
        raise AffordanceError("there is no task to decide, must be at least one")
    offered = {option.object_name: option.features for each in questions for option in each.choice.options}
    objects = {**{tool.name: measure_drawing(tool) for tool in candidates}, **offered}
    samples = HoldSamples(memory, objects, settings, np.random.default_rng(seed), looks).draw(num_samples)
    decisions = [_decide(question, samples, criterion, bounds) for question in questions]
    ranked, outlook = _rank(candidates, samples, decisions, settings, seed)
    open_decisions = [_describe(decision, criterion) for decision in decisions]
    least = max(price, _NEGLIGIBLE * sum(each.cost for each in open_decisions))
    is_settled, is_below_price = all(each.is_settled for each in open_decisions), ranked[0].worth <= least
    pair, pair_worth = None, 0.0
    if is_below_price and not is_settled:
        pair, pair_worth = outlook.find_best_pair([each.name for each in ranked[:_MOST_PAIRED]])
        is_below_price = pair_worth <= 2.0 * least
        pair = None if is_below_price else pair
    stop = ""
    if not any(each.is_possible for each in open_decisions):
        stop = "impossible"
    elif is_settled:
        stop = "settled"
    elif is_below_price:
        stop = "not worth its price"
    check = ""
    if stop:
        supports = _find_supports(questions, samples, criterion, bounds, open_decisions)
        open_decisions = [
            each._replace(rests_on=tuple(one.name for one in weak))
            for each, weak in zip(open_decisions, supports, strict=True)
        ]
        checks = {name for weak in supports for one in weak for name in samples.list_checks(one)}
        check = next((each.name for each in ranked if each.name in checks and each.worth >= price), "")
        stop = "" if check else stop
    plan: tuple[str, ...] = ()
    planned = np.zeros(0)
    if looks_ahead and not stop and not check:
        # No hold can settle a task that no option can do.
        settled = np.array([SETTLED if each.is_possible else 0.0 for each in open_decisions])
        plan, planned = outlook.look_ahead(list(pair or [ranked[0].name]), settled, least)
    return HoldAdvice(
        ranked,
        tuple(open_decisions),
        stop,
        is_settled,
        is_below_price,
        price,
        pair,
        pair_worth,
        criterion.unit,
        plan,
        tuple(planned.tolist()),
        check,
    )


def _rank(
    candidates: Sequence[Tool], samples: HoldSamples, decisions: Sequence[Decision], settings: Settings, seed: int
) -> tuple[tuple[RankedHold, ...], Outlook]:
    """Ranks objects by the worth of holding them.

    Returns: Ranked objects, and their simulated measurements for planning several holds.
    """
    arm, noise = load_arm(settings.arm), settings.noise
    static, priced = StaticHold(arm), PricedDecisions(decisions)
    sd, covariance = samples.mu.std(axis=0), np.atleast_2d(np.cov(samples.mu.T))
    found: list[RankedHold] = []
    felt: dict[str, Array] = {}
    for tool in candidates:
        geometry = samples.build_geometry(tool.name, tool.grips[0].X_TG if tool.grips else None)
        hold = PossibleHold(tool.name, geometry, samples.draw_own(tool.name), samples.draw_errors(tool.name))
        p_held = hold.compute_probability(static, arm.limits)
        percept = feel(hold, static, noise, sd, np.random.default_rng([seed, 1]))
        felt[tool.name] = percept if p_held >= _HOLDABLE else percept[:, :0]
        worth = compute_worth([felt[tool.name]], priced)
        information = compute_information(hold, static, noise, covariance, samples.common)
        worths, p_best_after = tuple(worth.worths.tolist()), tuple(worth.p_best_after.tolist())
        information = information if p_held >= _HOLDABLE else 0.0
        found.append(RankedHold(tool.name, worth.total, worth.se, worths, information, p_best_after, p_held))
    return tuple(sorted(found, key=lambda each: (-each.worth, -each.information))), Outlook(felt, priced)


def _decide(question: Question, samples: HoldSamples, criterion: Criterion, bounds: GripBounds | None) -> Decision:
    """Computes the costs of all options of a task for each sample."""
    parameters: dict[str, Array] = {}
    for option in question.choice.options:
        if option.object_name not in parameters:
            geometry = samples.build_geometry(option.object_name)
            own, errors = samples.draw_own(option.object_name), samples.draw_errors(option.object_name)
            parameters[option.object_name] = geometry.compute_parameters(own, errors)
    choice, pi = question.choice, question.choice.grip(parameters)
    costs, _ = price_options(choice, pi, criterion, bounds)
    joint_names = load_arm(choice.settings.arm).joint_names
    reasons = tuple(
        explain_excess(plan, pi[i], bounds or GripBounds(), joint_names) if p < MIN_FEASIBILITY else ""
        for i, (plan, p) in enumerate(zip(choice.cost_models, costs.feasible.mean(axis=1), strict=True))
    )
    names = tuple(option.name for option in choice.options)
    alike = tuple(option.alike for option in choice.options)
    return Decision(question.name, names, costs.cost, costs.feasible, alike, reasons)


def _find_supports(
    questions: Sequence[Question],
    samples: HoldSamples,
    criterion: Criterion,
    bounds: GripBounds | None,
    chosen: Sequence[OpenDecision],
) -> list[list[Suspicion]]:
    """Finds the held objects on whose evidence each settled choice depends."""
    supports: list[list[Suspicion]] = [[] for _ in questions]
    for suspicion in samples.suspicions:
        samples.draw(_NUM_DOUBTED, suspicion)
        for place, (question, now) in enumerate(zip(questions, chosen, strict=True)):
            names = {option.object_name for option in question.choice.options}
            if now.p_best >= SETTLED and samples.concerns(suspicion, names):
                decision = _decide(question, samples, criterion, bounds)
                if decision.mark_best().mean(axis=1)[decision.options.index(now.best)] < SETTLED:
                    supports[place].append(suspicion)
    return supports


def _describe(decision: Decision, criterion: Criterion) -> OpenDecision:
    p_feasible = decision.feasible.mean(axis=1)
    taken = find_chosen(decision.cost, decision.feasible, criterion)
    is_usable = taken != NO_OPTION
    best = taken if is_usable else int(p_feasible.argmax())
    costs = decision.charge().mean(axis=1)
    others = np.delete(costs, best)
    return OpenDecision(
        name=decision.name,
        best=decision.options[best],
        is_usable=is_usable,
        p_feasible=float(p_feasible[best]),
        p_best=float(decision.mark_best()[best].mean()),
        regret=decision.compute_regret(best),
        cost=float(costs[best]),
        margin=float(others.min() - costs[best]) if len(others) else None,
        p_possible=float((decision.feasible & np.isfinite(decision.cost)).any(axis=0).mean()),
        alike=decision.alike[best],
        infeasible_reason=decision.infeasible_reasons[best],
    )
