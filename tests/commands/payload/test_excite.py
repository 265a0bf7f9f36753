"""``affordance excite``: its output and files, and one line for bad input."""

import functools
import json

import numpy as np
import pytest
import yaml
from helpers.answers import answer
from helpers.refusals import refuse_command

from affordance import Robot
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


def test_postures_as_json():
    content = answer("excite", "--for", "com", "--postures", 2, "--seconds", 9, "--above", -2, "--json").content
    assert (content["for"], content["postures"]) == ("com", 2)
    assert content["predicted_sd"]["mass_g"] > 10.0  # the floor


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("--seconds 0", "--seconds: is 0"),
        ("--postures 0", "--postures: is 0"),
        (
            "--seconds 1 --postures 20",
            "--seconds: is 1: none of 8 motions of 1 s respects the limits of angles",
        ),
        ("--mass 60", "fewer postures, a lighter load, or a smaller --above"),
        ("--above 9", "--above: is 9"),
        ("--mass nan", "--mass: is nan"),
        ("--reach 9", "--reach: is 9"),
        ("--tip-speed 0", "--tip-speed: is 0"),
        ("--acceleration 0", "--acceleration: is 0"),
        ("--gains nowhere.yaml", "nowhere.yaml: cannot be read"),
    ],
)
def test_mistake_is_refused_in_one_line(tmp_path, monkeypatch, words, said):
    monkeypatch.chdir(tmp_path)
    assert said in refuse_command("excite", *words.split())


def test_accelerations_are_those_of_the_option_or_usual_ones(tmp_path):
    for options, expected in (((), 3.0), (("--acceleration", 2), 2.0)):
        content = answer("excite", "--seconds", 4, *options, "--out", tmp_path, "--json").content
        assert set(content["acceleration_limits"].values()) == {expected}
        table = np.genfromtxt(tmp_path / "motion.csv", delimiter=",", names=True)
        assert np.abs(table["vdot_1"]).max() <= expected
    said = answer("excite", "--acceleration", 1, 2, status=2).err
    assert "--acceleration: has 2 numbers, must have 1, or one for each of" in said


def test_tip_stays_above_the_base_unless_told_otherwise(tmp_path, monkeypatch):
    monkeypatch.setattr(excite, "design_motion", functools.partial(design_motion, num_draws=30, num_changes=0))
    robot, lowest = Robot(), {}
    for options in ((), ("--above", -2)):
        content = answer("excite", "--seconds", 4, "--seed", 5, *options, "--out", tmp_path, "--json").content
        motion = np.genfromtxt(tmp_path / "motion.csv", delimiter=",", skip_header=1)[:, 1:8]
        ways = [
            yaml.safe_load((tmp_path / name).read_text())["points"] for name in ("to_start.yaml", "back_home.yaml")
        ]
        q = np.concatenate([motion, *([point["positions"] for point in way] for way in ways)])
        lowest[options] = robot.chain.compute_positions(q, np.zeros(3))[:, 2].min()
        assert "the tip stays above" in content["sentence"]
    assert lowest[()] > -1e-6  # home is at the height of the base, and the ways start there
    assert lowest["--above", -2] < -0.1


def test_home_below_the_least_height_is_said():
    said = answer("excite", "--seconds", 4, "--above", 0.05).out
    assert "The tip at home is at 0.00 m, below --above 0.05 m: so are ends of the ways" in said
