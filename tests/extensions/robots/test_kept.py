"""Importing once: its messages, and its folder, which is written whole or not at all."""

import shutil
from pathlib import Path

import numpy as np
import pytest
import yaml
from helpers.answers import answer
from helpers.robot_files import MJCF, write_urdf
from matplotlib.figure import Figure

from affordance.belief.material_memory import MaterialMemory
from affordance.extensions.robots import kept, report
from affordance.extensions.robots.fitting import Fitted, fit_tasks
from affordance.extensions.robots.importer import ImportOptions, extract_arm
from affordance.extensions.robots.kept import import_kept, write_folder
from affordance.files.lacks import read_lacks
from affordance.files.model_folder import MODELS
from affordance.objects.load import load_tools
from affordance.plant.arm import ARM
from affordance.plant.arm_model import ArmModel
from affordance.plant.load import load_arm
from affordance.settings import Settings
from affordance.simulation.blow import describe_blow_fault
from affordance.simulation.rollout import describe_path_fault
from affordance.simulation.trial import TrialRunner

TIP = ImportOptions("right_tool")


@pytest.fixture(autouse=True)
def _hurry(monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest) -> None:
    """Skips fitting of tasks, which is slow and tested elsewhere, and pictures."""
    monkeypatch.setattr(kept, "fit_tasks", lambda *_: Fitted((), {"blow": "too weak"}))
    if "report" not in request.node.name:
        monkeypatch.setattr(report, "draw_posture", lambda _: Figure())


def test_an_arm_is_imported_once_for_the_same_file_and_options(tmp_path: Path) -> None:
    path = write_urdf(tmp_path)
    first = import_kept(path, TIP, tmp_path / "kept")
    stamp = (first / "arm.sdf").stat().st_mtime_ns
    assert import_kept(path, TIP, tmp_path / "kept") == first
    assert (first / "arm.sdf").stat().st_mtime_ns == stamp
    turned = import_kept(path, ImportOptions("right_tool", posture={"neck": 0.3}), tmp_path / "kept")
    assert turned != first
    path.write_text(path.read_text().replace('effort="40"', 'effort="41"'))
    assert import_kept(path, TIP, tmp_path / "kept") not in (first, turned)


def test_an_import_that_was_broken_off_is_done_anew(tmp_path: Path) -> None:
    path = write_urdf(tmp_path)
    folder = import_kept(path, TIP, tmp_path / "kept")
    (folder / "report.html").unlink()
    (folder / "arm.sdf").write_text("half")
    assert import_kept(path, TIP, tmp_path / "kept") == folder
    assert load_arm(folder / ARM.name).num_joints == 4


def test_the_report_says_what_was_taken_assumed_left_out_and_lacks(tmp_path: Path) -> None:
    folder = import_kept(write_urdf(tmp_path), TIP, tmp_path / "kept")
    text = (folder / "report.txt").read_text()
    for said in (
        "4 joints from torso to right_tool: right_j1, right_j2, right_j3, right_j4",
        "base: torso, because another limb branches off there, at left_j1",
        "Coulomb friction (N m), which Drake's joints do not have: right_j2 1.5",
        "couplings of joints, each frozen where its leader puts it: right_follow, left_follow",
        "inertia of the link head, which is not part of the arm: it has a mass of -1 kg",
        "no inertia of rotors and gears for every joint",
        "links merged into the link they are fixed to: 3 to right_4",
        "blow: too weak",
        "the mesh package://nowhere/meshes/right_1.stl was not found",
        "static payload at home ",
    ):
        assert said in text
        assert said.split("<")[0].replace("'", "&#39;") in (folder / "report.html").read_text()
    assert (folder / "posture.png").stat().st_size > 10_000
    assert read_lacks(folder) == {"blow": "too weak"}


def test_the_command_imports_any_format_and_says_what_it_did(tmp_path: Path) -> None:
    path = tmp_path / "reacher.xml"
    path.write_text(MJCF)
    out = tmp_path / "models"
    words = ["--tip", "grip_site", "--rotor-inertia", 0.2, "a4=0.3", "--base-height", 1.1, "--out", out]
    printed = answer("import-arm", path, *words, "--tasks", "keep").out
    assert "4 joints from root to grip_site; static payload at home" in printed
    assert f"{out}: written in" in printed
    text = (out / "arm.sdf").read_text()
    assert text.count("<drake:rotor_inertia>0.2<") == 3
    assert text.count("<drake:rotor_inertia>0.3<") == 1
    assert "translation: [0.0, 0.0, 1.1]" in (out / ARM.name).read_text()


def test_limits_of_torque_that_are_given_are_said_and_not_called_placeholders(tmp_path: Path) -> None:
    path = write_urdf(tmp_path, changes={'effort="40"': 'effort="0"'})
    words = ["--tip", "right_tool", "--effort", 1000, "right_j4=900", "--tasks", "keep"]
    answer("import-arm", path, *words, "--out", tmp_path / "models")
    assert (tmp_path / "models" / "arm.sdf").read_text().count("<effort>1000.0<") == 3
    text = (tmp_path / "models" / "report.txt").read_text()
    assert "torque limits as given, not the file's" in text
    assert "placeholder" not in text


def test_a_kept_import_is_made_anew_if_an_included_file_was_changed(tmp_path: Path) -> None:
    start, end = MJCF.index("<actuator>"), MJCF.index("</mujoco>")
    path, motors = tmp_path / "reacher.xml", tmp_path / "motors.xml"
    path.write_text(MJCF[:start] + '<include file="motors.xml"/></mujoco>')
    motors.write_text(f"<mujoco>{MJCF[start:end]}</mujoco>")
    first = import_kept(path, ImportOptions("grip_site"), tmp_path / "kept")
    motors.write_text(motors.read_text().replace("-9 9", "-8 8"))
    assert import_kept(path, ImportOptions("grip_site"), tmp_path / "kept") != first


def test_shapes_of_an_mjcf_that_are_not_taken_over_are_named(tmp_path: Path) -> None:
    path = tmp_path / "reacher.xml"
    mesh = '<geom type="mesh" mesh="m"/>'
    text = MJCF.replace('<site name="grip_site"', f'{mesh}<site name="grip_site"')
    path.write_text(text.replace('<body name="third"', mesh.replace("/>", ' group="3"/>') + '<body name="third"'))
    folder = import_kept(path, ImportOptions("grip_site"), tmp_path / "kept")
    said = "some shapes of base, third are not imported: simple shapes or capsules are"
    assert said in (folder / "report.txt").read_text()


@pytest.fixture(scope="module")
def ours(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of our own arm, imported in its own posture and place."""
    arm = load_arm()
    posture = dict(zip(arm.joint_names, arm.home.tolist(), strict=True))
    folder = tmp_path_factory.mktemp("ours") / "models"
    imported = extract_arm(MODELS / "arm.sdf", ImportOptions("hand_grip", posture=posture, height=1.44, roll=0.0))
    write_folder(*imported, folder, source="arm.sdf")
    return folder


def test_our_own_arm_is_the_same_to_the_last_bit(ours: Path) -> None:
    before, after = load_arm(), load_arm(ours / ARM.name)
    assert after.joint_names == before.joint_names
    np.testing.assert_array_equal(after.home, before.home)
    for old, new in zip(before.limits, after.limits, strict=True):
        np.testing.assert_array_equal(new, old)
    rng, n = np.random.default_rng(0), before.num_joints
    models = ArmModel(before), ArmModel(after)
    for _ in range(20):
        x, vdot = rng.uniform(-2.0, 2.0, 2 * n), rng.uniform(-9.0, 9.0, n)
        for model in models:
            model.set_state(x)
        old, new = models
        np.testing.assert_array_equal(new.compute_mass_matrix(), old.compute_mass_matrix())
        np.testing.assert_array_equal(new.compute_inverse_dynamics(vdot), old.compute_inverse_dynamics(vdot))
        np.testing.assert_array_equal(new.compute_hand_pose().GetAsMatrix4(), old.compute_hand_pose().GetAsMatrix4())


def test_a_hold_by_our_own_arm_is_the_same_to_the_last_bit(ours: Path) -> None:
    tool = load_tools(MODELS / "tools" / "weight.yaml")[0]
    old, new = (
        TrialRunner(Settings(arm=arm)).run_hold(tool, MaterialMemory(), duration=0.3, seed=(0,))
        for arm in (ARM, ours / ARM.name)
    )
    np.testing.assert_array_equal(new.q, old.q)
    np.testing.assert_array_equal(new.height_centre, old.height_centre)


def test_tasks_that_our_own_arm_can_do_stay_as_they_are(ours: Path, tmp_path: Path) -> None:
    """Tasks with the paper's tool are not changed for our own arm; fitting all tools takes twenty seconds."""
    models = tmp_path / "models"
    shutil.copytree(ours, models)
    novel = models / "tools" / "novel.yaml"
    content = yaml.safe_load(novel.read_text(encoding="utf-8"))
    novel.write_text(yaml.safe_dump({**content, "tools": content["tools"][:1]}), encoding="utf-8")
    fitted = fit_tasks(models, describe_path_fault, describe_blow_fault)
    assert fitted.changes == ()
    assert fitted.lacks == {}
    for file in ("nail.yaml", "paths/reach.yaml", "tools/weight.yaml"):
        assert (models / file).read_bytes() == (MODELS / file).read_bytes()


def test_nothing_is_left_of_an_import_that_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    imported = extract_arm(write_urdf(tmp_path), TIP)

    def fail(*_: object) -> None:
        raise RuntimeError("no more")

    monkeypatch.setattr("affordance.extensions.robots.kept.load_arm", fail)
    with pytest.raises(RuntimeError, match="no more"):
        write_folder(*imported, tmp_path / "models", source="a test")
    assert {path.name for path in tmp_path.iterdir()} == {"two_arms.urdf"}
