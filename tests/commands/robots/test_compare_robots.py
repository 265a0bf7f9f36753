"""Comparison of two files of one robot, of two formats."""

from pathlib import Path

import numpy as np
import pytest
from helpers.answers import answer
from helpers.bench_arm import build_bench_mjcf, write_bench
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix

from affordance.extensions.robots.comparison import compare, read_joints
from affordance.extensions.robots.description import Inertial
from affordance.extensions.robots.home import HomePosture
from affordance.extensions.robots.importer import ImportOptions, read_arm
from affordance.extensions.robots.kept import write_folder
from affordance.extensions.robots.reduced_arm import describe_pose


def test_files_of_one_arm_in_two_formats_agree(tmp_path: Path) -> None:
    """MJCF has no velocity limits, which is no difference."""
    urdf, mjcf = write_bench(tmp_path), write_bench(tmp_path, mjcf=True)
    for one, other in ((urdf, mjcf), (mjcf, urdf)):
        found = answer("compare-robots", one, other, "--tip", "flange", "--other-tip", "flange")
        assert " ".join(found.lines).startswith(
            "The arms agree to 1 % (17.2 and 17.2 kg, 6 joints). At 20 random postures, "
        )
        assert "remark: velocity limits are not compared: an MJCF has none" in found.lines
    assert "remark" not in " ".join(answer("compare-robots", urdf, urdf).lines)


@pytest.mark.parametrize("seed", [0, 1])
def test_an_arm_agrees_with_itself_in_other_frames(tmp_path: Path, seed: int) -> None:
    """Links' frames are turned, and moved along the axes; the base is moved, and turned about the vertical."""
    path, rng = write_bench(tmp_path), np.random.default_rng(seed)
    arm = read_arm(path, ImportOptions("flange"))
    base = RigidTransform(RollPitchYaw(0.0, 0.0, rng.uniform(-3.0, 3.0)), rng.normal(size=3))
    parts, before, parent = ['<robot name="other"><link name="plate"/>'], base, "plate"

    def write_origin(X: RigidTransform) -> str:
        place, rpy = (" ".join(map(repr, each)) for each in describe_pose(X))
        return f'<origin xyz="{place}" rpy="{rpy}"/>'

    for link in arm.links:
        R = RotationMatrix(RollPitchYaw(rng.uniform(-1.5, 1.5, 3)))
        X_LN = RigidTransform(R, np.array(link.axis) * rng.uniform(-0.3, 0.3))
        inertial: Inertial = link.inertial
        moments = " ".join(f'{name}="{value!r}"' for name, value in zip(_MOMENTS, inertial.moments, strict=True))
        X_NC = X_LN.inverse() @ RigidTransform(np.array(inertial.place))
        parts.append(
            f'<link name="{link.name}"><inertial>{write_origin(X_NC)}<mass value="{inertial.mass}"/>'
            f'<inertia {moments}/></inertial></link><joint name="{link.joint}" type="revolute">'
            f'<parent link="{parent}"/><child link="{link.name}"/>{write_origin(before @ link.X_PL @ X_LN)}'
            f'<axis xyz="{" ".join(map(repr, (R.inverse() @ np.array(link.axis)).tolist()))}"/>'
            f'<limit lower="{link.lower}" upper="{link.upper}" effort="{link.effort}" velocity="{link.velocity}"/>'
            "</joint>"
        )
        before, parent = X_LN.inverse(), link.name
    parts.append(
        f'<link name="flange"/><joint name="end" type="fixed"><parent link="{parent}"/><child link="flange"/>'
        f"{write_origin(before @ arm.X_LT)}</joint></robot>"
    )
    other = tmp_path / "other.urdf"
    other.write_text("".join(parts))
    found = compare(read_joints(path), read_joints(other))
    assert not found.differs
    assert max(max(each.apart.values()) for each in found.joints) < 1e-7
    assert max(found.mass_matrix, found.gravity) < 1e-7
    assert len(found.remarks) == 1
    assert "their base frames differ" in found.remarks[0]
    assert compare(read_joints(other), read_joints(path)).differs is False


_MOMENTS = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
_J_F = '<origin xyz="0.42 0 0"/><axis xyz="0 1 0"/>'


@pytest.mark.parametrize(
    ("change", "differing"),
    [
        (('mass value="8.4"', 'mass value="8.8"'), {"j_u": ["mass"]}),
        (('mass value="8.4"', 'mass value="8.41"'), {}),
        (('xyz="0.21 0 0.12"', 'xyz="0.25 0 0.12"'), {"j_u": ["centre"]}),
        (('xyz="0.21 0 0.12"', 'xyz="-0.21 0 0.12"'), {"j_u": ["centre"]}),
        (('xyz="0.21 0 0.12"', 'xyz="0.21 0.3 0.12"'), {"j_u": ["centre"]}),  # along the axis
        (('iyy="0.055"', 'iyy="0.057"'), {"j_f": ["moments"]}),
        (('ixy="0.001" ixz="0.002"', 'ixy="0.001" ixz="0.06"'), {"j_u": ["moments"]}),  # turned axes
        (('xyz="0.42 0 0"', 'xyz="0.44 0 0"'), {"j_f": ["place"]}),
        (('xyz="0 0 0.095"', 'xyz="0 0 0.2"'), {"j_w3": ["place"]}),  # along the axis of j_w2
        (('xyz="0 0.1 0"', 'xyz="0 0.1 0.1"'), {"j_w2": ["centre"], "j_w3": ["place"]}),  # along its own axis
        (('<origin xyz="0.09 0 0"/>', '<origin xyz="0.24 0 0"/>'), {"j_w3": ["tip"]}),
        ((_J_F, _J_F.replace("0 1 0", "0 -1 0")), {"j_f": ["axis"]}),
        ((_J_F, _J_F.replace("0 1 0", "0.1 1 0")), {"j_f": ["axis"]}),
        ((_J_F, _J_F.replace('"/><axis', '" rpy="0 0.5 0"/><axis')), {"j_f": ["zero"]}),
        ((_J_F, _J_F.replace('"/><axis', '" rpy="0.1 0.5 0"/><axis')), {"j_f": ["axis", "zero"]}),
        (
            ('lower="-2.9" upper="2.9" effort="120"', 'lower="-3" upper="2.9" effort="130"'),
            {"j_f": ["lower", "effort"]},
        ),
        (('upper="2.9" effort="120"', 'upper="1.9" effort="120"'), {"j_f": ["upper"]}),
        (('effort="120" velocity="3.1"', 'effort="120" velocity="2.1"'), {"j_f": ["velocity"]}),
    ],
)
def test_what_differs_is_named_by_joint(
    tmp_path: Path, change: tuple[str, str], differing: dict[str, list[str]]
) -> None:
    (tmp_path / "other").mkdir()
    one, other = write_bench(tmp_path), write_bench(tmp_path / "other", change)
    content = answer("compare-robots", one, other, "--json", status=3 if differing else 0).content
    found = {each["one"]["joint"]: each["differing"] for each in content["joints"] if each["differing"]}
    assert found == differing
    names = {name for of_joint in differing.values() for name in of_joint}
    largest = max(content["mass_matrix"], content["gravity"])
    if names & {"axis", "zero", "place", "mass", "centre"}:
        assert largest > 0.01
    elif "moments" not in names:
        assert largest < 0.01


def test_rotors_are_compared_where_both_formats_state_them(tmp_path: Path) -> None:
    urdf, one, other = write_bench(tmp_path), tmp_path / "one.xml", tmp_path / "other.xml"
    one.write_text(build_bench_mjcf())
    other.write_text(build_bench_mjcf(('<joint name="j_u"', '<joint armature="0.2" name="j_u"')))
    assert "rotor inertia of j_u (0 | 0.200 kg m^2)" in " ".join(answer("compare-robots", one, other, status=3).lines)
    assert "remark: rotor inertias are not compared" in " ".join(answer("compare-robots", urdf, other).lines)


def test_an_inertia_that_no_solid_can_have_is_said(tmp_path: Path) -> None:
    path = write_bench(tmp_path, ('<mass value="8.4"/>', '<mass value="-8"/>'))
    said = " ".join(answer("compare-robots", path, path).lines)
    assert said.count("remark: bench.urdf: link u has a mass of -8 kg with moments of inertia") == 1


def test_tips_of_other_names_are_compared_only_if_they_are_given(tmp_path: Path) -> None:
    path = write_bench(tmp_path)
    said = " ".join(answer("compare-robots", path, path, "--other-tip", "w3").lines)
    assert "remark: the tips flange and w3, 90 mm apart, are not compared (--tip, --other-tip)" in said
    said = " ".join(answer("compare-robots", path, path, "--tip", "flange", "--other-tip", "w3", status=3).lines)
    assert "tip of j_w3 (0.090 m)" in said


def test_an_imported_folder_is_compared_with_its_file(tmp_path: Path) -> None:
    """Also if the arm is mounted at an angle."""
    mount = (
        '<link name="mount"/><joint name="tilted" type="fixed"><parent link="mount"/><child link="pedestal"/>'
        '<origin rpy="0 0.3 0"/></joint><link name="pedestal"/>'
    )
    path = write_bench(tmp_path, ('<link name="pedestal"/>', mount))
    home = HomePosture(np.zeros(6), 0.0, 0.0, np.zeros(6), 1.0, "j_u", 1.0, 0.9, 1.0, 1.0, 0.0)
    write_folder(read_arm(path, ImportOptions("flange")), home, tmp_path / "arm", source="bench", with_meshes=False)
    assert "The arms agree" in " ".join(answer("compare-robots", path, tmp_path / "arm").lines)


def test_arms_with_other_numbers_of_joints_are_refused(tmp_path: Path) -> None:
    path = write_bench(tmp_path)
    said = answer("compare-robots", path, path, "--other-tip", "w2", status=2).err
    assert (
        "have 6 joints (j_s, j_u, j_f, j_w1, j_w2, j_w3) and 5 (j_s, j_u, j_f, j_w1, j_w2), must have equally many"
        in said
    )
