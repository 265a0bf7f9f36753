"""Live identification on streams with known loads: what it says, how soon, and that it is ``identify``'s answer."""

import dataclasses

import numpy as np
import pytest
from helpers.generated_runs import PAYLOAD
from helpers.live_streams import compute_signal, follow, list_kinds, list_rows, record_empty, record_loads
from helpers.refusals import refuse

from affordance import BadArgumentError, LiveIdentifier, Runs, identify
from affordance.extensions.payload.payload_setting import PayloadSetting
from affordance.extensions.payload.recording.run import resample
from affordance.extensions.payload.settings import DEFAULT_SETTINGS

MASS = PAYLOAD[0]
NAMES = ("taken up", "put down", "exchanged", "disturbed")


@pytest.fixture(scope="module")
def empty(robot):
    return record_empty(robot, np.random.default_rng(1))


@pytest.fixture
def live(robot, empty):
    return LiveIdentifier(robot, empty)


@pytest.fixture(scope="module")
def pickup(robot):
    return record_loads(robot, np.random.default_rng(2), [(7.0, None), (11.0, PAYLOAD), (7.0, None)])


@pytest.fixture(scope="module")
def events(robot, empty, pickup):
    return follow(LiveIdentifier(robot, empty), list_rows(pickup))


def list_beliefs(events, start, end):
    """Beliefs from rows between two times."""
    beliefs = [each.content for each in events if each.kind == "belief"]
    return [each for each in beliefs if each["of"] - each["seconds"] > start and each["of"] < end]


def holds(content, mass=MASS):
    low, high = content["mass_interval90"]
    return low <= mass <= high


def test_a_load_is_noticed_dated_named_and_known(events):
    assert list_kinds(events) == ["changed", "taken up", "final", "changed", "put down"]
    changed, taken, final, again, put = (each for each in events if each.kind != "belief")
    assert 7.0 < changed.time < 9.5
    assert 18.0 < again.time < 20.5
    assert taken.content["since"] == pytest.approx(7.0, abs=0.6)
    assert put.content["since"] == pytest.approx(18.0, abs=0.6)
    of_load = list_beliefs(events, 6.9, 18.0)
    assert len(of_load) >= 6
    assert all(holds(each) for each in [*of_load, final.content])
    before = [each for each in list_beliefs(events, -1.0, 7.0) if each["of"] < 7.0]
    assert len(before) >= 3
    assert {each["holds"] for each in before} == {"little or nothing"}


def test_the_final_answer_is_that_of_identify_on_its_rows(robot, empty, pickup, events):
    final = next(each for each in events if each.kind == "final")
    rows = slice(*np.searchsorted(pickup.times, [final.content["from"], final.content["to"]], side="left"))
    rows = slice(rows.start, rows.stop + 1)
    assert np.array_equal(final.run.signal, pickup.signal[rows])
    settings = dataclasses.replace(DEFAULT_SETTINGS, cutoff=final.content["cutoff_hz"])
    again = identify(robot, Runs(pickup.select(rows), tuple(empty)), paired=False, settings=settings)
    assert final.content["mass_kg"] == again.mass
    assert final.content["mass_interval90"] == list(again.mass_interval90)
    assert final.belief.doubts == again.doubts == ()


def test_another_load_is_an_exchange(robot, live):
    stream = record_loads(robot, np.random.default_rng(3), [(8.0, PAYLOAD), (8.0, 2.0 * PAYLOAD)])
    events = follow(live, list_rows(stream))
    assert [each for each in list_kinds(events) if each in NAMES] == ["exchanged"]
    assert holds(list_beliefs(events, 7.9, 16.0)[-1], 2.0 * MASS)


@pytest.mark.parametrize("jitter", [0.0, 0.005], ids=["exact stamps", "jitter and no velocities"])
@pytest.mark.parametrize("load", [None, PAYLOAD], ids=["nothing", "a load"])
def test_a_constant_load_never_changes(robot, live, load, jitter):
    live._believe = lambda: iter(())  # beliefs take long and do not matter here
    rng = np.random.default_rng(4)
    stream = record_loads(robot, rng, [(60.0, load)], motion_seed=5)
    rows = [(t + jitter * abs(rng.normal()), *rest) for t, *rest in list_rows(stream, has_v=not jitter)]
    assert list_kinds(follow(live, rows)) == []


@pytest.mark.parametrize("harm", ["no velocities", "lost", "jitter", "all"])
def test_streams_that_arrive_badly_show_the_same_load(robot, live, harm):
    rng = np.random.default_rng(5)
    stream = record_loads(robot, rng, [(6.0, None), (9.0, PAYLOAD)])
    rows = list_rows(stream, has_v=harm not in ("no velocities", "all"))
    if harm in ("lost", "all"):
        rows = [row for row in rows if rng.random() > 0.05]
    if harm in ("jitter", "all"):
        rows = [(t + 0.005 * abs(rng.normal()), *rest) for t, *rest in rows]
    events = follow(live, rows)
    assert [each for each in list_kinds(events) if each in NAMES] == ["taken up"]
    assert holds(list_beliefs(events, 5.9, 15.0)[-1])
    assert live.num_late < 0.02 * len(rows)


def test_samples_that_overtake_each_other_count_as_if_in_order(robot, empty, pickup):
    rows = list_rows(pickup)[:600]
    swapped = [rows[i ^ 1] if 300 <= i < 500 else rows[i] for i in range(len(rows))]
    lives = [LiveIdentifier(robot, empty) for _ in range(2)]
    in_order, overtaken = (follow(live, each) for live, each in zip(lives, (rows, swapped), strict=True))
    masses = [[each.content["mass_kg"] for each in events] for events in (in_order, overtaken)]
    assert len(masses[0]) >= 2
    assert masses[0] == pytest.approx(masses[1], abs=2e-3)  # [kg]
    assert lives[1].num_late == 0


def test_arrays_that_the_caller_uses_again_are_copied(live, pickup):
    q, v, signal = np.zeros(6), np.zeros(6), np.zeros(6)
    for i in range(70):
        q[:], v[:], signal[:] = pickup.q[i], pickup.v[i], pickup.signal[i]
        live.add(float(pickup.times[i]), q, v, signal)
    assert np.array_equal([row for row, _, _ in live._raw], pickup.q[:70])


def test_a_gap_begins_anew_and_a_double_sample_does_not_count(live, pickup):
    rows = list_rows(pickup)
    events = follow(live, [*rows[:300], rows[299], *rows[340:700]])
    assert list_kinds(events) == ["gap"]
    gap = next(each for each in events if each.kind == "gap")
    assert gap.content["seconds"] == pytest.approx(0.41, abs=1e-6)
    assert live.num_late == 1
    assert all(each["of"] - each["seconds"] > rows[340][0] for each in list_beliefs(events, 3.3, 9.0))


def test_what_changed_in_a_gap_is_named_after_it_and_what_did_not_is_not(robot, empty, pickup):
    rows = list_rows(pickup)
    for resumed, names in ((800, ["taken up"]), (250, [])):
        events = follow(LiveIdentifier(robot, empty), [*rows[:200], *rows[resumed : resumed + 450]])
        assert [each for each in list_kinds(events) if each in NAMES] == names


def test_a_stream_that_lags_loses_beliefs_and_no_sample(live, pickup):
    rows = list_rows(pickup)[:600]
    assert [each.kind for each in follow(live, rows, behind=1.0)] == []
    assert (live.num_samples, live.num_late) == (600, 0)
    assert live.num_skipped >= 2


def test_at_rest_it_waits(live, pickup):
    times = pickup.times[:1400]
    rate = np.clip(0.25 * (10.0 - times), 0.0, 1.0)  # slower and slower, at rest from 10 s on
    phase = np.cumsum(rate) * 0.01
    q = resample(phase, pickup.times, pickup.q)
    v = rate[:, None] * resample(phase, pickup.times, pickup.v)
    events = follow(
        live, zip(times, q, v, compute_signal(live.robot, q, v, np.gradient(v, 0.01, axis=0)), strict=True)
    )
    assert list_kinds(events) == ["at rest"]
    assert all(each.time < 13.0 for each in events)


def test_another_unit_and_bursts_are_doubted(robot, empty):
    stream = record_loads(robot, np.random.default_rng(6), [(9.0, None)])
    live = LiveIdentifier(robot, empty)
    live._believe = lambda: iter(())  # it would take long
    follow(live, [(t, q, v, 0.1 * signal) for t, q, v, signal in list_rows(stream)])
    units = [each.content["why"] for each in live._check()]
    assert any(each.startswith("joint_2: ") and "another unit" in each for each in units)
    live = LiveIdentifier(robot, empty)
    live._believe = lambda: iter(())
    follow(live, [(0.15 * (i // 15) + 1e-4 * (i % 15), *row[1:]) for i, row in enumerate(list_rows(stream))])
    doubts = [each.content["why"] for each in live._check()]
    assert any("bursts" in each for each in doubts) or any("jumps" in each for each in doubts)


def test_what_is_set_on_the_controller_is_said_once(robot, empty, live):
    setting = PayloadSetting(0.5, np.array([0.0, 0.0, 0.05]))
    (event,) = live.set_payload(setting)
    assert event.content["changes_signal"] is False
    assert live.set_payload(setting) == []
    described = dataclasses.replace(empty[0].description, compensates_arm=True)
    compensated = [dataclasses.replace(run, description=described) for run in empty]
    (event,) = LiveIdentifier(robot, compensated).set_payload(setting)
    assert event.content["changes_signal"] is True
    assert "subtracts" in event.content["why"]


@pytest.mark.parametrize(
    ("row", "words"),
    [
        ((0.0, np.full(6, np.nan), None, np.zeros(6)), "q of joint_1: is not a finite number"),
        ((0.0, np.zeros(6), None, np.array([0, 0, np.inf, 0, 0, 0])), "signal of joint_3"),
        ((np.nan, np.zeros(6), None, np.zeros(6)), "q of its time"),
    ],
)
def test_numbers_that_are_none_are_lost_samples_until_there_are_no_others(live, row, words):
    for _ in range(99):
        assert live.add(*row) == []
    assert words in refuse(live.add, *row)
    assert (live.num_samples, live.num_late) == (0, 100)


def test_degrees_are_refused_at_once(live):
    said = refuse(live.add, 0.0, np.full(6, 45.0), None, np.zeros(6))
    assert "q of joint_1: is 45 rad, must be at most 12.57 rad: are these degrees?" in said


def test_wrong_shapes_and_runs_are_refused(robot, empty, live):
    assert "(6,)" in refuse(live.add, 0.0, np.zeros(5), None, np.zeros(6), error=BadArgumentError)
    live.add(0.0, np.zeros(6), np.zeros(6), np.zeros(6))
    assert "for all samples or for none" in refuse(live.add, 0.01, np.zeros(6), None, np.zeros(6))
    assert "at least one recording" in refuse(LiveIdentifier, robot, [])
    postures = dataclasses.replace(empty[0].description, postures=True)
    assert "cannot be followed live" in refuse(
        LiveIdentifier, robot, [dataclasses.replace(empty[0], description=postures)]
    )
