"""Measures of cost, against integrals of Drake's own inverse dynamics."""

import dataclasses

import numpy as np
import pytest
from helpers.two_tools import HELD, REACH

from affordance.choice.motion_cost import Costs
from affordance.choice.ranking import pick_cheapest
from affordance.control.cost_measure import CostMeasure
from affordance.settings import DEFAULT_SETTINGS

WOODEN = HELD["wood"]


@pytest.fixture(scope="module")
def reach(own_model):
    return REACH.build_cost(own_model, WOODEN.components, DEFAULT_SETTINGS)


@pytest.fixture(scope="module")
def powers(own_model, reach):
    """Power of every joint in the middle of every control period, (K, 7), and squared torques, (K, 7)."""
    motion, half = reach.motion, 0.5 * reach.motion.control_period
    own_model.set_payload(WOODEN.parameters)
    rows = []
    for q, v, vdot in zip(motion.q, motion.v, motion.vdot, strict=True):
        middle = v + half * vdot
        own_model.set_state(np.concatenate([q + half * v + 0.5 * half**2 * vdot, middle]))
        tau = own_model.compute_inverse_dynamics(vdot)
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
    """Cost at 50 nodes agrees to 0.2 % with the midpoint rule at every control period, and other measures do not."""
    expected = reach.motion.control_period * integrand(*powers).sum()
    costs = reach.measured_by(measure).compute(WOODEN.parameters[None])
    assert costs.cost[0] == pytest.approx(expected, rel=2e-3)
    others = [reach.measured_by(other).compute(WOODEN.parameters[None]).cost[0] for other in CostMeasure]
    assert sum(abs(other / expected - 1.0) < 0.01 for other in others) == 1


def test_settings_decide_the_measure_and_the_default_is_the_work_itself(model, reach):
    effort = dataclasses.replace(DEFAULT_SETTINGS, cost_measure=CostMeasure.EFFORT)
    by_effort = REACH.build_cost(model, WOODEN.components, effort).compute(WOODEN.parameters[None])
    by_work = reach.compute(WOODEN.parameters[None])
    np.testing.assert_array_equal(by_work.cost, by_work.work)
    np.testing.assert_array_equal(by_effort.cost, by_effort.effort)
    np.testing.assert_array_equal(by_effort.work, by_work.work)
    assert DEFAULT_SETTINGS.cost_measure is CostMeasure.WORK


def test_the_cheapest_is_the_cheapest_by_the_measure():
    work, effort, feasible = np.array([[1.0], [2.0]]), np.array([[9.0], [3.0]]), np.ones((2, 1), dtype=bool)
    rng = np.random.default_rng(0)
    assert pick_cheapest(Costs(work, effort, feasible, work), rng) == [0]
    assert pick_cheapest(Costs(work, effort, feasible, effort), rng) == [1]
