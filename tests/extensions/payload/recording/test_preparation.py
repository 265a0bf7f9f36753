import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from affordance.extensions.payload.recording.preparation import compute_cutoff, prepare, smooth_evenly
from affordance.extensions.payload.recording.run import Run, RunDescription
from affordance.extensions.payload.settings import DEFAULT_SETTINGS, IdentificationSettings, SignalKind

# Steps that have no rounding error.
_RATE, _DURATION = 64.0, 40.0
_TIMES = np.arange(0.0, _DURATION, 1.0 / _RATE)


def build_run(amplitude):
    """Two joints that swing at 0.5 Hz, with some velocity at 5 Hz on top."""
    v = np.sin(np.pi * _TIMES) + amplitude * np.sin(10.0 * np.pi * _TIMES)
    q = -np.cos(np.pi * _TIMES) / np.pi - amplitude * np.cos(10.0 * np.pi * _TIMES) / (10.0 * np.pi)
    both = np.ones(2)
    return Run(
        "run.csv",
        RunDescription(("a", "b"), SignalKind.JOINT_TORQUE),
        _TIMES,
        np.outer(q, both),
        np.outer(v, both),
        v=np.outer(v, both),
    )


@pytest.mark.parametrize(("amplitude", "bandwidth"), [(0.0, 0.5), (0.02, 0.5), (0.05, 5.0)])
def test_cutoff_is_four_times_what_holds_nearly_all_power(amplitude, bandwidth):
    """Cut-off is 4 times the bandwidth of 0.999 of the power; amplitudes 0.02 and 0.05 have 4e-4 and 25e-4 of it."""
    cutoff = compute_cutoff(build_run(amplitude), IdentificationSettings(cutoff_factor=4.0))
    assert cutoff == pytest.approx(4.0 * bandwidth, rel=0.05)


def test_samples_span_the_run_but_for_what_is_trimmed():
    run = build_run(0.0)
    prepared = prepare(run, DEFAULT_SETTINGS)
    assert prepared.times[0] == pytest.approx(DEFAULT_SETTINGS.trim)
    assert prepared.times[-1] == pytest.approx(run.times[-1] - 1.0 / _RATE - DEFAULT_SETTINGS.trim)
    # Motion slower than the cut-off comes through, and its derivative is a derivative.
    np.testing.assert_allclose(prepared.v, np.outer(np.sin(np.pi * prepared.times), [1.0, 1.0]), atol=1e-3)
    np.testing.assert_allclose(prepared.vdot[:, 0], np.pi * np.cos(np.pi * prepared.times), atol=2e-2)


def test_filter_is_a_butterworth_filter_forwards_and_backwards(rng):
    values = np.cumsum(rng.standard_normal((4000, 2)), axis=0)
    for cutoff in (2.0, 10.0, 40.0):
        reference = sosfiltfilt(butter(4, cutoff, fs=100.0, output="sos"), values, axis=0)
        np.testing.assert_allclose(smooth_evenly(values, cutoff, 100.0), reference, atol=1e-9)
