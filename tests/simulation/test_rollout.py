import numpy as np

from affordance.belief.material_memory import MaterialMemory
from affordance.control.systems import ControlCounts
from affordance.simulation.rollout import Rollout, measure_costs
from affordance.simulation.trial import TrialRecord


def make_record(v, tau):
    v, tau = np.array(v), np.array(tau)
    times = np.arange(len(v), dtype=float)
    return TrialRecord(times, v, v, tau, times, times, times, MaterialMemory(), 0.0, ControlCounts(0, 0))


def test_costs_are_torques_of_ticks_times_mean_rates_over_them():
    """By hand, with a torque beside the time at which its tick ends.

    Joint 1: tick 1 has 3 N m at 1 rad/s in the mean, tick 2 has -5 N m at 3 rad/s; joint 2: 2 N m at 4 rad/s, and
    7 N m at 2 rad/s. Each lasts 0.5 s.
    """
    record = make_record(v=[[0.0, -4.0], [2.0, -4.0], [4.0, 0.0]], tau=[[0.0, 0.0], [3.0, 2.0], [-5.0, 7.0]])
    work, effort = measure_costs(record, 0.5)
    assert work == 0.5 * (3 * 1 + 5 * 3 + 2 * 4 + 7 * 2)
    assert effort == 0.5 * (9 + 25 + 4 + 49)


def test_error_is_the_largest_distance_at_any_one_time():
    """Distances 0, 5 and 3 m; the second point lies on the reference, but of another time."""
    path = np.array([[1.0, 2.0, 3.0], [4.0, 6.0, 3.0], [4.0, 6.0, 6.0]])
    reference = np.array([[1.0, 2.0, 3.0], [1.0, 2.0, 3.0], [4.0, 6.0, 3.0]])
    rollout = Rollout(0.0, 0.0, path, reference, make_record([[0.0]], [[0.0]]))
    assert rollout.error == 5.0
