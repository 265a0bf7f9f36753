import numpy as np

from affordance.choice.motion_cost import measure_cost


def test_costs_are_torques_of_control_periods_times_mean_velocities_over_them():
    """By hand, with a torque beside the time at which its period ends.

    Joint 1: period 1 has 3 N m at 1 rad/s in the mean, period 2 has -5 N m at 3 rad/s; joint 2: 2 N m at 4 rad/s, and
    7 N m at 2 rad/s. Each lasts 0.5 s.
    """
    v = np.array([[0.0, -4.0], [2.0, -4.0], [4.0, 0.0]])
    tau = np.array([[0.0, 0.0], [3.0, 2.0], [-5.0, 7.0]])
    work, effort = measure_cost(tau, v, 0.5)
    assert work == 0.5 * (3 * 1 + 5 * 3 + 2 * 4 + 7 * 2)
    assert effort == 0.5 * (9 + 25 + 4 + 49)
