"""Identification from held postures, end to end: what it finds, and what it says that they do not show."""

import re
from dataclasses import replace

import numpy as np
import pytest
from helpers.generated_runs import PAYLOAD
from helpers.refusals import refuse

from affordance.commands.payload.identify import write_belief
from affordance.extensions.payload.identify import Runs, identify
from affordance.extensions.payload.payload_figures import draw_fit
from affordance.extensions.payload.recording.run import Run, RunDescription
from affordance.extensions.payload.settings import IdentificationSettings, SignalKind
from studies.payload.at_rest import draw_postures, generate_torques, generate_wrench, hold

_FAST = IdentificationSettings(num_samples=1000)
_TRUTH = np.array([PAYLOAD[0], *(PAYLOAD[1:4] / PAYLOAD[0])])


def _hold_pair(robot, rng, num):
    q = draw_postures(num, 6, rng)
    empty, loaded = generate_torques(robot, q, (0.0 * PAYLOAD, PAYLOAD), rng)
    kind = SignalKind.JOINT_TORQUE
    return Runs(hold(robot, q, loaded, kind), (hold(robot, q, empty, kind, "empty"),))


@pytest.mark.parametrize("num", [4, 12])
@pytest.mark.parametrize("sensor", ["wrist", "joints"])
def test_four_postures_determine_mass_and_centre_of_mass(robot, num, sensor):
    """Of twenty tables the 90 % intervals hold at least fifteen masses, and centres coordinate by coordinate."""
    inside = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        if sensor == "wrist":
            q = draw_postures(num, 6, rng)
            runs = Runs(hold(robot, q, generate_wrench(robot, q, PAYLOAD, rng), SignalKind.WRENCH))
        else:
            runs = _hold_pair(robot, rng, num)
        belief = identify(robot, runs, settings=_FAST)
        m = belief.marginals
        inside.append((m.low90[:4] <= _TRUTH) & (m.high90[:4] >= _TRUTH))
        assert belief.is_trusted, belief.doubts
        assert belief.mass_sd < 0.15
    assert np.sum(inside, axis=0).min() >= 15


def test_axes_of_a_wrist_sensor_that_disagree_widen_the_interval_or_are_doubted(robot):
    """By 3 % the interval is wider and holds the mass; by 12 % the axes are named, with the mass that each shows."""
    rng = np.random.default_rng(0)
    q = draw_postures(30, 6, rng)
    wrench = generate_wrench(robot, q, PAYLOAD, rng)
    usual, apart, wrong = (
        identify(
            robot, Runs(hold(robot, q, wrench * np.array([*gains, 1.0, 1.0, 1.0]), SignalKind.WRENCH)), settings=_FAST
        )
        for gains in ((1.0, 1.0, 1.0), (0.97, 1.0, 1.04), (1.0, 1.0, 1.12))
    )
    assert usual.doubts == apart.doubts == ()
    assert apart.mass_sd > 1.3 * usual.mass_sd
    assert apart.mass_interval90[0] < PAYLOAD[0] < apart.mass_interval90[1]
    (doubt,) = wrong.doubts
    assert doubt.startswith("fz: the load implies a gain ")
    shown = [float(each) for each in re.findall(r"f[xyz] ([\d.]+) kg", doubt)]
    np.testing.assert_allclose(shown, PAYLOAD[0] * np.array([1.0, 1.0, 1.12]), rtol=0.03)  # gains are off by 1 %


@pytest.mark.parametrize("paired", [True, False])
def test_times_of_postures_have_no_meaning(robot, rng, paired):
    """Postures a second apart, or at uneven times, give the same masses as those half a second apart."""
    runs = _hold_pair(robot, rng, 12)
    masses = []
    for times in (runs.loaded.times, np.arange(12.0), np.cumsum(rng.uniform(0.1, 9.0, 12))):
        later = Runs(replace(runs.loaded, times=times), (replace(runs.empty[0], times=times),))
        masses.append(identify(robot, later, paired=paired, settings=_FAST).mass)
    assert masses[1:] == masses[:1] * 2


@pytest.mark.parametrize("sensor", ["wrist", "joints"])
def test_postures_of_a_table_without_noise_show_the_load(robot, sensor):
    """Its errors count as the step of a converter of 16 bits; with none at all no equation had a solution."""
    q = draw_postures(20, 6, np.random.default_rng(1))
    rest, links = np.zeros_like(q), robot.link_parameters.ravel()
    if sensor == "wrist":
        wrench = robot.compute_wrench_regressors(q, rest, rest)[:, [3, 4, 5, 0, 1, 2]] @ PAYLOAD
        runs = Runs(hold(robot, q, wrench, SignalKind.WRENCH))
    else:
        kind, empty = SignalKind.JOINT_TORQUE, robot.compute_link_regressors(q, rest, rest) @ links
        loaded = empty + robot.compute_payload_regressors(q, rest, rest) @ PAYLOAD
        runs = Runs(hold(robot, q, loaded, kind), (hold(robot, q, empty, kind, "empty"),))
    belief = identify(robot, runs, settings=_FAST)
    assert belief.mass == pytest.approx(PAYLOAD[0], rel=1e-3)


def test_postures_in_which_nothing_changes_are_refused(robot):
    """Turned about the vertical alone, an exact arm feels the same in all postures; other joints are asked for."""
    q = np.tile([0.0, 0.3, -0.2, 0.4, 0.2, 0.1], (20, 1))
    q[:, 0] = np.linspace(-1.5, 1.5, 20)
    rest = np.zeros_like(q)
    signal = robot.compute_payload_regressors(q, rest, rest) @ PAYLOAD
    said = refuse(identify, robot, Runs(hold(robot, q, signal, SignalKind.JOINT_TORQUE)))
    assert "signal: is the same in all 20 postures, must change: turn joints that turn the hand about" in said


def test_too_few_postures_for_a_fitted_arm_are_refused(robot, rng):
    message = refuse(identify, robot, _hold_pair(robot, rng, 6), paired=False)
    assert "empty: q: has 6 postures, must have at least 12 for an arm to be fitted to them: hold the same" in message


def test_moments_are_not_seen_at_rest_and_no_motion_is_advised(robot, rng):
    belief = identify(robot, _hold_pair(robot, rng, 6), settings=_FAST)
    assert any(
        each.startswith("moments of inertia") and "an arm at rest cannot show them" in each for each in belief.unseen
    )
    assert any("one more posture" in note for note in belief.notes)
    assert not any("4 s more" in note for note in belief.notes)
    assert any("6 postures held at rest" in each for each in belief.assumptions)


def test_figures_of_postures_have_no_time(robot, rng, tmp_path):
    """The fit is drawn posture by posture, and no picture shows over which time errors agree."""
    belief = identify(robot, _hold_pair(robot, rng, 6), settings=_FAST)
    left, right = draw_fit(belief.fit).axes[-2:]
    assert (left.get_xlabel(), right.get_xlabel()) == ("posture", "posture")
    np.testing.assert_array_equal(left.lines[0].get_xdata(), np.arange(1, 7))
    assert {(line.get_linestyle(), line.get_marker()) for line in left.lines} == {("None", "o"), ("None", "x")}
    write_belief(tmp_path, belief, is_used=True)
    assert {path.stem for path in tmp_path.glob("*.png")} == {"fit", "posteriors"}


def test_a_direction_along_gravity_in_all_postures_is_named_and_a_posture_advised(robot, rng):
    """Postures that turn about the vertical alone show nothing of how high or low the centre of mass is."""
    q = np.tile([0.0, 0.3, -0.2, 0.4, 0.2, 0.1], (8, 1))
    q[:, 0] = np.linspace(-1.5, 1.5, 8)
    empty, loaded = generate_torques(robot, q, (0.0 * PAYLOAD, PAYLOAD), rng)
    kind = SignalKind.JOINT_TORQUE
    runs = Runs(hold(robot, q, loaded, kind), (hold(robot, q, empty, kind, "empty"),))
    belief = identify(robot, runs, settings=_FAST)
    vertical = robot.compute_motion(q, 0.0 * q, 0.0 * q).R_WT[0].T @ [0.0, 0.0, 1.0]
    direction = belief.hidden_direction
    assert direction is not None
    assert abs(direction @ vertical) > 0.97
    assert belief.setting is None or belief.setting.is_centre_guessed
    (advice,) = [note for note in belief.notes if "one more posture" in note]
    assert "turned by" in advice


def test_postures_without_a_counterpart_are_left_out(robot, rng):
    runs = _hold_pair(robot, rng, 8)
    few = Runs(runs.loaded, (runs.empty[0].select(slice(5)),))
    assert any("3 postures without a counterpart" in note for note in identify(robot, few, settings=_FAST).notes)
    fewer = Runs(runs.loaded, (runs.empty[0].select(slice(4)),))
    other = Runs(Run(**{**vars(runs.loaded), "q": runs.loaded.q + 0.1}), fewer.empty)
    assert "repeats 0 postures of empty within 0.02 rad, must repeat at least 4" in refuse(identify, robot, other)


def test_postures_and_a_motion_are_not_compared(robot, rng):
    runs = _hold_pair(robot, rng, 30)
    moving = RunDescription(robot.joint_names, SignalKind.JOINT_TORQUE)
    q = 0.1 * np.sin(np.arange(30)[:, None] * 0.2 + np.arange(6))
    empty = Run("moving", moving, 0.1 * np.arange(30), q, runs.empty[0].signal)
    assert "postures" in refuse(identify, robot, Runs(runs.loaded, (empty,)))


@pytest.mark.parametrize("paired", [True, False])
def test_an_arm_fitted_to_postures_serves_other_ones(robot, rng, paired):
    runs = _hold_pair(robot, rng, 40)
    belief = identify(robot, runs, paired=paired, settings=_FAST)
    assert belief.mass == pytest.approx(PAYLOAD[0], abs=4.0 * belief.mass_sd)
    assert belief.mass_sd < 0.2
