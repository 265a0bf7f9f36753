"""Contradictions by the arm's own weight: what is found of recordings that their description misdescribes."""

import re
from dataclasses import replace

import numpy as np
import pytest
from helpers.generated_runs import PAYLOAD, Truth, generate_run
from scipy.spatial.transform import Rotation

from affordance.extensions.payload.contradictions import describe_direction, find_contradictions
from affordance.extensions.payload.evidence.wrist_sensor import compute_force_regressors
from affordance.extensions.payload.identify import Runs, identify
from affordance.extensions.payload.recording.run import Run, RunDescription, resample
from affordance.extensions.payload.settings import DEFAULT_SETTINGS, IdentificationSettings, SignalKind
from studies.payload.at_rest import draw_postures, generate_slow_wrench, generate_torques, generate_wrench

_FAST = IdentificationSettings(num_samples=500)
_TRUTH = Truth(noise_sd=0.1, friction=(1.0, 0.5, 0.2), load_friction=0.03, file_error=0.1)
_SIDEWAYS = (0.0, -9.81, 0.0)


def _record(robot, payload=None, kind=SignalKind.JOINT_TORQUE, **more):
    return generate_run(robot, payload, truth=_TRUTH, rng=np.random.default_rng(3), kind=kind, **more)


def _describe(run, **changes):
    return replace(run, description=replace(run.description, **changes))


def _say(robot, run):
    return list(find_contradictions(robot, run, DEFAULT_SETTINGS))


@pytest.mark.parametrize("payload", [None, PAYLOAD])
@pytest.mark.parametrize("kind", [SignalKind.JOINT_TORQUE, SignalKind.CURRENT, SignalKind.WRENCH])
def test_nothing_is_found_of_a_run_as_described(robot, payload, kind):
    held = PAYLOAD if kind is SignalKind.WRENCH else payload
    assert _say(robot, _record(robot, held, kind)) == []


def test_the_sign_of_a_joint_and_of_all_is_found(robot):
    run = _record(robot)
    (said,) = _say(robot, replace(run, signal=run.signal * [1.0, -1.0, 1.0, 1.0, 1.0, 1.0]))
    assert said.startswith("joint_2 has the opposite sign")
    (said,) = _say(robot, replace(run, signal=-run.signal))
    assert said.startswith("all joints have the opposite sign, as is KUKA's convention")


@pytest.mark.parametrize("late", [0.06, -0.06])
def test_the_time_by_which_signals_are_late_is_found(robot, late):
    run = _record(robot)
    (said,) = _say(robot, replace(run, signal=resample(run.times - late, run.times, run.signal)))
    milliseconds, way = re.search(r"the signals are (\d+) ms (late|early)", said).groups()
    assert float(milliseconds) == pytest.approx(60.0, abs=11.0)
    assert way == ("late" if late > 0.0 else "early")


@pytest.mark.parametrize("kind", [SignalKind.JOINT_TORQUE, SignalKind.WRENCH])
def test_gravity_along_another_axis_is_found(robot, kind):
    held = PAYLOAD if kind is SignalKind.WRENCH else None
    run = _record(robot.with_gravity(_SIDEWAYS), held, kind)
    assert _say(robot, run)[0] == "gravity seems to be along -y of the base"
    assert _say(robot, _describe(run, gravity=_SIDEWAYS)) == []


def test_torques_without_the_arm_s_own_are_found_in_either_direction(robot):
    run = _record(robot)
    without = replace(
        run, signal=run.signal - robot.compute_arm_torques(run.q, run.v, np.gradient(run.v, run.times, axis=0))
    )
    assert "lack the arm's own weight" in _say(robot, replace(without, signal=0.1 * without.signal))[0]
    assert "contain the arm's own weight" in _say(robot, _describe(run, compensates_arm=True))[0]
    assert _say(robot, _describe(replace(without, signal=0.1 * without.signal), compensates_arm=True)) == []


@pytest.mark.parametrize("kind", [SignalKind.JOINT_TORQUE, SignalKind.MOTOR_TORQUE])
def test_torques_without_gravity_alone_or_without_all_of_the_arm_s_own_are_told_apart(robot, kind):
    """A controller that subtracts the torque at rest leaves friction and the inertia of the links in the signal."""
    truth = replace(_TRUTH, file_error=0.0)
    run = generate_run(robot, None, truth=truth, rng=np.random.default_rng(3), kind=kind)
    v, rest = run.v, np.zeros_like(run.v)
    for motion, key in (((rest, rest), "gravity"), ((v, np.gradient(v, run.times, axis=0)), "arm")):
        without = replace(run, signal=run.signal - 0.95 * robot.compute_arm_torques(run.q, *motion))
        (said,) = _say(robot, without)
        assert said.startswith("the signals lack the arm's own weight")
        assert said.endswith(f"(compensates: {key})")
        described = {"compensates_arm": True, "leaves_inertia": key == "gravity"}
        assert _say(robot, _describe(without, **described)) == []


def _hold(robot, signal, q, kind=SignalKind.WRENCH):
    return Run("held", RunDescription(robot.joint_names, kind, postures=True), 0.5 * np.arange(len(q)), q, signal)


def test_a_wrist_sensor_s_sign_and_mounting_are_found_in_held_postures(robot, rng):
    q = draw_postures(20, 6, rng)
    wrench = generate_wrench(robot, q, PAYLOAD, rng)
    assert _say(robot, _hold(robot, wrench, q)) == []
    assert "opposite sign: 'force_on'" in _say(robot, _hold(robot, -wrench, q))[0]
    R = Rotation.from_euler("z", 90.0, degrees=True).as_matrix()
    turned = np.hstack([wrench[:, :3] @ R, wrench[:, 3:] @ R])
    assert _say(robot, _hold(robot, turned, q)) == ["the sensor seems to be turned by 90 deg about +z of the tip"]


def test_the_sign_of_a_joint_is_found_in_held_postures(robot, rng):
    q = draw_postures(20, 6, rng)
    (signal,) = generate_torques(robot, q, (0.0 * PAYLOAD,), rng)
    assert _say(robot, _hold(robot, signal, q, SignalKind.JOINT_TORQUE)) == []
    turned = signal * [1.0, 1.0, -1.0, 1.0, 1.0, 1.0]
    assert _say(robot, _hold(robot, turned, q, SignalKind.JOINT_TORQUE))[0].startswith(
        "joint_3 has the opposite sign"
    )


def test_contradictions_are_doubts(robot):
    signs = np.array([1.0, -1.0, 1.0, 1.0, 1.0, 1.0])
    runs = [_record(robot, pi, duration=12.0) for pi in (PAYLOAD, None)]
    loaded, empty = (replace(run, signal=run.signal * signs) for run in runs)
    assert identify(robot, Runs(loaded, (empty,)), settings=_FAST).doubts[0] == (
        "generated: joint_2 has the opposite sign: the signal falls where the arm's own weight pulls more"
    )


@pytest.mark.parametrize(
    ("direction", "name"),
    [([0.0, -1.0, 0.0], "-y"), ([0.01, 0.0, 1.0], "+z"), ([0.6, 0.0, 0.8], "(0.60, 0.00, 0.80)")],
)
def test_directions_are_named(direction, name):
    assert describe_direction(np.array(direction)) == name


def test_forces_a_second_late_and_a_wrench_along_the_axes_of_the_base_are_named(robot, rng):
    runs = [generate_slow_wrench(PAYLOAD, rng, late) for late in (0.0, 1.0)]
    assert find_contradictions(*runs[0], DEFAULT_SETTINGS) == ()
    (sentence,) = find_contradictions(*runs[1], DEFAULT_SETTINGS)
    (late,) = re.findall(r"the forces are about (\S+) s late", sentence)
    assert float(late) == pytest.approx(1.0, abs=0.1)
    run = generate_run(robot, PAYLOAD, truth=Truth(), rng=rng, kind=SignalKind.WRENCH, speed=0.2)
    assert find_contradictions(robot, run, DEFAULT_SETTINGS) == ()
    of_axes = [compute_force_regressors(robot.with_gravity(axis), run.q)[:, :3, 0] for axis in np.eye(3)]
    in_base = np.einsum("nib,nci->ncb", np.stack(of_axes, axis=2), run.signal.reshape(-1, 2, 3)).reshape(-1, 6)
    (sentence,) = find_contradictions(robot, replace(run, signal=in_base), DEFAULT_SETTINGS)
    assert sentence.endswith("along the base's axes (wrench_axes: base)")


def test_a_wrench_along_the_axes_of_the_base_is_turned_if_its_description_says_so(robot, rng):
    """Of held postures and a motion the mass and the centre are then right; without the key they are doubted."""
    q = draw_postures(30, 6, rng)
    held = _hold(robot, generate_wrench(robot, q, PAYLOAD, rng), q)
    moved = generate_run(robot, PAYLOAD, truth=Truth(), rng=rng, kind=SignalKind.WRENCH)
    for run in (held, moved):
        R = robot.compute_motion(run.q, 0.0 * run.q, 0.0 * run.q).R_WT
        in_base = replace(run, signal=np.einsum("nij,nkj->nki", R, run.signal.reshape(-1, 2, 3)).reshape(-1, 6))
        found = identify(robot, Runs(_describe(in_base, wrench_in_base=True)), settings=_FAST)
        assert found.doubts == ()
        np.testing.assert_allclose(found.parameters[:4], PAYLOAD[:4], atol=4.0 * found.mass_sd)
        assert any("(wrench_axes: base)" in each for each in identify(robot, Runs(in_base), settings=_FAST).doubts)
