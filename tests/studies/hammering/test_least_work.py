"""Blows of least work, with the search of seconds replaced by the swing that it would begin with."""

import dataclasses

import numpy as np
import pytest
from helpers.two_tools import STICK

from affordance.choice.blow_cost import BlowCost
from affordance.choice.hammer import load_hammer
from affordance.choice.motion_cost import MotionCost
from affordance.exceptions import AffordanceError
from affordance.files.model_folder import MODELS
from affordance.plant.arm_model import ArmModel
from affordance.plant.load import load_arm
from affordance.settings import DEFAULT_SETTINGS
from studies.hammering import least_work
from studies.hammering.optimal_swing import SwingSearch, measure_swing

HELD = STICK.list_gripped()["wood"]


@pytest.fixture(scope="module")
def model():
    return ArmModel(load_arm())


def find_least_acceleration(self):
    """Returns the swing with which a search of seconds would begin."""
    return self.measured


@pytest.fixture
def planned(model, monkeypatch):
    """A blow, whose motion of least work is taken to be that of least acceleration."""
    hammer = load_hammer(MODELS / "nail.yaml")
    hammer = dataclasses.replace(hammer, force=150.0)
    blows = hammer.build_cost(model, HELD.components, DEFAULT_SETTINGS)

    def begin(self, model, target, swing, pi):
        self.measured = measure_swing(model, swing, pi)

    monkeypatch.setattr(SwingSearch, "__init__", begin)
    monkeypatch.setattr(SwingSearch, "find_least_work", find_least_acceleration)
    return hammer, blows


def test_motion_of_least_work_costs_what_it_did_where_it_was_found(model, planned):
    hammer, blows = planned
    found = least_work.plan_least_work(blows, hammer, model, HELD.parameters, DEFAULT_SETTINGS)
    assert isinstance(found, BlowCost)
    pi = HELD.parameters[None]
    speed = blows.find_speed(pi)
    assert found.compute_at_speed(pi, speed).work[0] == pytest.approx(blows.compute(pi).work[0], rel=0.03)
    # Run slower it follows the same way with less power, and strikes as much slower.
    assert (np.diff(found.speeds) > 0.0).all()
    for motion, swing in zip(found.motions, found.swings, strict=True):
        assert isinstance(motion, MotionCost)
        np.testing.assert_allclose(motion.motion.q, found.motions[0].motion.q)
        assert motion.motion.control_period * len(motion.motion.q) == pytest.approx(swing.duration)
        travelled = motion.motion.control_period * motion.motion.v.sum(axis=0)
        np.testing.assert_allclose(travelled, swing.q_end - swing.q_start, atol=0.02)


def test_search_that_does_not_converge_is_named(model, planned, monkeypatch):
    hammer, blows = planned

    def fail(self):
        return self.measured._replace(converged=False)

    monkeypatch.setattr(SwingSearch, "find_least_work", fail)
    with pytest.raises(AffordanceError, match="least work does not converge"):
        least_work.plan_least_work(blows, hammer, model, HELD.parameters, DEFAULT_SETTINGS)


def test_swings_of_least_work_strike_with_the_speeds_of_their_table(model, planned):
    """Speeds by Drake's Jacobian at the end are those of the table to 1e-9; durations are inversely proportional."""
    hammer, blows = planned
    found = least_work.plan_least_work(blows, hammer, model, HELD.parameters, DEFAULT_SETTINGS)
    for swing, speed in zip(found.swings, found.speeds, strict=True):
        model.set_state(np.concatenate([swing.q_end, swing.v_end]))
        struck = model.compute_point_jacobian(found.target.p_TS) @ swing.v_end
        assert found.target.direction_W @ struck == pytest.approx(speed, rel=1e-9)
        assert swing.duration * speed == pytest.approx(found.swings[0].duration * found.speeds[0], rel=1e-9)
