"""Advice on what to hold next before tools are chosen, what it is worth, and when to stop."""

import itertools
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from affordance.arguments import check_kind, check_number, check_whole
from affordance.arrays import Array
from affordance.belief.kind_memory import KindMemory
from affordance.belief.likelihood import Likelihood
from affordance.belief.object_belief import Memory
from affordance.choice.demand import Criterion
from affordance.choice.hold_worth import Decision, PossibleHold, feel, measure_information, measure_worth
from affordance.choice.inner_simulation import Choice
from affordance.choice.weighing import GripBounds, measure
from affordance.exceptions import AffordanceError
from affordance.files.constraints import Whole
from affordance.objects.inertia import Geometry, build_transform_map
from affordance.objects.tool import Tool
from affordance.plant.load import load_arm
from affordance.proprioception.static_hold import StaticHold
from affordance.settings import Settings
from affordance.vision.eye import measure_drawing
from affordance.vision.features import ComponentFeatures
from affordance.vision.systems import measure_geometry

# Probability from which a choice counts as certain, as elsewhere.
CERTAIN = 0.95
# Candidates of which pairs are looked at, the best by information, before nothing is called worth its price.
_MOST_PAIRED = 8
# Worth below this share of the expected cost is rounding and noise.
_NEGLIGIBLE = 1e-4
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
        worth_se: Standard error of the worth.
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
    """

    name: str
    best: str
    p_best: float
    regret: float


class HoldAdvice(NamedTuple):
    """Advice on what to hold next.

    Attributes:
        ranked: Objects that may be held, the one of greatest worth first.
        decisions: Decisions as they stand.
        stop: Reason to hold nothing more: "certain" or "not worth its price"; empty if something should be held.
        pair: Names of the two objects that are worth most together, if no single one is worth its price.
        pair_worth: Worth of that pair.
        unit: Unit of costs and worths.
    """

    ranked: tuple[RankedHold, ...]
    decisions: tuple[OpenDecision, ...]
    stop: str
    pair: tuple[str, str] | None
    pair_worth: float
    unit: str


def advise_hold(
    candidates: Sequence[Tool],
    questions: Sequence[Question],
    memory: Memory,
    settings: Settings,
    *,
    criterion: Criterion = Criterion.WORK,
    price: float = 0.0,
    known: Mapping[str, Likelihood] | None = None,
    num_samples: int = 4000,
    seed: int = 0,
) -> HoldAdvice:
    """Advises on what to hold next, so that choices come out right.

    Every candidate is held still in the arm's home posture, by its first grip or as it is written. All share their
    samples and random numbers, so that differences between them are those of the objects.

    Args:
        candidates: Objects that may be held, at least one.
        questions: Tasks and options, at least one.
        memory: Belief about materials.
        settings: Settings of arm, noise and prior.
        criterion: Criterion by which options are compared; worths have its unit.
        price: Price of a hold, in that unit.
        known: Likelihood of the own densities of objects that were held before, by name; a density for each of their
            colours, in the order in which they show them.
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
    rng = np.random.default_rng(seed)
    features = {tool.name: measure_drawing(_grip(tool)) for tool in candidates}
    for parts in features.values():
        memory = memory.add_colours([part.colour for part in parts], settings.prior)
    for question in questions:
        memory = question.choice.add_colours(memory)
    mu = memory.belief.draw_samples(rng, num_samples)
    sampler = _Sampler(memory, mu, settings, dict(known or {}), rng)
    decisions = [_decide(question, sampler, criterion) for question in questions]
    static, noise = StaticHold(load_arm(settings.arm)), settings.noise
    holds = [sampler.build_hold(name, parts) for name, parts in features.items()]
    sd, covariance = mu.std(axis=0), np.atleast_2d(np.cov(mu.T))
    percepts = [feel(hold, static, noise, sd, np.random.default_rng([seed, 1])) for hold in holds]
    uses = np.array([question.uses for question in questions])
    found = []
    for hold, percept in zip(holds, percepts, strict=True):
        worth = measure_worth([percept], decisions)
        information = measure_information(hold, static, noise, covariance)
        found.append(
            RankedHold(
                hold.name,
                float(worth.worths @ uses),
                worth.se,
                tuple(float(each) for each in worth.worths),
                information,
                tuple(float(each) for each in worth.p_best_after),
            )
        )
    open_decisions = [_describe(decision) for decision in decisions]
    ranked = tuple(sorted(found, key=lambda each: (-each.worth, -each.information)))
    scale = sum(
        use * float(decision.charge().mean(axis=1).min()) for use, decision in zip(uses, decisions, strict=True)
    )
    least = max(price, _NEGLIGIBLE * scale)
    stop, pair, pair_worth = "", None, 0.0
    if all(each.p_best >= CERTAIN for each in open_decisions):
        stop = "certain"
    elif ranked[0].worth <= least:
        pair, pair_worth = _find_pair(found, percepts, decisions, uses)
        if pair_worth <= 2.0 * least:
            stop, pair = "not worth its price", None
    return HoldAdvice(ranked, tuple(open_decisions), stop, pair, pair_worth, criterion.unit)


class _Sampler:
    """Samples of objects' own densities, around the same samples of their materials' means."""

    def __init__(
        self,
        memory: Memory,
        mu: Array,
        settings: Settings,
        known: Mapping[str, Likelihood],
        rng: np.random.Generator,
    ) -> None:
        self._memory, self._mu, self._settings, self._known, self._rng = memory, mu, settings, known, rng
        self._own: dict[str, Array] = {}

    def draw_own(self, name: str, parts: Sequence[ComponentFeatures]) -> Array:
        """Draws an object's own densities given its materials' means, (S, M); the same at every call."""
        if name not in self._own:
            sd = self._settings.prior.deviation_sd
            own = self._mu + sd * self._rng.standard_normal(self._mu.shape)
            columns = self._find_columns(parts)
            chosen = list(dict.fromkeys(columns))
            if self._is_odd(parts):  # its densities are its own, and say nothing about the materials' means
                recollection = self._memory.recall([part.appearance for part in parts], self._settings.prior)
                drawn = recollection.densities.draw_samples(self._rng, len(own))
                for part, column in zip(recollection.columns, columns, strict=True):
                    own[:, column] = drawn[:, part]
            elif (likelihood := self._known.get(name)) is not None and len(likelihood.precision) == len(chosen):
                precision = np.eye(len(chosen)) / sd**2 + likelihood.precision
                covariance = np.linalg.inv(precision)
                mean = (self._mu[:, chosen] / sd**2 + likelihood.information_vector) @ covariance
                root = np.linalg.cholesky(0.5 * (covariance + covariance.T))
                own[:, chosen] = mean + self._rng.standard_normal(mean.shape) @ root.T
            self._own[name] = np.maximum(own, 0.0)
        return self._own[name]

    def build_hold(self, name: str, parts: Sequence[ComponentFeatures]) -> PossibleHold:
        """Builds an object that may be held."""
        return PossibleHold(name, self.build_geometry(parts), self.draw_own(name, parts))

    def build_geometry(self, parts: Sequence[ComponentFeatures]) -> Geometry:
        """Builds an object's geometry, with a column for each colour of the memory."""
        return measure_geometry(parts, self._find_columns(parts), self._mu.shape[1])

    def draw_errors(self, geometry: Geometry) -> Array:
        """Draws the errors of an object's measurements, (S, G)."""
        return self._rng.standard_normal((len(self._mu), len(geometry.Phi_errors)))

    def _find_columns(self, parts: Sequence[ComponentFeatures]) -> list[int]:
        return [
            self._memory.recognise(part.colour, part.colour_sd, self._settings.prior, part.lightness_sd)[1]
            for part in parts
        ]

    def _is_odd(self, parts: Sequence[ComponentFeatures]) -> bool:
        """Returns True if a learner with kinds holds an object for another kind than the most populous one."""
        if not isinstance(self._memory, KindMemory):
            return False
        place = self._memory.find([part.appearance for part in parts])
        if place is None:
            return False
        known = self._memory.kinds.objects[place]
        return any(
            membership.kind != self._memory.kinds.find_most_populous(colour)
            for membership, colour in zip(known.memberships, known.colours, strict=True)
        )


def _decide(question: Question, sampler: _Sampler, criterion: Criterion) -> Decision:
    """Builds a decision: the costs of all options under the samples."""
    parameters: dict[str, Array] = {}
    for option in question.choice.options:
        if option.object_name not in parameters:
            geometry = sampler.build_geometry(option.features)
            own = sampler.draw_own(option.object_name, option.features)
            parameters[option.object_name] = geometry.compute_parameters(own, sampler.draw_errors(geometry))
    pi = np.array(
        [
            parameters[option.object_name] @ build_transform_map(np.linalg.inv(option.X_TG)).T
            for option in question.choice.options
        ]
    )
    costs, _ = measure(question.choice, pi, criterion, GripBounds())
    names = tuple(option.name for option in question.choice.options)
    return Decision(question.name, names, costs.cost, costs.feasible, question.uses)


def _describe(decision: Decision) -> OpenDecision:
    best, shares, regret = decision.find_best()
    return OpenDecision(decision.name, decision.options[best], float(shares[best]), regret)


def _find_pair(
    found: Sequence[RankedHold], percepts: Sequence[Array], decisions: Sequence[Decision], uses: Array
) -> tuple[tuple[str, str] | None, float]:
    """Finds the two objects that are worth most together, among those that tell most: worth is not concave."""
    order = sorted(range(len(found)), key=lambda i: -found[i].information)[:_MOST_PAIRED]
    best: tuple[str, str] | None = None
    most = 0.0
    for i, j in itertools.combinations(order, 2):
        worth = float(measure_worth([percepts[i], percepts[j]], decisions).worths @ uses)
        if worth > most:
            best, most = (found[i].name, found[j].name), worth
    return best, most


def _grip(tool: Tool) -> Tool:
    return tool.gripped_by(tool.grips[0]) if tool.grips else tool
