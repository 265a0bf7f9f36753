"""One robot for everything: opened once, by its folder or its file, and taken by all that need an arm."""

import shutil
from argparse import Namespace
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.refusals import refuse
from helpers.robot_files import write_urdf

from affordance.belief.material_memory import MaterialMemory
from affordance.choice.hammer import Hammer
from affordance.choice.listed_options import list_options
from affordance.choice.ranking import rank
from affordance.choice.reach import Reach
from affordance.commands.payload import identify
from affordance.exceptions import BadArgumentError
from affordance.extensions.memory.ledger import count_of, open_memory
from affordance.extensions.memory.simulated_trial import describe_trial
from affordance.extensions.payload import identify as identification
from affordance.extensions.robots import kept
from affordance.extensions.robots.importer import ImportOptions
from affordance.extensions.robots.kept import import_arm, open_robot
from affordance.extensions.robots.recorded_arm import load_robot
from affordance.files.model_folder import MODELS
from affordance.objects.load import load_tools
from affordance.plant.arm import name_robot
from affordance.plant.load import load_arm
from affordance.robot import Robot
from affordance.simulation.trial import TrialRunner

TIP = ImportOptions("right_tool")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of models of an arm of four joints, with tasks as they come."""
    root = tmp_path_factory.mktemp("robot")
    import_arm(write_urdf(root), TIP, root / "models", with_meshes=False, fits_tasks=False)
    return root / "models"


def test_robot_is_the_papers_arm_unless_another_is_named() -> None:
    robot = Robot()
    assert (robot.is_default, robot.name) == (True, "the paper's arm")
    assert robot.arm is load_arm()
    assert open_robot(None, ImportOptions(""), "nowhere") == robot


def test_robot_has_arm_chain_and_tasks(folder: Path) -> None:
    robot = Robot.load(str(folder))
    assert (robot.is_default, robot.name) == (False, "models")
    assert robot.joint_names == robot.chain.joint_names == ("right_j1", "right_j2", "right_j3", "right_j4")
    assert robot.limits.tau_max.tolist() == [40.0] * 4
    assert robot.home.shape == (4,)
    assert robot.tasks == ("hammer", "reach", "mash", "carry", "hold")
    assert isinstance(robot.load_task("hammer"), Hammer)
    assert isinstance(robot.load_task("mash"), Reach)


def test_chain_of_a_folder_is_that_of_the_robots_file(folder: Path, tmp_path: Path) -> None:
    """Torques of motion agree to 1e-9 N m, although base and hand are posed otherwise than in the robot's file."""
    one = load_robot(folder).with_gravity([0.0, 0.0, 0.0])
    other = load_robot(write_urdf(tmp_path), "right_tool").with_gravity([0.0, 0.0, 0.0])
    q, v, vdot = np.random.default_rng(0).uniform(-1.0, 1.0, (3, 5, 4))
    np.testing.assert_allclose(one.compute_arm_torques(q, v, vdot), other.compute_arm_torques(q, v, vdot), atol=1e-9)


def test_arm_is_recognised_by_what_is_felt_and_by_what_is_recorded(folder: Path, tmp_path: Path) -> None:
    """An arm of a kept folder has the name of its file and tip, and one fingerprint, whatever its tip."""
    kept_folder = tmp_path / "two_arms-right_tool-0123456789ab"
    shutil.copytree(folder, kept_folder)
    robot, chain = Robot.load(kept_folder), load_robot(write_urdf(tmp_path), "right_tool")
    assert robot.name == name_robot(Path(chain.source), chain.tip) == "two_arms-right_tool"
    assert name_robot(Path("arm.urdf"), "left/tool0") == "arm-left_tool0"
    assert robot.chain.fingerprint == chain.fingerprint
    record = TrialRunner(robot=robot).run_hold(
        load_tools(MODELS / "tools" / "novel.yaml")[0], MaterialMemory(), duration=0.1
    )
    felt = describe_trial(record)
    assert felt is not None
    assert (felt.robot, felt.fingerprint) == (robot.name, chain.fingerprint)
    place = tmp_path / "memory.sqlite"
    for fingerprint, count in ((chain.fingerprint, 0), ("of another", 1)):
        with open_memory(place) as ledger:
            ledger.append([replace(felt, fingerprint=fingerprint, source_hash=fingerprint)])
        assert count_of(robot, str(place)) == count
    assert count_of(robot, None) == count_of(robot, str(tmp_path / "nowhere.sqlite")) == 0
    assert count_of(Robot.load(folder), str(place)) == 0  # of another name


def test_what_is_no_robot_is_refused(tmp_path: Path) -> None:
    assert "is not a folder, must be one that import-arm wrote" in refuse(Robot.load, tmp_path / "nowhere")


def test_robots_file_is_imported_once(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    imports = []

    def copy(path: Path, options: ImportOptions, target: Path) -> None:
        imports.append(path.name)
        shutil.copytree(folder, target)

    monkeypatch.setattr(kept, "import_arm", copy)
    path = write_urdf(tmp_path)
    one, other = (open_robot(path, TIP, tmp_path / "kept") for _ in range(2))
    assert one == other
    assert imports == ["two_arms.urdf"]
    assert one.name == "two_arms-right_tool"


def test_trials_and_rankings_are_of_the_robot(folder: Path) -> None:
    robot = Robot.load(folder)
    tool, *_ = load_tools(MODELS / "tools" / "novel.yaml")
    held = tool.gripped_by(tool.grips[0])
    record = TrialRunner(robot=robot).run_hold(held, MaterialMemory(), duration=0.2)
    assert record.q.shape[1] == 4
    ranking = rank(list_options(tool), robot.load_task("reach"), MaterialMemory(), robot=robot, num_samples=20)
    assert len(ranking.ranked[0].works) == 20
    for wrong in ("robot", robot.arm):
        with pytest.raises(BadArgumentError, match="robot: is of type"):
            TrialRunner(robot=wrong)  # type: ignore[arg-type]


def test_identification_takes_a_robot_for_its_chain(folder: Path) -> None:
    """A robot and its chain are taken, so that the next argument is refused; a path is not."""
    robot = Robot.load(folder)
    for arm, refused in ((robot, "runs"), (robot.chain, "runs"), (folder, "arm")):
        said = refuse(identification.identify, arm, "runs", error=BadArgumentError)
        assert said.startswith(f"{refused}: is of type")


def test_payload_of_a_folder_is_at_the_tip_of_its_file_and_a_seen_object_in_the_hand(folder: Path) -> None:
    run = SimpleNamespace(description=SimpleNamespace(tip="", base="", compensated_payload=np.zeros(10)))
    for seen, tip in ((None, TIP.tip), (Path("tools.yaml"), "hand_grip")):
        words = Namespace(robot=folder, robot_option=None, tip=None, object=seen)
        assert identify.load_robot_of(words, run).tip == tip  # type: ignore[arg-type]
