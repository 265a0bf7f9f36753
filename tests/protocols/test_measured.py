from pathlib import Path

import numpy as np
import pytest
from helpers.workshop import BLANKS

from affordance.protocols.measured import MeasuredObservers, compute_numbers, compute_volume
from affordance.protocols.number_entries import Measure, NumberEntry
from affordance.protocols.object_entries import ProtocolObjects

TOOLS = tuple(BLANKS.values())[:4]
VOLUMES = np.array([compute_volume(tool) for tool in TOOLS])


def observe(presented, values, groups):
    """Observers with values of one measure, (R, K)."""
    objects = ProtocolObjects(TOOLS, {"all": range(len(TOOLS)), **groups}, Path("tools.yaml"))
    return MeasuredObservers(objects, np.array(presented), lambda measure, quantile: np.array(values))


def test_a_line_of_measure_and_volume_predicts_for_the_first_object_of_a_group():
    assert len(set(VOLUMES)) == len(TOOLS)
    presented = [[0, 1, 2, 3], [3, 1, 0, 2]]
    slopes = np.array([[2e4], [-5e3]])
    values = 3.0 + slopes * VOLUMES[np.array(presented)]
    values[:, 0] = 100.0  # the first presentation, which the last three leave out
    entry = NumberEntry(measure=Measure.LIFT, last=3, predicted_for="two", over="sum")
    (found,) = compute_numbers({"x": entry}, observe(presented, values, {"two": [2, 0]})).values()
    assert found == pytest.approx((3.0 + slopes * VOLUMES[2]).sum())
