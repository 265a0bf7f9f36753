"""Likelihood of pushes: against exact densities without errors, and against whole simulated courses of lifts."""

import dataclasses

import numpy as np
import pytest
from helpers.refusals import refuse
from scipy.stats import norm

from affordance.belief.kinds_learner import Kinds
from affordance.belief.learner_file import load_learner
from affordance.belief.learners import DENSITY, KINDS_DRAWN
from affordance.extensions.people.experiments.lifts import cylinder
from affordance.extensions.people.likelihood import (
    draw_courses,
    filter_pushes,
    list_free,
    set_learner,
    set_participant,
    split_free,
)
from affordance.extensions.people.participant import Participant, Pushes, with_participant
from affordance.extensions.people.pushes import Person
from affordance.extensions.people.rivals import OWN_AND_SHARED, OWN_MEMORY
from affordance.extensions.people.static_lifts import StaticLifter
from affordance.proprioception.torque_noise import WeberNoise
from affordance.settings import Settings

TOOLS = (
    cylinder("small", radius=0.045, height=0.06, mass=0.6),
    cylinder("large", radius=0.045, height=0.12, mass=1.2),
    cylinder("odd", radius=0.045, height=0.09, mass=1.6),
)
OBJECTS = np.array([0, 1, 2, 2, 0])
ALL = np.ones(len(OBJECTS), dtype=bool)


def compute(*arguments, **options):
    """Log likelihoods of pushes, (D, N)."""
    return run_filter(*arguments, **options).log_density


def run_filter(person, learner, settings, free, values, *, particles, seed):
    """Pushes given those before them, with courses drawn for each of D values."""
    own, pushed = split_free(free)
    courses = draw_courses(
        person, TOOLS, learner, settings, free, values[:, own], particles=particles, seeds=[seed] * len(values)
    )
    participant, others = with_participant(settings).participant, [free[i] for i in pushed]
    return filter_pushes(person, courses, np.arange(len(values)), participant, others, values[:, pushed])


def lift(learner, settings, size, rng, pushes=None):
    """Forces of observers who all lift the objects in their order, (N, size)."""
    lifter = StaticLifter(TOOLS, settings)
    seeds = [(0, each) for each in range(size)]
    errors = rng.standard_normal((len(OBJECTS), size, 2, lifter.num_joints)) * lifter.error_sds[:, None]
    objects = np.tile(OBJECTS[:, None], (1, size))
    return lifter.run(objects, lifter.start(seeds), errors, seeds, pushes=pushes).force


def test_without_errors_of_feeling_pushes_are_independent_and_normal():
    quiet = dataclasses.replace(Settings(), noise=WeberNoise(weber_fraction=1e-9, threshold=1e-9), learner=OWN_MEMORY)
    believed = lift(OWN_MEMORY, quiet, 1, np.random.default_rng(0))[:, 0]
    pushes = believed * np.array([1.1, 0.8, 1.2, 1.0, 0.9])
    person = Person("P1", OBJECTS, pushes, ALL)
    free = list_free(OWN_MEMORY, Participant())
    values = np.array([[0.1], [0.3]])
    found = compute(person, OWN_MEMORY, quiet, free, values, particles=3, seed=(0,))
    for row, (error,) in zip(found, values, strict=True):
        np.testing.assert_allclose(row, norm.logpdf(pushes, believed, error * believed), rtol=1e-6)


@pytest.mark.parametrize("learner", [DENSITY, OWN_MEMORY, KINDS_DRAWN], ids=lambda each: each.name)
def test_likelihood_is_that_of_whole_courses_of_lifts(learner):
    """The mean over 3,000 courses of the product of densities is the likelihood, with no filter at all.

    Pushes are predicted by these courses, weighted by the product for the pushes before.
    """
    settings = dataclasses.replace(Settings(), learner=learner)
    rng = np.random.default_rng(1)
    pushes = np.array([4.0, 12.0, 9.0, 14.0, 6.0])
    error = np.full(3000, 0.25)
    one = Pushes(error, np.ones(3000), np.zeros(3000))
    logs, predicted = np.zeros(3000), []
    for push, believed in zip(pushes, lift(learner, settings, 3000, rng), strict=True):
        predicted.append(np.average(believed, weights=np.exp(logs)))
        logs += one.compute_log_density(push, believed, np.full(3000, np.nan))
    likelihoods = np.exp(logs)
    standard_error = likelihoods.std() / np.sqrt(3000) / likelihoods.mean()
    assert standard_error < 0.05
    free = list_free(learner, Participant(), ["push_error"])
    person = Person("P1", OBJECTS, pushes, ALL)
    found = run_filter(person, learner, settings, free, np.array([[0.25]]), particles=2000, seed=(2,))
    np.testing.assert_allclose(found.predicted[0], predicted, rtol=0.01)
    assert found.log_density.sum() == pytest.approx(np.log(likelihoods.mean()), abs=5.0 * standard_error)


def test_a_push_that_is_not_known_counts_nothing_and_a_lift_that_does_not_teach_changes_nothing():
    free, settings = list_free(OWN_MEMORY, Participant()), Settings()
    pushes = np.array([4.0, np.nan, 9.0, 14.0, 6.0])

    def find(teaches):
        person = Person("P1", OBJECTS, pushes, np.array(teaches))
        return compute(person, OWN_MEMORY, settings, free, np.array([[0.2]]), particles=20, seed=(0,))[0]

    found = find([True] * 5)
    assert found[1] == 0.0
    assert (found[[0, 2, 3, 4]] != 0.0).all()
    untaught = find([False] * 5)
    weights = 9.81 * 1000.0 * np.pi * 0.045**2 * np.array([0.06, 0.12, 0.09, 0.09, 0.06])
    expected = norm.logpdf(pushes, weights, 0.2 * weights)
    np.testing.assert_allclose(untaught[[0, 2, 3, 4]], expected[[0, 2, 3, 4]], rtol=1e-3)


def test_a_look_that_comes_after_many_masses_is_the_second_object(monkeypatch):
    """A state has room for two objects, not for twenty: they are numbered by looks."""
    masses = [cylinder("can", radius=0.045, height=0.06, mass=0.5 + 0.01 * k, colour="#808080") for k in range(19)]
    tools, seen = [*masses, cylinder("new", radius=0.045, height=0.06, mass=0.6, colour="#ff0000")], []
    person = Person("P1", np.arange(20), np.full(20, 6.0), np.ones(20, dtype=bool))
    feel = StaticLifter.feel
    monkeypatch.setattr(StaticLifter, "feel", lambda self, *given: seen.append(given[1].things) or feel(self, *given))
    free = list_free(KINDS_DRAWN, PUSHES)
    draw_courses(person, tools, KINDS_DRAWN, Settings(), free, np.array([[0.2]]), particles=3, seeds=[(0,)])
    assert [each.tolist() for each in seen] == [[0] * 3] * 19 + [[1] * 3]


def test_values_share_one_stream():
    """The same value twice has the same likelihood, and so has each alone."""
    free = list_free(KINDS_DRAWN, Participant())
    person = Person("P1", OBJECTS, np.array([4.0, 12.0, 9.0, 14.0, 6.0]), ALL)
    options = {"particles": 10, "seed": (3,)}
    values = np.array([[0.2, 0.2], [0.25, 0.4], [0.2, 0.2]])
    found = compute(person, KINDS_DRAWN, Settings(), free, values, **options)
    np.testing.assert_allclose(found[0], found[2], rtol=1e-12)
    alone = compute(person, KINDS_DRAWN, Settings(), free, values[1:2], **options)
    np.testing.assert_allclose(found[1], alone[0], rtol=1e-9)


PUSHES = Participant(push_error=0.2)


@pytest.mark.parametrize(
    ("learner", "names"),
    [
        (DENSITY, ["push_error"]),
        (KINDS_DRAWN, ["push_error", "kappa"]),
        (OWN_AND_SHARED, ["push_error", "own_rate", "shared_rate"]),
        (load_learner("examples/forgetting.py:Forgetting"), ["push_error", "drift"]),
    ],
)
def test_what_is_fitted_unless_it_is_said(learner, names):
    assert [each.name for each in list_free(learner, Participant())] == names


def test_medians_and_spreads_of_priors():
    z = np.array([0.0, 1.0])
    by_name = {each.name: each.convert(z) for each in list_free(KINDS_DRAWN, PUSHES, ["kappa", "own_drift", "lapse"])}
    np.testing.assert_allclose(by_name["kappa"], KINDS_DRAWN.parameters.kappa * np.exp([0.0, 0.5]))
    np.testing.assert_allclose(by_name["own_drift"], 0.07 * np.exp([0.0, 0.5]))
    odds = by_name["lapse"] / (1.0 - by_name["lapse"])
    np.testing.assert_allclose(odds, 0.05 / 0.95 * np.exp([0.0, 1.0]))
    (rate, _) = list_free(OWN_AND_SHARED, PUSHES, ["own_rate", "shared_rate"])
    assert rate.convert(np.array([0.0]))[0] == pytest.approx(0.3)
    assert (rate.convert(np.array([-60.0, 60.0])) <= 1.0).all()
    (error,) = list_free(DENSITY, PUSHES, ["push_error"])
    assert error.convert(np.array([9.0]))[0] == 1.0


def test_values_are_set_by_observer_and_all_else_is_kept():
    learner, participant = Kinds("drawn", spread=3.0), Participant(push_error=0.2, gain=1.1)
    free = list_free(learner, participant, ["kappa", "lapse"])
    own = set_learner(learner, free[:1], np.array([[0.2], [0.3]]))
    pushed = set_participant(participant, free[1:], np.array([[0.1], [0.05]]))
    assert own.parameters.kappa == (0.2, 0.3)
    assert own.parameters.spread == 3.0
    assert (pushed.push_error, pushed.gain, pushed.lapse) == (0.2, 1.1, (0.1, 0.05))


def test_too_many_parameters_are_refused():
    names = ["push_error", "gain", "lapse", "kappa", "concentration", "switching", "own_drift", "spread"]
    assert len(list_free(KINDS_DRAWN, PUSHES, names)) == 8
    assert "has gain twice" in refuse(list_free, KINDS_DRAWN, PUSHES, ["gain", "gain"])
