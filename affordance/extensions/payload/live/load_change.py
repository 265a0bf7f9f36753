"""Tests if the newest part of a stream has another load than the part before.

The test compares two explanations by their likelihoods, integrated over all loads, instead of a residual with a
threshold. The newest cells have either the load of the earlier cells, as far as it is known, or any load. The test
needs only sums of products in cells of half a second.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.belief.likelihood import Quadratic
from affordance.extensions.payload.evidence.fitted_arm import FittedArm
from affordance.extensions.payload.evidence.gains import Gains
from affordance.extensions.payload.evidence.joint_statistics import (
    FRICTION,
    NUM_COLUMNS,
    SIGNAL,
    ChannelSamples,
    JointStatistics,
)
from affordance.extensions.payload.evidence.model_error import build_phantom_covariance
from affordance.extensions.payload.evidence.payload_likelihood import ChannelPrior, PayloadLikelihood
from affordance.objects.inertia import NUM_PARAMETERS

# SD of the mass of a load of which nothing is known, [kg]: what arms of ten to thirty kilograms lift.
_ANY_LOAD = 1.5
# Log Bayes factor from which a change is believed: 1 in 3000. Each cell is tested with five splits.
_CHANGED = 8.0
_AGES = (2, 3, 4, 6, 8)  # ages of a change that are tested, [cells]
_FEWEST_BEFORE, _FEWEST_AFTER = 4, 2  # cells with motion before and after a change
_DATED = 14  # largest age at which a change is dated, [cells]
# Least error of the earlier load, [kg], and as a share of its mass: errors of the arm's model differ between motions.
_FLOOR, _FLOOR_SHARE = 0.03, 0.05
# Time after a change is noticed until it is dated, [s]: what came first is noticed too early or too late.
WAIT = 2.5


class Cell(NamedTuple):
    """Sums of products over half a second."""

    products: Array  # sum of z z^T of each channel, shape (C, 27, 27)
    sums: Array  # sum of z, shape (C, 27)
    counts: Array  # number of used samples, shape (C,)
    jitter: Array  # sum over used samples of the long-run variance of errors by jitter of stamps, shape (C,)
    start: float  # time of the first row, [s]
    end: float  # time of the last row, [s]

    @classmethod
    def of(cls, samples: ChannelSamples, times: Array, jitter: Array) -> "Cell":
        """Computes the sums of samples at times, (N,), [s]. Long-run variances due to stamp jitter are (N, C)."""
        z = samples.build_columns()
        counts = samples.used.sum(axis=0, dtype=float)
        spread = (samples.used * jitter).sum(axis=0)
        return cls(z.transpose(0, 2, 1) @ z, z.sum(axis=1), counts, spread, float(times[0]), float(times[-1]))

    @property
    def moves(self) -> bool:
        """True if a joint moves fast enough to show a load."""
        return bool(self.counts.any())


class LoadChange:
    """Test for a change of the load, based on the errors of a fitted empty arm."""

    def __init__(self, fitted: FittedArm, gains: Gains) -> None:
        """Stores the gains, which are assumed to have no error. A wrong gain is wrong before and after a change."""
        num = len(gains.mean)
        exact, no_friction = np.zeros((num, 2, 2)), np.zeros((num, 3))
        self._prior = ChannelPrior(gains.mean, exact, no_friction, fitted.friction_left, has_arm=False)
        self._least = np.maximum(fitted.least_variance, np.finfo(float).tiny)
        self._phantom = max(fitted.phantom_mass, _FLOOR)

    def measure(self, cells: Sequence[Cell]) -> float:
        """Computes the largest log Bayes factor of a change in the newest cells.

        The result is negative without a change.
        """
        anything, best = build_phantom_covariance(_ANY_LOAD), -np.inf
        for age in _AGES:
            old, new = cells[:-age], cells[-age:]
            if sum(cell.moves for cell in old) < _FEWEST_BEFORE or sum(cell.moves for cell in new) < _FEWEST_AFTER:
                continue
            variance = self._measure_variance(old, anything)
            before, after = (self._linearise(each, variance + _average_jitter(each)) for each in (old, new))
            covariance = np.linalg.inv(np.linalg.inv(anything) + before.precision)
            mean = covariance @ before.information
            floor = build_phantom_covariance(float(np.hypot(self._phantom, _FLOOR_SHARE * mean[0])))
            as_before = _integrate(after, mean, covariance + floor)
            best = max(best, _integrate(after, np.zeros(NUM_PARAMETERS), anything) - as_before)
        return float(best)

    def is_change(self, cells: Sequence[Cell]) -> bool:
        """Returns True if the newest cells have another load than the earlier ones."""
        return self.measure(cells) > _CHANGED

    def date(self, cells: Sequence[Cell]) -> int:
        """Finds the most probable number of newest cells after the change. Two loads then explain all cells best."""
        ages = range(_FEWEST_AFTER, min(_DATED + 1, len(cells) - 1))
        return max(ages, key=lambda age: self._explain(cells[:-age]) + self._explain(cells[-age:]))

    def _explain(self, cells: Sequence[Cell]) -> float:
        """Computes the log evidence of cells under one unknown load."""
        likelihood = PayloadLikelihood(_join(cells), self._prior, self._least + _average_jitter(cells))
        return float(likelihood.compute_log_evidence(build_phantom_covariance(1.0), np.array([_ANY_LOAD]))[0])

    def _linearise(self, cells: Sequence[Cell], variance: Array) -> Quadratic:
        return PayloadLikelihood(_join(cells), self._prior, variance).linearise(np.zeros(NUM_PARAMETERS))

    def _measure_variance(self, cells: Sequence[Cell], anything: Array) -> Array:
        """Estimates the long-run error variance, (C,).

        The variance is at least the variance of the empty runs, or of the residual of a load.
        """
        if len(cells) < 3:
            return self._least
        before = self._linearise(cells, self._least)
        load = np.linalg.solve(np.linalg.inv(anything) + before.precision, before.information)
        w = np.zeros((len(self._least), NUM_COLUMNS))
        w[:, 1 : NUM_PARAMETERS + 1] = -self._prior.gain[:, :1] * load
        w[:, SIGNAL] = 1.0
        sums, counts = (np.array([getattr(cell, name) for cell in cells]) for name in ("sums", "counts"))
        num = np.maximum(counts.sum(axis=0), 1.0)
        w[:, FRICTION.stop - 1] = -np.einsum("kci,ci->c", sums, w) / num  # the offset
        residual = np.einsum("kci,ci->kc", sums, w)
        squares = (residual**2).sum(axis=0)
        # Neighbouring cells share errors, by the filter at least.
        squares += np.maximum(2.0 * (residual[1:] * residual[:-1]).sum(axis=0), 0.0)
        freedom = np.maximum(1.0 - (1.0 + NUM_PARAMETERS / len(num)) / len(cells), 1.0 / len(cells))
        own = squares / (num * freedom)
        # A few cells show a joint's errors badly; those of bad stamps or rates grow at all joints alike.
        alike = self._least * float(np.mean(own / self._least))
        variance: Array = np.maximum(np.maximum(own, alike), self._least)
        return variance


def _join(cells: Sequence[Cell]) -> JointStatistics:
    """Adds the sums of cells. Blocks are left empty, because no variance is estimated from them here."""
    products, sums, counts = (sum(each) for each in zip(*(cell[:3] for cell in cells), strict=True))
    return JointStatistics(products, 0.0 * products, 0.0 * products, sums, counts, 1, 0)  # type: ignore[arg-type]


def _average_jitter(cells: Sequence[Cell]) -> Array:
    """Averages the long-run variance of jitter errors over cells, (C,)."""
    sums, counts = (sum(getattr(cell, name) for cell in cells) for name in ("jitter", "counts"))
    mean: Array = sums / np.maximum(counts, 1.0)
    return mean


def _integrate(likelihood: Quadratic, mean: Array, covariance: Array) -> float:
    """Computes the log of the mean of exp(-x^T H x / 2 + b^T x), x ~ N(mean, covariance)."""
    H, b = likelihood.precision, likelihood.information
    rest, M = b - H @ mean, np.eye(len(b)) + H @ covariance
    at_mean = float(likelihood.evaluate(mean[None])[0])
    spread = 0.5 * rest @ covariance @ np.linalg.solve(M, rest) - 0.5 * np.linalg.slogdet(M)[1]
    return at_mean + float(spread)
