"""Filters a stream of samples with a fixed lag.

The kernel is the impulse response of the offline filter, truncated on both sides. The filter therefore has the same
gain and no phase shift. A filtered row is complete some tenths of a second after its time.
"""

import bisect

import numpy as np

from affordance.arrays import Array
from affordance.extensions.payload.recording.preparation import PreparedRun, smooth_evenly
from affordance.extensions.payload.recording.run import resample

# Half-width of the filter in periods of its cut-off; beyond it the impulse response is below a thousandth.
_REACH = 1.6
_HIGHEST = 0.8  # largest cut-off, as a share of the Nyquist frequency
_MARGIN = 2  # additional rows on either side for derivatives
_FEWEST = 10  # least number of rows that are filtered together


class FixedLag:
    """Fixed-lag filter for joint angles, velocities and signals."""

    def __init__(self, cutoff: float, step: float, num_joints: int, rate: float) -> None:
        """Builds the filter.

        Args:
            cutoff: Cut-off, [Hz].
            step: Typical time between samples, [s].
            num_joints: Number of joints n.
            rate: Rate to which faster streams are decimated after filtering, [Hz].
        """
        self.cutoff = min(cutoff, _HIGHEST * 0.5 / step)
        self._step, self._num = step, num_joints
        self._every = max(1, round(1.0 / (step * rate)))
        half = int(np.ceil(_REACH / (self.cutoff * step)))
        impulse = np.zeros((4 * half + 1, 1))
        impulse[2 * half] = 1.0
        kernel = smooth_evenly(impulse, self.cutoff, 1.0 / step)[half : 3 * half + 1, 0]
        self._kernel = kernel / kernel.sum()
        self._margin = half + _MARGIN
        # Noise gains from white noise to acceleration: from angles if velocities are derived, or from measured
        # velocities.
        first = np.gradient(np.pad(self._kernel, _MARGIN), step)
        self._noise = float(np.linalg.norm(np.gradient(first, step))), float(np.linalg.norm(first))
        self._times: list[float] = []
        self._rows: list[Array] = []
        self._next: float | None = None  # time of the next filtered row, [s]

    @property
    def lag(self) -> float:
        """Delay after which a filtered row is complete, [s]."""
        return self._margin * self._step

    @property
    def step(self) -> float:
        """Time between filtered rows, [s]."""
        return self._every * self._step

    @property
    def alike(self) -> float:
        """Number of neighbouring filtered rows with correlated errors."""
        return max(1.0, 0.5 / (self.cutoff * self.step))

    def spread_jitter(self, rows: PreparedRun, jitter: float, has_v: bool) -> Array:
        """Computes the SD of acceleration errors due to time-stamp jitter, (N, n), [rad/s^2].

        A time stamp that is late by e causes an error of -e dx/dt. With independent e of SD ``jitter``, [s], the
        error grows with joint speed, and derivatives amplify it.
        """
        spread: Array = jitter * (self._noise[1] * np.abs(rows.vdot) if has_v else self._noise[0] * np.abs(rows.v))
        return spread

    def add(self, t: float, row: Array) -> None:
        """Adds a sample at a time in [s]: angles, optional velocities, and signals, shape (2n,) or (3n,)."""
        place = bisect.bisect(self._times, t) if self._times and t < self._times[-1] else len(self._times)
        self._times.insert(place, t)
        self._rows.insert(place, row)

    def take(self) -> PreparedRun | None:
        """Returns and removes the completed filtered rows; None if there are only a few."""
        if self._next is None:
            self._next = self._times[0] + self.lag
        count = int((self._times[-1] - self.lag - self._next) / self.step) + 1
        if count < _FEWEST:
            return None
        n, reach = self._num, (count - 1) * self._every + 2 * self._margin + 1
        table = np.array(self._rows)
        grid = np.asarray(self._next - self.lag + self._step * np.arange(reach), dtype=float)
        even = resample(grid, np.array(self._times), table)
        low = np.lib.stride_tricks.sliding_window_view(even, len(self._kernel), axis=0) @ self._kernel
        q, signal = low[:, :n], low[:, -n:]
        v = low[:, n : 2 * n] if table.shape[1] == 3 * n else np.gradient(q, self._step, axis=0)
        vdot = np.gradient(v, self._step, axis=0)
        kept = _MARGIN + self._every * np.arange(count)
        times = np.asarray(self._next + self.step * np.arange(count), dtype=float)
        self._next += count * self.step
        old = bisect.bisect(self._times, self._next - self.lag - 2.0 * self._step) - 1
        if old > 0:
            del self._times[:old], self._rows[:old]
        return PreparedRun(times, q[kept], v[kept], vdot[kept], signal[kept], self.cutoff)


def join(parts: list[PreparedRun]) -> PreparedRun:
    """Concatenates successive stretches of filtered rows."""
    times, q, v, vdot, signal = (
        np.concatenate(columns) for columns in zip(*(each[:-1] for each in parts), strict=True)
    )
    return PreparedRun(times, q, v, vdot, signal, parts[0].cutoff)
