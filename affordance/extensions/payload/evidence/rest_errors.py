"""Errors of an arm that is held at rest: their variance, estimated from a few postures with its uncertainty."""

import numpy as np
import scipy

from affordance.arrays import Array
from affordance.extensions.payload.evidence.joint_statistics import JointStatistics

# Numbers of unknowns that postures determine: the offset of a channel; mass and first moment; and three each for the
# forces and the moments of a wrist sensor, which include the two angles of gravity.
_OFFSET, _OF_LOAD, _OF_WRENCH = 1.0, 4.0, 3.0
# Weight of the mean variance of similar channels, as a number of postures added to a channel's own.
_SHRINKAGE = 4.0
_LEVEL, _NORMAL = 0.95, 1.6448536  # upper end of a 90 % interval, as a quantile and in normal SDs


def estimate_variance_at_rest(statistics: JointStatistics, weights: Array, alike: tuple[slice, ...]) -> Array:
    """Estimates the variance of each channel's error from the residual of a few postures, shape (C,).

    A posture counts as one sample, because its error persists as long as it is held. Each channel's variance is
    shrunk towards the mean over channels with similar errors, and widened so that a normal error has the 90 %
    interval of Student's t.

    Args:
        statistics: Sums over the postures.
        weights: Weights w of the residual w^T z, shape (C, 26).
        alike: Groups of channels with errors of similar size.
    """
    variance = np.empty(statistics.num_channels)
    squares = statistics.sum_squares(weights)
    shared = _OF_LOAD if len(alike) == 1 else _OF_WRENCH
    for group in alike:
        counts = statistics.counts[group]
        freedom = np.maximum(counts - _OFFSET - shared / len(counts), 0.0)
        mean = squares[group].sum() / max(freedom.sum(), 1.0)
        sure = freedom + _SHRINKAGE
        widening = scipy.special.stdtrit(np.minimum(sure, max(freedom.sum(), 1.0)), _LEVEL) / _NORMAL
        variance[group] = widening**2 * (squares[group] + _SHRINKAGE * mean) / sure
    result: Array = np.maximum(variance, np.finfo(float).tiny)
    return result
