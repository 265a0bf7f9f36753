import numpy as np
import pytest

from studies.hammering.work_map import pick_forces_around

FORCES = np.linspace(102.0, 800.0, 80)
ALL = np.ones(80, dtype=bool)
BLOCKED = (FORCES > 500.0) & (FORCES < 600.0)


def pick(crossovers, feasible=ALL, demanded=400.0):
    return pick_forces_around(crossovers, forces=FORCES, feasible=feasible, least=100.0, demanded=demanded)


@pytest.mark.parametrize(
    ("crossovers", "feasible", "below", "above"),
    [
        pytest.param([225.0], ALL, 150.0, 300.0, id="half-way to the least and to the demanded one"),
        pytest.param([450.0], ALL, np.sqrt(450.0 * 100.0), 600.0, id="above the demanded one, to the last one"),
        # The force above lies below the first force that a grip cannot give, even if both can give more beyond.
        pytest.param([450.0], ~BLOCKED, None, np.sqrt(450.0 * FORCES[FORCES < 500.0].max()), id="blocked"),
        pytest.param([225.0], ~BLOCKED, None, 300.0, id="demanded one before what is blocked"),
        pytest.param([225.0, 256.0, 700.0], ALL, None, 240.0, id="before the next crossover"),
    ],
)
def test_forces_are_half_way_in_proportion(crossovers, feasible, below, above):
    found = pick(crossovers, feasible)
    assert found[1] == pytest.approx(above)
    assert below is None or found[0] == pytest.approx(below)


def test_forces_lie_on_either_side_whatever_the_crossovers(rng):
    for _ in range(300):
        crossovers = sorted(rng.uniform(FORCES[0], FORCES[-1], rng.integers(1, 4)))
        feasible = rng.random(len(FORCES)) < 0.8
        cell = int(np.searchsorted(FORCES, crossovers[0]))
        feasible[cell - 1 : cell + 1] = True  # both could be used on either side, or it would not have been found
        below, above = pick(crossovers, feasible, demanded=float(rng.uniform(FORCES[0], 500.0)))
        assert 100.0 < below < crossovers[0] < above
        assert all(above < other for other in crossovers[1:])
