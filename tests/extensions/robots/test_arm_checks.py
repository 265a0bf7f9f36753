"""What is wrong with an arm is said at once, with the options that settle it; what hardly matters is mended."""

from pathlib import Path

import numpy as np
import pytest
from helpers.bench_arm import write_bench
from helpers.refusals import refuse

from affordance.extensions.robots.description import Inertial
from affordance.extensions.robots.importer import ImportOptions, extract_arm, read_arm
from affordance.extensions.robots.recorded_arm import load_robot
from affordance.extensions.robots.report import list_warnings

TIP = ImportOptions("flange")
NO_LIMITS = [(f'effort="{effort}" velocity="3.1"', 'effort="0" velocity="-1"') for effort in (150, 120, 28)]
PAD = (
    "</robot>",
    '<link name="pad"><inertial><mass value="{mass}"/><inertia ixx="{large}" iyy="2e-6" izz="2e-6" ixy="0" ixz="0" '
    'iyz="0"/></inertial></link><joint name="j_pad" type="prismatic"><parent link="flange"/><child link="pad"/>'
    '<axis xyz="0 1 0"/><limit lower="0" upper="0.04" effort="20" velocity="0.1"/></joint></robot>',
)


def add_pad(mass: float, large: float) -> tuple[str, str]:
    return PAD[0], PAD[1].format(mass=mass, large=large)


def test_all_faults_are_in_one_message_with_the_options_that_settle_them(tmp_path: Path) -> None:
    heavy = add_pad(2.0, 0.05)
    damping = ('<axis xyz="1 0 0"/>', '<axis xyz="1 0 0"/><dynamics damping="-2"/>')
    path = write_bench(tmp_path, *NO_LIMITS, heavy, damping)
    said = refuse(read_arm, path, TIP)
    for part in (
        "joint j_s: has a torque limit (effort) of 0 N m, must be more than 0 (as have j_u, j_f, j_w1, j_w2, j_w3)",
        "--effort VALUE sets limits (N m)",
        "joint j_s: has a velocity limit of -1 rad/s, must be more than 0 (as have j_u, j_f, j_w1, j_w2, j_w3)",
        "--velocity VALUE sets limits (rad/s)",
        "joint j_w3: has a damping of -2 N m s/rad, must be at least 0; --damping none",
        "link pad: has an inertia no solid can have",
        "--mend-inertia",
    ):
        assert part in said
    options = ImportOptions(
        "flange", effort={"": 90.0}, velocity={"": 2.0, "j_u": 1.0}, damping=False, mend_inertia=True
    )
    arm = read_arm(path, options)
    assert [link.velocity for link in arm.links] == [2.0, 1.0, 2.0, 2.0, 2.0, 2.0]
    assert [link.effort for link in arm.links] == [90.0] * 6
    assert arm.mended == ("pad",)


@pytest.mark.parametrize(
    ("mass", "large", "mended"), [(0.03, 2e-5, True), (0.0, 2e-5, False), (2.0, 2e-5, False), (0.03, 2.0, False)]
)
def test_impossible_inertia_is_mended_where_it_hardly_matters(
    tmp_path: Path, mass: float, large: float, mended: bool
) -> None:
    path = write_bench(tmp_path, add_pad(mass, large))
    if not mended:
        said = "link pad: has an inertia no solid can have" if mass else "link pad: has a mass of 0 kg with moments"
        assert said in refuse(read_arm, path, TIP)
        assert said in refuse(load_robot, path, "flange")
        assert read_arm(path, ImportOptions("flange", mend_inertia=True)).mended == ("pad",)
        return
    arm, home = extract_arm(path, TIP)
    assert any(each.startswith("link pad has ") and "is used instead" in each for each in list_warnings(arm, home))
    assert arm.mass == pytest.approx(17.2 + mass)
    assert load_robot(path, "flange").joint_names == tuple(arm.joint_names)


def test_a_negative_mass_is_never_dropped(tmp_path: Path) -> None:
    path = write_bench(tmp_path, ('<mass value="8.4"/>', '<mass value="-8"/>'))
    for options in (TIP, ImportOptions("flange", mend_inertia=True)):
        said = refuse(read_arm, path, options)
        assert "link u: has a mass of -8 kg with moments of inertia, must have more than 0; it is part" in said
        assert "--mend-inertia" not in said


@pytest.mark.parametrize("mass", ["-8", "-0.01"])
def test_a_negative_mass_that_mujoco_drops_is_refused(tmp_path: Path, mass: str) -> None:
    part = f'<body name="pad"><inertial pos="0 0 0" mass="{mass}" diaginertia="1e-4 1e-4 1e-4"/></body>'
    path = write_bench(tmp_path, ('<site name="flange"', f'{part}<site name="flange"'), mjcf=True)
    for options in (TIP, ImportOptions("flange", mend_inertia=True)):
        said = refuse(read_arm, path, options)
        assert f"link pad: has a mass of {mass} kg with moments of inertia, must have more than 0; it is part" in said


def test_a_negative_moment_that_mujoco_drops_is_said(tmp_path: Path) -> None:
    part = '<body name="pad"><inertial pos="0 0 0" mass="1" diaginertia="-1 1 1"/></body>'
    path = write_bench(tmp_path, ('<site name="flange"', f'{part}<site name="flange"'), mjcf=True)
    assert "link pad: has an inertia no solid can have (Ixx, Iyy, Izz -1, 1, 1 kg m^2)" in refuse(read_arm, path, TIP)


def test_one_fault_of_many_links_is_named_once(tmp_path: Path) -> None:
    moments = [("0.012", "0.2"), ("0.055", "0.5"), ("0.0021", "0.3")]  # of s, f, w1 and w2
    path = write_bench(tmp_path, *[(f'="{old}"', f'="{new}"') for old, new in moments])
    said = refuse(read_arm, path, TIP)
    assert said.count("has an inertia no solid can have") == 1
    assert "link s: has an inertia no solid can have (Ixx, Iyy, Izz 0.011, 0.2, 0.008 kg m^2)" in said
    assert "(as have f, w1, w2, with other numbers)" in said
    arm, home = extract_arm(path, ImportOptions("flange", mend_inertia=True))
    assert sum("no solid can have" in each for each in list_warnings(arm, home)) == 1


@pytest.mark.parametrize("seed", range(20))
def test_mend_inertia_is_possible_and_no_other_is_nearer(seed: int) -> None:
    rng = np.random.default_rng(seed)
    written = Inertial(1.0, (0.0,) * 3, (0.0,) * 3, tuple(rng.normal(size=6).tolist()))
    nearest = written.find_nearest()
    assert nearest.find_fault() == ""

    def matrix(inertial: Inertial) -> np.ndarray:
        a, b, c, d, e, f = inertial.moments
        return np.array([[a, d, e], [d, b, f], [e, f, c]])

    least = np.linalg.norm(matrix(nearest) - matrix(written))
    for _ in range(300):  # second moments of any solid near the nearest one
        S = 0.5 * np.trace(matrix(nearest)) * np.eye(3) - matrix(nearest)
        values, axes = np.linalg.eigh(S + 0.1 * rng.normal() * (lambda A: A + A.T)(rng.normal(size=(3, 3))))
        S = axes @ np.diag(np.maximum(values, 0.0)) @ axes.T
        other = np.trace(S) * np.eye(3) - S
        assert np.linalg.norm(other - matrix(written)) >= least - 1e-12


def test_possible_inertia_is_its_own_nearest() -> None:
    written = Inertial(1.0, (0.0,) * 3, (0.0,) * 3, (0.004, 0.055, 0.054, 0.0, 0.001, 0.0004))
    assert written.find_nearest().moments == pytest.approx(written.moments, rel=1e-12)
