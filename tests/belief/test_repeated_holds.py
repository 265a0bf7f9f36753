"""The deviation of an object from its material is one, however often the object is held: its evidence counts once."""

import numpy as np
import pytest

from affordance.belief.density_belief import Prior
from affordance.belief.learners import LEARNERS
from affordance.belief.likelihood import Likelihood
from affordance.belief.material_memory import MaterialMemory, start_memory
from affordance.objects.appearance import PartAppearance

PRIOR = Prior(mode=1000.0, sd=4000.0, deviation=0.06)
OAK, STEEL = (0.6, 0.4, 0.2), (0.5, 0.5, 0.6)
# Objects by their colours and lengths, and how often each is held, in turns.
OBJECTS = (((OAK,), 0.1), ((OAK, STEEL), 0.2), ((STEEL, OAK), 0.3), ((OAK,), 0.4))
HOLDS = (0, 1, 0, 2, 1, 1, 3, 0, 2, 0)


def draw_likelihood(number, size):
    rng = np.random.default_rng([number, 5])
    A = rng.standard_normal((size, size + 1)) / 60.0
    return Likelihood(A @ A.T, A @ A.T @ rng.normal(900.0, 200.0, size), -1.0, 0.0, size)


def weigh(density):
    """A measurement of a density with a standard deviation of 1 kg/m^3."""
    return Likelihood(np.eye(1), np.array([density]), -0.5 * (density**2 + np.log(2.0 * np.pi)), 0.0, 1)


def look(number):
    colours, length = OBJECTS[number]
    return [PartAppearance(colour, (length, 0.02), (length * k, 0.0, 0.0)) for k, colour in enumerate(colours)]


def hold(memory, number, likelihood):
    return memory.recall(look(number), PRIOR).memory.learn(lambda _: likelihood, PRIOR.deviation).memory


def hold_all(memory):
    for trial, number in enumerate(HOLDS):
        memory = hold(memory, number, draw_likelihood(trial, len(OBJECTS[number][0])))
    return memory


def estimate(number):
    """Densities of an object by the sum of its own trials, near a common density where these leave them open.

    By least squares: measurements of the square root of the sum, and as many of a common density.
    """
    trials = [draw_likelihood(trial, len(OBJECTS[number][0])) for trial, held in enumerate(HOLDS) if held == number]
    P, q = sum(each.precision for each in trials), sum(each.information_vector for each in trials)
    root = np.linalg.cholesky(P).T
    seen, ones = np.linalg.solve(root.T, q), np.ones((len(q), 1))
    common = np.linalg.lstsq(root @ ones, seen)[0].item()
    rms = np.hypot(common, np.linalg.norm(root @ ones) ** -1.0)
    rows, values = np.vstack([root, np.eye(len(q)) / rms]), [*seen, *np.full(len(q), common / rms)]
    return np.linalg.lstsq(rows, np.array(values))[0]


def condition_jointly(deviation):
    """Mean and covariance of both materials by brute force, from one normal distribution with all own densities."""
    colours = (OAK, STEEL)
    places = [(number, colour) for number, (shown, _) in enumerate(OBJECTS) for colour in shown]
    size = len(colours) + len(places)
    covariance = np.zeros((size, size))
    covariance[:2, :2] = PRIOR.sd**2 * np.eye(2)
    for i, (_, colour) in enumerate(places, 2):
        k = colours.index(colour)
        covariance[i, :2] = covariance[:2, i] = covariance[k, :2]
        for j, (_, other) in enumerate(places, 2):
            covariance[i, j] = covariance[k, colours.index(other)]
        place = OBJECTS[places[i - 2][0]][0].index(places[i - 2][1])
        covariance[i, i] += (deviation * estimate(places[i - 2][0])[place]) ** 2
    precision = np.linalg.inv(covariance)
    shift = precision @ np.full(size, PRIOR.mode)
    for trial, number in enumerate(HOLDS):
        mine = [i for i, (of, _) in enumerate(places, 2) if of == number]
        likelihood = draw_likelihood(trial, len(mine))
        precision[np.ix_(mine, mine)] += likelihood.precision
        shift[mine] += likelihood.information_vector
    covariance = np.linalg.inv(precision)
    return (covariance @ shift)[:2], covariance[:2, :2]


def test_belief_about_materials_is_that_of_all_own_densities_at_once():
    memory = hold_all(MaterialMemory())
    mean, covariance = condition_jointly(PRIOR.deviation)
    assert memory.colours == (OAK, STEEL)
    np.testing.assert_allclose(memory.belief.untruncated_mean, mean, rtol=1e-9)
    np.testing.assert_allclose(memory.belief.covariance, covariance, rtol=1e-8)


def test_order_of_holds_does_not_matter():
    memories = []
    for order in (range(len(HOLDS)), reversed(range(len(HOLDS)))):
        memory = MaterialMemory().add_colours([OAK, STEEL], PRIOR)
        for trial in order:
            memory = hold(memory, HOLDS[trial], draw_likelihood(trial, len(OBJECTS[HOLDS[trial]][0])))
        memories.append(memory.belief)
    np.testing.assert_allclose(memories[0].precision, memories[1].precision, rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize("learner", LEARNERS)
def test_many_holds_of_one_object_tell_no_more_of_its_material_than_its_deviation_allows(learner):
    memory = start_memory(learner)
    for _ in range(10):
        memory = hold(memory, 0, weigh(850.0))
    density = memory.belief
    variance = 1.0 / (PRIOR.sd**-2 + 1.0 / ((PRIOR.deviation * 850.0) ** 2 + 0.1))
    assert density.covariance[0, 0] == pytest.approx(variance, rel=1e-9)


def test_object_of_another_kind_begins_anew():
    """Evidence for an object as one of a kind does not count when the object is taken for another kind."""
    memory = start_memory("kinds_map")
    for number in (0, 3, 0, 3):
        memory = hold(memory, number, weigh(8000.0))
    odd = weigh(600.0)
    memory = hold(memory, 3, odd)
    assert memory.state["is_kind"].sum() == 2  # the object has left its kind
    assert memory.recall(look(3), PRIOR).felt.own.precision == pytest.approx(odd.precision)
    again = hold(memory, 3, odd).recall(look(3), PRIOR)
    assert again.felt.own.precision == pytest.approx(2.0 * odd.precision)


def test_what_a_hold_adds_is_the_difference_of_the_marginals():
    one, other = draw_likelihood(1, 2), draw_likelihood(2, 2)
    both, first = one.add(other).marginalise_deviation(0.1), one.marginalise_deviation(0.1)
    added = other.marginalise_deviation(0.1, one)
    np.testing.assert_allclose(added.precision, both.precision - first.precision, rtol=1e-6, atol=1e-14)
    np.testing.assert_allclose(
        added.information_vector, both.information_vector - first.information_vector, rtol=1e-6
    )
    nothing = Likelihood(np.zeros((2, 2)), np.zeros(2), np.nan)
    np.testing.assert_allclose(
        other.marginalise_deviation(0.1, nothing).precision,
        other.marginalise_deviation(0.1).precision,
        rtol=1e-12,
    )
    np.testing.assert_allclose(other.marginalise_deviation(0.0, one).precision, other.precision, rtol=1e-12)
