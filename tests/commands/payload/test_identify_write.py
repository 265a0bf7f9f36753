"""``affordance identify --write``: the demonstration's payload as a file, and frames of payloads that are claimed."""

import json

import numpy as np
import pytest
from helpers.answers import answer
from helpers.refusals import refuse_command


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_posterior_mean_and_draws_are_written(folder):
    words = ("identify", "--demo", "--samples", 500, "--write", "bar.json", "--draws", 30, "--json")
    content = answer(*words).content
    assert content["written"] == ["bar.json", *(f"bar_{k:02}.json" for k in range(1, 31))]
    bodies = [json.loads((folder / name).read_text()) for name in content["written"]]
    assert bodies[0]["mass"] == pytest.approx(content["parameters"][0], rel=1e-12)
    moments = np.array(content["parameters"][1:4]) / content["parameters"][0]
    assert bodies[0]["com"] == pytest.approx(moments, abs=1e-12)
    masses = np.array([each["mass"] for each in bodies[1:]])
    assert 0.4 < masses.std() / content["mass_sd_kg"] < 1.7


def test_a_claimed_payload_in_another_frame_is_refused(folder):
    (folder / "set.yaml").write_text("mass: 0.5\nframe: tool0\n")
    said = answer("identify", "--demo", "--samples", 500, "--claimed", "set.yaml", status=2).err.strip()
    assert said.endswith(
        "set.yaml: frame: is 'tool0', must be that of the flange, hand_grip (--flange names another)"
    )


def test_bad_targets_are_refused_before_anything_is_read():
    said = refuse_command("identify", "--loaded", "nowhere.csv", "--write", "bar.stl")
    assert "--write: is 'bar.stl', must end with .urdf, .sdf, .xml, .json" in said
