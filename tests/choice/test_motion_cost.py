"""Costs of planned motions, against sums by hand and integrals of Drake's own inverse dynamics, and their limits."""

import dataclasses

import numpy as np
import pytest
from helpers.two_tools import HELD, REACH, STICK

from affordance.choice.motion_cost import MotionCost, PlannedMotion, describe_limit, measure_cost
from affordance.control.cost_measure import CostMeasure
from affordance.plant.arm_model import ArmModel
from affordance.plant.chain_plant import build_chain
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


def test_costs_are_torques_of_control_periods_times_mean_velocities_over_them():
    """Work and effort equal sums by hand; each torque is logged at the time at which its period ends.

    Joint 1: period 1 has 3 N m at 1 rad/s in the mean, period 2 has -5 N m at 3 rad/s; joint 2: 2 N m at 4 rad/s, and
    7 N m at 2 rad/s. Each lasts 0.5 s.
    """
    v = np.array([[0.0, -4.0], [2.0, -4.0], [4.0, 0.0]])
    tau = np.array([[0.0, 0.0], [3.0, 2.0], [-5.0, 7.0]])
    work, effort = measure_cost(tau, v, 0.5)
    assert work == 0.5 * (3 * 1 + 5 * 3 + 2 * 4 + 7 * 2)
    assert effort == 0.5 * (9 + 25 + 4 + 49)


def test_joint_without_torque_limit_costs_the_same_and_bears_any_load(arm, rng):
    parameters = STICK.gripped_by(STICK.grips[0]).parameters * rng.uniform(0.5, 2.0, (5, 1))
    q = arm.home + 0.1 * rng.standard_normal((40, arm.num_joints))
    motion = PlannedMotion(0.005, q, rng.standard_normal(q.shape), rng.standard_normal(q.shape))
    unlimited = arm.limits.tau_max.copy()
    unlimited[[1, 4]] = np.inf
    cost, other = (
        MotionCost(ArmModel(dataclasses.replace(arm, limits=arm.limits._replace(tau_max=tau_max))), motion)
        for tau_max in (arm.limits.tau_max, unlimited)
    )
    one, two = cost.compute_load(parameters), other.compute_load(parameters)
    np.testing.assert_allclose(two[:3], one[:3], rtol=1e-12)
    loads = cost.compute_joint_loads(parameters)
    np.testing.assert_allclose(one[3], loads.max(axis=0), rtol=1e-12)
    loads[[1, 4]] = 0.0
    np.testing.assert_allclose(other.compute_joint_loads(parameters), loads, rtol=1e-12)
    np.testing.assert_allclose(two[3], loads.max(axis=0), rtol=1e-12)


def test_peaks_are_those_over_every_control_period(model, rng):
    """Peaks miss less than 0.1 % (at 50 nodes 1 %), also those of a jerk that lasts one control period."""
    num_ticks = 400
    phase = np.linspace(0.0, 2.0, num_ticks)[:, None]
    amplitude, pace = rng.uniform(0.05, 0.2, 7), rng.uniform(1.0, 30.0, 7)
    q = model.arm.home + amplitude * np.sin(pace * phase)
    v, vdot = amplitude * pace * np.cos(pace * phase), -amplitude * pace**2 * np.sin(pace * phase)
    jerk = vdot.copy()
    jerk[203] += 300.0
    parameters, chain = WOODEN.parameters * rng.uniform(0.5, 5.0, (20, 1)), build_chain(model.arm)
    for accelerations in (vdot, jerk):
        motion = PlannedMotion(2.0 / num_ticks, q, v, accelerations)
        half = 0.5 * motion.control_period
        states = q + half * v + 0.5 * half**2 * accelerations, v + half * accelerations, accelerations
        cost, loads = MotionCost(model, motion), []
        for each in parameters:
            model.set_payload(each)
            torques = []
            for angles, rates, vdot_now in zip(*states, strict=True):
                model.set_state(np.concatenate([angles, rates]))
                torques.append(model.compute_inverse_dynamics(vdot_now))
            loads.append(np.abs(torques / model.arm.limits.tau_max).max(axis=0))
        demand = cost.compute_demand(parameters)
        np.testing.assert_allclose(demand.loads, np.transpose(loads), rtol=1e-3)
        np.testing.assert_allclose(cost.compute_load(parameters).load, np.max(loads, axis=1), rtol=1e-3)
        wrenches = np.einsum("kwp,sp->skw", chain.compute_wrench_regressors(*states), parameters)
        moments, forces = (np.linalg.norm(wrenches[..., k : k + 3], axis=-1).max(axis=1) for k in (0, 3))
        np.testing.assert_allclose(demand.force, forces, rtol=1e-3)
        np.testing.assert_allclose(demand.moment, moments, rtol=1e-3)


@pytest.fixture
def middle(arm):
    return 0.5 * (arm.limits.q_lower + arm.limits.q_upper)


def describe(arm, q, v):
    still = np.zeros((2, arm.num_joints))
    return describe_limit(arm, PlannedMotion(0.005, np.stack([still[0], q]), np.stack([still[0], v]), still), 1)


@pytest.mark.parametrize("side", ["q_lower", "q_upper"])
def test_angle_at_a_limit_is_named_first(arm, middle, side):
    q, v = middle.copy(), arm.limits.v_max.copy()
    q[3] = getattr(arm.limits, side)[3] + (0.01 if side == "q_lower" else -0.01)
    limit = getattr(arm.limits, side)[3]
    assert describe(arm, q, v) == f"where {arm.joint_names[3]} is at its limit of {limit:.3g} rad"


def test_rate_at_a_limit_is_named_next(arm, middle):
    v = 0.5 * arm.limits.v_max
    v[1] = -arm.limits.v_max[1]
    assert (
        describe(arm, middle, v) == f"where {arm.joint_names[1]} is at its limit of {arm.limits.v_max[1]:.3g} rad/s"
    )


def test_arm_at_no_limit_may_be_too_far_from_the_place(arm, middle):
    expected = "where no joint is at a limit of angle or rate: the place may be out of reach of its 7 joints"
    assert describe(arm, middle, 0.5 * arm.limits.v_max) == expected
