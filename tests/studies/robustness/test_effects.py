"""Shares and first-order effects against analytical values for made-up outcomes."""

import numpy as np
import pytest

from studies.robustness.assumptions import Assumption, sample_places
from studies.robustness.effects import (
    compute_indices,
    find_levels,
    measure_effects,
    name_levels,
    share_by_level,
)

RANGES = tuple(Assumption(f"x{k}", f"x{k}", "made up", 0.5, 0.0, 1.0) for k in range(6))
CHOICE = Assumption("kind", "kind", "made up", "a", choices=("a", "b"), weights=(1.0, 1.0))
ASSUMPTIONS = (*RANGES, CHOICE)
PLACES = sample_places(len(ASSUMPTIONS), 512, 3)
LEVELS = find_levels(ASSUMPTIONS, PLACES)


def test_index_is_what_the_assumption_alone_explains():
    """The index of x0 is 1 for [x0 < 2/5], about 0 for an exclusive or of two, and analytical for a mixture."""
    x, kind = PLACES[:, 0], LEVELS[:, 6]
    low = x < 0.4
    assert compute_indices(low[None].astype(float), LEVELS)[0, 0] == pytest.approx(1.0, abs=1e-12)
    either = (low ^ (kind == 0)).astype(float)
    np.testing.assert_allclose(compute_indices(either[None], LEVELS)[0, [0, 6]], [0.05, 0.0], atol=0.06)
    # P(y) = 0.4 and 0.1 given kind: Var(E[y | kind]) / Var(y) = 0.15^2 / (0.25 * 0.75).
    mixed = np.where(kind == 0, x < 0.4, x < 0.1).astype(float)
    assert compute_indices(mixed[None], LEVELS)[0, 6] == pytest.approx(0.0225 / 0.1875, abs=0.02)


def test_what_levels_explain_by_chance_is_taken_off(rng):
    """Shares explained by chance are subtracted, by hand for four settings; most indices of random outcomes are 0."""
    levels = np.array([[0], [0], [1], [1]])
    # The two groups explain 1/4 of the sum of squares 3/4, a third, as one of three degrees of freedom does.
    assert compute_indices(np.array([[1.0, 1.0, 1.0, 0.0]]), levels)[0, 0] == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(compute_indices(np.array([[1.0, 1.0, 0.0, 0.0]]), levels), 1.0)
    # Six outcomes, 1 in three and in one of three: a half is explained, and a fifth of it expected.
    outcomes, levels = np.array([[1.0, 1.0, 1.0, 1.0, 0.0, 0.0]]), np.repeat([[0], [1]], 3, axis=0)
    assert compute_indices(outcomes, levels)[0, 0] == pytest.approx((0.5 - 0.2) / (1.0 - 0.2), abs=1e-12)
    chance = compute_indices((rng.random((200, 512)) < 0.4).astype(float), LEVELS)
    assert chance.mean() < 0.003  # uncorrected: 4 / 511 = 0.008 of five levels
    assert (chance == 0.0).mean() > 0.5


def test_strongest_assumption_is_found_and_noise_is_not(rng):
    outcomes = np.where(rng.random(512) < np.where(PLACES[:, 2] > 0.6, 0.8, 0.3), 1.0, 0.0)
    effects = measure_effects(outcomes, LEVELS, 0)
    assert (effects.strongest, effects.is_above_chance) == (2, True)
    above = [measure_effects((rng.random(512) < 0.4).astype(float), LEVELS, k).is_above_chance for k in range(20)]
    assert np.mean(above) < 0.2  # expected: 0.05


def test_share_counts_only_settings_in_which_the_claim_was_judged():
    outcomes = np.full(512, np.nan)
    outcomes[:100], outcomes[100:130] = 1.0, 0.0
    effects = measure_effects(outcomes, LEVELS, 0)
    assert effects.evaluated == 130
    assert effects.holds == pytest.approx(100 / 130)
    low, high = effects.ci95
    assert low < 100 / 130 < high
    nothing = measure_effects(np.full(512, np.nan), LEVELS, 0)
    assert (nothing.evaluated, nothing.is_above_chance) == (0, False)
    always = measure_effects(np.ones(512), LEVELS, 0)
    assert (always.holds, always.is_above_chance) == (1.0, False)


def test_levels_are_named_and_have_shares_of_their_own():
    outcomes = np.where(LEVELS[:, 6] == 0, 1.0, 0.0)
    assert share_by_level(outcomes, LEVELS[:, 6], name_levels(CHOICE)) == {"a": 1.0, "b": 0.0}
    assert name_levels(RANGES[0])[0] == "0 to 0.2"
    densities = Assumption("density", "density (kg/m³)", "ours", 500.0, 500.0, 8500.0, is_log=True)
    assert name_levels(densities)[1:3] == ["881 to 1550", "1550 to 2740"]
