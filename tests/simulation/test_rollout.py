import numpy as np
import pytest
from helpers.two_tools import REACH, STEEL, STICK, WOOD

from affordance.belief.material_memory import MaterialMemory
from affordance.choice.motion_cost import measure_cost
from affordance.control.systems import ControlCounts
from affordance.settings import DEFAULT_SETTINGS
from affordance.simulation.rollout import Rollout, roll_out
from affordance.simulation.trial import TrialRecord


def make_record(v, tau):
    v, tau = np.array(v), np.array(tau)
    times = np.arange(len(v), dtype=float)
    return TrialRecord(times, v, v, tau, times, times, times, MaterialMemory(), 0.0, ControlCounts(0, 0))


def test_error_is_the_largest_distance_at_any_one_time():
    """Distances 0, 5 and 3 m; the second point lies on the reference, but of another time."""
    path = np.array([[1.0, 2.0, 3.0], [4.0, 6.0, 3.0], [4.0, 6.0, 6.0]])
    reference = np.array([[1.0, 2.0, 3.0], [1.0, 2.0, 3.0], [4.0, 6.0, 3.0]])
    rollout = Rollout(0.0, 0.0, path, reference, make_record([[0.0]], [[0.0]]))
    assert rollout.error == 5.0


def test_work_is_without_recovery():
    """Braking costs as much as driving: the torques' signs do not matter, and the work exceeds what energy gains."""
    densities = {WOOD: 720.0, STEEL: 7850.0}
    rollout = roll_out(STICK.gripped_by(STICK.grips[0]), REACH, densities, DEFAULT_SETTINGS)
    record, control_period = rollout.record, DEFAULT_SETTINGS.control_period
    mean_rates = 0.5 * (record.v[1:] + record.v[:-1])
    powers = record.tau[1:] * mean_rates
    assert rollout.work > 1.5 * abs(control_period * powers.sum())
    assert rollout.work == pytest.approx(control_period * np.abs(powers).sum(), rel=1e-3)
    without_signs = measure_cost(np.abs(record.tau), record.v, control_period)
    assert without_signs == pytest.approx((rollout.work, rollout.effort))
