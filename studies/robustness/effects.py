"""Fraction of settings in which claims hold, and first-order sensitivity indices of assumptions.

The outcome y of a claim is 1 if it holds and 0 otherwise. The first-order index of an assumption x is the fraction of
variance explained by x alone, Var(E[y | x]) / Var(y). It is estimated from sampled settings in bins of x (Saltelli et
al. 2008, Global Sensitivity Analysis, chapter 4), and corrected for chance (epsilon squared, Kelley 1935). The null
level is the 95 % quantile of the largest index over random permutations of the outcomes.
"""

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.reporting.statistics import CONFIDENCE, estimate_proportion
from studies.random_streams import StudyStream
from studies.robustness.assumptions import Assumption

NUM_BINS = 5
_NUM_PERMUTATIONS = 1_000
# Smallest number of settings in which a claim must hold, and in which it must fail, for computing indices.
_LEAST_OUTCOMES = 5


class Effects(NamedTuple):
    """Robustness of one claim over the settings."""

    evaluated: int  # number of settings in which the claim could be tested
    holds: float  # fraction of these settings in which the claim holds
    ci95: tuple[float, float]  # Wilson's interval of this fraction
    indices: Array  # first-order index of each assumption, (D,); zeros if there are too few outcomes of either kind
    null_level: float  # level that the largest index exceeds by chance in 5 % of permutations

    @property
    def strongest(self) -> int:
        """Index of the assumption with the largest first-order index."""
        return int(self.indices.argmax())

    @property
    def is_above_chance(self) -> bool:
        """True if the largest index exceeds the null level."""
        return bool(self.indices.max() > self.null_level)


def measure_effects(outcomes: Array, levels: NDArray[np.intp], seed: int) -> Effects:
    """Computes the fraction of settings in which a claim holds, and first-order indices.

    Args:
        outcomes: 1 if the claim holds, 0 if it does not, NaN if it was not tested, (N,).
        levels: Levels of the assumptions from ``find_levels``, (N, D).
        seed: Seed of the permutations.
    """
    judged = np.isfinite(outcomes)
    y, levels = outcomes[judged], levels[judged]
    if not (count := len(y)):
        return Effects(0, float("nan"), (0.0, 1.0), np.zeros(levels.shape[1]), 1.0)
    estimate = estimate_proportion(np.array(y.sum()), count)
    ci95 = (float(estimate.low), float(estimate.high))
    if min(y.sum(), count - y.sum()) < _LEAST_OUTCOMES:
        return Effects(count, float(y.mean()), ci95, np.zeros(levels.shape[1]), 1.0)
    rng = np.random.default_rng([seed, StudyStream.ROBUSTNESS])
    permuted = np.array([rng.permutation(y) for _ in range(_NUM_PERMUTATIONS)])
    null_level = float(np.quantile(compute_indices(permuted, levels).max(axis=1), CONFIDENCE))
    return Effects(count, float(y.mean()), ci95, compute_indices(y[None], levels)[0], null_level)


def compute_indices(y: Array, levels: NDArray[np.intp]) -> Array:
    """Computes first-order indices, (P, D), for P outcomes in N settings, (P, N), and levels, (N, D).

    An index is zero if the assumption explains less variance than expected by chance for its number of levels.
    """
    count = y.shape[1]
    centred = y - y.mean(axis=1, keepdims=True)
    total = np.square(centred).sum(axis=1)
    indices = []
    for column in levels.T:
        members = column[:, None] == np.unique(column)  # (N, levels)
        between = (np.square(centred @ members) / members.sum(axis=0)).sum(axis=1)
        free = (members.shape[1] - 1) / (count - 1)
        indices.append((between / total - free) / (1.0 - free))
    explained: Array = np.maximum(0.0, np.array(indices).T)
    return explained


def find_levels(assumptions: Sequence[Assumption], places: Array) -> NDArray[np.intp]:
    """Converts quantiles of assumptions, (N, D), to levels, (N, D), which are choices or fifths of ranges."""
    columns = []
    for assumption, column in zip(assumptions, places.T, strict=True):
        if assumption.choices:
            columns.append([assumption.choices.index(str(assumption.place(float(u)))) for u in column])
        else:
            columns.append([int(NUM_BINS * u) for u in column])
    return np.array(columns, dtype=np.intp).T


def name_levels(assumption: Assumption) -> list[str]:
    """Lists the names of the levels of an assumption."""
    if assumption.choices:
        return list(assumption.choices)
    ends = [assumption.place(k / NUM_BINS) for k in range(NUM_BINS + 1)]
    return [" to ".join(map(_show_end, pair)) for pair in itertools.pairwise(ends)]


def _show_end(end: float | str) -> str:
    """Formats the end of a range with three significant digits and without exponent."""
    return np.format_float_positional(float(end), precision=3, unique=False, fractional=False, trim="-")


def share_by_level(outcomes: Array, level: NDArray[np.intp], names: Sequence[str]) -> dict[str, float | None]:
    """Computes the fraction of settings in which a claim holds at each level, or None for unused levels."""
    shares: dict[str, float | None] = {}
    for index, name in enumerate(names):
        chosen = outcomes[(level == index) & np.isfinite(outcomes)]
        shares[name] = float(chosen.mean()) if len(chosen) else None
    return shares
