"""Advice on what to hold next: against nested brute force with the learner itself, and plain answers at the edges."""

import numpy as np
import pytest
from helpers.loop_runs import build_bench
from helpers.workshop import BLANKS

from affordance.belief.kind_memory import start_memory
from affordance.belief.likelihood import Likelihood
from affordance.belief.material_memory import MaterialMemory
from affordance.choice.demand import Criterion
from affordance.choice.next_hold import Question, advise_hold
from affordance.choice.weighing import measure
from affordance.exceptions import AffordanceError
from affordance.plant.arm import ARM
from affordance.plant.load import load_arm
from affordance.proprioception.estimator import condition_on_torques
from affordance.proprioception.static_hold import StaticHold
from affordance.settings import DEFAULT_SETTINGS
from affordance.vision.eye import measure_drawing
from affordance.vision.systems import predict_object

OAK, STEEL, RUBBER, BRASS = (
    BLANKS[n] for n in ("bar of oak", "rod of cast steel", "block of rubber", "pin of brass")
)
PRIOR = DEFAULT_SETTINGS.prior


@pytest.fixture(scope="module")
def question():
    return Question("reach", build_bench().choices["reach"])


def advise(question, candidates, memory=None, **more):
    return advise_hold(
        candidates, [question], memory or MaterialMemory(), DEFAULT_SETTINGS, criterion=Criterion.WORK, **more
    )


def price_by_brute_force(choice, candidate, num_outcomes, rng):
    """Draws outcomes, lets the learner learn, and averages the least expected cost; returns worth and its error."""
    static, noise = StaticHold(load_arm(ARM)), DEFAULT_SETTINGS.noise
    parts = measure_drawing(candidate)
    memory = choice.add_colours(MaterialMemory().add_colours([part.colour for part in parts], PRIOR))

    def find_costs(belief, count):
        costs, _ = measure(choice, choice.draw_parameters(belief, rng, count), Criterion.WORK)
        assert costs.feasible.all()
        return costs.cost.mean(axis=1)

    before = find_costs(memory, 20_000)
    fell = []
    for number in range(num_outcomes):
        belief = predict_object(parts, memory, PRIOR)
        own = belief.densities.draw_samples(rng, 1)[0]
        felt = static.measure(belief, own, noise, (5, number))
        posterior, _ = condition_on_torques(belief, felt, len(static.tau_arm), noise, PRIOR.deviation_sd)
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


def test_who_knows_everything_stops_and_who_sees_a_tie_says_so(question):
    densities = {part.material.colour: part.material.density for part in (OAK.components[0], STEEL.components[0])}
    known = advise(question, [OAK, STEEL], MaterialMemory.from_densities(densities))
    assert known.decisions[0].p_best > 0.95
    assert known.stop == "certain"
    dear = advise(question, [OAK, BRASS], price=1e6)
    assert dear.stop == "not worth its price"
    assert dear.pair is None


def test_an_object_that_is_known_by_itself_tells_little_more(question):
    """What ten holds of a bar have told of it is no news, though its material's mean is as uncertain as before."""
    fresh, held = (
        advise(question, [OAK], known=known).ranked[0]
        for known in ({}, {OAK.name: Likelihood(np.array([[1.0]]), np.array([563.0]), 0.0)})
    )
    assert held.worth < 0.2 * fresh.worth


def test_a_thing_of_another_kind_tells_nothing_about_its_colour(question):
    memory = start_memory("kinds_map")
    for tool, density in ((OAK, 560.0), (STEEL, 7800.0)):
        for length in (1.0, 1.3):
            parts = [p.appearance._replace(sizes=(0.1 * length, 0.06, 0.04)) for p in measure_drawing(tool)]
            recollection = memory.recall(parts, PRIOR)
            likelihood = Likelihood(np.eye(1) / 20.0**2, np.array([density]) / 20.0**2, 0.0, 0.0, 1)
            learn = recollection.memory.learn
            memory = learn(recollection.densities, lambda _, found=likelihood: found, PRIOR.deviation_sd).memory
    decoy = [part.appearance for part in measure_drawing(STEEL)]
    recollection = memory.recall(decoy, PRIOR)
    likelihood = Likelihood(np.eye(1) / 20.0**2, np.array([1500.0]) / 20.0**2, 0.0, 0.0, 1)
    memory = recollection.memory.learn(recollection.densities, lambda _: likelihood, PRIOR.deviation_sd).memory
    assert len(memory.kinds.colours) == 3  # the decoy is of a kind of its own
    advice = advise(question, [STEEL], memory)
    assert advice.ranked[0].worth < 0.01


def test_questions_that_are_none_are_refused(question):
    for candidates, questions, message in (
        ([], [question], "objects to hold are"),
        ([OAK, OAK], [question], "each of another name"),
        ([OAK], [], "nothing is to be decided"),
    ):
        with pytest.raises(AffordanceError, match=message):
            advise_hold(candidates, questions, MaterialMemory(), DEFAULT_SETTINGS)
    with pytest.raises(AffordanceError, match="price"):
        advise(question, [OAK], price=-1.0)


def test_pairs_are_looked_at_before_nothing_is_worth_its_price(question):
    single = advise(question, [OAK, STEEL])
    between = 1.01 * max(each.worth for each in single.ranked)
    advice = advise(question, [OAK, STEEL], price=between)
    assert (advice.stop, advice.pair) in (
        ("", ("bar of oak", "rod of cast steel")),
        ("", ("rod of cast steel", "bar of oak")),
        ("not worth its price", None),
    )
    assert advice.pair_worth > between
