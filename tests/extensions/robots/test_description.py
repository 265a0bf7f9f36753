"""What a robot's file leaves out, says twice or contradicts is said at the command line."""

from pathlib import Path

import pytest
from helpers.bench_arm import write_bench
from helpers.refusals import refuse

from affordance.exceptions import ModelFileError
from affordance.extensions.robots.importer import ImportOptions, extract_arm
from affordance.extensions.robots.report import list_warnings

U = '<inertial><origin xyz="0.21 0 0.12"/><mass value="8.4"/>'
INERTIA = '<inertia ixx="0.02" iyy="0.24" izz="0.23" ixy="0.001" ixz="0.002" iyz="0.0"/>'
LIMIT_S = '<axis xyz="0 0 1"/><limit lower="-2.9" upper="2.9" effort="150" velocity="3.1"/>'
FINGER = (
    '<link name="finger_{0}"><inertial><mass value="0.1"/><inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" '
    'iyz="0"/></inertial></link><joint name="k_{0}" type="revolute"><parent link="flange"/><child link="finger_{0}"/>'
    '<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="5" velocity="2"/>{1}</joint>'
)


def add(*fingers: str) -> tuple[str, str]:
    return "</robot>", "".join(fingers) + "</robot>"


def finger(name: str, leader: str = "") -> str:
    return FINGER.format(name, f'<mimic joint="{leader}"/>' if leader else "")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ((U + INERTIA, U), "link u has 8.4 kg and no <inertia>; URDF's default is a point"),
        ((INERTIA, INERTIA + INERTIA), "link u has 2 <inertia> elements, of which the first is used"),
        (
            (f"{U}{INERTIA}</inertial>", f"{U}{INERTIA}</inertial><inertial><mass value='1'/></inertial>"),
            "link u has 2 <inertial> elements, of which the first is used",
        ),
        ((LIMIT_S, LIMIT_S + LIMIT_S), "joint j_s has 2 <axis> elements, of which the first is used"),
        (("</robot>", '<link name="table"/></robot>'), "2 links have no parent and are fixed to the world"),
        (add(finger("a"), finger("b", "k_typo")), "joint k_b follows k_typo, which is not in the file"),
        (add(finger("a", "k_b"), finger("b", "k_a")), "joint k_a follows itself (k_a follows k_b follows k_a)"),
    ],
)
def test_what_is_missing_doubled_or_contradicted_is_said(tmp_path: Path, change: tuple[str, str], said: str) -> None:
    good = [*list_warnings(*extract_arm(write_bench(tmp_path), ImportOptions("flange")))]
    assert good == []
    found = [*list_warnings(*extract_arm(write_bench(tmp_path, change), ImportOptions("flange")))]
    assert sum(each.startswith(said) for each in found) == 1


@pytest.mark.parametrize(
    ("joint", "kind", "said"),
    [
        ("j_f", "prismatic", "above them j_f slides"),
        ("j_w1", "floating", "above them j_w1 floats"),
    ],
)
def test_joint_above_the_arm_that_slides_or_floats_is_named(tmp_path: Path, joint: str, kind: str, said: str) -> None:
    path = write_bench(tmp_path, (f'name="{joint}" type="revolute"', f'name="{joint}" type="{kind}"'))
    assert said in refuse(extract_arm, path, ImportOptions("flange"), error=ModelFileError)
