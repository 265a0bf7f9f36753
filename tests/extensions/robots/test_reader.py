"""A xacro template is a program: ``import-arm`` runs it, and every other command says so."""

import importlib.util
import re
from pathlib import Path

import pytest
from helpers.bench_arm import build_bench_urdf, write_bench
from helpers.refusals import refuse, refuse_command

from affordance.exceptions import AffordanceError
from affordance.extensions.robots.importer import ImportOptions, read_arm
from affordance.extensions.robots.reader import is_template, read_robot

XMLNS = '<robot xmlns:xacro="http://www.ros.org/wiki/xacro"'


def write_template(folder: Path, body: str) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "robot.urdf.xacro"
    path.write_text(f'{XMLNS} name="r">{body}</robot>')
    return path


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (f'{XMLNS} name="r"><link name="a"/></robot>', False),
        ('<robot name="r"><!-- by xacro: ${prefix}link <xacro:arm/> --><link name="a"/></robot>', False),
        ('<robot name="r"><!-- <!-- ${prefix} --><link name="a"/><!-- $(arg x)', False),
        ('<robot name="r"><!-- one --><link name="${prefix}a"/></robot>', True),
        ('<robot name="r"><!-- one --><link name="$(arg side)"/></robot>', True),
        (f'{XMLNS} name="r"><xacro:arm/></robot>', True),
    ],
)
def test_what_xacro_has_expanded_is_no_template(tmp_path: Path, text: str, expected: bool) -> None:
    (tmp_path / "robot.urdf").write_text(text)
    assert is_template(tmp_path / "robot.urdf") == expected
    (tmp_path / "robot.urdf.xacro").write_text(text)
    assert is_template(tmp_path / "robot.urdf.xacro")


def test_arm_of_a_template_is_that_of_its_expansion(tmp_path: Path) -> None:
    """Arguments, expressions, macros, and includes from a package beside and from the template's own folder."""
    text = build_bench_urdf()
    links, flange = text.split('<link name="flange"/>')
    body = re.sub("<robot[^>]*>", "", links).replace('xyz="0.39 0 0"', 'xyz="${2 * half} 0 0"', 1)
    package = tmp_path / "bench_parts"
    package.mkdir()
    (package / "package.xml").write_text("<package><name>parts</name></package>")
    (package / "flange.xacro").write_text(
        f'{XMLNS}><xacro:macro name="flange"><link name="$(arg tip)"/>{flange.replace("</robot>", "")}'
        "</xacro:macro></robot>"
    )
    path = write_template(
        tmp_path / "robot",
        '<xacro:arg name="tip" default="gone"/><xacro:property name="half" value="0.195"/>'
        f'<xacro:include filename="$(find parts)/flange.xacro"/>{body}<xacro:flange/>',
    )
    arm = read_arm(path, ImportOptions("flange", xacro={"tip": "flange"}))
    plain = read_arm(write_bench(tmp_path), ImportOptions("flange"))
    assert [link.inertial for link in arm.links] == [link.inertial for link in plain.links]
    assert [link.X_PL.translation().tolist() for link in arm.links] == [
        link.X_PL.translation().tolist() for link in plain.links
    ]
    assert arm.tree.description.sources == (package / "flange.xacro",)
    moved = tmp_path / "far" / path.name
    moved.parent.mkdir()
    moved.write_text(path.read_text())
    (package / "package.xml").unlink()
    options = ImportOptions("flange", xacro={"tip": "flange"}, packages={"parts": str(package)})
    assert len(read_arm(moved, options).links) == 6


@pytest.mark.parametrize(
    ("body", "said"),
    [
        ('<xacro:include filename="$(find nowhere)/a.xacro"/>', "needs the package nowhere, which is not near it"),
        (
            '<xacro:include filename="$(find one)/a.xacro"/><xacro:include filename="$(find two)/a.xacro"/>',
            "needs the packages one, two, which are not near it; --package NAME=DIR gives one",
        ),
        (
            '<xacro:arg name="tip" default=""/><xacro:arg name="kind" default="mk1"/><link name="$(arg side)"/>',
            "Undefined substitution argument side; the template's arguments: tip (empty by default), kind (mk1)",
        ),
        ('<xacro:include filename="gone.xacro"/>', "/robot/gone.xacro"),
        (
            '<xacro:arg name="kind" default="mk2"/><xacro:property name="p" '
            """value="${xacro.load_yaml('$(arg kind).yaml')}"/><link name="${p['a']}"/>""",
            "/robot/mk2.yaml: No such file or directory; the template's arguments: kind (mk2); NAME:=VALUE gives",
        ),
        ("<xacro:nothing/>", "cannot be expanded by xacro: "),
        (
            '<xacro:macro name="arm" params=""><link name="a"/></xacro:macro>',
            "it only defines macros (arm); give the",
        ),
    ],
)
def test_template_that_fails_is_refused_in_a_line(tmp_path: Path, body: str, said: str) -> None:
    path = write_template(tmp_path / "robot", body)
    told = refuse(read_robot, path, {}, error=AffordanceError)
    assert said in told


def test_argument_that_a_template_does_not_have_is_refused(tmp_path: Path) -> None:
    path = write_template(tmp_path, '<xacro:arg name="side" default="left"/><link name="$(arg side)"/>')
    assert "sied:=right: is no argument; the template's arguments: side (left)" in refuse(
        read_robot, path, {"sied": "right"}
    )


@pytest.mark.parametrize("place", ["src/hands/hand_parts", "src/parts/hands/hand_parts", "src/hand_parts"])
def test_packages_of_a_workspace_are_found(tmp_path: Path, place: str) -> None:
    package, broken = tmp_path / place, tmp_path / "src/other/broken"
    for folder in (package, broken):
        folder.mkdir(parents=True)
    (broken / "package.xml").write_text("<package>")
    (package / "package.xml").write_text("<package><name>parts</name></package>")
    (package / "part.xacro").write_text(f'{XMLNS}><link name="part"/></robot>')
    include = '<xacro:include filename="$(find parts)/part.xacro"/>'
    path = write_template(tmp_path / "src/arms/arm_description/urdf", include)
    assert list(read_robot(path, {}).visuals) == ["part"]


def test_other_commands_do_not_run_a_template(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    path = write_template(tmp_path, '<link name="${1 / 0}"/>')
    said = f"is a xacro template, a program; to run it and use FOLDER instead: affordance import-arm {path} --out"
    assert said in refuse_command("compare-robots", path, path)


def test_without_the_extra_the_command_to_type_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write_template(tmp_path, "")
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    assert "needs pip install 'visual-inertial-affordances[xacro]'" in refuse(read_robot, path, {})


def test_arguments_of_a_template_are_refused_for_other_files(tmp_path: Path) -> None:
    options = ImportOptions("flange", xacro={"side": "left"})
    assert "is no xacro template, must be one if NAME:=VALUE" in refuse(read_arm, write_bench(tmp_path), options)
