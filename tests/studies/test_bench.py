"""The shortest measurement of ``make bench``."""

import pytest


def test_regressor_is_compared_with_pinocchio() -> None:
    pytest.importorskip("pinocchio")
    from studies import bench

    ((what, other, result),) = bench.measure_regressor()
    assert (what, other) == ("payload regressor, 300 samples", "Pinocchio's, C++, in a loop")
    assert 0.0 < float(result.split()[0]) < 100.0
