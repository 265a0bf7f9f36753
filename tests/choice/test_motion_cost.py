import dataclasses

import numpy as np
from helpers.two_tools import STICK

from affordance.choice.motion_cost import MotionCost, PlannedMotion, measure_cost
from affordance.plant.arm_model import ArmModel


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
