"""Resamples a recorded run evenly, filters it without phase shift, and differentiates it.

All quantities pass the same filter, because filtered signals then still obey the linear equation of the dynamics.
Accelerations are differences of filtered velocities.
"""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_banded

from affordance.arrays import Array
from affordance.exceptions import BadValueError
from affordance.extensions.payload.recording.run import POSTURE_STEP, Run, resample
from affordance.extensions.payload.settings import IdentificationSettings

_ORDER = 4
# Share of the velocity's power that defines its bandwidth.
_POWER = 0.999
# Least power of a joint's velocity, relative to the largest, for computing its bandwidth.
_FAINT = 0.02
# Largest bandwidth as a multiple of the bandwidth of the tapered motion.
_FADED = 4.0
# Smallest cut-off, [Hz], because slower filters ring for longer than short runs last, and largest cut-off as a share
# of the Nyquist frequency.
_SLOWEST, _FASTEST = 0.5, 0.8


class PreparedRun(NamedTuple):
    """Filtered run with evenly spaced samples."""

    times: Array  # times of the samples, shape (N,), [s]
    q: Array  # joint angles, shape (N, n), [rad]
    v: Array  # joint velocities, shape (N, n), [rad/s]
    vdot: Array  # joint accelerations, shape (N, n), [rad/s^2]
    signal: Array  # signals of the channels, shape (N, C), in the unit of their kind
    cutoff: float  # cut-off of the filter, [Hz]

    @property
    def motion(self) -> tuple[Array, Array, Array]:
        """Joint angles, velocities and accelerations."""
        return self.q, self.v, self.vdot

    @property
    def rate(self) -> float:
        """Sampling rate, [Hz]."""
        return float(1.0 / (self.times[1] - self.times[0]))

    def select(self, rows: slice | NDArray[np.intp]) -> "PreparedRun":
        """Selects samples by their rows."""
        return self._replace(**{name: getattr(self, name)[rows] for name in self._fields if name != "cutoff"})


def compute_cutoff(run: Run, settings: IdentificationSettings) -> float:
    """Computes the filter cut-off that passes a run's motion, [Hz].

    The cut-off is a multiple of the largest bandwidth of any joint. A joint's bandwidth contains 99.9 % of its
    velocity's power. A cut-off in the settings takes precedence.
    """
    if run.description.postures:
        return 1.0 / POSTURE_STEP  # postures are not filtered
    if settings.cutoff is not None:
        return min(settings.cutoff, _FASTEST * run.rate / 2.0)
    times = np.arange(run.times[0], run.times[-1], 1.0 / run.rate)
    v = resample(times, run.times, np.gradient(run.q, run.times, axis=0) if run.v is None else run.v)
    v = v[:, np.ptp(run.q, axis=0) > settings.min_speed]  # the velocities of joints at rest are noise
    highest = _FASTEST * run.rate / 2.0
    if not v.shape[1]:
        return min(max(2.0, _SLOWEST), highest)
    # A window of a motion begins and ends with different velocities, and such a jump contains all frequencies. The
    # line from the first to the last value is therefore subtracted, and the tapered motion limits the bandwidth.
    bandwidth = _compute_bandwidth(v - np.linspace(v[0], v[-1], len(v)), run.rate)
    faded = _compute_bandwidth((v - v.mean(axis=0)) * np.hanning(len(v))[:, None], run.rate)
    bandwidth = min(bandwidth, _FADED * faded)
    return min(max(settings.cutoff_factor * bandwidth, _SLOWEST), highest)


def _compute_bandwidth(v: Array, rate: float) -> float:
    """Computes the largest bandwidth of the moving joints' velocities, [Hz]."""
    power = np.abs(np.fft.rfft(v - v.mean(axis=0), axis=0)) ** 2
    total = power.sum(axis=0)
    share = np.cumsum(power, axis=0) / total
    frequencies = np.fft.rfftfreq(len(v), 1.0 / rate)
    moving = share.T[total >= _FAINT * total.max()]  # the power of the others may be mostly noise
    return max(float(frequencies[np.argmax(column >= _POWER)]) for column in moving)


def prepare(
    run: Run, settings: IdentificationSettings, *, cutoff: float | None = None, times: Array | None = None
) -> PreparedRun:
    """Filters a run and computes its derivatives. Held postures are returned unchanged, with zero derivatives.

    Args:
        run: Recorded run.
        settings: Settings of the filter and of trimming.
        cutoff: Cut-off of the filter, [Hz]; None to use ``compute_cutoff``.
        times: Evenly spaced times at about the run's own rate, (N,), [s], before trimming; None for the run's own.

    Raises:
        BadValueError: The run is too short to be trimmed.
    """
    if run.description.postures:
        rest, steps = np.zeros_like(run.q), POSTURE_STEP * np.arange(len(run.q), dtype=float)
        return PreparedRun(steps, run.q, rest, rest, run.signal, compute_cutoff(run, settings))
    if times is None:
        times = np.arange(run.times[0], run.times[-1], 1.0 / run.rate)
    rate = 1.0 / (times[1] - times[0])
    if cutoff is None:
        cutoff = compute_cutoff(run, settings)
    trimmed = round(settings.trim * rate)  # rounding makes this equal for two runs with different clocks
    if len(times) < 2 * trimmed + int(rate):
        length, least = (times[-1] - times[0]), 2.0 * settings.trim + 1.0
        raise BadValueError(run.source, "time", f"spans {length:.2f} s, must span at least {least:.2f} s")

    def smooth(values: Array) -> Array:
        return smooth_evenly(resample(times, run.times, values), cutoff, rate)

    q, signal = smooth(run.q), smooth(run.signal)
    v = np.gradient(q, 1.0 / rate, axis=0) if run.v is None else smooth(run.v)
    vdot = np.gradient(v, 1.0 / rate, axis=0) if run.vdot is None else smooth(run.vdot)
    kept = slice(trimmed, len(times) - trimmed, max(1, round(rate / settings.max_rate)))
    return PreparedRun(times, q, v, vdot, signal, cutoff).select(kept)


def smooth_evenly(values: Array, cutoff: float, rate: float) -> Array:
    """Applies a Butterworth filter forwards and backwards to evenly spaced samples.

    The results equal ``scipy.signal.sosfiltfilt``, whose import takes as long as an identification. Values are
    extended with odd reflections at both ends, and each pass starts in the steady state of its first value.

    Args:
        values: Samples, shape (N, C).
        cutoff: Frequency at which each pass halves the power, [Hz].
        rate: Sampling rate, [Hz].
    """
    edge = 3 * (_ORDER + 1)
    smoothed = np.concatenate(
        [2.0 * values[0] - values[edge:0:-1], values, 2.0 * values[-1] - values[-2 : -edge - 2 : -1]]
    )
    w = np.tan(np.pi * cutoff / rate)
    for _ in range(2):
        for damping in 2.0 * np.sin(np.pi * (np.arange(_ORDER // 2) + 0.5) / _ORDER):
            smoothed = _apply_section(smoothed, w, damping)
        smoothed = smoothed[::-1]
    return smoothed[edge:-edge]


def _apply_section(values: Array, w: float, damping: float) -> Array:
    """Applies the bilinear transform of 1 / (s^2 / w^2 + damping s / w + 1), from the steady state."""
    a = np.array([1.0 + damping * w + w**2, 2.0 * (w**2 - 1.0), 1.0 - damping * w + w**2])
    known = np.concatenate([values[:1], values[:1], values])
    inputs = w**2 * (known[2:] + 2.0 * known[1:-1] + known[:-2])
    inputs[0] -= (a[1] + a[2]) * values[0]
    inputs[1] -= a[2] * values[0]
    outputs: Array = solve_banded((2, 0), np.tile(a[:, None], len(values)), inputs)
    return outputs


def prepare_alike(runs: Iterable[Run], settings: IdentificationSettings) -> list[PreparedRun]:
    """Prepares runs with a common filter that passes the motion of every run."""
    runs = list(runs)
    cutoff = max(compute_cutoff(run, settings) for run in runs)
    return [prepare(run, settings, cutoff=cutoff) for run in runs]
