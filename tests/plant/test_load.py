"""Files of an arm that make none are refused with the arm's file and the joint."""

import shutil
from pathlib import Path

import pytest
from helpers.refusals import refuse

from affordance.exceptions import ModelFileError
from affordance.files.model_folder import MODELS
from affordance.plant.load import load_arm


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('frame name="hand_grip"', 'frame name="claw"', "hand_grip"),
        (
            "<effort>9.5</effort>",
            "<effort>0</effort>",
            "has no actuator for wrist_deviation; in a URDF Drake creates one for each <transmission>, in an SDF for"
            " each joint with an effort limit other than 0",
        ),
        (
            'name="elbow_flexion" type="revolute"',
            'name="elbow_flexion" type="prismatic"',
            "has elbow_flexion of type prismatic, must be revolute",
        ),
        (
            "<lower>-1.396263</lower>",
            "<lower>-1</lower>",
            "has forearm_rotation at -1.22173 rad in the home posture, must be from -1 to 1.39626",
        ),
        (
            "<velocity>26.4</velocity>",
            "<velocity>0</velocity>",
            "has elbow_flexion with a velocity limit of 0 rad/s, must be more than 0",
        ),
    ],
)
def test_joints_that_make_no_arm_are_refused(tmp_path: Path, old: str, new: str, said: str) -> None:
    for name in ("arm.dmd.yaml", "package.xml"):
        shutil.copy(MODELS / name, tmp_path)
    text = (MODELS / "arm.sdf").read_text(encoding="utf-8")
    (tmp_path / "arm.sdf").write_text(text.replace(old, new, 1), encoding="utf-8")
    message = refuse(load_arm, tmp_path / "arm.dmd.yaml", error=ModelFileError)
    assert message.startswith(f"{tmp_path / 'arm.dmd.yaml'}: ")
    assert said in message
