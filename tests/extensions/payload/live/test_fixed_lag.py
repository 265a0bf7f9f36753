"""The filter of a stream is the offline filter, some tenths of a second late."""

import numpy as np
import pytest
from helpers.live_streams import record_loads

from affordance.extensions.payload.live.fixed_lag import FixedLag, join
from affordance.extensions.payload.recording.preparation import prepare
from affordance.extensions.payload.settings import DEFAULT_SETTINGS


@pytest.mark.parametrize("has_v", [True, False])
def test_rows_are_those_of_the_offline_filter(robot, has_v):
    run = record_loads(robot, np.random.default_rng(1), [(8.0, None)])
    stream, parts = FixedLag(4.0, 0.01, 6, 100.0), []
    for i, t in enumerate(run.times):
        stream.add(float(t), np.concatenate([run.q[i], *([run.v[i]] if has_v else []), run.signal[i]]))
        if (part := stream.take()) is not None:
            parts.append(part)
    live = join(parts)
    assert len(live.times) == pytest.approx((8.0 - 2.0 * stream.lag) * 100.0, abs=12)
    assert stream.lag == pytest.approx(1.6 / 4.0, abs=0.03)
    offline = prepare(run if has_v else _without_v(run), DEFAULT_SETTINGS, cutoff=4.0)
    for name, least in (("q", 2e-3), ("v", 5e-3), ("vdot", 0.03), ("signal", 5e-3)):
        expected = np.array([np.interp(live.times, offline.times, each) for each in getattr(offline, name).T]).T
        inside = (live.times > offline.times[0]) & (live.times < offline.times[-1])
        assert np.abs(getattr(live, name) - expected)[inside].max() < least * max(1.0, np.abs(expected).max())


@pytest.mark.parametrize("has_v", [True, False])
def test_jitter_of_stamps_moves_accelerations_as_far_as_predicted(has_v):
    jitter, w = 0.002, np.array([2.0, 5.0])
    t = 0.004 * np.arange(20_000)
    q, v, signal = np.sin(t[:, None] * w), w * np.cos(t[:, None] * w), np.zeros((len(t), 2))
    squares = []
    for late in (jitter * np.random.default_rng(2).standard_normal(len(t)), np.zeros(len(t))):
        stream = FixedLag(4.0, 0.004, 2, 100.0)
        for i in np.argsort(t + late):
            stream.add(float(t[i] + late[i]), np.concatenate([q[i], *([v[i]] if has_v else []), signal[i]]))
        rows = stream.take()
        squares.append(np.mean((rows.vdot + w**2 * np.sin(rows.times[:, None] * w)) ** 2, axis=0))
    # The filter itself errs, too, without any jitter.
    found = np.sqrt(squares[0] - squares[1])
    expected = np.sqrt(np.mean(stream.spread_jitter(rows, jitter, has_v) ** 2, axis=0))
    assert found == pytest.approx(expected, rel=0.25)  # interpolation smooths a little, which is left out


def _without_v(run):
    return type(run)(run.source, run.description, run.times, run.q, run.signal)


def test_a_slow_stream_has_a_lower_cut_off():
    assert FixedLag(4.0, 0.2, 1, 100.0).cutoff == pytest.approx(0.8 * 2.5)
