"""Checks of a fit: errors against earlier ones, halves of a run, wrist sensors, one recording in other forms."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.generated_runs import PAYLOAD, record, rename
from helpers.refusals import refuse

from affordance.exceptions import BadValueError
from affordance.extensions.payload.identify import Runs, identify
from affordance.extensions.payload.settings import IdentificationSettings, SignalKind

_SETTINGS = IdentificationSettings(num_samples=200)
_GRIPPER = 0.7 * PAYLOAD


@pytest.fixture(scope="module")
def wrenches(robot):
    rng = np.random.default_rng(1)
    empty = record(robot, rng, _GRIPPER, SignalKind.WRENCH, source="e")
    return record(robot, rng, _GRIPPER + PAYLOAD, SignalKind.WRENCH, motion_seed=1, source="l"), empty


@pytest.fixture(scope="module")
def torques(robot):
    rng = np.random.default_rng(1)
    kind = SignalKind.JOINT_TORQUE
    return record(robot, rng, PAYLOAD, kind, source="l"), record(robot, rng, None, kind, source="e")


@pytest.fixture(scope="module")
def currents(robot):
    """Gains of a weighed load, and another load."""
    rng = np.random.default_rng(1)
    empty = record(robot, rng, None, SignalKind.CURRENT, source="e")
    weighed = record(robot, rng, 2.0 * PAYLOAD, SignalKind.CURRENT, source="w")
    gains = identify(robot, Runs(weighed, (empty,)), reference_mass=2.0 * PAYLOAD[0], settings=_SETTINGS).calibration
    return gains, record(robot, rng, PAYLOAD, SignalKind.CURRENT, source="l"), empty


def _of_signal(run, change):
    return replace(run, signal=change(run.signal.copy()))


def _turn(run):
    R = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    return _of_signal(run, lambda signal: np.hstack([signal[:, :3] @ R.T, signal[:, 3:] @ R.T]))


# Mistakes in both runs of a wrist sensor, or in the loaded one, and a word of the first reason.
_BOTH = {
    "signs": (lambda run: _of_signal(run, np.negative), "the forces have the opposite sign"),
    "gravity upwards": (lambda run: rename(run, gravity=(0.0, 0.0, 9.81)), "the forces have the opposite sign"),
    "gravity along x": (
        lambda run: rename(run, gravity=(9.81, 0.0, 0.0)),
        "gravity seems to be along -z",
    ),
    "forces for moments": (lambda run: _of_signal(run, lambda s: s[:, [3, 4, 5, 0, 1, 2]]), "left unexplained"),
    "rows of others": (lambda run: _of_signal(run, lambda s: np.roll(s, 350, axis=0)), "left unexplained"),
    "joints reversed": (lambda run: replace(run, q=run.q[:, ::-1], v=run.v[:, ::-1]), "left unexplained"),
    "sensor turned": (_turn, "the sensor seems to be turned by 9"),
}


def test_wrist_sensor_is_trusted_and_finds_the_load(robot, wrenches):
    loaded, empty = wrenches
    belief = identify(robot, Runs(loaded, (empty,)), settings=_SETTINGS)
    assert belief.is_trusted
    assert abs(belief.mass - PAYLOAD[0]) < 3.0 * belief.mass_sd
    assert any("the sensor's unit and mounting" in sentence for sentence in belief.assumptions)


@pytest.mark.parametrize("mistake", _BOTH)
def test_mistakes_with_a_wrist_sensor_are_doubted(robot, wrenches, mistake):
    make, word = _BOTH[mistake]
    loaded, empty = map(make, wrenches)
    doubts = identify(robot, Runs(loaded, (empty,)), settings=_SETTINGS).doubts
    assert word in doubts[0]


def test_loads_lost_weighed_otherwise_or_of_exchanged_runs_are_doubted_at_the_wrist(robot, wrenches):
    loaded, empty = wrenches
    without = record(robot, np.random.default_rng(2), _GRIPPER, SignalKind.WRENCH, motion_seed=1, source="e")
    late = np.arange(len(loaded.times)) >= len(loaded.times) // 2
    lost = replace(loaded, signal=np.where(late[:, None], without.signal, loaded.signal))
    for runs, mass, word in (
        (Runs(lost, (empty,)), None, "its first half shows"),
        (Runs(empty, (loaded,)), None, "errors are"),
        (Runs(loaded, (empty,)), 5.0, "5 kg was weighed"),
    ):
        doubts = identify(robot, runs, reference_mass=mass, settings=_SETTINGS).doubts
        assert any(word in doubt for doubt in doubts)


def test_a_dead_channel_of_a_wrist_sensor_is_refused(robot, wrenches):
    loaded, empty = (_of_signal(run, lambda signal: signal * [1, 1, 0, 1, 1, 1]) for run in wrenches)
    with pytest.raises(BadValueError, match="signal of fz: is 0 throughout, must change while the joint moves"):
        identify(robot, Runs(loaded, (empty,)), settings=_SETTINGS)


_ONE_RECORDING = {
    "copied": lambda run: run,
    "trimmed": lambda run: run.select(slice(50, None)),
    "thinned": lambda run: run.select(slice(None, None, 2)),
    "rounded": lambda run: replace(run, q=np.round(run.q, 5), signal=np.round(run.signal, 4)),
}


@pytest.mark.parametrize("form", _ONE_RECORDING)
@pytest.mark.parametrize("kind", ["torques", "wrenches"])
def test_one_recording_in_another_form_is_refused(robot, request, kind, form):
    loaded, _ = request.getfixturevalue(kind)
    copy = replace(_ONE_RECORDING[form](loaded), source="copy")
    for runs in (Runs(loaded, (copy,)), Runs(replace(copy, source="l"), (replace(loaded, source="copy"),))):
        said = refuse(identify, robot, runs, settings=_SETTINGS)
        assert f"{100 * (form == 'copied') or ''} % of the samples of l, must be another recording" in said


def test_a_load_that_changes_half_way_is_doubted(robot, torques):
    loaded, empty = torques
    late = np.arange(len(loaded.times)) >= len(loaded.times) // 2
    for share, is_doubted in ((0.0, False), (0.4, True)):
        kept = np.where(late[:, None], (1.0 - share) * loaded.signal + share * empty.signal, loaded.signal)
        doubts = identify(robot, Runs(replace(loaded, signal=kept), (empty,)), settings=_SETTINGS).doubts
        assert any(doubt.startswith("l: its first half shows") for doubt in doubts) == is_doubted


def _silence(run, seed):
    signal = run.signal.copy()
    signal[:, 5] = 1e-3 * np.random.default_rng(seed).standard_normal(len(signal))
    return replace(run, signal=signal)


def _flip(signal):
    signal[:, 3] *= -1.0
    return signal


def test_errors_are_compared_with_those_of_the_calibration(robot, currents):
    gains, loaded, empty = currents
    good = identify(robot, Runs(loaded, (empty,)), gains=gains, settings=_SETTINGS)
    assert good.is_trusted
    turned = loaded.q + np.array([0.0, 0.0, 0.0, 0.5 * np.pi, 0.0, 0.0])
    for wrong in (
        Runs(replace(loaded, q=turned), (replace(empty, q=turned),)),
        Runs(_silence(loaded, 0), (_silence(empty, 1),)),
        Runs(_of_signal(loaded, _flip), (empty,)),
    ):
        doubts = identify(robot, wrong, gains=gains, settings=_SETTINGS).doubts
        assert any("times those of the earlier runs" in doubt for doubt in doubts)


def test_gains_unlike_those_of_other_joints_are_doubted_by_calibration(robot, currents):
    _, _, empty = currents
    weighed = record(robot, np.random.default_rng(1), 2.0 * PAYLOAD, SignalKind.CURRENT, source="w")

    def weaken(signal):
        signal[:, 2] *= 0.1
        return signal

    runs = Runs(_of_signal(weighed, weaken), (_of_signal(empty, weaken),))
    doubts = identify(robot, runs, reference_mass=2.0 * PAYLOAD[0], settings=_SETTINGS).doubts
    assert any("joint_3: the gain is 0.01" in doubt and "the median 0.1" in doubt for doubt in doubts)


def test_currents_called_torques_are_doubted_without_an_empty_run(robot, currents):
    _, loaded, _ = currents
    assert not identify(robot, Runs(record(robot, np.random.default_rng(3), PAYLOAD, SignalKind.MOTOR_TORQUE))).doubts
    doubts = identify(robot, Runs(rename(loaded, kind=SignalKind.MOTOR_TORQUE)), settings=_SETTINGS).doubts
    assert any("the arm's own weight implies a gain" in doubt for doubt in doubts)


def test_a_small_lag_of_currents_leaves_the_load_of_a_pair_as_it_is(robot, currents):
    """Without known gains the error of friction is one of gains: as a payload it would draw the load to zero."""
    _, loaded, empty = currents
    late = replace(
        empty, signal=np.column_stack([np.interp(empty.times - 0.03, empty.times, x) for x in empty.signal.T])
    )
    mass = [identify(robot, Runs(loaded, (run,)), settings=_SETTINGS).mass for run in (empty, late)]
    assert abs(np.log(mass[1] / mass[0])) < 0.3
    assert abs(np.log(mass[0] / PAYLOAD[0])) < 0.5
