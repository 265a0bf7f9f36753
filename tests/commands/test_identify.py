"""``affordance identify`` on generated logs: its output, its files, and its messages for bad input."""

import argparse
import json
import sys

import numpy as np
import pytest
from helpers.generated_runs import PAYLOAD, Truth, build_robot, generate_run

from affordance.commands import identify
from affordance.exceptions import AffordanceError
from affordance.files.model_folder import MODELS
from affordance.identification.recording.run import Run
from affordance.identification.settings import SignalKind
from affordance.memory.ledger import open_memory
from affordance.objects.load import load_tools
from affordance.objects.materials import load_materials
from affordance.reporting import figures

_TOOLS = load_tools(MODELS / "tools" / "novel.yaml", load_materials(MODELS / "materials.yaml"))
_STICK = next(tool for tool in _TOOLS if tool.name == "stick")
_TRUTH = Truth(gain=0.1, load_friction=0.05, friction=(1.0, 0.5, 0.2), noise_sd=0.1)


def _write(folder, name: str, run: Run) -> None:
    unit = "current" if run.description.kind is SignalKind.CURRENT else "tau"
    n = run.q.shape[1]
    names = ["time", *(f"{kind}_{i + 1}" for kind in ("q", "v", unit) for i in range(n))]
    np.savetxt(
        folder / f"{name}.csv",
        np.hstack([run.times[:, None], run.q, run.v, run.signal]),
        delimiter=",",
        header=",".join(names),
        comments="",
    )
    joints = ", ".join(run.description.joint_names)
    (folder / f"{name}.yaml").write_text(f"joints: [{joints}]\nsignal: {run.description.kind.value}\ntip: flange\n")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("logs")
    robot = build_robot(folder)
    rng = np.random.default_rng(11)
    held = {"empty": None, "loaded": PAYLOAD, "heavy": 2.0 * PAYLOAD, "stick": _STICK.parameters}
    held["stick_again"] = held["stick"]
    for name, pi in held.items():
        run = generate_run(robot, pi, truth=_TRUTH, rng=rng, kind=SignalKind.CURRENT, rate=50.0)
        _write(folder, name, run)
    return folder


def _run(folder, *words: str) -> int:
    parser = argparse.ArgumentParser()
    identify.add_arguments(parser)
    few = () if "--samples" in words else ("--samples", "500")
    return identify.run(parser.parse_args([str(folder / "robot.urdf"), *few, *words]))


def _name(folder, *names: str) -> list[str]:
    return [str(folder / f"{name}.csv") for name in names]


def test_gains_of_a_weighed_load_serve_the_next_one(folder, tmp_path, capsys):
    empty, loaded, heavy = _name(folder, "empty", "loaded", "heavy")
    mass = str(2.0 * PAYLOAD[0])
    assert _run(folder, "--empty", empty, "--loaded", heavy, "--reference-mass", mass, "--out", str(tmp_path)) == 0
    text = capsys.readouterr().out
    assert "gains from one half, the mass of the other" in text
    assert "set_target_payload(" in text
    assert "Assumed:" in text
    for name in (
        "fit.png",
        "posteriors.png",
        "whiteness.png",
        "samples.nc",
        "belief.json",
        "belief.txt",
        "gains.yaml",
    ):
        assert (tmp_path / name).stat().st_size > 0
    gains = str(tmp_path / "gains.yaml")
    slow = ("--min-speed", "0.05")
    assert _run(folder, "--empty", empty, "--loaded", loaded, "--gains", gains, *slow, "--json") == 0
    found = json.loads(capsys.readouterr().out)
    assert abs(found["mass_kg"] - PAYLOAD[0]) < 3.0 * found["mass_sd_kg"]
    assert found["mass_interval90"][0] < PAYLOAD[0] < found["mass_interval90"][1]
    assert len(found["com_m"]) == len(found["com_sd_m"]) == 3
    assert found["mass_sd_kg"] < 0.1
    assert "samples of a joint slower than 0.05 rad/s are left out" in found["assumed"]


def test_a_seen_object_teaches_a_memory_once(folder, tmp_path, capsys):
    empty, loaded, again = _name(folder, "empty", "stick", "stick_again")
    tools, memory = str(MODELS / "tools" / "novel.yaml"), tmp_path / "memory.sqlite"
    words = ["--empty", empty, "--object", tools, "--object-name", "stick", "--memory", str(memory)]
    assert _run(folder, *words, "--loaded", loaded, "--json") == 0
    densities = json.loads(capsys.readouterr().out)["densities_kg_m3"]
    assert len(densities) == 2
    with open_memory(memory) as ledger:
        before = ledger.recall().belief
    assert _run(folder, *words, "--loaded", loaded) == 0
    text = capsys.readouterr().out
    assert "learns nothing: this run has taught it before" in text
    assert "kg/m^3, 90 % from" in text
    with open_memory(memory) as ledger:
        assert len(ledger) == 1
        assert np.array_equal(ledger.recall().belief.precision, before.precision)
    assert _run(folder, *words, "--loaded", again) == 0
    assert "has learned them" in capsys.readouterr().out
    with open_memory(memory) as ledger:
        assert len(ledger) == 2
        assert len(ledger.list_things()) == 1
        # A thing's deviation from its materials counts once: of two runs hardly more is known of these than of one.
        sds = np.sqrt(np.diag(ledger.recall().belief.covariance))
        assert (sds < np.sqrt(np.diag(before.covariance))).all()
        assert ledger.verify() == []


def test_an_object_that_is_another_teaches_nothing(folder, tmp_path, capsys):
    """A load ten times as heavy as any stick of its size leaves no memory."""
    empty, loaded = _name(folder, "empty", "heavy")
    tools, memory = str(MODELS / "tools" / "novel.yaml"), tmp_path / "memory.sqlite"
    words = ["--empty", empty, "--loaded", loaded, "--object", tools, "--object-name", "stick"]
    _run(folder, *words, "--memory", str(memory))
    capsys.readouterr()
    assert not memory.exists()


def test_a_result_that_is_not_to_be_trusted_says_so_first_and_leaves_nothing_behind(
    folder, tmp_path, capsys, monkeypatch
):
    monkeypatch.setattr(figures, "save_figure", lambda *arguments: None)  # drawn by the test above
    empty, loaded = _name(folder, "empty", "heavy")
    mass = str(2.0 * PAYLOAD[0])
    swapped = ("--empty", loaded, "--loaded", empty, "--reference-mass", mass, "--out", str(tmp_path / "a"))
    assert _run(folder, *swapped) == 3
    text = capsys.readouterr().out
    assert text.splitlines()[1] == "NOT TO BE TRUSTED:"
    assert "set_target_payload(" not in text
    assert not (tmp_path / "a" / "gains.yaml").exists()
    assert json.loads((tmp_path / "a" / "belief.json").read_text())["trusted"] is False
    assert _run(folder, *swapped[:-1], str(tmp_path / "b"), "--anyway") == 3
    assert "its flange, NOT TO BE TRUSTED" in capsys.readouterr().out
    assert (tmp_path / "b" / "gains.yaml").exists()


def test_payload_of_the_controller_is_compared(folder, tmp_path, capsys):
    empty, heavy = _name(folder, "empty", "heavy")
    x, y, z = PAYLOAD[1:4] / PAYLOAD[0]
    (tmp_path / "set.script").write_text(f"set_target_payload({2 * PAYLOAD[0]:.3f}, [{x:.4f}, {y:.4f}, {z:.4f}])")
    words = ("--empty", empty, "--loaded", heavy, "--reference-mass", str(2.0 * PAYLOAD[0]))
    assert _run(folder, *words, "--claimed", str(tmp_path / "set.script"), "--json") == 0
    assert json.loads(capsys.readouterr().out)["claimed"]["verdict"] == "right"
    (tmp_path / "set.yaml").write_text("mass: 0.73\ncom: [0, 0, 0.06]\n")
    assert _run(folder, *words, "--claimed", str(tmp_path / "set.yaml")) == 0
    text = capsys.readouterr().out
    assert "Claimed: the payload that is set is wrong (right with probability 0.00" in text
    assert text.index("Claimed:") < text.index("Assumed:") < text.index("set_target_payload(")


def test_pose_of_the_object_is_checked(folder):
    pose = ("--object-pose", "0", "0", "3", "0", "0", "0")
    with pytest.raises(AffordanceError, match=r"--object-pose Z: is 3\.0, must be from -2 to 2"):
        _run(folder, "--loaded", *_name(folder, "loaded"), *pose)


def test_without_any_tip_there_is_a_line(folder, tmp_path):
    (tmp_path / "run.yaml").write_text("joints: [joint_1]\n")
    text = (folder / "loaded.yaml").read_text().replace("tip: flange\n", "")
    (tmp_path / "no_tip.yaml").write_text(text)
    with pytest.raises(AffordanceError, match="--tip: is missing"):
        _run(folder, "--loaded", *_name(folder, "loaded"), "--description", str(tmp_path / "no_tip.yaml"))


def test_libraries_that_take_long_to_import_are_left_out(children):
    """Libraries that take longer to import than identification takes are not imported."""
    slow = {"cv2", "jinja2", "joblib", "matplotlib", "pandas", "sqlalchemy", "xarray"}
    slow |= {f"scipy.{name}" for name in ("interpolate", "optimize", "signal", "spatial", "stats")}
    program = "import sys, affordance.commands.identify_payload; print(*sys.modules)"
    out, _ = children([sys.executable, "-c", program]).communicate()
    assert "scipy.linalg" in out.split()
    assert not slow & set(out.split())
