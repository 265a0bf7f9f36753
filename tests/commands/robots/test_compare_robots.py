"""Comparison of two files of one robot, of two formats."""

from pathlib import Path

import pytest
from helpers.answers import answer
from helpers.bench_arm import write_bench

from affordance.extensions.robots.comparison import compare, read_joints


def test_files_of_one_arm_in_two_formats_agree(tmp_path: Path) -> None:
    """MJCF has no velocity limits, so that these alone differ."""
    urdf, mjcf = write_bench(tmp_path), write_bench(tmp_path, mjcf=True)
    compared = compare(read_joints(urdf), read_joints(mjcf, "flange"))
    assert {each.differing for each in compared} == {("velocity",)}
    assert answer("compare-robots", urdf, urdf).lines[0] == "The arms agree to 1 % (17.2 and 17.2 kg, 6 joints)."


@pytest.mark.parametrize(
    ("change", "differing"),
    [
        (('mass value="8.4"', 'mass value="8.8"'), {"j_u": ["mass"]}),
        (('mass value="8.4"', 'mass value="8.41"'), {}),
        (('xyz="0.21 0 0.12"', 'xyz="0.25 0 0.12"'), {"j_u": ["offset"]}),
        (('xyz="0.21 0 0.12"', 'xyz="0.21 0.3 0.12"'), {}),  # along the axis
        (('iyy="0.055"', 'iyy="0.057"'), {"j_f": ["moment"]}),
        (('xyz="0.42 0 0"', 'xyz="0.44 0 0"'), {"j_u": ["length"]}),
        (('xyz="0 0 0.095"', 'xyz="0 0 0.2"'), {}),  # along the axis of j_w2
        (
            ('lower="-2.9" upper="2.9" effort="120"', 'lower="-3" upper="2.9" effort="130"'),
            {"j_f": ["range", "effort"]},
        ),
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


def test_arms_with_other_numbers_of_joints_are_refused(tmp_path: Path) -> None:
    path = write_bench(tmp_path)
    said = answer("compare-robots", path, path, "--other-tip", "w2", status=2).err
    assert (
        "have 6 joints (j_s, j_u, j_f, j_w1, j_w2, j_w3) and 5 (j_s, j_u, j_f, j_w1, j_w2), must have equally many"
        in said
    )
