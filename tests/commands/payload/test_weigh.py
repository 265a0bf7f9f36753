"""``affordance weigh``: its output, files and exit statuses; it imports no Drake."""

import json
import sys

import numpy as np
import pytest
from helpers.answers import answer
from helpers.children import PATIENCE
from helpers.refusals import refuse_command

from studies.weigh.simulated import simulate_poses


@pytest.fixture
def table(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    simulated = simulate_poses(0, 36)  # quaternions, ten poses, the smallest noise
    simulated.write(tmp_path / "poses.csv")
    return simulated


def test_the_answer_holds_the_truth_and_is_written(table, tmp_path):
    said = answer("weigh", "poses.csv", "--out", "out")
    content = json.loads((tmp_path / "out" / "weighing.json").read_text())
    assert said.lines[0] == content["answer"]
    assert said.lines[0].endswith("trusted")
    assert (tmp_path / "out" / "weighing.txt").read_text() == said.out
    low, high = content["mass_interval90"]
    assert low - 0.01 < table.mass < high + 0.01
    assert content["com_m"] == pytest.approx(table.centre, abs=0.005)
    assert np.shape(content["parameters_covariance"]) == (4, 4)
    assert (content["poses"], content["orientation"], content["wrench_axes"]) == (10, "quaternion", table.axes)
    assert any(line.startswith("Next pose: ") for line in said.lines)


def test_json_and_files_for_simulators(table, tmp_path):
    words = ("weigh", "poses.csv", "--json", "--frame", "ft_link", "--write", "load.json", "--draws", 2)
    content = answer(*words).content
    assert content["written"] == ["load.json", "load_1.json", "load_2.json"]
    body = json.loads((tmp_path / "load.json").read_text())
    assert body["frame"] == content["frame"] == "ft_link"
    assert body["mass"] == pytest.approx(content["mass_kg"])
    assert answer("compare-payloads", "load.json", "load_1.json", status=2).err.count("\n") == 1


def test_what_is_not_trusted_has_status_3_and_writes_no_link(table, tmp_path):
    spoilt = table.columns | {"fz": 0.7 * table.columns["fz"]}
    table._replace(columns=spoilt).write(tmp_path / "poses.csv")
    said = answer("weigh", "poses.csv", "--write", "load.urdf", status=3)
    assert said.lines[0].endswith("NOT TO BE TRUSTED")
    assert said.lines[-1] == "load.urdf is not written, as the answer is not to be trusted"
    assert not (tmp_path / "load.urdf").exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("nowhere.csv", "nowhere.csv: cannot be read"),
        ("poses.csv --write load.stl", "--write: is 'load.stl', must end with"),
        ("poses.csv --draws 3", "--draws: is 3, must be given with --write FILE"),
        ("poses.csv --gravity 0 0 0", "--gravity: is [0.0, 0.0, 0.0], must be a direction"),
        ("poses.csv --axes flange", "--axes: is 'flange', must be one of sensor, base"),
        ("poses.csv --orientation rpy", "poses.csv: has no columns roll, pitch, yaw"),
        ("down.csv --axes base", "--axes: is base, must be sensor: a table with gravity does not show"),
    ],
)
def test_bad_input_is_refused_in_a_line(table, tmp_path, words, said):
    simulate_poses(0, 4).write(tmp_path / "down.csv")
    assert said in refuse_command("weigh", *words.split())


def test_neither_drake_nor_pandas_is_imported(table, children, tmp_path):
    code = (
        "import sys; from affordance.cli import main; assert main(['weigh', 'poses.csv', '--json']) == 0; "
        "print(*sorted({'pydrake', 'pandas', 'matplotlib'} & set(sys.modules)), file=sys.stderr)"
    )
    out, err = children([sys.executable, "-c", code], cwd=tmp_path).communicate(timeout=PATIENCE)
    assert json.loads(out)["trusted"]
    assert err == "\n"
