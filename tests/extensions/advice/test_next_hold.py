"""Advice on what to hold next: against nested brute force, and rules of stopping on decisions known by hand."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest
from helpers.refusals import refuse
from helpers.two_tools import STICK, believe
from helpers.workshop import BLANKS, plan_reach

from affordance.arrays import Array
from affordance.belief.density_belief import DensityBelief
from affordance.belief.holds import Felt
from affordance.belief.likelihood import Likelihood
from affordance.belief.material_memory import MaterialMemory, start_memory
from affordance.choice.demand import Criterion
from affordance.choice.inner_simulation import Choice
from affordance.choice.pricing import price_options
from affordance.exceptions import AffordanceError
from affordance.extensions.advice import next_hold
from affordance.extensions.advice.hold_samples import HoldSamples
from affordance.extensions.advice.hold_worth import Decision, Outlook, PossibleHold
from affordance.extensions.advice.next_hold import HoldAdvice, OpenDecision, Question, RankedHold, advise_hold
from affordance.objects.tool import Tool
from affordance.plant.arm import ARM
from affordance.plant.load import load_arm
from affordance.proprioception.estimator import condition_on_torques
from affordance.proprioception.static_hold import StaticHold
from affordance.settings import DEFAULT_SETTINGS
from affordance.vision.eye import measure_drawing
from affordance.vision.prediction import predict_object

OAK, STEEL, RUBBER, BRASS = (
    BLANKS[n] for n in ("bar of oak", "rod of cast steel", "block of rubber", "pin of brass")
)
TOOLS = (OAK, STEEL, BRASS)
PRIOR = DEFAULT_SETTINGS.prior


@pytest.fixture(scope="module")
def question():
    return Question("reach", plan_reach())


def advise(question, candidates, memory=None, **more):
    return advise_hold(
        candidates, [question], memory or MaterialMemory(), DEFAULT_SETTINGS, criterion=Criterion.WORK, **more
    )


def look(tool):
    return [part.appearance for part in measure_drawing(tool)]


def resize(tool, name, factor):
    """Another object of the same material, of another size."""
    (part,) = tool.components
    return replace(
        tool, name=name, components=(replace(part, shape=part.shape.with_sizes(factor * part.shape.sizes)),)
    )


def hold(memory, tool, density, sd=20.0):
    """The memory after holding an object of one material: its own density was felt with a standard deviation."""
    felt = Felt.from_quadratic(Likelihood(np.eye(1) / sd**2, np.array([density]) / sd**2, 0.0, 0.0, 1))
    return memory.recall(look(tool), PRIOR).memory.learn(felt, PRIOR.deviation).memory


def hold_all(*held):
    """The memory after holding objects, each given with its density and, perhaps, the error of what was felt."""
    memory = MaterialMemory()
    for each in held:
        memory = hold(memory, *each)
    return memory


SECOND, THIRD = resize(OAK, "second bar", 1.2), resize(OAK, "third bar", 0.8)
LOOKS = {tool.name: look(tool) for tool in (OAK, STEEL, SECOND, THIRD)}


def price_by_brute_force(choice, candidate, num_outcomes, rng):
    """Draws outcomes, lets the learner learn, and averages the least expected cost; returns worth and its error."""
    static, noise = StaticHold(load_arm(ARM)), DEFAULT_SETTINGS.noise
    parts = measure_drawing(candidate)
    memory = choice.add_colours(MaterialMemory().add_colours([part.colour for part in parts], PRIOR))

    def find_costs(belief, count):
        costs, _ = price_options(choice, choice.draw_parameters(belief, rng, count), Criterion.WORK)
        assert costs.feasible.all()
        return costs.cost.mean(axis=1)

    before = find_costs(memory, 20_000)
    fell = []
    for number in range(num_outcomes):
        belief = predict_object(parts, memory, PRIOR)
        own = belief.densities.draw_samples(rng, 1)[0]
        felt = static.measure(belief, own, noise, (5, number))
        posterior, _ = condition_on_torques(belief, felt, len(static.tau_arm), noise, PRIOR.deviation)
        after = find_costs(posterior.memory, 500)
        fell.append(before.min() - after.min())
    fell = np.array(fell)
    return fell.mean(), fell.std() / np.sqrt(num_outcomes)


def test_worth_is_that_of_nested_brute_force_with_the_learner(question):
    rng = np.random.default_rng(4)
    found = {each.name: each for each in advise(question, [OAK, STEEL, BRASS]).ranked}
    for candidate in (OAK, STEEL):
        worth, se = price_by_brute_force(question.choice, candidate, 150, rng)
        each = found[candidate.name]
        assert each.worth == pytest.approx(worth, abs=0.15 * worth + 3.0 * np.hypot(se, each.worth_se))
    assert found["pin of brass"].worth < 0.01  # no part of the hammer is brass
    assert found["bar of oak"].information > 1.0


def test_worths_by_other_samples_scatter_less_than_those_of_independent_samples_would(question):
    found = [advise(question, [OAK], num_samples=1000, seed=seed).ranked[0] for seed in range(12)]
    assert np.std([each.worth for each in found], ddof=1) < 0.6 * found[0].worth_se


def test_who_knows_everything_stops_and_who_sees_a_tie_says_so(question):
    densities = {part.material.colour: part.material.density for part in (OAK.components[0], STEEL.components[0])}
    known = advise(question, [OAK, STEEL], MaterialMemory.from_densities(densities))
    assert known.decisions[0].p_best > 0.95
    assert known.stop == "settled"
    dear = advise(question, [OAK, BRASS], price=1e6)
    assert dear.stop == "not worth its price"
    assert dear.pair is None


def test_an_object_that_is_known_by_itself_tells_little_more(question):
    """What is felt of a bar that was felt exactly follows from it alone, and tells less than another bar."""
    memory = hold_all((OAK, 563.0, 1.0))
    samples = HoldSamples(
        memory,
        {"held": measure_drawing(OAK), "other": measure_drawing(SECOND)},
        DEFAULT_SETTINGS,
        np.random.default_rng(0),
    ).draw(2000)
    assert samples.draw_own("held").std() == pytest.approx(1.0, rel=0.1)
    assert samples.draw_own("other").std() > 30.0
    held, other = advise(question, [OAK], memory), advise(question, [SECOND], memory)
    assert held.ranked[0].worth < 0.2 * other.ranked[0].worth


def test_a_thing_of_another_kind_tells_nothing_about_its_colour(question):
    memory = start_memory("kinds_map")
    for tool, density in ((OAK, 560.0), (STEEL, 7800.0)):
        for factor in (1.0, 1.3):
            memory = hold(memory, resize(tool, tool.name, 2.0 * factor), density)
    memory = hold(memory, STEEL, 1500.0)
    assert memory.state["is_kind"].sum() == 3  # the decoy is of a kind of its own
    advice = advise(question, [STEEL], memory)
    assert advice.ranked[0].worth < 0.01


def test_questions_that_are_none_are_refused(question):
    for candidates, questions, message in (
        ([], [question], "objects to hold are"),
        ([OAK, OAK], [question], "with different names"),
        ([OAK], [], "there is no task to decide"),
    ):
        with pytest.raises(AffordanceError, match=message):
            advise_hold(candidates, questions, MaterialMemory(), DEFAULT_SETTINGS)
    assert "price" in refuse(advise, question, [OAK], error=AffordanceError, price=-1.0)


def test_hold_of_a_tool_tells_of_the_errors_of_its_look(question):
    """The errors under which options are priced are those under which the same tool is felt."""
    features = question.choice.options[0].features
    objects = {"tool": features}
    samples = HoldSamples(MaterialMemory(), objects, DEFAULT_SETTINGS, np.random.default_rng(0)).draw(50)
    first = samples.draw_errors("tool")
    assert first.shape == (50, len(samples.build_geometry("tool").Phi_errors))
    np.testing.assert_array_equal(first, samples.draw_errors("tool"))
    assert not np.array_equal(first, samples.draw(50).draw_errors("tool"))


def test_settled_choice_that_rests_on_one_object_is_said_and_a_check_proposed(question):
    memory = hold_all((OAK, 563.0), (STEEL, 7200.0))
    advice = advise(question, [SECOND, BRASS], memory, looks=LOOKS)
    assert advice.rests_on == ("bar of oak",)  # steel never felt would be denser than oak, most probably
    assert (advice.stop, advice.check) == ("", "second bar")
    dear = advise(question, [SECOND], memory, looks=LOOKS, price=1e3)
    assert (dear.stop, dear.rests_on, dear.check) == ("settled", ("bar of oak",), "")
    unnamed = advise(question, [SECOND], memory, price=1e3)
    assert unnamed.rests_on == ("object 1",)
    checked = hold(memory, SECOND, 580.0)
    advice = advise(question, [BRASS], checked, looks=LOOKS)
    assert (advice.stop, advice.rests_on, advice.check) == ("settled", (), "")


def test_two_objects_that_differ_settle_nothing_until_a_third_decides(question):
    """Two objects at odds leave a third hold worth while, though the learner itself is sure of the mean of both."""
    at_odds = hold_all((OAK, 7200.0), (SECOND, 580.0), (STEEL, 7200.0))
    mean, covariance = at_odds.belief.untruncated_mean, at_odds.belief.covariance
    sure = MaterialMemory.from_belief(at_odds.colours, DensityBelief.from_moments(mean, covariance))
    believed = advise(question, [BRASS], sure).decisions[0]
    doubted = advise(question, [THIRD, BRASS], at_odds)
    assert doubted.stop == ""
    assert doubted.ranked[0].name == "third bar"
    assert doubted.decisions[0].p_best < believed.p_best
    advice = advise(question, [BRASS], hold(at_odds, THIRD, 570.0))
    assert (advice.stop, advice.rests_on) == ("settled", ())


class Advisor:
    """Advises on decisions, among two or three options, that are put in place of the planned ones.

    Their costs depend on whether the own densities of objects, which are felt well, are above their medians. To know
    one side that decides between the costs 1 and 2 is worth a half; where two sides must be equal, only both are.
    """

    def __init__(self, choice: Choice, monkeypatch: pytest.MonkeyPatch) -> None:
        self._choice, self._monkeypatch = choice, monkeypatch

    def advise(self, *costs: Callable[[Array], Array], tools: Sequence[Tool] = TOOLS, **more: object) -> HoldAdvice:
        """Advises with costs, (k, S), of each decision, by which objects are above the medians, (number, S)."""

        def decide(question: Question, samples: HoldSamples, *_: object) -> Decision:
            own = np.array([samples.draw_own(tool.name) @ samples.build_geometry(tool.name).Phi[0] for tool in tools])
            cost = costs[int(question.name)](own > np.median(own, axis=1)[:, None])
            names = ("a", "b", "c")[: len(cost)]
            return Decision(question.name, names, cost, np.isfinite(cost), ((),) * len(names), ("",) * len(names))

        self._monkeypatch.setattr(next_hold, "_decide", decide)
        memory = more.pop("memory", MaterialMemory())
        questions = [Question(str(number), self._choice) for number in range(len(costs))]
        return advise_hold(tools, questions, memory, DEFAULT_SETTINGS, num_samples=1000, **more)  # type: ignore[arg-type]


@pytest.fixture
def advisor(question: Question, monkeypatch: pytest.MonkeyPatch) -> Advisor:
    return Advisor(question.choice, monkeypatch)


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
    assert advisor.advise(fix(1.0, 2.0)).stop == "settled"
    assert advisor.advise(depend(0)).stop == ""


@pytest.mark.parametrize(("gain", "stop"), [(1e-4, "not worth its price"), (4e-4, "")])
def test_worth_below_a_ten_thousandth_of_the_cost_is_none(advisor: Advisor, gain: float, stop: str) -> None:
    """The worth is half the gain, of a cost of 1."""
    assert advisor.advise(depend(0, gain)).stop == stop


@pytest.mark.parametrize(
    ("costs", "stop"),
    [
        ([fix(1.0, 2.0)], "settled"),
        ([fix(1.0, 2.0), fix(2.0, 1.0)], "settled"),
        ([fix(1.0, 2.0), depend(0)], ""),
        ([fix(np.inf, np.inf)], "impossible"),
        ([fix(np.inf, np.inf), fix(np.inf, np.inf)], "impossible"),
        ([fix(np.inf, np.inf), fix(1.0, 2.0)], "settled"),
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
    assert advisor.advise(*costs).plan == ()


def test_plan_ends_after_four_holds(advisor: Advisor) -> None:
    tools = list(BLANKS.values())
    assert len(tools) == 5
    assert len(advisor.advise(*map(depend, range(5)), tools=tools, looks_ahead=True).plan) == 4


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


def test_object_that_is_an_option_too_is_seen_as_it_is_there(
    question: Question, monkeypatch: pytest.MonkeyPatch
) -> None:
    def look(memory: object, objects: dict[str, object], *_: object) -> None:
        assert objects[option.object_name] is option.features
        assert OAK.name in objects
        raise InterruptedError

    option = question.choice.options[0]
    monkeypatch.setattr(next_hold, "HoldSamples", look)
    tools = [OAK, replace(STEEL, name=option.object_name)]
    with pytest.raises(InterruptedError):
        advise_hold(tools, [question], MaterialMemory(), DEFAULT_SETTINGS)


OPEN = OpenDecision("reach", "a", True, 1.0, 0.5, 0.1, 1.0, 0.1, 1.0)


@pytest.mark.parametrize(
    ("changes", "is_possible", "is_settled"),
    [
        ({}, True, False),
        ({"p_best": 0.949}, True, False),
        ({"p_best": 0.95}, True, True),
        ({"p_possible": 0.06}, True, False),
        ({"p_possible": 0.04}, False, True),
    ],
)
def test_choice_is_settled_from_a_probability_of_95_percent(
    changes: dict[str, float], is_possible: bool, is_settled: bool
) -> None:
    decision = OPEN._replace(**changes)
    assert (decision.is_possible, decision.is_settled) == (is_possible, is_settled)


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
