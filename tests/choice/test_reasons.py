"""Reasons of a choice, where they are known beforehand: costs that are linear in two densities."""

import numpy as np
import pytest
from scipy.stats import norm

from affordance.choice.inner_simulation import Draws
from affordance.choice.reasons import find_reasons

GREY, BROWN = (0.5, 0.5, 0.5), (0.6, 0.4, 0.2)
GREY_MEAN, BROWN_MEAN = 2000.0, 1000.0
ONE_OBJECT = np.array([0, 0])


def compute_costs(rho):
    """Costs of two options; they are equal where grey = 2000 + brown."""
    return np.stack([1e-3 * (rho[:, 0] + rho[:, 1]), 2.0 + 2e-3 * rho[:, 1]])


def draw(rng, grey_sd, brown_sd, samples=20_000):
    rho = np.array([GREY_MEAN, BROWN_MEAN]) + rng.standard_normal((samples, 2)) * [grey_sd, brown_sd]
    return Draws((GREY, BROWN), rho[:, None, :], np.array([[True, True]]), np.zeros((2, samples, 10))), rho


def find(draws, costs, *, feasible=None, is_peak=False):
    feasible = np.ones(costs.shape, dtype=bool) if feasible is None else feasible
    return find_reasons(draws, costs, feasible, ONE_OBJECT, is_peak=is_peak)


def test_shares_are_those_of_the_variances_and_turns_lie_where_costs_are_equal(rng):
    draws, rho = draw(rng, 600.0, 200.0)
    reasons = find(draws, compute_costs(rho))
    assert [each.colour for each in reasons.shares] == [GREY, BROWN]
    assert [each.share for each in reasons.shares] == pytest.approx([0.9, 0.1], abs=0.01)  # 600^2 and 200^2
    assert reasons.rest == pytest.approx(0.0, abs=1e-9)
    (turn,) = reasons.turns
    assert (turn.colour, turn.above, turn.option) == (GREY, True, 1)
    assert turn.density == pytest.approx(2000.0 + BROWN_MEAN, rel=0.05)  # within a bin of one fortieth
    assert turn.probability == pytest.approx(norm.sf(1000.0 / 600.0), abs=0.03)
    assert turn.probability == pytest.approx((rho[:, 0] >= turn.density).mean(), abs=1e-9)


def test_peaks_turn_where_their_quantiles_differ_by_more_than_two_per_cent(rng):
    draws, rho = draw(rng, 600.0, 5.0)  # brown is nearly certain: its cost 1, twice that of the other option
    (turn,) = find(draws, compute_costs(rho), is_peak=True).turns
    assert (turn.colour, turn.above, turn.option) == (GREY, True, 1)
    assert turn.density == pytest.approx(4000.0 / 0.98 - BROWN_MEAN, rel=0.05)


def test_what_is_certain_decides_nothing(rng):
    draws, rho = draw(rng, 0.0, 0.0, samples=50)
    reasons = find(draws, compute_costs(rho))
    assert (reasons.shares, reasons.rest, reasons.turns) == ((), 0.0, ())


def test_equal_options_are_not_told_apart_by_chance(rng):
    draws, _ = draw(rng, 600.0, 200.0, samples=2000)
    costs = 5.0 + rng.standard_normal((2, 2000))
    costs[1] += 0.05
    turns = find(draws, costs).turns
    assert sum(turn.probability for turn in turns) < 0.3  # of four tails at two standard errors, seldom one


def test_option_that_becomes_infeasible_gives_way(rng):
    draws, rho = draw(rng, 300.0, 200.0)
    feasible = np.stack([rho[:, 1] <= 1300.0, np.ones(len(rho), dtype=bool)])
    (turn,) = [each for each in find(draws, compute_costs(rho), feasible=feasible).turns if each.colour == BROWN]
    assert (turn.above, turn.option) == (True, 1)
    assert turn.density == pytest.approx(1300.0, rel=0.05)


def test_option_that_nothing_replaces_stays(rng):
    draws, rho = draw(rng, 300.0, 200.0)
    feasible = np.tile(rho[:, 1] <= 1300.0, (2, 1))
    assert find(draws, compute_costs(rho) + np.array([[0.0], [100.0]]), feasible=feasible).turns == ()
