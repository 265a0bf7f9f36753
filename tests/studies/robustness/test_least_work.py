"""Blows of least work, with the search of seconds replaced by the swing that it would begin with."""

import dataclasses

import numpy as np
import pytest
from helpers.two_tools import STICK

from affordance.choice.blow_cost import BlowCost
from affordance.choice.motion_cost import MotionCost
from affordance.exceptions import AffordanceError
from affordance.settings import DEFAULT_SETTINGS
from studies.robustness import least_work
from studies.robustness.inverse_dynamics import InverseDynamics
from studies.robustness.optimal_swing import SwingSearch, measure_motion

HELD = STICK.list_gripped()["wood"]


@pytest.fixture
def task(own_model, hammer, monkeypatch):
    """A blow, whose motion of least work is taken to be that of least acceleration."""
    hammer = dataclasses.replace(hammer, force=150.0)
    blows = hammer.build_cost(own_model, HELD.components, DEFAULT_SETTINGS)

    def begin(self, model, target, swing, pi):
        times = np.linspace(0.0, swing.duration, 801)
        dynamics = InverseDynamics(model, pi)
        self.measured = measure_motion(dynamics, times, *swing.evaluate(times), converged=True)

    monkeypatch.setattr(SwingSearch, "__init__", begin)
    monkeypatch.setattr(SwingSearch, "find_least_work", lambda self: self.measured)
    return hammer, blows


def test_motion_of_least_work_costs_what_it_did_where_it_was_found(own_model, task):
    hammer, blows = task
    found = least_work.plan_least_work(blows, hammer, own_model, HELD.parameters, DEFAULT_SETTINGS)
    assert isinstance(found, BlowCost)
    pi = HELD.parameters[None]
    speed = blows.compute_speed(pi)
    assert found.compute_at_speed(pi, speed).work[0] == pytest.approx(blows.compute(pi).work[0], rel=0.03)
    # Run slower it follows the same way with less power, and strikes as much slower.
    assert (np.diff(found.speeds) > 0.0).all()
    for motion, swing in zip(found.motions, found.swings, strict=True):
        assert isinstance(motion, MotionCost)
        np.testing.assert_allclose(motion.motion.q, found.motions[0].motion.q)
        assert motion.motion.control_period * len(motion.motion.q) == pytest.approx(swing.duration)
        travelled = motion.motion.control_period * motion.motion.v.sum(axis=0)
        np.testing.assert_allclose(travelled, swing.q_end - swing.q_start, atol=0.02)


def test_search_that_does_not_converge_is_named(own_model, task, monkeypatch):
    hammer, blows = task

    monkeypatch.setattr(SwingSearch, "find_least_work", lambda self: self.measured._replace(converged=False))
    with pytest.raises(AffordanceError, match="least work does not converge"):
        least_work.plan_least_work(blows, hammer, own_model, HELD.parameters, DEFAULT_SETTINGS)


def test_swings_of_least_work_strike_with_the_speeds_of_their_table(own_model, task):
    """Speeds by Drake's Jacobian at the end are those of the table to 1e-9; durations are inversely proportional."""
    hammer, blows = task
    found = least_work.plan_least_work(blows, hammer, own_model, HELD.parameters, DEFAULT_SETTINGS)
    for swing, speed in zip(found.swings, found.speeds, strict=True):
        own_model.set_state(np.concatenate([swing.q_end, swing.v_end]))
        struck = own_model.compute_point_jacobian(found.target.p_TS) @ swing.v_end
        assert found.target.direction_W @ struck == pytest.approx(speed, rel=1e-9)
        assert swing.duration * speed == pytest.approx(found.swings[0].duration * found.speeds[0], rel=1e-9)
