"""Tables with jumps, each made from a good motion by one mistake, and what is said of them."""

import re
from dataclasses import replace

import numpy as np
import pytest
from helpers.refusals import refuse

from affordance.extensions.payload.identify import Runs, identify
from affordance.extensions.payload.recording.joint_rates import FASTEST, find_jumps, find_lag
from affordance.extensions.payload.recording.run import Run, RunDescription
from affordance.extensions.payload.settings import IdentificationSettings, SignalKind

_LIMITS = np.array([2.0, 3.0])
_RANGES = np.array([[-3.0, -3.0], [3.0, 3.0]])
_RATE = 50.0


def _build(q, rate=_RATE, **more):
    q = np.asarray(q)
    times = 1e5 + np.arange(len(q)) / rate
    signal = np.random.default_rng(0).standard_normal(q.shape)
    return Run("run.csv", RunDescription(("pan", "lift"), SignalKind.JOINT_TORQUE), times, q, signal, **more)


def _move(seconds=20.0, rate=_RATE):
    """Angles of a motion up to a radian a second."""
    t = np.arange(0.0, seconds, 1.0 / rate)
    return np.column_stack([0.8 * np.sin(1.2 * t), 0.5 * np.cos(2.0 * t)])


def _check(run, ranges=_RANGES):
    return refuse(run.check_rates, _LIMITS, ranges, "robot.urdf")


def _hold(seconds, rate=_RATE, noise=1e-4):
    """Twelve postures, each held for some seconds, with the noise of encoders."""
    rng = np.random.default_rng(4)
    postures = np.repeat(rng.uniform(-2.5, 2.5, (12, 2)), round(seconds * rate), axis=0)
    return postures + noise * rng.standard_normal(postures.shape)


@pytest.mark.parametrize("rate", [10.0, 50.0, 1000.0])
def test_a_motion_within_the_limits_has_no_jumps(rate):
    run = _build(_move(rate=rate) + 1e-3 * np.random.default_rng(1).standard_normal(_move(rate=rate).shape), rate)
    assert find_jumps(run.times, run.q, _LIMITS) == ()
    run.check_rates(_LIMITS, _RANGES, "robot.urdf")


def test_a_late_stamp_is_no_jump():
    """Each fourth row is stamped as late as the next: a short step, though the motion is not fast."""
    run = _build(_move(rate=10.0), 10.0)
    times = run.times.copy()
    times[3:-1:4] = times[4::4] - 1e-5
    replace(run, times=times).check_rates(_LIMITS, _RANGES, "robot.urdf")


def test_jumps_are_those_between_postures():
    q = _hold(2.0)
    run = _build(q)
    jumps = find_jumps(run.times, q, _LIMITS)
    large = np.abs(np.diff(q[::100], axis=0)) > 1.5 * _LIMITS / _RATE + 0.05
    assert {(jump.row, jump.joint) for jump in jumps} == {(100 * (k + 1), j) for k, j in np.argwhere(large)}
    assert all(jump.change == q[jump.row, jump.joint] - q[jump.row - 1, jump.joint] for jump in jumps)
    assert all(jump.rate == pytest.approx(abs(jump.change) * _RATE, rel=1e-4) for jump in jumps)
    assert {jump.limit for jump in jumps} == {2.0, 3.0}


@pytest.mark.parametrize("seconds", [2.0, 0.1])
def test_held_postures_one_after_the_other_are_named(seconds):
    said = _check(_build(_hold(seconds)))
    assert "these look like 12 postures, held one after the other" in said


def test_a_jump_is_named_with_row_joint_time_rate_and_limit():
    q = _move()
    q[500:, 1] += 1.0
    change = q[500, 1] - q[499, 1]
    said = _check(_build(q))
    where = f"changes by {change:.3g} rad in 0.02 s, 10 s after the start: {_RATE * change:.3g} rad/s"
    assert said.startswith(
        f"run.csv: row 501, column q_2 (lift): {where}, must be at most 3 according to robot.urdf; "
    )
    assert "rows are missing or wrong, or these are several recordings in one table" in said


def test_an_encoder_that_starts_again_is_named():
    q = _move()
    q[:, 0] = (q[:, 0] + 2.6 + np.pi) % (2.0 * np.pi) - np.pi
    assert "the angle jumps by a turn (2 pi)" in _check(_build(q))
    # With rates beside it, which alone would say that columns are exchanged.
    said = refuse(_build, q, v=np.gradient(_move(), 1.0 / _RATE, axis=0))
    assert "must be at most 25.1 for any arm; the angle jumps by a turn (2 pi)" in said


@pytest.mark.parametrize("rate", [20.0, 500.0])
def test_angles_in_degrees_are_named(rate):
    """Degrees of a motion so small that they could be radians, of some robot."""
    run = _build(np.rad2deg(0.15 * _move(rate=rate)), rate)
    said = _check(run)
    assert "are these degrees? then its description must have 'units: {q: deg}'" in said
    row, change, step = re.search(r"row (\d+), .* changes by (\S+) rad in (\S+) s", said).groups()
    before, joint = round(int(row) - 1 - float(step) * rate), "lift" in said
    assert abs(run.q[int(row) - 1, int(joint)] - run.q[before, int(joint)]) == pytest.approx(float(change), rel=5e-3)


@pytest.mark.parametrize("rate", [20.0, 100.0])
def test_seconds_taken_for_milliseconds_are_named(rate):
    run = _build(_move(rate=rate), 1000.0 * rate)
    said = _check(run)
    assert f"{1e3 / rate:g} us between samples is improbable: is the unit of time a thousand times longer" in said


def test_a_clock_that_is_four_times_too_fast_is_refused():
    run = _build(_move(), 4.0 * _RATE)
    assert "are the units of time and angles as described" in _check(run)


def test_joints_without_a_limit_turn_four_times_a_second_at_most():
    q = _move()
    q[500:, 0] += 1.0
    run = _build(q)
    jumps = find_jumps(run.times, q, np.full(2, np.inf))
    assert [(jump.row, jump.joint, jump.limit) for jump in jumps] == [(500, 0, FASTEST)]
    said = refuse(run.check_rates)
    assert "must be at most 25.1 for any arm" in said


@pytest.mark.parametrize("which", ["loaded", "empty"])
def test_an_identification_refuses_jumps_of_any_run(robot, which):
    """Held postures without the moves between them would give a centre of mass that is wrong, and sure."""
    rng = np.random.default_rng(0)
    postures = np.repeat(rng.uniform(-2.0, 2.0, (14, 6)), 100, axis=0)
    q = {"held": postures, "moved": np.cumsum(0.002 * rng.standard_normal((1400, 6)), axis=0)}
    description = RunDescription(robot.joint_names, SignalKind.WRENCH)
    held, moved = (
        Run(f"{name}.csv", description, np.arange(1400) / _RATE, angles, rng.standard_normal((1400, 6)))
        for name, angles in q.items()
    )
    runs = Runs(held, (moved,)) if which == "loaded" else Runs(moved, (held,))
    said = refuse(identify, robot, runs, settings=IdentificationSettings(num_samples=200))
    assert "held.csv: row " in said
    assert f"rad/s, must be at most 5 according to {robot.source}; these look like 14 postures" in said


@pytest.mark.parametrize("lag", [-0.02, 0.0, 0.065, 0.2])
def test_the_lag_of_a_rate_is_found_to_a_millisecond(lag):
    times = np.arange(0.0, 12.0, 0.01)

    def move(t):
        return np.sin(1.3 * t) + 0.4 * np.sin(3.1 * t + 1.0)

    rate = (move(times - lag + 1e-5) - move(times - lag - 1e-5)) / 2e-5
    assert find_lag(times, move(times), rate) == pytest.approx(lag, abs=1e-3)
