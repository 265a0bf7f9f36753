"""Numbers that no robot has are named with their likely cause; a plausible arm has none."""

import re
from pathlib import Path

import pytest
from helpers.bench_arm import build_bench_urdf, write_bench
from helpers.refusals import refuse

from affordance.exceptions import ModelFileError
from affordance.extensions.robots.importer import ImportOptions, extract_arm, read_arm
from affordance.extensions.robots.plausibility import list_implausible
from affordance.extensions.robots.report import list_warnings

TIP = ImportOptions("flange")


def scale(text: str, attribute: str, factor: float, element: str) -> str:
    """Multiplies the numbers of an attribute of all elements of a name."""

    def change(found: re.Match[str]) -> str:
        return found[1] + " ".join(repr(factor * float(word)) for word in found[2].split()) + '"'

    return re.sub(rf'(<{element}\b[^>]*?\b{attribute}=")([^"]*)"', change, text)


@pytest.mark.parametrize(
    ("element", "attributes", "factor", "said"),
    [
        ("inertia", ("ixx", "iyy", "izz", "ixy", "ixz", "iyz"), 1e6, "u 169 m, f 155 m"),
        ("inertia", ("ixx", "iyy", "izz", "ixy", "ixz", "iyz"), 1e6, "are moments of inertia in kg mm^2 or g mm^2?"),
        ("inertia", ("ixx", "iyy", "izz", "ixy", "ixz", "iyz"), 1e-6, "radii of gyration like points'"),
        ("mass", ("value",), 1e3, "s 3.7e+03 kg, u 8.4e+03 kg"),
        ("mass", ("value",), 1e-3, "less than a thin aluminium tube"),
        ("limit", ("lower", "upper"), 57.3, "ranges of more than 50 rad: j_s 332.3"),
        ("limit", ("velocity",), 57.3, "velocity limits of more than 50 rad/s: j_s 177.63"),
    ],
)
def test_wrong_units_are_named(
    tmp_path: Path, element: str, attributes: tuple[str, ...], factor: float, said: str
) -> None:
    text = build_bench_urdf()
    for attribute in attributes:
        text = scale(text, attribute, factor, element)
    path = tmp_path / "bench.urdf"
    path.write_text(text)
    assert list_implausible(read_arm(write_bench(tmp_path), TIP)) == []
    path.write_text(text)
    assert said in "; ".join(list_implausible(read_arm(path, TIP)))


def test_centres_of_mass_in_millimetres_are_named(tmp_path: Path) -> None:
    path = write_bench(tmp_path, ('origin xyz="0.21 0 0.12"', 'origin xyz="210 0 120"'))
    assert "u 242 m; are they in millimetres?" in "; ".join(list_implausible(read_arm(path, TIP)))


@pytest.mark.parametrize(("limit", "degrees"), [("2.9", "5.8"), ("6.28319", "13")])
def test_radians_that_were_read_as_degrees_are_the_cause_that_no_posture_is_found(
    tmp_path: Path, limit: str, degrees: str
) -> None:
    wide = ('range="-2.9 2.9"', f'range="-{limit} {limit}"')
    path = write_bench(tmp_path, (' angle="radian"', ""), wide, mjcf=True)
    said = refuse(extract_arm, path, TIP, error=ModelFileError)
    assert f"no joint turns by more than {degrees} degrees" in said
    assert 'An MJCF needs <compiler angle="radian"/>' in said


EFFORTS = [(f'effort="{each}"', 'effort="1000"') for each in (150, 120, 28)]


@pytest.mark.parametrize(
    ("key", "given", "changes", "said"),
    [
        (
            "effort",
            1000.0,
            EFFORTS,
            "every joint has a torque limit of 1000 N m: a placeholder? --effort overrides it",
        ),
        (
            "velocity",
            10.0,
            [('velocity="3.1"', 'velocity="10"')],
            "every joint has a velocity limit of 10 rad/s: a placeholder? --velocity overrides it",
        ),
        ("effort", 250.0, [('effort="150"', 'effort="250"')], ""),
        ("velocity", 60.0, [('velocity="3.1"', 'velocity="60"')], "velocity limits of more than 50 rad/s: j_s 60"),
    ],
)
def test_limits_that_are_placeholders_are_named_unless_the_user_gave_them(
    tmp_path: Path, key: str, given: float, changes: list[tuple[str, str]], said: str
) -> None:
    found = "; ".join(list_implausible(read_arm(write_bench(tmp_path, *changes), TIP)))
    assert found.startswith(said)
    assert bool(found) == bool(said)
    options = ImportOptions("flange", **{key: {"": given}})
    assert list_implausible(read_arm(write_bench(tmp_path), options)) == []


def test_moments_of_a_part_that_is_merged_are_checked_too(tmp_path: Path) -> None:
    part = (
        '<link name="cover"><inertial><mass value="{}"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" '
        'iyz="0"/></inertial></link><joint name="j_cover" type="fixed"><parent link="{}"/><child link="cover"/>'
        "</joint></robot>"
    )
    for mass, parent, said in (("0.01", "u", "cover 3.16 m; are moments placeholders?"), ("20", "u", "")):
        path = write_bench(tmp_path, ("</robot>", part.format(mass, parent)))
        found = "; ".join(list_implausible(read_arm(path, TIP)))
        assert said in found
        assert bool(said) == bool(found)


def test_arm_that_cannot_bear_itself_is_told_by_which_joint_and_links(tmp_path: Path) -> None:
    path = write_bench(tmp_path, ('mass value="2.3"', 'mass value="90"'))
    warnings = "; ".join(list_warnings(*extract_arm(path, TIP)))
    assert "the arm cannot carry its own weight at home: j_u would need" in warnings
    assert "its limit is 150 N m; the heaviest links that it carries are f 90 kg" in warnings
    assert "no posture with a level hand holds" not in warnings


def test_links_that_differ_from_their_twin_are_named(tmp_path: Path) -> None:
    inertia = '<inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    pads = "".join(
        f'<link name="{side}_pad"><inertial><mass value="{mass}"/>{inertia}<joint name="{side}" type="fixed">'
        f'<parent link="{parent}"/><child link="{side}_pad"/></joint>'
        for side, mass, parent in (("left", 0.2, "flange"), ("right", 0.3, "pedestal"))
    )
    other = ("</robot>", f"{pads}</robot>")
    found = list_implausible(read_arm(write_bench(tmp_path, other), TIP))
    assert found == ["link left_pad has 0.2 kg, but its twin right_pad has 0.3 kg"]


def test_centre_of_mass_of_a_light_part_that_is_merged_is_checked_too(tmp_path: Path) -> None:
    part = (
        '<link name="cover"><inertial><origin xyz="{} 0 0"/><mass value="0.01"/><inertia ixx="2e-6" iyy="2e-6" '
        'izz="2e-6" ixy="0" ixz="0" iyz="0"/></inertial></link><joint name="j_cover" type="fixed"><parent link="f"/>'
        '<child link="cover"/></joint></robot>'
    )
    for place, said in (("100", "cover 100 m; are they in millimetres?"), ("0.1", "")):
        path = write_bench(tmp_path, ("</robot>", part.format(place)))
        found = "; ".join(list_implausible(read_arm(path, TIP)))
        assert bool(found) == bool(said)
        assert said in found
