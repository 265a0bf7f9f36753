"""Calibration after many holds of one piece: sums are right, a deviation that is counted anew is too certain."""

import numpy as np
import pytest

from studies.active.repeats import measure_repeats


@pytest.fixture(scope="module")
def found() -> dict[str, dict[str, float]]:
    return measure_repeats(num_observers=12)


def test_one_deviation_counts_once(found: dict[str, dict[str, float]]) -> None:
    """Twelve observers: the root mean square of twelve normal numbers is below 1.5 with a probability of 0.997."""
    assert max(found["repeat_z"].values()) < 1.5
    assert found["repeat_z_anew"]["oak"] > 2.0 * found["repeat_z"]["oak"]
    assert found["repeat_z_anew"]["rubber"] > 1.5 * found["repeat_z"]["rubber"]


def test_both_agree_after_one_hold() -> None:
    once = measure_repeats(num_observers=2, num_holds=1)
    np.testing.assert_allclose(list(once["repeat_z"].values()), list(once["repeat_z_anew"].values()), rtol=1e-6)
