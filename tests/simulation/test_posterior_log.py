"""The posterior as it is logged within a trial."""

import dataclasses

import numpy as np
import pytest
from helpers.density_quadrature import integrate
from helpers.seen_objects import know
from scipy.stats import norm

from affordance.belief.material_memory import MaterialMemory
from affordance.proprioception.torque_noise import WhiteNoise
from affordance.simulation.trial import Observer, TrialRunner

PERIOD = 0.1


def run(weight, memory, *, duration=0.5, tool=0, **changes):
    settings = dataclasses.replace(weight.settings, posterior_log_period=PERIOD, **changes)
    return TrialRunner(settings).run_hold(weight.tools[tool], memory, duration=duration, seed=(4,))


def compute_sd(record):
    return np.sqrt([entry.belief.densities.covariance[0, 0] for entry in record.posteriors])


def test_log_goes_from_the_visual_prior_to_what_the_memory_takes_over(weight):
    """The entries at 0 and at the first sample are the visual prior; the last has the evidence of every sample."""
    record = run(weight, MaterialMemory(), duration=0.7)
    times = [entry.time for entry in record.posteriors]
    np.testing.assert_allclose(times, PERIOD * np.arange(8), atol=1e-6)
    assert (np.diff(times) > 0.0).all()
    before, first, second, *_, last = record.posteriors
    prior = weight.settings.prior
    for entry in (before, first):
        assert entry.belief.densities.untruncated_mean == pytest.approx(prior.mode)
        scatter = prior.deviation * np.hypot(prior.mode, prior.sd)
        assert entry.belief.densities.covariance[0, 0] == pytest.approx(prior.sd**2 + scatter**2)
    assert second.belief.densities.covariance[0, 0] < 0.5 * before.belief.densities.covariance[0, 0]
    np.testing.assert_array_equal(last.belief.memory.belief.precision, record.memory.belief.precision)
    np.testing.assert_array_equal(
        last.belief.memory.belief.information_vector, record.memory.belief.information_vector
    )


def test_white_noise_narrows_the_posterior_sample_by_sample(weight, hold):
    """Information grows in equal steps, one a sample, for an arm that believes the truth and so does not move."""
    noise, before = WhiteNoise(0.7), 1e-6
    record = run(weight, know(weight, precision=before), duration=1.0, noise=noise)
    assert np.abs(record.height_centre).max() < 0.002
    per_density = hold.Y @ weight.tools[0].parameters / 8500.0
    says = float(per_density @ per_density) / noise.sd**2
    counts = np.array([0, *range(9), 10])
    expected = []
    for entry, count in zip(record.posteriors, counts, strict=True):
        state = entry.belief.memory.state
        A, y = (state[name].ravel() for name in ("hold_regressor", "hold_tau"))  # empty before the first sample
        np.testing.assert_allclose(A @ A, count * says, rtol=1e-3)
        moments = integrate(
            lambda rho, A=A, y=y: norm.logpdf(y, rho * A, 1.0).sum(axis=1),
            [np.arange(2.5, 16_000.0, 5.0)],
            [8500.0],
            [before**-0.5],
            weight.settings.prior.deviation,
        )
        expected.append(moments.own_covariance[0, 0] ** 0.5)
    np.testing.assert_allclose(compute_sd(record), expected, rtol=1e-3)


def test_control_uses_the_logged_posterior_if_it_is_told_to(weight):
    """Motions differ from the first sample on; the arm that uses its posterior comes back, the other stays low."""
    believing, learning = (
        run(weight, MaterialMemory(), duration=2.0, tool=3, uses_posterior=uses) for uses in (False, True)
    )
    differs = np.abs(believing.q - learning.q).max(axis=1) > 1e-9
    assert believing.times[differs][0] == pytest.approx(PERIOD, abs=0.011)
    assert learning.height_centre.min() < -0.03
    assert abs(learning.height_centre[-1]) < 0.005
    assert believing.height_centre[-1] < -0.1


def test_log_changes_nothing_of_the_trial_and_is_off_unless_asked_for(weight, runner):
    without = runner.run_hold(weight.tools[0], MaterialMemory(), duration=0.5, seed=(4,))
    record = run(weight, MaterialMemory())
    assert without.posteriors == ()
    np.testing.assert_array_equal(record.q, without.q)
    np.testing.assert_array_equal(record.memory.belief.precision, without.memory.belief.precision)
    assert not runner.get_diagram().diagram.HasSubsystemNamed("posterior_log")


def test_every_presentation_has_a_log_of_its_own(weight):
    settings = dataclasses.replace(weight.settings, posterior_log_period=PERIOD)
    observer = Observer(TrialRunner(settings), MaterialMemory(), duration=0.3)
    first, second = (observer.hold(tool, (number,)) for number, tool in enumerate(weight.tools[:2]))
    for record in (first, second):
        np.testing.assert_allclose([entry.time for entry in record.posteriors], [0, 0.1, 0.2, 0.3], atol=1e-6)
    taken_over = first.posteriors[-1].belief.memory.belief
    np.testing.assert_array_equal(second.posteriors[0].belief.memory.belief.precision, taken_over.precision)
