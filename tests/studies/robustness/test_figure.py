"""Map of claims by assumptions: only what is above chance is drawn."""

import numpy as np
import pytest

from affordance.reporting.statistics import Estimate
from studies.robustness.figure import draw_multiverse

SHARES = Estimate(np.array([0.2, 0.8]), np.array([0.1, 0.7]), np.array([0.3, 0.9]))


@pytest.mark.parametrize(("null_level", "shown"), [(0.1, ["b"]), (0.9, ["a", "b", "c"])])
def test_assumptions_that_move_no_claim_above_chance_are_left_out_unless_none_does(null_level, shown):
    figure = draw_multiverse(
        ["weight: x", "com: y"],
        ["a", "b", "c"],
        shares=SHARES,
        indices=np.array([[0.0, 0.5, 0.05], [0.1, 0.0, 0.0]]),
        null_levels=np.full(2, null_level),
    )
    left, right, _ = figure.axes
    assert [text.get_text() for text in left.get_yticklabels()] == ["weight: x", "com: y"]
    assert [text.get_text() for text in right.get_xticklabels()] == shown
    (image,) = right.get_images()
    assert image.get_array().shape == (2, len(shown))
