"""``affordance live``: its lines, its files, its sources, and one line for bad input."""

import io
import json
import re
import sys
import time

import numpy as np
import pytest
from helpers.answers import answer
from helpers.fake_ur import FakeController
from helpers.refusals import refuse_command

from affordance import MODELS, Run, read_run
from affordance.commands.payload import live
from affordance.extensions.payload.live import foreign_robot
from affordance.extensions.payload.live.recorder import Recorder, describe
from affordance.extensions.payload.recording.run import RunDescription
from affordance.extensions.payload.settings import SignalKind

DEMO = MODELS / "demo"
ARM = (MODELS / "arm.dmd.yaml", "--empty", DEMO / "empty.csv")


@pytest.fixture(scope="module")
def demo():
    return answer("live", "--demo")


def test_the_demonstration_takes_up_a_bar(demo):
    lines = [line for line in demo.lines if re.match(r" *[\d.]+ s  ", line)]
    assert re.search(r"ready: 3 empty runs;", lines[0])
    (taken,) = [line for line in lines if "TAKEN UP" in line]
    low, high = map(float, re.search(r"\[([\d.]+), ([\d.]+)\]", taken).groups())
    assert low < 0.550 < high
    assert re.search(r"FINAL: 0\.5\d+ kg .*: trusted$", lines[-1])
    assert "For the controller" in demo.out
    assert "800 samples, 0 skipped (double, late or without numbers)" in demo.out


def test_what_is_recorded_gives_identify_the_same_answer(tmp_path):
    words = [*ARM, "--replay", DEMO / "empty.csv", DEMO / "bar_of_oak.csv", "--record", tmp_path / "seen", "--json"]
    events = [json.loads(line) for line in answer("live", *words, status=3).lines]
    assert events[0]["event"] == "ready"
    final = events[-1]
    words = [*ARM, "--unpaired", "--loaded", final["recorded"], "--cutoff", final["cutoff_hz"], "--json"]
    again = answer("identify", *words, status=3).content
    assert again["mass_kg"] == final["mass_kg"]
    assert again["com_interval90"] == final["com_interval90"]
    assert again["doubts"] == [each.replace("the stream", final["recorded"]) for each in final["doubts"]]
    seen = [read_run(tmp_path / "seen" / f"seen_{k}.csv") for k in (1, 2)]
    assert [len(run.times) for run in seen] == [400, 400]


def test_a_table_on_standard_input_is_recorded_without_empty_runs(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "stdin", io.StringIO((DEMO / "empty.csv").read_text()))
    answer("live", ARM[0], "--tip", "hand_grip", "--record", tmp_path, "--seconds", 3)
    run, original = read_run(tmp_path / "seen_1.csv"), read_run(DEMO / "empty.csv")
    assert np.array_equal(run.signal, original.signal[:151])
    assert run.description.joint_names == original.description.joint_names


def test_lines_on_standard_input_end_with_the_first_final_answer(monkeypatch):
    runs = [read_run(DEMO / f"{name}.csv") for name in ("bar_of_oak", "empty")]
    names = runs[0].description.joint_names
    lines, start = [], 0.0
    for run in runs:
        for t, q, v, signal in zip(run.times, run.q, run.v, run.signal, strict=True):
            values = {"position": q[::-1].tolist(), "velocity": v[::-1].tolist(), "effort": signal[::-1].tolist()}
            lines.append(json.dumps({"time": start + t, "name": names[::-1], **values}))
        start += run.times[-1] + 1.0
    monkeypatch.setattr(sys, "stdin", io.StringIO("\n".join(lines)))
    out = answer("live", *ARM, "--json", status=3).lines
    events = [json.loads(line) for line in out]
    beliefs = [each for each in events if each["event"] == "belief" and each["time"] < 8.0]
    assert all(each["mass_interval90"][0] < 0.55 < each["mass_interval90"][1] for each in beliefs)
    assert "put down" in [each["event"] for each in events]


def test_a_controller_of_universal_robots_is_read_and_gets_no_value(tmp_path):
    pytest.importorskip("mujoco")
    arm = foreign_robot.ARMS["ur5e"]
    (tmp_path / "ur5e.xml").write_text(foreign_robot.write_model("ur5e"))
    recorder = Recorder(tmp_path, describe(None, arm.joints, SignalKind.CURRENT, "flange"))

    def simulate(script, seed):
        return [
            each for each in foreign_robot.simulate("ur5e", script, seed) if isinstance(each, foreign_robot.Sample)
        ]

    paths = []
    for seed in (1, 2):
        rows = simulate("move 16", seed)
        columns = (np.array([getattr(row, name) for row in rows]) for name in ("time", "q", "signal", "v"))
        paths.append(recorder.write(Run("empty", RunDescription(arm.joints, SignalKind.CURRENT), *columns)))
    rows = [
        [each.time, *each.q, *each.v, *each.signal, 0.5, 0.0, 0.0, 0.05] for each in simulate("hold 3, move 7", 3)
    ]
    controller = FakeController(rows)
    words = [
        tmp_path / "ur5e.xml",
        "--empty",
        *paths,
        "--rtde",
        f"127.0.0.1:{controller.port}",
        "--seconds",
        4.5,
        "--json",
    ]
    told = answer("live", *words, status=3)
    controller.join()
    assert controller.packages == [86, 79, 83]
    events = [json.loads(line) for line in told.lines]
    (set_,) = [each for each in events if each["event"] == "controller"]
    assert (set_["mass_kg"], set_["changes_signal"]) == (0.5, False)
    beliefs = [each for each in events if each["event"] == "belief"]
    assert beliefs[-1]["mass_interval90"][0] < 3.0 < beliefs[-1]["mass_interval90"][1]
    assert "1126 samples, 0 skipped" in told.err


@pytest.mark.parametrize(
    ("words", "refusal"),
    [
        ([ARM[0]], "--empty: is missing, must be recordings with an empty hand; --record DIR makes them"),
        ([*ARM, "--replay", "nothing.csv"], "nothing.csv: does not exist"),
        ([*ARM, "--ros2", "/joint_states"], "ROS_DOMAIN_ID: is 'home', must be a whole number from 0 to 232"),
        ([*ARM, "--rtde", "x:y"], "must be HOST or HOST:PORT"),
        ([*ARM, "--rtde", "x"], "but the empty runs have joint_torque"),
        ([*ARM, "--seconds", "0"], "--seconds"),
        ([ARM[0], "--demo"], "must be given without a robot"),
        ([*ARM, "--demo", "--rtde", "x"], "not allowed with"),
    ],
)
def test_bad_input_is_refused_in_a_line(words, refusal, monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", "home")
    assert refusal in refuse_command("live", *words)


def test_a_stream_of_other_joints_is_refused_by_their_names(monkeypatch):
    line = json.dumps({"time": 0.0, "name": ["wheel"], "position": [0], "effort": [0]})
    monkeypatch.setattr(sys, "stdin", io.StringIO(line))
    assert "names: are wheel, must include shoulder_azimuth" in answer("live", *ARM, status=2).err


def test_a_source_that_sends_nothing_is_named(monkeypatch):
    def send():
        time.sleep(0.5)
        yield from (DEMO / "empty.csv").read_text().splitlines()[:60]

    monkeypatch.setattr(live, "_SILENT", 0.1)
    monkeypatch.setattr(sys, "stdin", send())
    assert answer("live", *ARM, status=3).out.count("nothing has come for 0.1 s: waiting for standard input") == 1


def test_a_stream_of_other_things_is_refused(monkeypatch):
    for text, refusal in (("hello\n", "line 1: is 'hello'"), ("", "ended without a sample, or without one")):
        monkeypatch.setattr(sys, "stdin", io.StringIO(text))
        assert refusal in answer("live", *ARM, status=2).err
