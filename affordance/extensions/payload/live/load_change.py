"""Tests if the load changed in the newest part of a stream.

The test is a Bayes factor between two hypotheses. Under the first, the newest cells have the load that is estimated
from the earlier cells. Under the second, they have any load. Only sums of products over cells of half a second are
needed.
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

# SD of the mass of an unknown load, [kg]: a typical load of arms that weigh ten to thirty kilograms.
_ANY_LOAD = 1.5
# Log Bayes factor at which a change is reported, 1 in 3000; each cell is tested with five dates of the change.
_CHANGED = 8.0
_AGES = (2, 3, 4, 6, 8)  # ages of a change that are tested, [cells]
_FEWEST_BEFORE, _FEWEST_AFTER = 4, 2  # least number of cells with motion before and after a change
_DATED = 14  # largest age of a change that is estimated, [cells]
# Least SD of the earlier load, [kg], and relative to its mass, because errors of the arm's model vary with motion.
_FLOOR, _FLOOR_SHARE = 0.03, 0.05
# Time from the detection of a change until its date is estimated, [s], because the first estimate is inaccurate.
WAIT = 2.5


class Cell(NamedTuple):
    """Sums of products over half a second of samples."""

    products: Array  # sum of z z^T of each channel, shape (C, 27, 27)
    sums: Array  # sum of z, shape (C, 27)
    counts: Array  # number of used samples, shape (C,)
    jitter: Array  # sum over used samples of the long-run error variance due to stamp jitter, shape (C,)
    start: float  # time of the first row, [s]
    end: float  # time of the last row, [s]

    @classmethod
    def of(cls, samples: ChannelSamples, times: Array, jitter: Array) -> "Cell":
        """Computes the sums of samples.

        Args:
            samples: Samples of all channels.
            times: Times of the samples, shape (N,), [s].
            jitter: Long-run error variances due to time-stamp jitter, shape (N, C).
        """
        z = samples.build_columns()
        counts = samples.used.sum(axis=0, dtype=float)
        spread = (samples.used * jitter).sum(axis=0)
        return cls(z.transpose(0, 2, 1) @ z, z.sum(axis=1), counts, spread, float(times[0]), float(times[-1]))

    @property
    def moves(self) -> bool:
        """True if a joint moves fast enough to reveal a load."""
        return bool(self.counts.any())


class LoadChange:
    """Detector of load changes, which uses the errors of a fitted empty arm."""

    def __init__(self, fitted: FittedArm, gains: Gains) -> None:
        """Stores the gains, the friction and the errors of the arm.

        Gains are assumed to be exact, because their errors are the same before and after a change.
        """
        num = len(gains.mean)
        exact, no_friction = np.zeros((num, 2, 2)), np.zeros((num, 3))
        self._prior = ChannelPrior(gains.mean, exact, no_friction, fitted.friction_left, has_arm=False)
        self._least = np.maximum(fitted.least_variance, np.finfo(float).tiny)
        self._phantom = max(fitted.phantom_mass, _FLOOR)

    def measure(self, cells: Sequence[Cell]) -> float:
        """Computes the largest log Bayes factor of a change in the newest cells. It is negative without a change."""
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
        """Returns True if the load of the newest cells differs from the load of the earlier cells."""
        return self.measure(cells) > _CHANGED

    def date(self, cells: Sequence[Cell]) -> int:
        """Estimates how many of the newest cells come after the change, by maximum evidence."""
        ages = range(_FEWEST_AFTER, min(_DATED + 1, len(cells) - 1))
        return max(ages, key=lambda age: self._explain(cells[:-age]) + self._explain(cells[-age:]))

    def _explain(self, cells: Sequence[Cell]) -> float:
        """Computes the log evidence of cells with one unknown load."""
        likelihood = PayloadLikelihood(_join(cells), self._prior, self._least + _average_jitter(cells))
        return float(likelihood.compute_log_evidence(build_phantom_covariance(1.0), np.array([_ANY_LOAD]))[0])

    def _linearise(self, cells: Sequence[Cell], variance: Array) -> Quadratic:
        return PayloadLikelihood(_join(cells), self._prior, variance).linearise(np.zeros(NUM_PARAMETERS))

    def _measure_variance(self, cells: Sequence[Cell], anything: Array) -> Array:
        """Estimates the long-run error variance of each channel, (C,).

        It is at least the variance in the empty runs, and at least the residual variance after fitting a load.
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
        w[:, FRICTION.stop - 1] = -np.einsum("kci,ci->c", sums, w) / num  # offset
        residual = np.einsum("kci,ci->kc", sums, w)
        squares = (residual**2).sum(axis=0)
        # Errors of neighbouring cells are correlated at least through the filter.
        squares += np.maximum(2.0 * (residual[1:] * residual[:-1]).sum(axis=0), 0.0)
        freedom = np.maximum(1.0 - (1.0 + NUM_PARAMETERS / len(num)) / len(cells), 1.0 / len(cells))
        own = squares / (num * freedom)
        # A few cells give an inaccurate variance per joint. Bad time stamps or rates increase the variance of all
        # joints alike.
        alike = self._least * float(np.mean(own / self._least))
        variance: Array = np.maximum(np.maximum(own, alike), self._least)
        return variance


def _join(cells: Sequence[Cell]) -> JointStatistics:
    """Adds the sums of cells. Blocks are left empty, because they are not needed here."""
    products, sums, counts = (sum(each) for each in zip(*(cell[:3] for cell in cells), strict=True))
    return JointStatistics(products, 0.0 * products, 0.0 * products, sums, counts, 1, 0)  # type: ignore[arg-type]


def _average_jitter(cells: Sequence[Cell]) -> Array:
    """Averages the long-run error variance due to jitter over cells, (C,)."""
    sums, counts = (sum(getattr(cell, name) for cell in cells) for name in ("jitter", "counts"))
    mean: Array = sums / np.maximum(counts, 1.0)
    return mean


def _integrate(likelihood: Quadratic, mean: Array, covariance: Array) -> float:
    """Computes the log of the expectation of exp(-x^T H x / 2 + b^T x) for x ~ N(mean, covariance)."""
    H, b = likelihood.precision, likelihood.information
    rest, M = b - H @ mean, np.eye(len(b)) + H @ covariance
    at_mean = float(likelihood.evaluate(mean[None])[0])
    spread = 0.5 * rest @ covariance @ np.linalg.solve(M, rest) - 0.5 * np.linalg.slogdet(M)[1]
    return at_mean + float(spread)
