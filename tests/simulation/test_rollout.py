import numpy as np

from affordance.belief.material_memory import MaterialMemory
from affordance.control.systems import ControlCounts
from affordance.simulation.rollout import Rollout
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
