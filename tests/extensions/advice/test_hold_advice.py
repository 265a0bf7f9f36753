"""When to hold what: rules of prices, pairs and plans on decisions whose worths are known by hand.

Decisions among two or three options are put in place of those that are planned: their costs depend on whether the own
densities of objects, which are felt well, are above their medians. To know one side that decides between the costs 1
and 2 is worth a half; where two sides must be equal, only both are worth it.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest
from helpers.two_tools import STICK, believe
from helpers.workshop import BLANKS, plan_reach

from affordance.arrays import Array
from affordance.belief.material_memory import MaterialMemory
from affordance.choice.inner_simulation import Choice
from affordance.extensions.advice import next_hold
from affordance.extensions.advice.hold_samples import HoldSamples
from affordance.extensions.advice.hold_worth import Decision, Outlook, PossibleHold
from affordance.extensions.advice.next_hold import HoldAdvice, OpenDecision, Question, RankedHold, advise_hold
from affordance.objects.tool import Tool
from affordance.settings import DEFAULT_SETTINGS

OAK, STEEL, BRASS = (BLANKS[name] for name in ("bar of oak", "rod of cast steel", "pin of brass"))
TOOLS = (OAK, STEEL, BRASS)


@pytest.fixture(scope="module")
def choice() -> Choice:
    return plan_reach()


class Advisor:
    """Advises on decisions that are put in place of the planned ones."""

    def __init__(self, choice: Choice, monkeypatch: pytest.MonkeyPatch) -> None:
        self._choice, self._monkeypatch = choice, monkeypatch

    def advise(self, *costs: Callable[[Array], Array], tools: Sequence[Tool] = TOOLS, **more: object) -> HoldAdvice:
        """Advises with costs, (k, S), of each decision, by which objects are above the medians, (number, S)."""

        def decide(question: Question, samples: HoldSamples, *_: object) -> Decision:
            own = np.array([samples.draw_own(tool.name) @ samples.build_geometry(tool.name).Phi[0] for tool in tools])
            cost = costs[int(question.name)](own > np.median(own, axis=1)[:, None])
            return Decision(question.name, ("a", "b", "c")[: len(cost)], cost, np.isfinite(cost), question.uses)

        self._monkeypatch.setattr(next_hold, "_decide", decide)
        uses = float(more.pop("uses", 1.0))  # type: ignore[arg-type]
        memory = more.pop("memory", MaterialMemory())
        questions = [Question(str(number), self._choice, uses) for number in range(len(costs))]
        return advise_hold(tools, questions, memory, DEFAULT_SETTINGS, num_samples=1000, **more)  # type: ignore[arg-type]


@pytest.fixture
def advisor(choice: Choice, monkeypatch: pytest.MonkeyPatch) -> Advisor:
    return Advisor(choice, monkeypatch)


def depend(number: int, gain: float = 1.0) -> Callable[[Array], Array]:
    """Costs of two options that depend on the side of one object."""
    return lambda high: 1.0 + gain * np.stack([high[number], ~high[number]])


def agree(one: int, other: int, third: int | None = None, little: float = 0.0) -> Callable[[Array], Array]:
    """Costs that depend on whether two objects are on the same side, and a little on a third object."""

    def compute(high: Array) -> Array:
        alike = np.stack([high[one] == high[other], high[one] != high[other]])
        return 1.0 + alike + (0.0 if third is None else little * np.stack([high[third], ~high[third]]))

    return compute


def fix(*costs: float) -> Callable[[Array], Array]:
    """Costs of options that are certain."""
    return lambda high: np.tile(np.array(costs)[:, None], (1, high.shape[1]))


@pytest.mark.parametrize(("share", "stop"), [(0.45, ""), (0.5, "not worth its price"), (0.55, "not worth its price")])
def test_pair_must_be_worth_more_than_the_price_of_two_holds(advisor: Advisor, share: float, stop: str) -> None:
    worth = advisor.advise(agree(0, 1), price=0.1).pair_worth
    assert worth == pytest.approx(0.5, abs=0.1)
    advice = advisor.advise(agree(0, 1), price=share * worth)
    ranked = tuple(each.name for each in advice.ranked if each.name != BRASS.name)
    assert advice.pair == (None if stop else ranked)  # alone neither is worth anything: information ranks them
    assert (advice.pair_worth, advice.stop, advice.is_below_price) == (worth, stop, bool(stop))


@pytest.mark.parametrize(("share", "stop"), [(0.9, ""), (1.0, "not worth its price")])
def test_hold_must_be_worth_more_than_its_price(advisor: Advisor, share: float, stop: str) -> None:
    worth = advisor.advise(depend(0)).ranked[0].worth
    assert worth == pytest.approx(0.5, abs=0.05)
    assert advisor.advise(depend(0), price=share * worth).stop == stop


def test_pair_may_be_without_the_object_that_is_worth_most_alone(advisor: Advisor) -> None:
    advice = advisor.advise(agree(1, 2, third=0, little=0.1), price=0.15, looks_ahead=True)
    assert advice.ranked[0].name == OAK.name
    assert advice.pair == advice.plan == (STEEL.name, BRASS.name)
    assert advice.next_name == STEEL.name


def test_pairs_are_looked_at_only_while_a_choice_is_open(advisor: Advisor, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Outlook, "find_best_pair", None)
    assert advisor.advise(fix(1.0, 2.0)).stop == "certain"
    assert advisor.advise(depend(0)).stop == ""


@pytest.mark.parametrize("uses", [1.0, 10.0])
@pytest.mark.parametrize(("gain", "stop"), [(1e-4, "not worth its price"), (4e-4, "")])
def test_worth_below_a_ten_thousandth_of_the_cost_is_none(
    advisor: Advisor, gain: float, stop: str, uses: float
) -> None:
    """The worth is half the gain, of a cost of 1; both count once for each use."""
    assert advisor.advise(depend(0, gain), uses=uses).stop == stop


@pytest.mark.parametrize(
    ("costs", "stop"),
    [
        ([fix(1.0, 2.0)], "certain"),
        ([fix(1.0, 2.0), fix(2.0, 1.0)], "certain"),
        ([fix(1.0, 2.0), depend(0)], ""),
        ([fix(np.inf, np.inf)], "impossible"),
        ([fix(np.inf, np.inf), fix(np.inf, np.inf)], "impossible"),
        ([fix(np.inf, np.inf), fix(1.0, 2.0)], "certain"),
        ([fix(np.inf, np.inf), depend(0)], ""),
    ],
)
def test_all_decisions_must_be_made_to_stop(
    advisor: Advisor, costs: list[Callable[[Array], Array]], stop: str
) -> None:
    advice = advisor.advise(*costs, looks_ahead=True)
    assert advice.stop == stop
    assert advice.plan == (() if stop else (OAK.name,))


def test_objects_are_ranked_by_worth_and_then_by_information(advisor: Advisor) -> None:
    tools = (BRASS, OAK, STEEL)
    useless = advisor.advise(fix(1.0, 2.0), tools=tools).ranked
    assert [each.name for each in useless] == [OAK.name, STEEL.name, BRASS.name]
    assert useless[0].information > useless[1].information > useless[2].information > 0.0
    assert {each.worth for each in useless} == {0.0}
    assert advisor.advise(depend(0), tools=tools).ranked[0].name == BRASS.name


@pytest.mark.parametrize(("p_held", "worth"), [(0.04, 0.0), (0.06, 0.5)])
def test_object_that_the_arm_hardly_can_hold_is_worth_nothing(
    advisor: Advisor, monkeypatch: pytest.MonkeyPatch, p_held: float, worth: float
) -> None:
    monkeypatch.setattr(PossibleHold, "compute_probability", lambda *_: p_held)
    (found,) = advisor.advise(depend(0), tools=[OAK]).ranked
    assert (found.worth, found.p_held) == (pytest.approx(worth, abs=0.05), p_held)
    assert bool(found.information) is bool(worth)


@pytest.mark.parametrize(
    ("costs", "found"),
    [
        (fix(3.0, 1.0, 2.0), ("b", 1.0, 0.0, 1.0, 1.0, 1.0)),
        (depend(0), ("a", 0.5, 0.5, 1.5, 0.0, 1.0)),
        (lambda high: np.where(high[:1], 1.0, np.inf), ("a", 0.5, 0.0, 1.5, None, 0.5)),
        (
            lambda high: np.stack([np.where(high[0], 1.0, np.inf), np.where(high[0], np.inf, 4.0)]),
            ("a", 0.5, 2.0, 4.5, 1.5, 1.0),
        ),
        (fix(np.inf), ("a", 0.0, 0.0, 0.0, None, 0.0)),
    ],
)
def test_decision_is_described_as_it_stands(
    advisor: Advisor, costs: Callable[[Array], Array], found: tuple[object, ...]
) -> None:
    """Best option, its probability, regret, cost and margin, and the probability that any option can be taken.

    An option costs twice the dearest mean where it cannot be taken: 2, or 8 in the fourth case.
    """
    decision = advisor.advise(costs).decisions[0]
    assert (decision.best, decision.margin) == (found[0], found[4])
    assert (decision.p_best, decision.regret, decision.cost, decision.p_possible) == pytest.approx(
        (*found[1:4], found[5])
    )


def test_plan_holds_one_object_after_the_other_until_no_gain_is_left(advisor: Advisor) -> None:
    """Each of three decisions depends on an object of its own, with worths of a half, a quarter and a tenth."""
    costs = depend(2, 1.0), depend(0, 0.5), depend(1, 0.2)
    free = advisor.advise(*costs, looks_ahead=True)
    assert free.plan == (BRASS.name, OAK.name, STEEL.name)
    assert min(free.p_best_planned) > 0.9
    dear = advisor.advise(*costs, looks_ahead=True, price=0.18)
    assert dear.plan == (BRASS.name, OAK.name)
    assert dear.p_best_planned == pytest.approx((1.0, 1.0, 0.5), abs=0.1)


def test_plan_ends_after_four_holds(advisor: Advisor) -> None:
    tools = list(BLANKS.values())
    assert len(tools) == 5
    assert len(advisor.advise(*map(depend, range(5)), tools=tools, looks_ahead=True).plan) == 4


def test_uses_of_a_task_multiply_the_worth_of_a_hold(choice: Choice) -> None:
    once, often = (
        advise_hold([OAK], [Question("reach", choice, uses)], MaterialMemory(), DEFAULT_SETTINGS, num_samples=500)
        for uses in (1.0, 7.0)
    )
    assert once.ranked[0].worth > 0.0
    assert often.ranked[0].worth == pytest.approx(7.0 * once.ranked[0].worth)
    assert often.ranked[0].worths == pytest.approx(once.ranked[0].worths)


def test_tool_is_held_by_its_first_grip(advisor: Advisor) -> None:
    """As if it was written as held by it; the wood is at one end, the steel at the other."""
    memory = believe(700.0, 7800.0, 300.0)
    found = []
    for grips in (STICK.grips, STICK.grips[::-1]):
        held = replace(STICK.gripped_by(grips[0]), name=STICK.name)
        for tool in (replace(STICK, grips=grips), held):
            found.append(advisor.advise(fix(1.0, 2.0), tools=[tool], memory=memory).ranked[0].information)
    assert found[0::2] == pytest.approx(found[1::2], rel=1e-9)
    assert found[0] != pytest.approx(found[2], rel=1e-3)


def test_object_that_is_an_option_too_is_seen_as_it_is_there(choice: Choice, monkeypatch: pytest.MonkeyPatch) -> None:
    def look(memory: object, objects: dict[str, object], *_: object) -> None:
        assert objects[option.object_name] is option.features
        assert OAK.name in objects
        raise InterruptedError

    option = choice.options[0]
    monkeypatch.setattr(next_hold, "HoldSamples", look)
    tools = [OAK, replace(STEEL, name=option.object_name)]
    with pytest.raises(InterruptedError):
        advise_hold(tools, [Question("reach", choice)], MaterialMemory(), DEFAULT_SETTINGS)


OPEN = OpenDecision("reach", "a", True, 1.0, 0.5, 0.1, 1.0, 0.1, 1.0)


@pytest.mark.parametrize(
    ("changes", "is_possible", "is_certain"),
    [
        ({}, True, False),
        ({"p_best": 0.949}, True, False),
        ({"p_best": 0.95}, True, True),
        ({"p_possible": 0.06}, True, False),
        ({"p_possible": 0.04}, False, True),
    ],
)
def test_choice_is_certain_from_a_probability_of_95_percent(
    changes: dict[str, float], is_possible: bool, is_certain: bool
) -> None:
    decision = OPEN._replace(**changes)
    assert (decision.is_possible, decision.is_certain) == (is_possible, is_certain)


@pytest.mark.parametrize(
    ("check", "pair", "name"),
    [("", None, "most"), ("", ("one", "other"), "one"), ("check", ("one", "other"), "check")],
)
def test_next_is_a_check_or_the_first_of_a_pair_or_what_is_worth_most(
    check: str, pair: tuple[str, str] | None, name: str
) -> None:
    ranked = tuple(RankedHold(each, 1.0, 0.1, (1.0,), 1.0, (0.9,), 1.0) for each in ("most", "one", "other"))
    decisions = OPEN._replace(rests_on=("x", "y")), OPEN._replace(rests_on=("y", "z"))
    advice = HoldAdvice(ranked, decisions, "", False, False, 0.0, pair, 1.0, "J", check=check)
    assert advice.next_name == name
    assert advice.rests_on == ("x", "y", "z")
