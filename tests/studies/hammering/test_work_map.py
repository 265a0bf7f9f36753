import numpy as np
import pytest

from studies.hammering.work_map import pick_forces_around

FORCES = np.linspace(102.0, 800.0, 80)
ALL = np.ones(80, dtype=bool)


def pick(crossovers, feasible=ALL, demanded=400.0):
    return pick_forces_around(crossovers, forces=FORCES, feasible=feasible, least=100.0, demanded=demanded)


def test_forces_are_half_way_in_proportion_to_the_least_and_to_the_demanded_one():
    assert pick([225.0]) == pytest.approx((150.0, 300.0))


def test_above_the_demanded_force_it_is_half_way_to_the_last_one():
    assert pick([450.0]) == pytest.approx((np.sqrt(450.0 * 100.0), 600.0))


def test_force_above_is_one_both_grips_can_give():
    """The force above lies below the first force that a grip cannot give, even if both grips can give more beyond."""
    blocked = (FORCES > 500.0) & (FORCES < 600.0)
    last = FORCES[FORCES < 500.0].max()
    assert pick([450.0], ~blocked)[1] == pytest.approx(np.sqrt(450.0 * last))
    assert pick([225.0], ~blocked)[1] == pytest.approx(300.0)


def test_force_above_lies_before_the_next_crossover():
    assert pick([225.0, 256.0, 700.0])[1] == pytest.approx(240.0)


def test_forces_lie_on_either_side_whatever_the_crossovers(rng):
    for _ in range(300):
        crossovers = sorted(rng.uniform(FORCES[0], FORCES[-1], rng.integers(1, 4)))
        feasible = rng.random(len(FORCES)) < 0.8
        cell = int(np.searchsorted(FORCES, crossovers[0]))
        feasible[cell - 1 : cell + 1] = True  # both could be used on either side, or it would not have been found
        below, above = pick(crossovers, feasible, demanded=float(rng.uniform(FORCES[0], 500.0)))
        assert 100.0 < below < crossovers[0] < above
        assert all(above < other for other in crossovers[1:])
