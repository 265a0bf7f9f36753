from dataclasses import replace

import numpy as np
import pytest
from helpers.generated_runs import Truth, generate_run
from helpers.refusals import refuse

from affordance.exceptions import BadValueError
from affordance.extensions.payload.evidence.paired_runs import align
from affordance.extensions.payload.recording.preparation import prepare
from affordance.extensions.payload.recording.run import Run, RunDescription
from affordance.extensions.payload.settings import DEFAULT_SETTINGS, SignalKind

_TRUTH = Truth(noise_sd=0.0)


@pytest.fixture
def empty(robot, rng):
    return generate_run(robot, None, truth=_TRUTH, rng=rng)


def _shift(run, seconds):
    """The run with its motion delayed on the same clock."""
    times = run.times
    q = np.column_stack([np.interp(times - seconds, times, column) for column in run.q.T])
    return replace(run, q=q, v=None, source="loaded")


@pytest.mark.parametrize("seconds", [0.0, 0.4137, -1.2503])
def test_lag_is_found_to_a_millisecond(empty, seconds):
    alignment = align(empty, _shift(empty, seconds), 0.02)
    assert alignment.lag == pytest.approx(seconds, abs=1e-3)
    assert alignment.difference < 0.01


def test_clocks_that_start_elsewhere_do_not_matter(robot, empty, rng):
    later = generate_run(robot, None, truth=_TRUTH, rng=rng, start=1000.0)
    assert align(empty, later, 0.02).lag == pytest.approx(1000.0, abs=1e-3)


def test_another_motion_is_no_repetition(robot, empty, rng):
    other = generate_run(robot, None, truth=_TRUTH, rng=rng, motion_seed=3, source="loaded")
    message = r"loaded: row \d+, column q_\d \(joint_\d\): is .* rad off the same moment of generated, must"
    with pytest.raises(BadValueError, match=message) as caught:
        align(empty, other, 0.02)
    assert "--unpaired" in str(caught.value)


def test_a_motion_repeated_in_part_only_is_refused(robot, rng):
    empty = generate_run(robot, None, truth=_TRUTH, rng=rng, duration=6.0)
    loaded = generate_run(robot, None, truth=_TRUTH, rng=rng, source="loaded")
    with pytest.raises(
        BadValueError, match=r"loaded: time: repeats 5.\d+ s of generated, must repeat at least 10.00 s"
    ):
        align(empty, loaded, 0.02)


def test_a_run_at_rest_is_refused(empty):
    still = replace(empty, q=np.zeros_like(empty.q), v=None, source="still")
    assert "still: q: has no joint that moves faster than 0.01 rad/s" in refuse(align, empty, still, 0.02)


def test_filtered_alike_signals_obey_the_equation_they_obeyed(robot, empty):
    prepared = prepare(empty, DEFAULT_SETTINGS)
    torque = robot.compute_arm_torques(prepared.q, prepared.v, prepared.vdot)
    # The equation is not linear in the motion: what is left of it is a thousandth.
    assert np.abs(prepared.signal - torque).max() < 2e-3 * np.abs(torque).max()


def test_velocities_and_accelerations_are_derived_where_missing(empty):
    given, derived = prepare(empty, DEFAULT_SETTINGS), prepare(replace(empty, v=None), DEFAULT_SETTINGS)
    # The filter rings at either end, and differently: an angle does not end like its velocity.
    middle = slice(300, -300)
    np.testing.assert_allclose(derived.v[middle], given.v[middle], atol=1e-4)
    np.testing.assert_allclose(derived.vdot[middle], given.vdot[middle], atol=1e-3)


def test_a_run_shorter_than_its_ends_is_refused(robot, rng):
    run = generate_run(robot, None, truth=_TRUTH, rng=rng, duration=2.5)
    with pytest.raises(BadValueError, match=r"generated: time: spans 2.4\d s, must span at least 3.00 s"):
        prepare(run, DEFAULT_SETTINGS)


def test_lag_of_a_fast_motion_is_the_nearest_to_where_velocities_agree():
    """The lag of a swing of 4 Hz is found to 1 ms, although a shift by a whole period fits nearly as well."""
    times = np.arange(0.0, 12.0, 0.01)

    def swing(lag):
        t = times - lag
        q = np.sin(8.0 * np.pi * t) * (1.0 + 0.1 * np.sin(0.6 * np.pi * t))
        q = np.outer(q, [1.0, 0.5])
        return Run("run.csv", RunDescription(("a", "b"), SignalKind.JOINT_TORQUE), times, q, np.zeros_like(q))

    assert align(swing(0.0), swing(0.1234), 0.05).lag == pytest.approx(0.1234, abs=1e-3)
