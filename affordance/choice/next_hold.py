"""Advice on what to hold next before tools are chosen, what it is worth, and when to stop."""

import itertools
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from affordance.arguments import check_kind, check_number, check_whole
from affordance.arrays import Array
from affordance.belief.object_belief import FeltObject, Memory
from affordance.choice.demand import Criterion
from affordance.choice.hold_samples import HoldSamples, Suspicion
from affordance.choice.hold_worth import (
    Decision,
    PossibleHold,
    PricedDecisions,
    feel,
    measure_information,
    measure_worth,
)
from affordance.choice.inner_simulation import Choice
from affordance.choice.pricing import price_options
from affordance.exceptions import AffordanceError
from affordance.files.constraints import Whole
from affordance.objects.inertia import build_transform_map
from affordance.objects.tool import Tool
from affordance.plant.load import load_arm
from affordance.proprioception.static_hold import StaticHold
from affordance.settings import Settings
from affordance.vision.eye import measure_drawing

# Probability from which a choice counts as certain, as elsewhere.
CERTAIN = 0.95
# Candidates of which pairs are looked at, the best by information, before nothing is called worth its price.
_MOST_PAIRED = 8
# Worth below this share of the expected cost is rounding and noise.
_NEGLIGIBLE = 1e-4
# Samples with which a choice is looked at again as if an object were odd.
_NUM_DOUBTED = 500
_SAMPLES = Whole(100, 1_000_000)


class Question(NamedTuple):
    """Task that is to be done, and the options for it.

    Attributes:
        name: Name of the task.
        choice: Planned options.
        uses: Number of times that the task is to be done.
    """

    name: str
    choice: Choice
    uses: float = 1.0


class RankedHold(NamedTuple):
    """Object that may be held, and what that is worth.

    Attributes:
        name: Name of the object.
        worth: Expected fall of the cost over all tasks and uses, in the unit of the cost.
        worth_se: Standard error of the worth, as of independent samples; of evenly spread ones it is less.
        worths: Worth for each task, once.
        information: Information about materials, [nat].
        p_best_after: Probability of being the best that each task's choice is expected to have then.
    """

    name: str
    worth: float
    worth_se: float
    worths: tuple[float, ...]
    information: float
    p_best_after: tuple[float, ...]


class OpenDecision(NamedTuple):
    """Decision as it stands.

    Attributes:
        name: Name of the task.
        best: Name of the option to take now.
        p_best: Probability that it is the best.
        regret: Expected cost in excess of the best, in the unit of the cost.
        rests_on: Names of the objects without any one of which a choice that is certain would be open; looked at only
            before it is advised to stop.
    """

    name: str
    best: str
    p_best: float
    regret: float
    rests_on: tuple[str, ...] = ()


class HoldAdvice(NamedTuple):
    """Advice on what to hold next.

    Attributes:
        ranked: Objects that may be held, the one of greatest worth first.
        decisions: Decisions as they stand.
        stop: Reason to hold nothing more: "certain" or "not worth its price"; empty if something should be held.
        pair: Names of the two objects that are worth most together, if no single one is worth its price.
        pair_worth: Worth of that pair.
        unit: Unit of costs and worths.
        check: Name of the object to hold as certainty rests on a single one; empty if it does not, or if nothing that
            may be held would tell and is worth its price.
    """

    ranked: tuple[RankedHold, ...]
    decisions: tuple[OpenDecision, ...]
    stop: str
    pair: tuple[str, str] | None
    pair_worth: float
    unit: str
    check: str = ""

    @property
    def next_name(self) -> str:
        """Name of the object to hold next: a check, the first of a pair, or what is worth most; even after a stop."""
        return self.check or (self.pair[0] if self.pair else self.ranked[0].name)

    @property
    def rests_on(self) -> tuple[str, ...]:
        """Names of the objects on a single one of which a choice that is certain rests."""
        return tuple(dict.fromkeys(name for each in self.decisions for name in each.rests_on))


def advise_hold(
    candidates: Sequence[Tool],
    questions: Sequence[Question],
    memory: Memory,
    settings: Settings,
    *,
    criterion: Criterion = Criterion.WORK,
    price: float = 0.0,
    felt: Mapping[str, FeltObject] | None = None,
    num_samples: int = 4000,
    seed: int = 0,
) -> HoldAdvice:
    """Advises on what to hold next, so that choices come out right.

    Every candidate is held still in the arm's home posture, by its first grip or as it is written; one that is an
    option too is seen as it is there. All share their samples and random numbers, so that differences between them
    are those of the objects.

    Args:
        candidates: Objects that may be held, at least one.
        questions: Tasks and options, at least one.
        memory: Belief about materials.
        settings: Settings of arm, noise and prior.
        criterion: Criterion by which options are compared; worths have its unit.
        price: Price of a hold, in that unit.
        felt: Objects that were held before, by name: their own deviations are no news, and one of them may be odd.
        num_samples: Number of samples of the belief.
        seed: Seed of the samples.

    Raises:
        BadArgumentError: An argument is of the wrong kind or out of bounds.
        AffordanceError: There is nothing that may be held, or nothing to be decided.
    """
    check_kind("memory", memory, Memory)
    check_number("price", price, 0.0)
    check_whole("num_samples", num_samples, _SAMPLES)
    names = [tool.name for tool in candidates]
    if not names or len(set(names)) < len(names):
        raise AffordanceError(f"objects to hold are {names}, must be at least one and each of another name")
    if not questions:
        raise AffordanceError("nothing is to be decided, must be at least one task")
    offered = {option.object_name: option.features for each in questions for option in each.choice.options}
    objects = {**{tool.name: measure_drawing(tool) for tool in candidates}, **offered}
    samples = HoldSamples(memory, objects, dict(felt or {}), settings, np.random.default_rng(seed)).draw(num_samples)
    decisions = [_decide(question, samples, criterion) for question in questions]
    static, noise = StaticHold(load_arm(settings.arm)), settings.noise
    holds = [
        PossibleHold(
            tool.name,
            samples.build_geometry(tool.name, tool.grips[0].X_TG if tool.grips else None),
            samples.draw_own(tool.name),
        )
        for tool in candidates
    ]
    sd, covariance = samples.mu.std(axis=0), np.atleast_2d(np.cov(samples.mu.T))
    percepts = [feel(hold, static, noise, sd, np.random.default_rng([seed, 1])) for hold in holds]
    priced = PricedDecisions(decisions)
    found = []
    for hold, percept in zip(holds, percepts, strict=True):
        worth = measure_worth([percept], priced)
        information = measure_information(hold, static, noise, covariance, samples.common)
        found.append(
            RankedHold(
                hold.name,
                float(worth.worths @ priced.uses),
                worth.se,
                tuple(float(each) for each in worth.worths),
                information,
                tuple(float(each) for each in worth.p_best_after),
            )
        )
    open_decisions = [_describe(decision) for decision in decisions]
    ranked = tuple(sorted(found, key=lambda each: (-each.worth, -each.information)))
    scale = sum(
        use * float(decision.charge().mean(axis=1).min())
        for use, decision in zip(priced.uses, decisions, strict=True)
    )
    least = max(price, _NEGLIGIBLE * scale)
    stop, pair, pair_worth, check = "", None, 0.0, ""
    if all(each.p_best >= CERTAIN for each in open_decisions):
        stop = "certain"
    elif ranked[0].worth <= least:
        pair, pair_worth = _find_pair(found, percepts, priced)
        if pair_worth <= 2.0 * least:
            stop, pair = "not worth its price", None
    if stop:
        supports = _find_supports(questions, samples, criterion, open_decisions)
        open_decisions = [
            each._replace(rests_on=tuple(one.name for one in weak))
            for each, weak in zip(open_decisions, supports, strict=True)
        ]
        checks = {name for weak in supports for one in weak for name in samples.list_checks(one)}
        check = next((each.name for each in ranked if each.name in checks and each.worth >= price), "")
        stop = "" if check else stop
    return HoldAdvice(ranked, tuple(open_decisions), stop, pair, pair_worth, criterion.unit, check)


def _decide(question: Question, samples: HoldSamples, criterion: Criterion) -> Decision:
    """Builds a decision: the costs of all options under the samples."""
    parameters: dict[str, Array] = {}
    for option in question.choice.options:
        if option.object_name not in parameters:
            geometry = samples.build_geometry(option.object_name)
            own, errors = samples.draw_own(option.object_name), samples.draw_errors(geometry)
            parameters[option.object_name] = geometry.compute_parameters(own, errors)
    pi = np.array(
        [
            parameters[option.object_name] @ build_transform_map(np.linalg.inv(option.X_TG)).T
            for option in question.choice.options
        ]
    )
    costs = price_options(question.choice, pi, criterion)
    names = tuple(option.name for option in question.choice.options)
    return Decision(question.name, names, costs.cost, costs.feasible, question.uses)


def _find_supports(
    questions: Sequence[Question], samples: HoldSamples, criterion: Criterion, chosen: Sequence[OpenDecision]
) -> list[list[Suspicion]]:
    """Finds, for each choice that is certain, the objects without any one of which it would not be."""
    supports: list[list[Suspicion]] = [[] for _ in questions]
    for suspicion in samples.suspicions:
        samples.draw(_NUM_DOUBTED, suspicion)
        for place, (question, now) in enumerate(zip(questions, chosen, strict=True)):
            names = {option.object_name for option in question.choice.options}
            if now.p_best >= CERTAIN and samples.concerns(suspicion, names):
                decision = _decide(question, samples, criterion)
                if decision.mark_best().mean(axis=1)[decision.options.index(now.best)] < CERTAIN:
                    supports[place].append(suspicion)
    return supports


def _describe(decision: Decision) -> OpenDecision:
    best, shares, regret = decision.find_best()
    return OpenDecision(decision.name, decision.options[best], float(shares[best]), regret)


def _find_pair(
    found: Sequence[RankedHold], percepts: Sequence[Array], priced: PricedDecisions
) -> tuple[tuple[str, str] | None, float]:
    """Finds the two objects that are worth most together, among those that tell most: worth is not concave."""
    order = sorted(range(len(found)), key=lambda i: -found[i].information)[:_MOST_PAIRED]
    best: tuple[str, str] | None = None
    most = 0.0
    for i, j in itertools.combinations(order, 2):
        worth = float(measure_worth([percepts[i], percepts[j]], priced).worths @ priced.uses)
        if worth > most:
            best, most = (found[i].name, found[j].name), worth
    return best, most
