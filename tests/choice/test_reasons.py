"""Reasons of a choice, where they are known beforehand: costs that are linear in two densities."""

import numpy as np
import pytest

from affordance.choice.inner_simulation import Draws
from affordance.choice.reasons import find_reasons

GREY, BROWN = (0.5, 0.5, 0.5), (0.6, 0.4, 0.2)
# Cost of option 0: grey / 1000 + brown / 1000; of option 1: 2 + brown / 500; of both per kg/m^3.
GREY_MEAN, BROWN_MEAN = 2000.0, 1000.0


def compute_costs(rho):
    return np.stack([1e-3 * (rho[:, 0] + rho[:, 1]), 2.0 + 2e-3 * rho[:, 1]])


def draw(rng, grey_sd, brown_sd, samples=20_000):
    rho = np.array([GREY_MEAN, BROWN_MEAN]) + rng.standard_normal((samples, 2)) * [grey_sd, brown_sd]
    return Draws((GREY, BROWN), rho[:, None, :], np.array([[True, True]]), np.zeros((2, samples, 10))), rho


def test_shares_are_those_of_the_variances_and_turns_lie_where_costs_are_equal(rng):
    draws, rho = draw(rng, 300.0, 100.0)
    reasons = find_reasons(draws, compute_costs(rho), np.array([0, 0]), (0, 1), compute_costs)
    assert [each.colour for each in reasons.shares] == [GREY, BROWN]
    assert [each.share for each in reasons.shares] == pytest.approx([0.9, 0.1], abs=0.01)  # 300^2 and 100^2
    assert reasons.rest == pytest.approx(0.0, abs=1e-9)
    # grey + brown = 2000 + 2 brown: grey = 3000 at brown 1000, and brown = 0 at grey 2000, lighter than any solid.
    (turn,) = reasons.turns
    assert (turn.colour, turn.above, turn.option) == (GREY, True, 1)
    assert turn.density == pytest.approx(3000.0, rel=1e-3)
    assert turn.probability == pytest.approx((rho[:, 0] > turn.density).mean())


def test_what_is_certain_decides_nothing(rng):
    draws, rho = draw(rng, 0.0, 0.0, samples=50)
    reasons = find_reasons(draws, compute_costs(rho), np.array([0, 0]), (0, 1), compute_costs)
    assert (reasons.shares, reasons.rest) == ((), 0.0)


def test_option_that_becomes_infeasible_gives_way(rng):
    def compute_limited(rho):
        costs = compute_costs(rho)
        costs[0, rho[:, 1] > 1500.0] = np.inf
        return costs

    draws, rho = draw(rng, 300.0, 100.0)
    reasons = find_reasons(draws, compute_costs(rho), np.array([0, 0]), (0, 1), compute_limited)
    (turn,) = [each for each in reasons.turns if each.colour == BROWN]
    assert turn.above
    assert 1500.0 < turn.density < 1700.0  # the next density of the grid


def test_option_that_nothing_replaces_stays(rng):
    def compute_alone(rho):
        return np.where(rho[:, 1] > 1500.0, np.inf, compute_costs(rho) + np.array([[0.0], [100.0]]))

    draws, rho = draw(rng, 300.0, 100.0)
    assert find_reasons(draws, compute_costs(rho), np.array([0, 0]), (0, 1), compute_alone).turns == ()
