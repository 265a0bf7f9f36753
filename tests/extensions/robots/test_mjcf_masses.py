"""Masses, inertias, gravity and couplings of MJCF models, against MuJoCo itself."""

from pathlib import Path

import pytest
from helpers.bench_arm import write_bench
from helpers.mujoco_parity import compare_with_mujoco
from helpers.refusals import refuse

from affordance.extensions.robots.importer import ImportOptions, read_arm

TIP = ImportOptions("flange")
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
    ],
)
def test_dynamics_are_those_of_mujoco(tmp_path: Path, changes: list[tuple[str, str]]) -> None:
    path = write_bench(tmp_path, *changes, mjcf=True)
    assert compare_with_mujoco(path, read_arm(path, TIP)) < 1e-9


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
    arm = read_arm(path, TIP)
    assert arm.frozen == pytest.approx({"k_pad": pad, "k_jaw": jaw})
    assert compare_with_mujoco(path, arm) < 1e-9


@pytest.mark.parametrize(("gravity", "strength"), [("0 0 -1.62", 1.62), ("0 0 0", 0.0), ("0 -3.7 0", 3.7)])
def test_another_strength_of_gravity_is_remarked_on(tmp_path: Path, gravity: str, strength: float) -> None:
    path = write_bench(tmp_path, ("<worldbody>", f'<option gravity="{gravity}"/><worldbody>'), mjcf=True)
    arm = read_arm(path, TIP)
    assert f"the file's gravity is {strength:g} m/s^2, but 9.81 m/s^2 is used" in arm.tree.description.remarks


def test_gravity_along_no_axis_is_refused(tmp_path: Path) -> None:
    path = write_bench(tmp_path, ("<worldbody>", '<option gravity="1 0 -9"/><worldbody>'), mjcf=True)
    assert "gravity: is 1 0 -9, must be along an axis" in refuse(read_arm, path, TIP)


def test_given_axis_that_points_up_replaces_that_of_gravity(tmp_path: Path) -> None:
    path = write_bench(tmp_path, ("<worldbody>", '<option gravity="0 -9.81 0"/><worldbody>'), mjcf=True)
    assert read_arm(path, TIP).up == "y"
    assert read_arm(path, ImportOptions("flange", up="x")).up == "x"


def test_weight_that_the_simulator_carries_is_refused_or_left_to_the_motors(tmp_path: Path) -> None:
    path = write_bench(tmp_path, ('<body name="u"', '<body name="u" gravcomp="1"'), mjcf=True)
    said = "link u: has a gravcomp of 1: MuJoCo carries its weight, but the motors must carry it; --gravcomp none"
    assert said in refuse(read_arm, path, TIP)
    arm = read_arm(path, ImportOptions("flange", gravcomp=False))
    assert compare_with_mujoco(write_bench(tmp_path, mjcf=True), arm) < 1e-9


def test_total_mass_needs_all_masses(tmp_path: Path) -> None:
    mesh = ("<worldbody>", '<asset><mesh name="m" file="m.stl"/></asset><worldbody>')
    table = ('<body name="pedestal">', '<body name="pedestal"><geom type="mesh" mesh="m"/>')
    path = write_bench(tmp_path, mesh, table, compiler('settotalmass="30"'), mjcf=True)
    assert "settotalmass: needs all masses, but link pedestal derives its inertia" in refuse(read_arm, path, TIP)


@pytest.mark.parametrize(
    ("tie", "said"),
    [
        ('<connect body1="w3" body2="f" anchor="0 0 0"/>', "body w3 is tied to f by <connect>"),
        ('<weld body1="w3"/>', "body w3 is tied to the world by <weld>"),
        ('<connect site1="flange" site2="flange"/>', "body w3 is tied to w3 by <connect>"),
        ('<connect body1="w3" body2="f" anchor="0 0 0" active="false"/>', ""),
    ],
)
def test_loops_that_are_cut_are_named(tmp_path: Path, tie: str, said: str) -> None:
    end = ("</worldbody>", f"</worldbody><equality>{tie}</equality>")
    remarks = read_arm(write_bench(tmp_path, end, mjcf=True), TIP).tree.description.remarks
    assert [each.split(";")[0] for each in remarks] == ([said] if said else [])


def test_drake_does_not_warn_of_what_is_read(tmp_path: Path) -> None:
    more = 'actuatorfrcrange="-28 28" frictionloss=".1" stiffness="2" springref=".1" armature=".01" margin="1"'
    option = ("<worldbody>", '<option timestep="0.01" cone="elliptic"/><worldbody>')
    path = write_bench(tmp_path, ('actuatorfrcrange="-28 28"', more), option, mjcf=True)
    assert read_arm(path, TIP).tree.remarks == ()
