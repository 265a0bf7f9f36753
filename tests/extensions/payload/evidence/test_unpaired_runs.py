import numpy as np
import pytest
from helpers.generated_runs import Truth, generate_run

from affordance.extensions.payload.evidence.unpaired_runs import fit_empty_arm, subtract_arm
from affordance.extensions.payload.posterior.payload_fit import build_channel_prior
from affordance.extensions.payload.recording.preparation import prepare
from affordance.extensions.payload.settings import DEFAULT_SETTINGS

_CELL = 0.5  # [s]


@pytest.fixture(scope="module")
def empty(robot):
    """A run that is two stretches of some eight cells long."""
    run = generate_run(robot, None, truth=Truth(noise_sd=0.1), rng=np.random.default_rng(1), duration=10.0)
    return prepare(run, DEFAULT_SETTINGS)


@pytest.fixture(scope="module")
def fit(robot, gains, empty):
    """Errors of prediction of an arm fitted to a signal, (N, n)."""
    return lambda signal: fit_empty_arm(robot, [empty], [signal], gains, DEFAULT_SETTINGS).residual[0]


def test_an_error_is_not_fitted_within_half_a_second_of_it(empty, fit):
    """A prediction does not change with signals within half a second of it, over which errors agree."""
    length = round(_CELL * empty.rate)
    num_cells = len(empty.times) // length
    assert 16 <= num_cells < 20  # two stretches, which meet in the middle
    before = fit(empty.signal)
    for cell in (0, *range(num_cells // 2 - 2, num_cells // 2 + 2)):
        rows = slice(cell * length, (cell + 1) * length)
        signal = empty.signal.copy()
        signal[rows] += 5.0
        change = np.abs(fit(signal) - before)
        np.testing.assert_allclose(change[rows], 5.0)
        for near in (slice(max(0, rows.start - length), rows.start), slice(rows.stop, rows.stop + length)):
            assert not change[near].any()
        if cell == 0:  # the rest of its stretch, up to the middle
            assert not change[rows.stop : num_cells // 2 * length].any()
        if cell == num_cells // 2 - 2:  # far from the other stretch, which it is fitted for
            assert change[rows.stop + 3 * length :].any()
            assert not change[: rows.start].any()


def test_what_is_left_after_a_fitted_arm_is_a_difference(robot, gains, empty):
    """Subtracting a fitted arm's prediction cancels the arm's own model, and leaves noise below 0.3 N m."""
    run = generate_run(robot, None, truth=Truth(noise_sd=0.1), rng=np.random.default_rng(2), duration=10.0)
    arm = fit_empty_arm(robot, [empty], [empty.signal], gains, DEFAULT_SETTINGS)
    evidence = subtract_arm(robot, arm, run, prepare(run, DEFAULT_SETTINGS), DEFAULT_SETTINGS)
    assert evidence.is_difference
    assert not build_channel_prior(evidence, gains, DEFAULT_SETTINGS).has_arm
    assert np.abs(evidence.samples.signal).std() < 0.3  # noise, of torques of tens of newton metres
