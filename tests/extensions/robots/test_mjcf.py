"""An MJCF model is what MuJoCo compiles: joints, torque limits, masses, couplings, and files that it includes."""

import importlib.util
import re
import warnings
from pathlib import Path

import pytest
import trimesh
from helpers.bench_arm import write_bench
from helpers.mujoco_parity import compare_with_mujoco
from helpers.refusals import refuse
from helpers.robot_files import MJCF

from affordance.exceptions import AffordanceError, BadValueError
from affordance.extensions.robots.importer import ImportOptions, extract_arm, read_arm
from affordance.extensions.robots.reduced_arm import ReducedArm

TIP = ImportOptions("grip_site")


def read(folder: Path, *changes: tuple[str, str], options: ImportOptions = TIP) -> ReducedArm:
    """Reads the arm of a model in which texts are exchanged."""
    text = MJCF
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new)
    path = folder / "reacher.xml"
    path.write_text(text)
    return read_arm(path, options)


def list_efforts(arm: ReducedArm) -> list[float]:
    return [link.effort for link in arm.links]


A2 = 'joint="a2" ctrlrange="-9 9"'


# Limits of torque of a1 to a4, whose gears are 3, 2, 2, 3; values as found in the dynamics of MuJoCo 3.17.
@pytest.mark.parametrize(
    ("old", "new", "efforts"),
    [
        # The actuators of a class share their attributes, whatever they are called in it; a class inherits.
        ('<motor gear="2"/>', '<general gear="2" forcerange="-3 3"/>', [9, 6, 14, 9]),
        ('<motor gear="2"/>', '<position gear="2" forcerange="-3 4" kp="9"/>', [9, 6, 14, 9]),
        # The last of them in a class counts.
        ('gear="2"/>', 'gear="2" forcerange="-3 3"/><general forcerange="-4 4"/>', [12, 8, 14, 12]),
        # Control and force are both limited.
        (A2, f'{A2} forcerange="-100 100"', [30, 18, 14, 30]),
        (A2, f'{A2} forcerange="-5 6"', [30, 10, 14, 30]),
        # A limit can be switched off; then the other one holds.
        (A2, f'{A2} forcerange="-1 1" forcelimited="false"', [30, 18, 14, 30]),
        # Limit on the sum of all actuators of a joint.
        ('name="a2" axis="0 1 0"', 'name="a2" axis="0 1 0" actuatorfrcrange="-500 500"', [30, 18, 14, 30]),
        ('name="a2" axis="0 1 0"', 'name="a2" axis="0 1 0" actuatorfrcrange="-4 5"', [30, 4, 14, 30]),
        # A general actuator multiplies its control, unless it feeds back.
        (f"<motor {A2}", '<general joint="a2" ctrlrange="-1 1" gainprm="7"', [30, 14, 14, 30]),
        (
            f"<motor {A2}",
            '<general joint="a2" ctrlrange="-1 1" gainprm="7" biastype="affine" biasprm="0 -70" forcerange="-20 20"',
            [30, 40, 14, 30],
        ),
        # Signs of gear and gain say which way it turns.
        ('gear="2"/>', 'gear="-2"/>', [30, 18, 14, 30]),
        (f"<motor {A2}", '<general joint="a2" ctrlrange="-1 1" gainprm="-7"', [30, 14, 14, 30]),
        # Two actuators of a joint add up.
        ("<actuator>", '<actuator><motor joint="a2" ctrlrange="-1 1"/>', [30, 20, 14, 30]),
    ],
)
def test_torque_is_limited_by_all_that_limits_it(tmp_path: Path, old: str, new: str, efforts: list[int]) -> None:
    assert list_efforts(read(tmp_path, (old, new))) == efforts


def test_joint_has_the_torque_of_the_weaker_direction_and_the_armature_of_its_class(tmp_path: Path) -> None:
    arm = read(tmp_path)
    # All actuators share the gear of 2 that the main class gives to motors.
    assert list_efforts(arm) == [30.0, 18.0, 14.0, 30.0]
    assert [link.rotor_inertia for link in arm.links] == [0.05, 0.05, 0.05, 0.01]
    assert [link.damping for link in arm.links] == [0.1] * 4
    assert arm.X_LH.translation()[0] == pytest.approx(0.1)
    assert {link.velocity for link in arm.links} == {float("inf")}


def test_classes_inherit_from_those_they_are_nested_in_and_the_elements_own_class_comes_first(tmp_path: Path) -> None:
    nested = '<default class="weak"><joint armature="0.7"/></default></default></default>'
    arm = read(
        tmp_path,
        ("</default></default>", nested),
        ('name="second" pos="0.3 0 0"', 'name="second" childclass="weak" pos="0.3 0 0"'),
        ('joint name="a4" axis', 'joint name="a4" class="main" axis'),
        (' armature="0.01"/>', "/>"),
    )
    assert [link.rotor_inertia for link in arm.links] == [0.05, 0.05, 0.7, 0.02]
    assert [link.damping for link in arm.links] == [0.1] * 4
    # The range is of the class "strong", of which the last joint is not.
    assert [link.upper for link in arm.links] == [2.0, 2.0, 2.0, float("inf")]


@pytest.mark.parametrize(
    ("attribute", "limits"),
    [
        ('limited="false"', (float("-inf"), float("inf"))),
        ('limited="true"', (-2.0, 2.0)),
        # MuJoCo's angles count from the reference, the arm's from the pose that the file draws.
        ('ref="0.5"', (-2.5, 1.5)),
    ],
)
def test_limits_of_joints_are_those_of_the_compiler(
    tmp_path: Path, attribute: str, limits: tuple[float, float]
) -> None:
    arm = read(tmp_path, ('range="-2 2"', f'range="-2 2" {attribute}'))
    assert {(link.lower, link.upper) for link in arm.links} == {limits}


def test_a_site_that_is_called_as_its_body_is_told_apart(tmp_path: Path) -> None:
    change = 'site name="grip_site"', 'site name="third"'
    assert read(tmp_path, change, options=ImportOptions("third")).X_LH.translation()[0] == 0.0
    assert read(tmp_path, change, options=ImportOptions("third_site")).X_LH.translation()[0] == pytest.approx(0.1)


def test_bodies_and_joints_without_names_get_some(tmp_path: Path) -> None:
    arm = read(
        tmp_path,
        ('body name="second"', "body"),
        ('<joint name="a3" axis="0 1 0"/>', '<joint axis="0 1 0" actuatorfrcrange="-5 5"/>'),
        ('<position joint="a3" forcerange="-8 7"/>', ""),
    )
    assert [(link.name, link.joint) for link in arm.links][2] == ("body", "body_joint")
    assert list_efforts(arm) == [30.0, 18.0, 5.0, 30.0]


ACTUATORS = MJCF[MJCF.index("<actuator>") : MJCF.index("</mujoco>")]


def write_parts(folder: Path, **files: str) -> Path:
    """Writes a model whose actuators and defaults are included from files of the given content."""
    start, end = MJCF.index("<default>"), MJCF.index("<asset>")
    main = MJCF[:start] + '<include file="parts/defaults.xml"/>' + MJCF[end:]
    main = main.replace(ACTUATORS, '<include file="motors.xml"/>')
    content = {
        "reacher.xml": main,
        "parts/defaults.xml": f"<mujocoinclude>{MJCF[start:end]}</mujocoinclude>",
        "motors.xml": f"<mujoco>{ACTUATORS}</mujoco>",
        **files,
    }
    for name, text in content.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    return folder / "reacher.xml"


def test_included_files_are_part_of_the_model(tmp_path: Path) -> None:
    found = read_arm(write_parts(tmp_path / "split"), TIP)
    assert list_efforts(found) == list_efforts(read(tmp_path))
    assert [path.name for path in found.tree.description.sources] == ["defaults.xml", "motors.xml"]


INCLUDE = '<mujoco><include file="{}"/></mujoco>'


@pytest.mark.parametrize(
    ("motors", "said"),
    [
        (INCLUDE.format("../secret.xml"), "must be a file in the model's own folder"),
        (INCLUDE.format("/etc/hosts"), "motors.xml: include: names '/etc/hosts', must"),
        ("<mujoco><include/></mujoco>", "include: names '', must be a file"),
        (INCLUDE.format("motors.xml"), "nests deeper than 8 files"),
        ('<mujoco><asset><model file="/etc/hosts"/></asset></mujoco>', "include: names '/etc/hosts', must"),
        (INCLUDE.format("none.xml"), "none.xml: cannot be read"),
        (INCLUDE.format("0.xml"), "nests deeper than 8 files"),
        ('<mujoco><replicate count="9"/></mujoco>', "replicate: is not supported, except for sites"),
        ('<mujoco><replicate count="9"><site/><body/></replicate></mujoco>', "replicate: is not supported"),
        ('<mujoco><replicate count="99999"><site/></replicate></mujoco>', "replicate: is not supported"),
        ("<mujoco>", "motors.xml: line 1, column 9: is not XML"),
    ],
)
def test_an_include_stays_in_the_models_folder_and_comes_to_an_end(tmp_path: Path, motors: str, said: str) -> None:
    (tmp_path / "secret.xml").write_text(f"<mujoco>{ACTUATORS}</mujoco>")
    nested = {f"{k}.xml": INCLUDE.format(f"{k + 1}.xml") for k in range(20)}
    with pytest.raises(BadValueError, match=re.escape(said)):
        read_arm(write_parts(tmp_path / "model", **nested, **{"motors.xml": motors}), TIP)


def test_a_link_of_the_models_folder_does_not_lead_out_of_it(tmp_path: Path) -> None:
    (tmp_path / "secret.xml").write_text(f"<mujoco>{ACTUATORS}</mujoco>")
    path = write_parts(tmp_path / "model")
    (path.parent / "motors.xml").unlink()
    (path.parent / "motors.xml").symlink_to(tmp_path / "secret.xml")
    assert "must be a file in the model's own folder" in refuse(read_arm, path, TIP)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            'forcerange="-8 7"',
            'forcerange="-8 7" forcelimited="false"',
            "joint a3: has no torque limit (effort), must have one of more than 0 N m; --effort a3=VALUE sets",
        ),
        (
            'forcerange="-8 7"',
            'ctrlrange="-1 1" kp="50"',
            "joint a3: has no torque limit (effort), must have one of more than 0 N m; --effort a3=VALUE sets",
        ),
        (
            'forcerange="-8 7"',
            'forcerange="0 0"',
            "joint a3: has no torque limit (effort), must have one of more than 0 N m; --effort a3=VALUE sets",
        ),
        ('forcerange="-8 7"', "", "joint a3: has no torque limit (effort)"),
        (
            '<inertial pos="0.05 0 0" mass="0.4" diaginertia="0.001 0.0012 0.0013"/>',
            '<geom type="mesh" mesh="m"/>',
            "link third: derives its inertia from the mesh m, whose file",
        ),
        (
            '<joint damping="0.1"',
            '<joint damping="-1"',
            "joint a1: has a damping of -1 N m s/rad, must be at least 0",
        ),
        ('mass="0.4"', 'mass="0"', "is refused by MuJoCo: Error: mass and inertia of moving bodies"),
        ('class="strong" joint="a4"', 'class="strog" joint="a4"', "unknown default class name 'strog'"),
    ],
)
def test_mistake_in_an_mjcf_is_refused(tmp_path: Path, old: str, new: str, said: str) -> None:
    assert old in MJCF
    path = tmp_path / "bad.xml"
    path.write_text(MJCF.replace(old, new))
    assert said in refuse(extract_arm, path, TIP, error=AffordanceError)


FLANGE = ImportOptions("flange")
COMPILER = '<compiler angle="radian"/>'
OF_F = (
    '<body name="f" pos="0.42 0 0"><inertial pos="0.19 0 0.02" mass="2.3" '
    'fullinertia="0.004 0.055 0.054 0.0 0.001 0.0004"/>'
)
GEOMS = (
    '<body name="f" pos="0.42 0 0"><geom group="2" type="box" size=".2 .1 .1"/>'
    '<geom group="3" type="capsule" fromto="0 0 0 .4 0 0" size=".04"/>'
    '<geom type="ellipsoid" size=".1 .02 .03" pos=".2 0 .1" euler=".1 .2 .3" mass=".7" class="c"/>'
)
CLASS = '<compiler angle="radian"/><default><default class="c"><geom group="3"/></default></default>'


MESH = '<body name="f" pos="0.42 0 0"><geom type="mesh" mesh="m" euler=".1 .2 .3"/>'
DRAWN = '<geom type="mesh" mesh="m" group="1"/><geom type="mesh" mesh="m" group="3"/>'


def compiler(attributes: str) -> tuple[str, str]:
    return COMPILER, f'<compiler angle="radian" {attributes}/>'


@pytest.mark.parametrize(
    "changes",
    [
        [],
        [(COMPILER, CLASS.replace("/>", ' inertiagrouprange="3 3"/>', 1)), (OF_F, GEOMS)],
        [(COMPILER, CLASS.replace("/>", ' inertiagrouprange="0 2"/>', 1)), (OF_F, GEOMS)],
        [(COMPILER, CLASS), (OF_F, GEOMS)],
        [compiler('settotalmass="30"')],
        [compiler('settotalmass="30"'), ('<body name="pedestal">', '<body name="pedestal"><geom size=".1"/>')],
        [compiler('boundmass="2" boundinertia="0.01"')],
        [compiler('boundmass="2" boundinertia="0.01" settotalmass="12"')],
        [compiler('balanceinertia="true"'), ("0.02 0.24 0.23 0.001 0.002 0.0", "0.02 0.24 0.13 0.001 0.002 0.0")],
        [
            compiler('balanceinertia="true" boundinertia="0.003"'),
            (
                'mass="0.4" fullinertia="0.0002 0.00017 0.00016 0.0 0.0 0.0"',
                'mass=".4" quat="1 .2 .1 0" diaginertia=".2 .02 .01"',
            ),
        ],
        [("<worldbody>", '<option gravity="0 -9.81 0"/><worldbody>')],
        [("<worldbody>", '<option gravity="9.81 0 0"/><worldbody>')],
        [("<worldbody>", '<asset><mesh name="m" file="m.stl"/></asset><worldbody>'), (OF_F, MESH)],
        [("<worldbody>", '<asset><mesh name="m" file="none.stl"/></asset><worldbody>'), (OF_F, OF_F + DRAWN)],
    ],
)
def test_dynamics_are_those_of_mujoco(tmp_path: Path, changes: list[tuple[str, str]]) -> None:
    trimesh.creation.box((0.1, 0.2, 0.05)).export(tmp_path / "m.stl")
    path = write_bench(tmp_path, *changes, mjcf=True)
    with warnings.catch_warnings(action="ignore"):  # MuJoCo's, of settotalmass
        assert compare_with_mujoco(path, read_arm(path, FLANGE)) < 1e-9


PAD = (
    '<body name="pad" pos=".1 0 0"><inertial pos="0 .3 0" mass=".3" diaginertia=".0002 .0002 .0002"/>'
    '<joint name="k_pad" type="slide" axis="0 1 0" range="0.01 .04"/></body>'
    '<body name="jaw" pos=".1 0 0"><inertial pos="0 .3 0" mass=".3" diaginertia=".0002 .0002 .0002"/>'
    '<joint name="k_jaw" axis="0 0 1"/></body><site name="flange"'
)


@pytest.mark.parametrize(
    ("equality", "pad", "jaw"),
    [
        ('<joint joint1="k_pad" polycoef="0.02 0 0 0 0"/>', 0.02, 0.0),
        ('<joint joint1="k_pad" polycoef="0.02 0 0 0 0" active="false"/>', 0.01, 0.0),
        ('<joint joint1="k_jaw" joint2="k_pad" polycoef="0.1 2 30 0 0"/>', 0.01, 0.123),
    ],
)
def test_coupled_joints_are_frozen_where_the_coupling_puts_them(
    tmp_path: Path, equality: str, pad: float, jaw: float
) -> None:
    """Frozen positions are those that MuJoCo's documentation of ``polycoef`` gives; dynamics there are MuJoCo's."""
    end = ("</worldbody>", f"</worldbody><equality>{equality}</equality>")
    path = write_bench(tmp_path, ('<site name="flange"', PAD), end, mjcf=True)
    arm = read_arm(path, FLANGE)
    assert arm.frozen == pytest.approx({"k_pad": pad, "k_jaw": jaw})
    assert compare_with_mujoco(path, arm) < 1e-9


@pytest.mark.parametrize(("gravity", "strength"), [("0 0 -1.62", 1.62), ("0 0 0", 0.0), ("0 -3.7 0", 3.7)])
def test_another_strength_of_gravity_is_remarked_on(tmp_path: Path, gravity: str, strength: float) -> None:
    path = write_bench(tmp_path, ("<worldbody>", f'<option gravity="{gravity}"/><worldbody>'), mjcf=True)
    arm = read_arm(path, FLANGE)
    assert f"the file's gravity is {strength:g} m/s^2, but 9.81 m/s^2 is used" in arm.tree.description.remarks


def test_gravity_along_no_axis_is_refused(tmp_path: Path) -> None:
    path = write_bench(tmp_path, ("<worldbody>", '<option gravity="1 0 -9"/><worldbody>'), mjcf=True)
    assert "gravity: is 1 0 -9, must be along an axis" in refuse(read_arm, path, FLANGE)


def test_given_axis_that_points_up_replaces_that_of_gravity(tmp_path: Path) -> None:
    path = write_bench(tmp_path, ("<worldbody>", '<option gravity="0 -9.81 0"/><worldbody>'), mjcf=True)
    assert read_arm(path, FLANGE).up == "y"
    assert read_arm(path, ImportOptions("flange", up="x")).up == "x"


def test_weight_that_the_simulator_carries_is_refused_or_left_to_the_motors(tmp_path: Path) -> None:
    path = write_bench(tmp_path, ('<body name="u"', '<body name="u" gravcomp="1"'), mjcf=True)
    said = "link u: has a gravcomp of 1: MuJoCo carries its weight, but the motors must carry it; --gravcomp none"
    assert said in refuse(read_arm, path, FLANGE)
    arm = read_arm(path, ImportOptions("flange", gravcomp=False))
    assert compare_with_mujoco(write_bench(tmp_path, mjcf=True), arm) < 1e-9


def test_total_mass_needs_all_masses(tmp_path: Path) -> None:
    mesh = ("<worldbody>", '<asset><mesh name="m" file="m.stl"/></asset><worldbody>')
    table = ('<body name="pedestal">', '<body name="pedestal"><geom type="mesh" mesh="m"/>')
    path = write_bench(tmp_path, mesh, table, compiler('settotalmass="30"'), mjcf=True)
    assert "settotalmass: needs all masses, but link pedestal derives its inertia" in refuse(read_arm, path, FLANGE)


@pytest.mark.parametrize(
    ("tie", "said"),
    [
        ('<connect body1="w3" body2="f" anchor="0 0 0"/>', "body w3 is tied to f by <connect>"),
        ('<weld body1="w3"/>', "body w3 is tied to the world by <weld>"),
        ('<connect site1="flange" site2="palm"/>', "body w3 is tied to f by <connect>"),
        ('<connect body1="w3" body2="f" anchor="0 0 0" active="false"/>', ""),
    ],
)
def test_loops_that_are_cut_are_named(tmp_path: Path, tie: str, said: str) -> None:
    end = ("</worldbody>", f"</worldbody><equality>{tie}</equality>")
    palm = ('<body name="w1"', '<site name="palm"/><body name="w1"')
    remarks = read_arm(write_bench(tmp_path, palm, end, mjcf=True), FLANGE).tree.description.remarks
    assert [each.split(";")[0] for each in remarks] == ([said] if said else [])


def test_drake_does_not_warn_of_what_is_read(tmp_path: Path) -> None:
    more = 'actuatorfrcrange="-28 28" frictionloss=".1" stiffness="2" springref=".1" armature=".01" margin="1"'
    option = ("<worldbody>", '<option timestep="0.01" cone="elliptic"/><worldbody>')
    path = write_bench(tmp_path, ('actuatorfrcrange="-28 28"', more), option, mjcf=True)
    assert read_arm(path, FLANGE).tree.remarks == ()


def test_turned_shapes_are_drawn(tmp_path: Path) -> None:
    path = write_bench(tmp_path, (OF_F, GEOMS.replace(' class="c"', "")), mjcf=True)
    shapes = read_arm(path, FLANGE).tree.description.visuals["f"]
    assert [(each.shape, each.place) for each in shapes] == [("box", (0.0, 0.0, 0.0)), ("ellipsoid", (0.2, 0.0, 0.1))]
    assert shapes[0].sizes == (0.4, 0.2, 0.2)
    assert any(shapes[1].rpy)


def test_without_mujoco_the_command_to_type_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write_bench(tmp_path, mjcf=True)
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    assert "needs pip install 'visual-inertial-affordances[mjcf]'" in refuse(read_arm, path, FLANGE)


def test_replicated_sites_weigh_nothing(tmp_path: Path) -> None:
    path = tmp_path / "a.xml"
    rays = '<replicate count="36" euler="0 0 0.1745"><site name="ray" zaxis="1 0 0"/></replicate>'
    path.write_text(MJCF.replace('<site name="grip_site"', f'{rays}<site name="grip_site"'))
    with_rays = read_arm(path, ImportOptions("grip_site"))
    path.write_text(MJCF)
    assert [link.inertial for link in with_rays.links] == [
        link.inertial for link in read_arm(path, ImportOptions("grip_site")).links
    ]
