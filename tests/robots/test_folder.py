"""The folder that an import writes: the strict program takes it, and nothing is half written."""

import shutil
from pathlib import Path

import numpy as np
import pytest
import yaml
from helpers.robot_files import write_urdf

from affordance.belief.material_memory import MaterialMemory
from affordance.exceptions import AffordanceError
from affordance.files.model_folder import MODELS
from affordance.objects.load import load_tools
from affordance.objects.materials import load_materials
from affordance.plant.arm import ARM
from affordance.plant.arm_model import ArmModel
from affordance.plant.load import load_arm
from affordance.robots.fitting import fit_tasks
from affordance.robots.importer import ImportOptions, extract_arm
from affordance.robots.kept import write_folder
from affordance.settings import Settings
from affordance.simulation.trial import TrialRunner


@pytest.fixture(scope="module")
def ours(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Our own arm through the importer, in its own posture and place."""
    arm = load_arm()
    posture = dict(zip(arm.joint_names, arm.home.tolist(), strict=True))
    folder = tmp_path_factory.mktemp("ours") / "models"
    imported = extract_arm(MODELS / "arm.sdf", ImportOptions("hand_grip", posture=posture, height=1.44))
    write_folder(imported, folder, source="arm.sdf")
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
    tool = load_tools(MODELS / "tools" / "weight.yaml", load_materials(MODELS / "materials.yaml"))[0]
    records = [
        TrialRunner(Settings(arm=arm)).run_hold(tool, MaterialMemory(), duration=0.3, seed=(0,))
        for arm in (ARM, ours / ARM.name)
    ]
    np.testing.assert_array_equal(records[1].q, records[0].q)
    np.testing.assert_array_equal(records[1].height_centre, records[0].height_centre)


def test_tasks_that_our_own_arm_can_do_stay_as_they_are(ours: Path, tmp_path: Path) -> None:
    """With the paper's tool; all of them take twenty seconds."""
    models = tmp_path / "models"
    shutil.copytree(ours, models)
    novel = models / "tools" / "novel.yaml"
    content = yaml.safe_load(novel.read_text(encoding="utf-8"))
    novel.write_text(yaml.safe_dump({**content, "tools": content["tools"][:1]}), encoding="utf-8")
    fitted = fit_tasks(models)
    assert fitted.changes == ()
    assert fitted.lacks == {}
    for file in ("nail.yaml", "paths/reach.yaml", "tools/weight.yaml"):
        assert (models / file).read_bytes() == (MODELS / file).read_bytes()


def test_a_folder_that_holds_something_is_left_alone(tmp_path: Path) -> None:
    imported = extract_arm(write_urdf(tmp_path), ImportOptions("right_tool"))
    taken = tmp_path / "taken"
    taken.mkdir()
    (taken / "mine.txt").write_text("mine")
    with pytest.raises(AffordanceError, match="which is not an empty folder"):
        write_folder(imported, taken, source="a test")
    assert [path.name for path in taken.iterdir()] == ["mine.txt"]


def test_nothing_is_left_of_an_import_that_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    imported = extract_arm(write_urdf(tmp_path), ImportOptions("right_tool"))

    def fail(*_: object) -> None:
        raise RuntimeError("no more")

    monkeypatch.setattr("affordance.robots.kept.load_arm", fail)
    with pytest.raises(RuntimeError, match="no more"):
        write_folder(imported, tmp_path / "models", source="a test")
    assert {path.name for path in tmp_path.iterdir()} == {"two_arms.urdf"}


def test_a_robot_full_of_traps_becomes_an_arm_that_the_strict_program_takes(tmp_path: Path) -> None:
    imported = extract_arm(write_urdf(tmp_path), ImportOptions("right_tool"))
    remarks = write_folder(imported, tmp_path / "models", source="a test")
    arm = load_arm(tmp_path / "models" / ARM.name)
    assert arm.joint_names == ["right_j1", "right_j2", "right_j3", "right_j4"]
    np.testing.assert_array_equal(arm.limits.tau_max, [40.0] * 4)
    # Its meshes are nowhere: capsules stand for them.
    assert "the mesh package://nowhere/meshes/right_1.stl was not found" in remarks
    assert "<capsule>" in (tmp_path / "models" / "arm.sdf").read_text()
