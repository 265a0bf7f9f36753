"""``affordance excite``: its output and files, and one line for bad input."""

import functools
import json

import numpy as np
import pytest
import yaml
from helpers.answers import answer
from helpers.refusals import refuse_command

from affordance.commands.payload import excite
from affordance.extensions.payload.excitation.motion_design import design_motion


@pytest.fixture(autouse=True)
def hasty(monkeypatch):
    monkeypatch.setattr(excite, "design_motion", functools.partial(design_motion, num_draws=8, num_changes=4))


def test_motion_is_said_and_written(tmp_path):
    said = answer("excite", "--seconds", 4, "--out", tmp_path).out
    assert (tmp_path / "excite.txt").read_text() == said
    assert "Predicted standard deviations: mass " in said
    assert "Not checked: collisions" in said
    message = yaml.safe_load((tmp_path / "trajectory.yaml").read_text())
    table = np.genfromtxt(tmp_path / "motion.csv", delimiter=",", names=True)
    assert set(message) == {"joint_names", "points"}
    assert len(message["points"]) == len(table) == 201
    last = message["points"][-1]
    assert last["time_from_start"] == {"sec": 4, "nanosec": 0}
    assert last["positions"][0] == pytest.approx(table["q_1"][-1], abs=1e-6)
    assert len(last["velocities"]) == len(last["accelerations"]) == len(message["joint_names"]) == 7
    content = json.loads((tmp_path / "excite.json").read_text())
    assert content["start"] == pytest.approx(
        dict(zip(message["joint_names"], message["points"][0]["positions"], strict=True)), abs=1e-6
    )


def test_task_and_postures_as_json():
    content = answer("excite", "--for", "reach", "--postures", 2, "--seconds", 9, "--json").content
    assert content["postures"] == 2
    assert content["predicted_sd"]["cost_J"] > 0.0
    assert content["predicted_sd"]["mass_g"] > 10.0  # the floor


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("--for mas", "--for: is 'mas', must be one of mass, com, inertia"),
        ("--for reach --only nothing", "is 'nothing', must be one of"),
        ("--seconds 0", "--seconds: is 0"),
        ("--postures 0", "--postures: is 0"),
        (
            "--seconds 1 --postures 20",
            "--seconds: is 1: none of 8 motions of 1 s respects the limits: most of them need more time; choose",
        ),
        ("--mass 60", "times the torque limit of wrist_flexion; choose a lighter load"),
        ("--above 2", "--above: is 2 m: none of 8 motions of 8 s respects the limits: most of them come at least"),
        ("--above 9", "--above: is 9"),
        ("--mass nan", "--mass: is nan"),
        ("--floor -1", "--floor: is -1"),
        ("--reach 9", "--reach: is 9"),
        ("--tip-speed 0", "--tip-speed: is 0"),
        ("--acceleration 0", "--acceleration: is 0"),
        ("--joint-limits nowhere.yaml", "nowhere.yaml: cannot be read"),
        ("--gains nowhere.yaml", "nowhere.yaml: cannot be read"),
    ],
)
def test_mistake_is_refused_in_one_line(tmp_path, monkeypatch, words, said):
    monkeypatch.chdir(tmp_path)
    assert said in refuse_command("excite", *words.split())


def test_accelerations_keep_the_least_of_file_and_option(tmp_path):
    names = list(answer("excite", "--seconds", 4, "--json").content["acceleration_limits"])
    entry = "    max_acceleration: {}\n    has_acceleration_limits: {}\n    max_velocity: 0.5\n"
    limits = tmp_path / "joint_limits.yaml"
    limits.write_text(
        f"joint_limits:\n  {names[0]}:\n{entry.format(1.5, 'true')}  {names[1]}:\n{entry.format(0.5, 'false')}"
        "  finger:\n    has_velocity_limits: false\n    max_velocity: 0\n"
    )
    for options, expected in (((), [1.5, 3.0]), (("--acceleration", 2), [1.5, 2.0])):
        words = ("--seconds", 4, "--joint-limits", limits, *options, "--out", tmp_path / "out")
        content = answer("excite", *words, "--json").content
        assert list(content["acceleration_limits"].values())[:2] == expected
        table = np.genfromtxt(tmp_path / "out" / "motion.csv", delimiter=",", names=True)
        assert (np.abs([table["vdot_1"], table["vdot_2"]]).max(axis=1) <= expected).all()
        assert np.abs(table["v_1"]).max() <= 0.5


def test_a_robot_without_an_option_is_taken_and_limits_of_acceleration_are_counted(tmp_path):
    said = answer("excite", tmp_path / "a", "--robot", tmp_path / "b", status=2).err
    assert "--robot: is given twice" in said
    said = answer("excite", "--acceleration", 1, 2, status=2).err
    assert "--acceleration: has 2 numbers, must have 1, or one for each of" in said
