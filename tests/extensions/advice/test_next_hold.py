"""Advice on what to hold next: against nested brute force with the learner itself, and plain answers at the edges."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.refusals import refuse
from helpers.workshop import BLANKS, plan_reach
from scipy.stats import norm

from affordance.belief.felt_object import FeltObject
from affordance.belief.likelihood import Likelihood
from affordance.belief.material_memory import MaterialMemory, start_memory
from affordance.choice.demand import Criterion
from affordance.choice.pricing import price_options
from affordance.exceptions import AffordanceError
from affordance.extensions.advice import next_hold
from affordance.extensions.advice.hold_samples import ODD, HoldSamples
from affordance.extensions.advice.hold_worth import Decision
from affordance.extensions.advice.next_hold import Question, advise_hold
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
PRIOR = DEFAULT_SETTINGS.prior


@pytest.fixture(scope="module")
def question():
    return Question("reach", plan_reach())


def advise(question, candidates, memory=None, **more):
    return advise_hold(
        candidates, [question], memory or MaterialMemory(), DEFAULT_SETTINGS, criterion=Criterion.WORK, **more
    )


def feel_density(tool, density, sd=20.0):
    """Returns what holding an object of one material told: its own density with a standard deviation."""
    own = Likelihood(np.eye(1) / sd**2, np.array([density]) / sd**2, 0.0)
    return FeltObject((tool.components[0].looks_like.colour,), own, own.marginalise_deviation(PRIOR.deviation))


def remember(felt):
    """Returns the memory that has learned from objects that were felt, each of one colour."""
    memory = MaterialMemory()
    for each in felt:
        memory = memory.add_colours(each.colours, PRIOR)
        column = memory.colours.index(each.colours[0])
        precision, vector = np.zeros((len(memory.colours),) * 2), np.zeros(len(memory.colours))
        precision[column, column], vector[column] = each.shared.precision[0, 0], each.shared.information_vector[0]
        memory = MaterialMemory.from_belief(
            memory.colours, memory.belief.condition(Likelihood(precision, vector, 0.0))
        )
    return memory


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
    assert known.stop == "certain"
    dear = advise(question, [OAK, BRASS], price=1e6)
    assert dear.stop == "not worth its price"
    assert dear.pair is None


def test_an_object_that_is_known_by_itself_tells_little_more(question):
    """Ten holds of a bar leave little news of that bar, though its material's mean is as uncertain as before."""
    fresh, held = (
        advise(question, [OAK], felt=felt).ranked[0] for felt in ({}, {OAK.name: feel_density(OAK, 563.0, 1.0)})
    )
    assert held.worth < 0.2 * fresh.worth


def test_a_thing_of_another_kind_tells_nothing_about_its_colour(question):
    memory = start_memory("kinds_map")
    for tool, density in ((OAK, 560.0), (STEEL, 7800.0)):
        for length in (1.0, 1.3):
            parts = [p.appearance._replace(sizes=(0.1 * length, 0.06, 0.04)) for p in measure_drawing(tool)]
            recollection = memory.recall(parts, PRIOR)
            likelihood = Likelihood(np.eye(1) / 20.0**2, np.array([density]) / 20.0**2, 0.0, 0.0, 1)
            memory = recollection.memory.learn(lambda _, found=likelihood: found, PRIOR.deviation).memory
    decoy = [part.appearance for part in measure_drawing(STEEL)]
    recollection = memory.recall(decoy, PRIOR)
    likelihood = Likelihood(np.eye(1) / 20.0**2, np.array([1500.0]) / 20.0**2, 0.0, 0.0, 1)
    memory = recollection.memory.learn(lambda _: likelihood, PRIOR.deviation).memory
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


def test_pair_is_advised_where_only_both_densities_tell(question, monkeypatch):
    """Where costs depend on whether two densities are on the same side of their medians, neither alone tells."""

    def decide(question, samples, *_):
        own = np.stack([samples.draw_own(tool.name)[:, column] for column, tool in enumerate((OAK, STEEL))])
        high = own > np.median(own, axis=1)[:, None]
        cost = np.where(high[0] == high[1], 1.0, 2.0)
        return Decision("reach", ("alike", "unlike"), np.stack([cost, 3.0 - cost]), np.ones((2, cost.size), bool))

    monkeypatch.setattr(next_hold, "_decide", decide)
    advice = advise(question, [OAK, STEEL, BRASS], price=0.1, looks_ahead=True)
    assert advice.ranked[0].worth < 0.1
    assert (advice.stop, advice.is_below_price) == ("", False)
    assert set(advice.pair) == {"bar of oak", "rod of cast steel"}
    assert advice.pair_worth > 0.2
    assert advice.plan == advice.pair
    assert advise(question, [OAK, STEEL, BRASS], price=1.0).stop == "not worth its price"


def test_plan_ends_where_nothing_is_gained(question):
    """Brass, of which no part of the hammer is, is in no plan; a price above the second gain ends it after one."""
    free = advise(question, [OAK, STEEL, BRASS], looks_ahead=True)
    assert set(free.plan) == {"bar of oak", "rod of cast steel"}
    assert free.p_best_planned[0] > max(each.p_best_after[0] for each in free.ranked)
    dear = advise(question, [OAK, STEEL, BRASS], looks_ahead=True, price=0.9 * free.ranked[0].worth)
    assert dear.plan == (free.plan[0],)
    assert advise(question, [OAK]).plan == ()


def test_another_object_of_the_same_name_is_not_what_was_felt(question):
    """A rod of steel by the name of a bar of oak that was held has no densities of its own yet."""
    felt = {OAK.name: feel_density(OAK, 563.0, 1.0)}
    objects = {OAK.name: measure_drawing(STEEL)}
    own = [
        HoldSamples(remember(felt.values()), objects, each, DEFAULT_SETTINGS, np.random.default_rng(0))
        .draw(500)
        .draw_own(OAK.name)
        for each in (felt, {})
    ]
    assert own[0][:, 1].std() == pytest.approx(own[1][:, 1].std(), rel=0.15)
    assert own[0][:, 1].std() > 100.0 * felt[OAK.name].own.precision[0, 0] ** -0.5


def test_hold_of_a_tool_tells_of_the_errors_of_its_look(question):
    """The errors under which options are priced are those under which the same tool is felt."""
    features = question.choice.options[0].features
    objects = {"tool": features}
    samples = HoldSamples(MaterialMemory(), objects, {}, DEFAULT_SETTINGS, np.random.default_rng(0)).draw(50)
    first = samples.draw_errors("tool")
    assert first.shape == (50, len(samples.build_geometry("tool").Phi_errors))
    np.testing.assert_array_equal(first, samples.draw_errors("tool"))
    assert not np.array_equal(first, samples.draw(50).draw_errors("tool"))


def test_certainty_that_rests_on_one_object_is_said_and_a_check_proposed(question):
    felt = {"bar of oak": feel_density(OAK, 563.0), "rod of cast steel": feel_density(STEEL, 7200.0)}
    second = replace(OAK, name="second bar")
    advice = advise(question, [second, BRASS], remember(felt.values()), felt=felt)
    assert advice.rests_on == ("bar of oak",)  # steel never felt would be denser than oak, most probably
    assert (advice.stop, advice.check) == ("", "second bar")
    dear = advise(question, [second], remember(felt.values()), felt=felt, price=1e3)
    assert (dear.stop, dear.rests_on, dear.check) == ("certain", ("bar of oak",), "")
    checked = {**felt, "second bar": feel_density(OAK, 580.0)}
    advice = advise(question, [BRASS], remember(checked.values()), felt=checked)
    assert (advice.stop, advice.rests_on, advice.check) == ("certain", (), "")


def test_two_objects_that_differ_are_no_certainty_until_a_third_decides(question):
    """Two objects at odds leave a third hold worth while, though the learner itself is sure of the mean of both."""
    at_odds = {"bar of oak": feel_density(OAK, 7200.0), "second bar": feel_density(OAK, 580.0)}
    at_odds["rod of cast steel"] = feel_density(STEEL, 7200.0)
    memory = remember(at_odds.values())
    believed = advise(question, [BRASS], memory).decisions[0]
    doubted = advise(question, [replace(OAK, name="third bar"), BRASS], memory, felt=at_odds)
    assert doubted.stop == ""
    assert doubted.ranked[0].name == "third bar"
    assert doubted.decisions[0].p_best < believed.p_best
    settled = {**at_odds, "third bar": feel_density(OAK, 570.0)}
    advice = advise(question, [BRASS], remember(settled.values()), felt=settled)
    assert (advice.stop, advice.rests_on) == ("certain", ())


def test_evidence_for_an_odd_object_is_that_of_bayes_rule():
    """The odds that an object is odd are the ratio of normal densities of two exactly known objects of a material."""
    felt = {"bar of oak": feel_density(OAK, 600.0, 1e-3), "second bar": feel_density(OAK, 1400.0, 1e-3)}
    parts = {name: measure_drawing(OAK) for name in felt}
    samples = HoldSamples(remember(felt.values()), parts, felt, DEFAULT_SETTINGS, np.random.default_rng(0))
    for suspicion, odd, other in zip(samples.suspicions, (600.0, 1400.0), (1400.0, 600.0), strict=True):
        sd, deviation = PRIOR.sd, PRIOR.deviation * other
        gain = sd**2 / (sd**2 + deviation**2)
        mean, variance = PRIOR.mode + gain * (other - PRIOR.mode), (1.0 - gain) * sd**2
        scatter = PRIOR.deviation * odd
        strange = norm.pdf(odd, PRIOR.mode, np.hypot(sd, scatter))
        expected = norm.pdf(odd, mean, np.hypot(np.sqrt(variance), scatter))
        assert suspicion.weight == pytest.approx(ODD / (1.0 - ODD) * strange / expected, rel=1e-3)
        assert suspicion.belief.untruncated_mean == pytest.approx([mean])
