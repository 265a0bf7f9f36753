import numpy as np
import pytest
from scipy.stats import t

from affordance.extensions.payload.evidence.evidence import ErrorModel, estimate_variance_at_rest
from affordance.extensions.payload.evidence.joint_statistics import SIGNAL, ChannelSamples, compute_statistics
from studies.payload.at_rest import draw_errors

_WEIGHTS = np.tile(np.eye(27)[SIGNAL], (6, 1))


def _sum(signal, block=1):
    zero = np.zeros_like(signal)
    samples = ChannelSamples(
        np.zeros((*signal.shape, 10)), zero, zero, zero, zero, zero, signal, np.ones(signal.shape, bool)
    )
    return compute_statistics(samples, block)


def test_many_postures_show_the_variance_of_each_channel():
    sd = np.array([3.0, 1.0, 2.0, 0.1, 0.2, 0.3])
    signal = sd * np.random.default_rng(0).standard_normal((20000, 6))
    variance = estimate_variance_at_rest(_sum(signal), _WEIGHTS, (slice(3), slice(3, 6)))
    assert np.sqrt(variance) == pytest.approx(sd, rel=0.03)


def test_errors_of_a_sensor_that_drifts_are_counted_over_many_blocks():
    """Errors of unit variance that agree over 30 s have a long-run variance of 300 samples, in blocks of 20 too."""
    errors = draw_errors(np.arange(0.0, 3000.0, 0.1), 6, 30.0, np.random.default_rng(0))
    statistics = _sum(errors, 20)
    model = ErrorModel(1.0, True, np.zeros(1))
    within, over = (each.estimate_variance(statistics, _WEIGHTS) for each in (model, model._replace(drifts=True)))
    freedom = model._replace(drifts=True).count_freedom(statistics, _WEIGHTS)
    assert within.mean() == pytest.approx(20.0, rel=0.15)
    assert over.mean() == pytest.approx(300.0, rel=0.25)
    assert freedom.mean() == pytest.approx(100.0, rel=0.25)


def test_few_postures_give_the_interval_of_students_t():
    """Four postures of three forces are twelve numbers for six unknowns: a channel has 2 + 4 degrees of freedom."""
    signal = np.tile([1.0, -1.0, 1.0, -1.0], (6, 1)).T
    variance = estimate_variance_at_rest(_sum(signal), _WEIGHTS, (slice(3), slice(3, 6)))
    mean = 12.0 / 6.0
    expected = (t.ppf(0.95, 6) / 1.6448536) ** 2 * (4.0 + 4.0 * mean) / 6.0
    assert variance == pytest.approx(np.full(6, expected))
