"""Tests of evenly spread points."""

import numpy as np
import pytest
from scipy.stats import kstest
from scipy.stats.qmc import Sobol, discrepancy

from affordance.extensions.payload.posterior.even_points import MAX_DIMENSION, draw_even_points, list_directions


def test_direction_numbers_are_those_of_scipy() -> None:
    points = Sobol(MAX_DIMENSION, scramble=False, bits=30).random_base2(9)
    for dimension in range(MAX_DIMENSION):
        values = np.zeros(1, dtype=int)
        for direction in list_directions(dimension)[:9]:
            values = np.concatenate([values, values ^ direction])
        np.testing.assert_array_equal(np.sort(values / 2.0**30), np.sort(points[:, dimension]))
    # Pairs of coordinates, too: SciPy has the same points in another order.
    own = np.array([_list_plain(dimension, 9) for dimension in range(MAX_DIMENSION)]).T
    assert {tuple(row) for row in own} == {tuple(row) for row in points}


def _list_plain(dimension: int, levels: int) -> np.ndarray:
    values = np.zeros(1, dtype=int)
    for direction in list_directions(dimension)[:levels]:
        values = np.concatenate([values, values ^ direction])
    return values / 2.0**30


def test_every_beginning_is_as_even_as_those_of_scipy_and_evener_than_chance() -> None:
    for num_points in (256, 300):
        ours = np.mean([discrepancy(draw_even_points(np.random.default_rng(s), num_points, 5)) for s in range(8)])
        theirs = np.mean([discrepancy(Sobol(5, rng=s).random_base2(9)[:num_points]) for s in range(8)])
        chance = np.mean([discrepancy(np.random.default_rng(s).random((num_points, 5))) for s in range(8)])
        assert ours < 1.5 * theirs
        assert ours < 0.5 * chance


@pytest.mark.parametrize("row", [0, 5])
def test_a_point_is_uniformly_distributed_over_seeds(row: int) -> None:
    drawn = np.array([draw_even_points(np.random.default_rng(seed), 6, 2)[row] for seed in range(600)])
    assert drawn.min() > 0.0
    assert drawn.max() < 1.0
    for column in drawn.T:
        assert kstest(column, "uniform").pvalue > 1e-4
