from dataclasses import replace

import numpy as np
import pytest
from helpers.generated_runs import PAYLOAD, Truth, generate_run, record, rename
from helpers.refusals import refuse

from affordance import MODELS, load_robot, read_run
from affordance.exceptions import BadValueError
from affordance.extensions.payload.doubts import compare_with_own_weight
from affordance.extensions.payload.evidence.gains import read_gains, write_gains
from affordance.extensions.payload.identify import Runs, identify
from affordance.extensions.payload.posterior.calibration import estimate_gains
from affordance.extensions.payload.recording.preparation import prepare
from affordance.extensions.payload.settings import DEFAULT_SETTINGS, IdentificationSettings, SignalKind

_SETTINGS = IdentificationSettings(num_samples=200)


@pytest.fixture(scope="module")
def pair(robot):
    rng = np.random.default_rng(8)
    return Runs(record(robot, rng, 2.0 * PAYLOAD, source="l"), (record(robot, rng, None, source="e"),))


def test_gain_by_the_own_weight_is_the_true_one_within_its_error(robot, pair):
    own = compare_with_own_weight(robot, pair.empty[0], DEFAULT_SETTINGS)
    assert own.judged.sum() >= 2
    assert (np.abs(own.gain - 0.1) < 4.0 * own.error * 0.1)[own.judged].all()
    assert (own.explained > 0.95)[own.judged].all()


def test_gains_remember_their_robot(robot, pair, tmp_path):
    found = identify(robot, pair, reference_mass=2.0 * PAYLOAD[0], settings=_SETTINGS)
    assert found.is_trusted
    write_gains(tmp_path / "gains.yaml", found.calibration)
    gains = read_gains(tmp_path / "gains.yaml")
    assert gains.robot == robot.fingerprint
    assert identify(robot, pair, gains=gains, settings=_SETTINGS).is_trusted
    # Another mounting is the same robot, a link that is a gram heavier another.
    assert robot.with_gravity((0.0, 9.81, 0.0)).fingerprint == robot.fingerprint
    heavier = replace(robot, link_parameters=robot.link_parameters + 1e-3 * np.eye(6, 10))
    doubts = identify(heavier, pair, gains=gains, settings=_SETTINGS).doubts
    assert len(doubts) == 1
    assert "with the file of another robot" in doubts[0]


_ROTORS = Truth(gain=0.1, friction=(1.0, 0.5, 0.2), noise_sd=0.1, rotor_inertia=3.0)


def _record_rotors(robot, rng, speed, truth=_ROTORS, kind=SignalKind.CURRENT):
    """A pair with 2.4 kg on an arm whose rotors are as inert as its links, as in geared arms."""
    loaded, empty = (
        generate_run(robot, payload, truth=truth, rng=rng, kind=kind, rate=50.0, speed=speed)
        for payload in (2.0 * PAYLOAD, None)
    )
    return Runs(loaded, (empty,))


def test_the_inertia_of_rotors_is_no_reason_for_doubt(robot):
    """A fast pair is trusted with the gains of a slow one and with its own, though no robot's file has rotors."""
    rng = np.random.default_rng(3)
    slow, fast = (_record_rotors(robot, rng, speed) for speed in (1.0, 3.0))
    mass = 2.0 * PAYLOAD[0]
    gains = identify(robot, slow, reference_mass=mass, settings=_SETTINGS).calibration
    assert compare_with_own_weight(robot, fast.empty[0], DEFAULT_SETTINGS).judged[0]
    for belief in (
        identify(robot, fast, gains=gains, settings=_SETTINGS),
        identify(robot, fast, reference_mass=mass, settings=_SETTINGS),
    ):
        assert belief.doubts == ()
        assert abs(belief.mass - mass) < 0.02 * mass


@pytest.mark.parametrize("kind", [SignalKind.CURRENT, SignalKind.MOTOR_TORQUE])
def test_the_inertia_of_rotors_is_not_mistaken_for_load_or_gain(robot, kind):
    """Without an empty run the interval holds the load; gains by the own weight are right within their errors."""
    truth = _ROTORS if kind is SignalKind.CURRENT else replace(_ROTORS, gain=1.0)
    loaded, (empty,) = _record_rotors(robot, np.random.default_rng(3), 3.0, truth, kind)
    belief = identify(robot, Runs(loaded), settings=_SETTINGS)
    assert belief.doubts == ()
    low, high = belief.mass_interval90
    assert low < 2.0 * PAYLOAD[0] < high
    if kind is SignalKind.CURRENT:
        own = estimate_gains(robot, empty, prepare(empty, DEFAULT_SETTINGS), DEFAULT_SETTINGS)
        sure = np.sqrt(own.covariance[:, 0, 0]) < 0.3 * own.mean[:, 0]
        assert sure.sum() >= 3
        assert (np.abs(own.mean[sure, 0] - 0.1) < 0.01).all()


@pytest.mark.parametrize("analysis", ["no empty run", "unpaired", "paired", "gains"])
def test_gains_by_the_own_weight_of_a_short_run_are_doubted(robot, analysis):
    """Gains by the arm's own weight are doubted after 14 s and not after 16 s; paired or given gains never are."""
    rng = np.random.default_rng(8)
    doubts = {}
    for duration in (14.0, 16.0):
        loaded = record(robot, rng, 2.0 * PAYLOAD, source="l", duration=duration)
        empty = record(robot, rng, None, source="e", duration=duration)
        gains = None
        if analysis == "gains":
            weighed = Runs(loaded, (empty,))
            gains = identify(robot, weighed, reference_mass=2.0 * PAYLOAD[0], settings=_SETTINGS).calibration
        runs = Runs(loaded) if analysis == "no empty run" else Runs(loaded, (empty,))
        belief = identify(robot, runs, paired=analysis == "paired", gains=gains, settings=_SETTINGS)
        doubts[duration] = [doubt for doubt in belief.doubts if "too short to determine the gains" in doubt]
    assert not doubts[16.0]
    assert len(doubts[14.0]) == int(analysis in ("no empty run", "unpaired"))
    if doubts[14.0]:
        assert doubts[14.0][0].startswith(f"{'l' if analysis == 'no empty run' else 'e'}: 14.0 s")


def test_angles_beyond_the_limits_of_joints_are_refused(robot, pair):
    narrow = replace(robot, limits=np.array([[-0.2] * 6, [0.2] * 6]))
    with pytest.raises(BadValueError, match=r"must be from -0.2 to 0.2 rad according to .*; are these degrees"):
        identify(narrow, pair, settings=_SETTINGS)
    assert (robot.limits == np.array([[-6.0] * 6, [6.0] * 6])).all()
    turned = pair._replace(
        loaded=replace(pair.loaded, q=pair.loaded.q + np.array([0.0, 2.0 * np.pi, 0.0, 0.0, 0.0, 0.0]))
    )
    with pytest.raises(BadValueError, match=r"q of joint_2: is .* according to .*robot.urdf; is it off by a turn"):
        identify(robot, turned, settings=_SETTINGS)


def test_a_sensor_that_sticks_is_named_with_its_time(robot):
    rng = np.random.default_rng(8)
    loaded, empty = (record(robot, rng, pi, SignalKind.JOINT_TORQUE, source="run") for pi in (PAYLOAD, None))
    signal = loaded.signal.copy()
    signal[400:600, 1] = signal[400, 1]
    doubts = identify(robot, Runs(replace(loaded, signal=signal), (empty,)), settings=_SETTINGS).doubts
    assert any(
        "run, joint_2: from 8.0 s on, the signal stays at" in doubt and " for 4.0 s " in doubt for doubt in doubts
    )


def test_errors_of_joints_that_move_little_are_no_reason_for_doubt_until_they_are_large(robot):
    """Errors of 3 % of a usual signal raise no doubt and 9 % do; joints 1 and 2 show a seventh of that signal."""
    q = np.random.default_rng(0).uniform(-np.pi, np.pi, (50, 6))
    strength = np.sqrt((robot.compute_arm_torques(q, 0.0 * q, 0.0 * q) ** 2).mean(axis=0)).max()
    for share, is_doubted in ((0.03, False), (0.09, True)):
        rng, truth = np.random.default_rng(0), Truth(noise_sd=share * strength)
        loaded, empty = (
            generate_run(robot, pi, truth=truth, rng=rng, kind=SignalKind.JOINT_TORQUE, rate=50.0, source=source)
            for pi, source in ((2.0 * PAYLOAD, "loaded"), (None, "empty"))
        )
        doubts = identify(robot, Runs(loaded, (empty,)), settings=_SETTINGS).doubts
        assert any("% of a typical signal of the arm unexplained" in doubt for doubt in doubts) == is_doubted
        assert is_doubted or not doubts


# Runs of a joint sensor or one at the wrist, by the way in which the empty arm is treated, and what counts there.
_COUNTS = {
    (SignalKind.JOINT_TORQUE, "paired"): {"gains", "friction", "floor", "correlated_noise"},
    (SignalKind.JOINT_TORQUE, "no empty run"): {"gains", "friction", "floor", "correlated_noise"},
    (SignalKind.MOTOR_TORQUE, "unpaired"): {"gains", "load_friction", "friction", "floor", "correlated_noise"},
    (SignalKind.CURRENT, "paired"): {"gains", "load_friction", "friction", "floor", "correlated_noise"},
    (SignalKind.CURRENT, "no empty run"): {"load_friction", "friction", "floor", "correlated_noise"},
    (SignalKind.CURRENT, "weighed"): {"gains", "load_friction", "friction", "floor", "correlated_noise"},
    (SignalKind.WRENCH, "paired"): {"gains", "friction", "tare", "floor", "correlated_noise"},
    (SignalKind.WRENCH, "no empty run"): {"gains", "friction", "correlated_noise"},
}


@pytest.fixture(scope="module")
def weighed(robot):
    """A pair of currents with a weighed load, the gains that it gives, and a second loaded run."""
    rng, kind = np.random.default_rng(3), SignalKind.CURRENT
    empty = record(robot, rng, None, kind, source="e", duration=20.0)
    first, second = (record(robot, rng, 2.0 * PAYLOAD, kind, source=name, duration=20.0) for name in "lm")
    gains = identify(robot, Runs(first, (empty,)), reference_mass=2.0 * PAYLOAD[0], settings=_SETTINGS).calibration
    return gains, empty, second


@pytest.mark.parametrize(("factor", "is_seen"), [(1.0, False), (1.25, True)])
def test_another_controller_is_seen_by_the_weight_of_the_arm(robot, weighed, factor, is_seen):
    gains, *runs = weighed
    assert np.isfinite(gains.own_weight).all(axis=1).any()
    empty, loaded = (replace(run, signal=factor * run.signal) for run in runs)
    doubts = identify(robot, Runs(loaded, (empty,)), gains=gains, settings=_SETTINGS).doubts
    assert any("since the gains were found; usual changes stay within " in doubt for doubt in doubts) == is_seen


@pytest.mark.parametrize(("joints", "name"), [((), ""), (range(6), "all joints"), ((1,), "joint_2")])
def test_gains_that_differ_between_both_runs_are_doubted(robot, weighed, joints, name):
    """Signals of all joints, or of one, that are 5 % too large in the loaded run alone are found and named."""
    gains, empty, loaded = weighed
    factors = np.ones(6)
    factors[list(joints)] = 1.05
    doubts = identify(
        robot, Runs(replace(loaded, signal=factors * loaded.signal), (empty,)), gains=gains, settings=_SETTINGS
    ).doubts
    found = [doubt for doubt in doubts if "since the empty run; usual changes stay within" in doubt]
    assert [doubt.split(":")[0] for doubt in found] == [name] * bool(joints)


@pytest.mark.parametrize("kept", [0.0, 0.3])
def test_commanded_currents_are_seen(robot, weighed, kept):
    """Commanded currents follow from the arm's model; at most the first joint has a part of its sensor noise."""
    gains, *runs = weighed
    commanded = []
    for run in runs:
        motion = run.q, run.v, np.gradient(run.v, run.times, axis=0)
        rng = np.random.default_rng(len(commanded))
        signal = gains.mean[:, 0] * robot.compute_arm_torques(*motion) + 1e-3 * rng.uniform(
            -0.5, 0.5, run.signal.shape
        )
        signal[:, 0] += kept * (np.sqrt(run.rate * gains.least_variance[0]) * rng.standard_normal(len(signal)))
        commanded.append(replace(run, signal=signal))
    doubts = identify(robot, Runs(commanded[1], (commanded[0],)), gains=gains, settings=_SETTINGS).doubts
    assert any("are these commanded values instead of measured ones?" in doubt for doubt in doubts)


def test_velocities_that_are_late_are_named(robot, weighed):
    gains, empty, loaded = weighed
    late = [np.interp(loaded.times - 0.04, loaded.times, v) for v in loaded.v.T]
    loaded = replace(loaded, v=np.column_stack(late))
    doubts = identify(robot, Runs(loaded, (empty,)), gains=gains, settings=_SETTINGS).doubts
    assert any("velocities are 40 ms late" in doubt for doubt in doubts)


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


def test_exchanged_runs_are_doubted_though_a_body_behind_the_hand_would_explain_them():
    """In the demonstration's motion the residual is the same, because the arm hardly changes its posture."""
    robot = load_robot(MODELS / "arm.dmd.yaml", "hand_grip")
    empty, loaded = (read_run(MODELS / "demo" / f"{name}.csv") for name in ("empty", "bar_of_oak"))
    (doubt,) = identify(robot, Runs(empty, (loaded,)), settings=_SETTINGS).doubts
    assert "the load has a negative mass (-0.56" in doubt


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
