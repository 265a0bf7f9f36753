"""The arm alone moves as it does in the whole robot."""

from pathlib import Path

import numpy as np
import pytest
from helpers.pinocchio_parity import compute_parity
from helpers.refusals import refuse
from helpers.robot_files import MJCF, SDF, write_urdf
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant

from affordance.extensions.robots.home import plant_arm
from affordance.extensions.robots.importer import ImportOptions, read_arm
from affordance.plant.arm_model import ArmModel

# Tolerance for rounding.
EXACT = 1e-12


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_urdf_arm_agrees_with_pinocchio_whatever_is_frozen(tmp_path: Path, seed: int) -> None:
    pytest.importorskip("pinocchio")
    grey = '<material name="grey"><color rgba="0.5 0.5 0.5 1"/></material>'  # Pinocchio accepts it only once
    path = write_urdf(tmp_path, changes={grey: ""})
    assert compute_parity(path, ImportOptions("right_tool"), seed).largest < EXACT


def test_an_mjcf_arm_agrees_with_pinocchio(tmp_path: Path) -> None:
    pytest.importorskip("pinocchio")
    path = tmp_path / "reacher.xml"
    text = MJCF
    # Pinocchio would open the mesh, lets a free root fall or puts it at the origin, and makes one joint of the two of
    # a body.
    for unwanted in (
        ' pos="0 0 0.4"',
        '<mesh name="m" file="nowhere.stl"/>',
        '<geom type="mesh" mesh="m"/>',
        "<freejoint/>",
        '<joint name="a2" axis="0 1 0"/>',
        '<motor joint="a2" ctrlrange="-9 9"/>',
    ):
        assert unwanted in text
        text = text.replace(unwanted, "")
    path.write_text(text)
    assert compute_parity(path, ImportOptions("third")).largest < EXACT


def test_an_sdf_arm_agrees_with_the_block_of_the_whole_robots_mass_matrix(tmp_path: Path) -> None:
    path = tmp_path / "swinger.sdf"
    path.write_text(SDF)
    imported = read_arm(path, ImportOptions("grip", base="upper", posture={"pan": 0.7}))
    whole = MultibodyPlant(0.0)
    without_mesh = SDF[: SDF.index("<collision")] + SDF[SDF.index("</collision>") + len("</collision>") :]
    Parser(whole).AddModelsFromString(without_mesh, "sdf")
    whole.WeldFrames(whole.world_frame(), whole.GetFrameByName("foot"))
    whole.Finalize()
    context, rng = whole.CreateDefaultContext(), np.random.default_rng(4)
    ours = plant_arm(imported).plant
    own = ours.CreateDefaultContext()
    for _ in range(10):
        q = rng.uniform(-1.5, 1.5, 2)
        whole.SetPositions(context, np.array([0.7, *q]))
        ours.SetPositions(own, q)
        p_WG = whole.GetFrameByName("grip").CalcPoseInWorld(context).translation()
        for actual, expected in (
            (ours.CalcMassMatrix(own), whole.CalcMassMatrix(context)[1:, 1:]),
            (ours.CalcGravityGeneralizedForces(own), whole.CalcGravityGeneralizedForces(context)[1:]),
            (ours.GetFrameByName("hand_grip").CalcPoseInWorld(own).translation(), p_WG),
        ):
            np.testing.assert_allclose(actual, expected, rtol=0.0, atol=EXACT)


def test_a_gripper_weighs_what_its_parts_weigh(tmp_path: Path) -> None:
    arm = read_arm(write_urdf(tmp_path), ImportOptions("right_tool"))
    assert arm.mass == pytest.approx(2.0 / 2 + 2.0 / 3 + 2.0 / 4 + 2.0 / 5 + 0.05 + 0.04, rel=1e-14)
    assert [name for name, _ in arm.links[-1].bodies] == ["right_4", "right_tool", "right_finger", "right_thumb"]


def test_joints_that_follow_are_frozen_where_they_follow_to(tmp_path: Path) -> None:
    imported = read_arm(write_urdf(tmp_path), ImportOptions("right_tool", posture={"right_grip": 0.03, "neck": 0.5}))
    assert imported.frozen["right_follow"] == pytest.approx(5 * 0.03 + 0.1)
    assert imported.frozen["left_follow"] == pytest.approx(0.1)
    assert imported.frozen["neck"] == 0.5


def test_rotors_and_damping_are_what_is_asked_for(tmp_path: Path) -> None:
    path = write_urdf(tmp_path)
    kept = read_arm(path, ImportOptions("right_tool"))
    assert [link.damping for link in kept.links] == [0.0, 0.2, 0.0, 0.0]
    options = ImportOptions("right_tool", rotor_inertia={"": 0.1, "right_j2": 0.3}, damping=False)
    changed = read_arm(path, options)
    assert [link.damping for link in changed.links] == [0.0] * 4
    q = np.array([0.1, 0.2, 0.3, 0.4])
    matrices = []
    for arm in (kept, changed):
        model = ArmModel(plant_arm(arm))
        model.set_posture(q)
        matrices.append(model.compute_mass_matrix())
    np.testing.assert_allclose(matrices[1] - matrices[0], np.diag([0.1, 0.3, 0.1, 0.1]), rtol=0.0, atol=1e-14)


def test_models_that_share_names_keep_what_is_theirs(tmp_path: Path) -> None:
    """Two arms of one kind in a world have their own values, and tips that are told apart by full names."""
    model = SDF.removeprefix('<sdf version="1.9">').removesuffix("</sdf>")
    twin = model.replace('name="swinger"', 'name="other"').replace("<mass>0.5</mass>", "<mass>0.7</mass>")
    twin = twin.replace("<effort>30</effort>", "<effort>35</effort>")
    path = tmp_path / "twins.sdf"
    path.write_text(f'<sdf version="1.9"><world name="w">{model}{twin}</world></sdf>')
    first, second = (read_arm(path, ImportOptions(f"{name}::grip")) for name in ("swinger", "other"))
    assert [link.effort for link in first.links] == [30.0, 30.0, 20.0]
    assert [link.effort for link in second.links] == [35.0, 35.0, 20.0]
    assert (first.links[-1].inertial.mass, second.links[-1].inertial.mass) == (0.5, 0.7)
    assert first.joint_names == second.joint_names == ["pan", "tilt", "bend"]
    assert "has more than once: other::grip, swinger::grip" in refuse(read_arm, path, ImportOptions("grip"))
