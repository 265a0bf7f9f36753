"""Pushes of participants: moments of what is drawn, densities, and values of each observer."""

import numpy as np
import pytest
from helpers.refusals import refuse
from scipy.stats import norm

from affordance.belief.learners import DENSITY, KINDS_DRAWN
from affordance.exceptions import BadArgumentError
from affordance.extensions.people.participant import (
    Participant,
    Pushes,
    compute_heaviness,
    draw_participants,
    list_own_values,
)

MANY = 20_000


def make(error=0.0, gain=1.0, lapse=0.0, size=MANY):
    return Pushes(np.full(size, error), np.full(size, gain), np.full(size, lapse))


def test_push_is_the_weight_that_is_believed_and_nothing_is_drawn():
    believed = np.array([3.0, 5.0])
    assert (make(size=2).draw(believed, np.full(2, np.nan), None) == believed).all()
    assert (make(gain=1.5, size=2).draw(believed, np.full(2, np.nan), None) == 1.5 * believed).all()


def test_error_of_a_push_is_in_proportion_to_it():
    rng = np.random.default_rng(0)
    for weight in (2.0, 20.0):
        pushes = make(0.2, 1.1).draw(np.full(MANY, weight), np.full(MANY, np.nan), rng)
        assert pushes.mean() == pytest.approx(1.1 * weight, rel=0.01)
        assert pushes.std() / pushes.mean() == pytest.approx(0.2, rel=0.03)


def test_a_lapse_repeats_the_lift_before_but_not_at_the_first():
    rng = np.random.default_rng(0)
    pushes = make(lapse=0.3).draw(np.full(MANY, 5.0), np.full(MANY, 9.0), rng)
    assert set(pushes) == {5.0, 9.0}
    assert (pushes == 9.0).mean() == pytest.approx(0.3, abs=0.02)
    assert set(make(lapse=0.3).draw(np.full(MANY, 5.0), np.full(MANY, np.nan), rng)) == {5.0}


@pytest.mark.parametrize(("lapse", "before"), [(0.0, 9.0), (0.3, 9.0), (0.3, np.nan)])
def test_density_is_that_of_what_is_drawn(lapse, before):
    """It is a normal density, or a mixture of two, as SciPy has them."""
    density = np.exp(make(0.2, 1.1, lapse, 1).compute_log_density(6.0, np.array([5.0]), np.array([before])))
    now, then = (norm.pdf(6.0, 1.1 * weight, 0.2 * 1.1 * weight) for weight in (5.0, before))
    assert density == pytest.approx(now if lapse == 0.0 or np.isnan(before) else 0.7 * now + 0.3 * then)


def test_participants_differ_by_their_spreads():
    rng = np.random.default_rng(1)
    observers = range(2000)
    pushes, learner = draw_participants(
        Participant(push_error=0.2, gain_spread=0.1, kappa_spread=0.3), KINDS_DRAWN, observers, rng
    )
    assert np.log(pushes.gain).std() == pytest.approx(0.1, rel=0.1)
    logs = np.log(learner.parameters.kappa)
    assert logs.mean() == pytest.approx(np.log(KINDS_DRAWN.parameters.kappa), abs=0.03)
    assert logs.std() == pytest.approx(0.3, rel=0.1)
    assert draw_participants(Participant(kappa_spread=0.3), DENSITY, observers, rng)[1] == DENSITY


def test_values_by_observer_are_those_of_the_observers_that_are_asked_for():
    participant = Participant(push_error=[0.1, 0.2, 0.3], gain=(1.0, 2.0, 3.0))
    learner = KINDS_DRAWN.change(kappa=[0.2, 0.3, 0.4])
    found = list_own_values(*draw_participants(participant, learner, [2, 0], None))
    assert found["participant.push_error"].tolist() == [0.3, 0.1]
    assert found["participant.gain"].tolist() == [3.0, 1.0]
    assert found["learner.kappa"].tolist() == [0.4, 0.2]
    assert found["learner.own_drift"].tolist() == [0.0, 0.0]


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"push_error": -0.1}, "Participant: push_error: is -0.1, must be from 0 to 1"),
        ({"lapse": [0.1, 2.0]}, "Participant: lapse: is 2.0, must be from 0 to 1"),
        ({"gain": "much"}, "Participant: gain: is 'much', must be a number"),
    ],
)
def test_values_that_there_cannot_be_are_refused_in_one_line(changes, said):
    assert refuse(Participant, error=BadArgumentError, **changes).startswith(said)


def test_too_few_values_are_refused_in_one_line():
    said = refuse(draw_participants, Participant(gain=[1.0]), DENSITY, [1], None, error=BadArgumentError)
    assert said.startswith("participant: gain: has 1 values, must have at least 2, one for each observer")


def test_heaviness_is_the_felt_weight_shifted_away_from_the_expected_one():
    felt = np.full(3, 5.0)
    small, as_seen, large = compute_heaviness(felt, np.array([2.5, 5.0, 10.0]), 0.1)
    assert as_seen == 5.0
    assert np.log([small / 5.0, large / 5.0]) == pytest.approx(0.1 * np.log([2.0, 0.5]))
