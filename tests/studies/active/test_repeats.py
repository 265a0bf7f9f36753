"""Calibration after many holds of one piece: sums are right, a deviation that is counted anew is too certain."""

from typing import Any

import numpy as np
import pytest

from studies.active.repeats import RepeatsConfig, describe_repeats, run_block


def describe(**changes: int) -> dict[str, Any]:
    found = run_block(RepeatsConfig(**changes), 0)
    return describe_repeats({name: values[None] for name, values in found.items()})


@pytest.fixture(scope="module")
def found() -> dict[str, Any]:
    return describe(num_observers=12)


def test_one_deviation_counts_once(found: dict[str, Any]) -> None:
    """Twelve observers: the root mean square of twelve normal numbers is below 1.5 with a probability of 0.997."""
    assert max(found["repeat_z"].values()) < 1.5
    assert found["repeat_z_anew"]["oak"] > 2.0 * found["repeat_z"]["oak"]
    assert found["repeat_z_anew"]["rubber"] > 1.5 * found["repeat_z"]["rubber"]
    assert found["repeat_z_least"] == min(found["repeat_z"].values())


def test_both_agree_after_one_hold() -> None:
    once = describe(num_observers=2, num_holds=1)
    np.testing.assert_allclose(list(once["repeat_z"].values()), list(once["repeat_z_anew"].values()), rtol=1e-6)


def test_blocks_are_of_other_observers() -> None:
    config = RepeatsConfig(num_observers=1, num_holds=1)
    first, second = (run_block(config, block)["repeat_z"] for block in range(2))
    assert not np.allclose(first, second)
