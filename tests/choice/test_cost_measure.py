"""Measures of cost, against integrals of Drake's own inverse dynamics."""

import dataclasses

import numpy as np
import pytest
from helpers.two_tools import REACH, STICK

from affordance.choice import least_work
from affordance.choice.blow_cost import BlowCost
from affordance.choice.hammer import load_hammer
from affordance.choice.motion_cost import Costs, MotionCost
from affordance.choice.ranking import pick_cheapest
from affordance.control.cost_measure import CostMeasure
from affordance.control.optimal_swing import SwingSearch, measure_swing
from affordance.exceptions import AffordanceError
from affordance.files.model_folder import MODELS
from affordance.plant.arm_model import ArmModel
from affordance.plant.load import load_arm
from affordance.settings import DEFAULT_SETTINGS

HELD = STICK.list_gripped()["wood"]


@pytest.fixture(scope="module")
def model():
    return ArmModel(load_arm())


@pytest.fixture(scope="module")
def reach(model):
    return REACH.build_cost(model, HELD.components, DEFAULT_SETTINGS)


@pytest.fixture(scope="module")
def powers(model, reach):
    """Power of every joint in the middle of every control period, (K, 7), and squared torques, (K, 7)."""
    motion, half = reach.motion, 0.5 * reach.motion.control_period
    model.set_payload(HELD.parameters)
    rows = []
    for q, v, vdot in zip(motion.q, motion.v, motion.vdot, strict=True):
        middle = v + half * vdot
        model.set_state(np.concatenate([q + half * v + 0.5 * half**2 * vdot, middle]))
        tau = model.compute_inverse_dynamics(vdot)
        rows.append((tau * middle, tau**2))
    return np.moveaxis(np.array(rows), 1, 0)


@pytest.mark.parametrize(
    ("measure", "integrand"),
    [
        (CostMeasure.WORK, lambda power, squared: np.abs(power)),
        (CostMeasure.POSITIVE_WORK, lambda power, squared: np.maximum(power, 0.0)),
        (
            CostMeasure.MUSCULAR_WORK,
            lambda power, squared: np.maximum(power, 0.0) + 0.25 / 1.2 * np.maximum(-power, 0.0),
        ),
        (CostMeasure.EFFORT, lambda power, squared: squared),
    ],
)
def test_cost_is_the_integral_that_its_measure_names(reach, powers, measure, integrand):
    """The midpoint rule at 50 nodes beside that at every control period, which errs by a hundredth of it."""
    expected = reach.motion.control_period * integrand(*powers).sum()
    costs = reach.measured_by(measure).compute(HELD.parameters[None])
    assert costs.cost[0] == pytest.approx(expected, rel=2e-3)
    others = [reach.measured_by(other).compute(HELD.parameters[None]).cost[0] for other in CostMeasure]
    assert sum(abs(other / expected - 1.0) < 0.01 for other in others) == 1


def test_settings_decide_the_measure_and_the_default_is_the_work_itself(model, reach):
    effort = dataclasses.replace(DEFAULT_SETTINGS, cost_measure=CostMeasure.EFFORT)
    by_effort = REACH.build_cost(model, HELD.components, effort).compute(HELD.parameters[None])
    by_work = reach.compute(HELD.parameters[None])
    np.testing.assert_array_equal(by_work.cost, by_work.work)
    np.testing.assert_array_equal(by_effort.cost, by_effort.effort)
    np.testing.assert_array_equal(by_effort.work, by_work.work)
    assert DEFAULT_SETTINGS.cost_measure is CostMeasure.WORK


def test_the_cheapest_is_the_cheapest_by_the_measure():
    work, effort, feasible = np.array([[1.0], [2.0]]), np.array([[9.0], [3.0]]), np.ones((2, 1), dtype=bool)
    rng = np.random.default_rng(0)
    assert pick_cheapest(Costs(work, effort, feasible, work), rng) == [0]
    assert pick_cheapest(Costs(work, effort, feasible, effort), rng) == [1]


def find_least_acceleration(self):
    """In place of a search of seconds: the swing it would begin with."""
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
    """By Drake's Jacobian where they end; the faster, the shorter."""
    hammer, blows = planned
    found = least_work.plan_least_work(blows, hammer, model, HELD.parameters, DEFAULT_SETTINGS)
    for swing, speed in zip(found.swings, found.speeds, strict=True):
        model.set_state(np.concatenate([swing.q_end, swing.v_end]))
        struck = model.compute_point_jacobian(found.target.p_TS) @ swing.v_end
        assert found.target.direction_W @ struck == pytest.approx(speed, rel=1e-9)
        assert swing.duration * speed == pytest.approx(found.swings[0].duration * found.speeds[0], rel=1e-9)
