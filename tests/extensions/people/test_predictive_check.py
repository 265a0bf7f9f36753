"""Predictive checks: people of the fitted learner pass, and one of a learner that the program does not have fails."""

import numpy as np
import pytest

from affordance.belief.learners import DENSITY
from affordance.experiments.shared.observers import Setup
from affordance.extensions.people.experiments.lifts import cylinder, repeat, run_lifts
from affordance.extensions.people.fit import Question, fit_each
from affordance.extensions.people.likelihood import list_free
from affordance.extensions.people.participant import LiftSettings, Participant
from affordance.extensions.people.predictive_check import check_person, compute_statistics, draw_checks, list_checks
from affordance.extensions.people.pushes import Lifts, Person
from affordance.extensions.people.rivals import OWN_MEMORY

TOOLS = (
    cylinder("small", radius=0.045, height=0.06, mass=0.6),
    cylinder("large", radius=0.045, height=0.12, mass=1.2),
    cylinder("odd", radius=0.045, height=0.09, mass=1.9),
)
OBJECTS = np.tile([0, 1, 2], 10)
NAMES = [tool.name for tool in TOOLS]


def build_person(name, weights):
    """A person who pushes with the weights, by object, and an error of 15 %."""
    error = np.random.default_rng(4).standard_normal(len(OBJECTS))
    pushes = np.array(weights)[OBJECTS] * (1.0 + 0.15 * error)
    return Person(name, OBJECTS, pushes, np.ones(len(OBJECTS), dtype=bool))


def simulate_person():
    """A person with own memory, as the program simulates it."""
    setup = Setup(observers=1, seed=3, settings=LiftSettings(participant=Participant(push_error=0.15)))
    lifts = run_lifts("mine", setup, TOOLS, lambda observer, rng: repeat(NAMES, 10, rng, block="x"), [OWN_MEMORY])
    objects = lifts["object"].map(NAMES.index).to_numpy(np.intp)
    return Person("learns", objects, lifts["force"].to_numpy(), np.ones(len(objects), dtype=bool))


@pytest.fixture(scope="module")
def checked():
    """A question about two people, and their checks: one has own memory, one pushes always alike."""
    people = simulate_person(), build_person("pushes alike", [10.0, 10.0, 10.0])
    free = list_free(OWN_MEMORY, LiftSettings().participant)
    question = Question(Lifts(people, TOOLS), OWN_MEMORY, LiftSettings(), free, draws=16, particles=10)
    found = fit_each(question)
    return question, [check_person(question, place, each.draws.normal) for place, each in enumerate(found)]


def test_who_learns_as_the_learner_passes_and_who_does_not_fails(checked):
    question, (learns, alike) = checked
    assert not [each.name for each in learns if each.fails]
    failed = [each.name for each in alike if each.fails]
    # To be of a learner with own memory, these pushes would need errors that scatter more than they do.
    assert "relative SD" in failed
    lines = list_checks(question, [learns, alike])
    assert lines[1].startswith("check, pushes alike: not described by own_memory: ")
    assert lines[-1] == "own_memory does not describe 1 of 2 people"
    assert len(draw_checks(question, [learns, alike]).axes) == 2


def test_statistics_are_those_computed_by_hand():
    person = build_person("knows", [5.9, 11.8, 18.6])
    found = compute_statistics(person, NAMES, person.pushes[None])
    odd = person.pushes[2::3]
    assert found["first push of odd"][0] == odd[0]
    assert found["last pushes of odd"][0] == pytest.approx(odd[-2:].mean())
    deviations = person.pushes.reshape(10, 3) / person.pushes.reshape(10, 3).mean(axis=0) - 1.0
    assert found["relative SD"][0] == pytest.approx(deviations.std())
    flat = deviations.ravel()
    lagged = (flat[1:] * flat[:-1]).sum() / (flat**2).sum()
    assert found["correlation with the push before"][0] == pytest.approx(lagged)


def test_another_learner_is_found_not_to_describe_a_person():
    """One density for all three objects cannot push each with its own weight."""
    free = list_free(DENSITY, LiftSettings().participant)
    person = build_person("knows", [5.9, 11.8, 18.6])
    question = Question(Lifts((person,), TOOLS), DENSITY, LiftSettings(), free, draws=8, particles=5)
    (found,) = fit_each(question)
    assert any(each.fails for each in check_person(question, 0, found.draws.normal))
