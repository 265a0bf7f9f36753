"""Xacro templates are expanded in a process that reads their own folder and packages only, and nothing else."""

import importlib.util
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
from helpers.bench_arm import build_bench_urdf, write_bench
from helpers.refusals import refuse

from affordance.exceptions import AffordanceError
from affordance.extensions.robots import xacro_child, xacro_file
from affordance.extensions.robots.importer import ImportOptions, read_arm
from affordance.extensions.robots.xacro_file import AS_IT_IS, XacroOptions, expand, is_template, parse_xacro

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
        '<xacro:arg name="tip" default="flange"/><xacro:property name="half" value="0.195"/>'
        f'<xacro:include filename="$(find parts)/flange.xacro"/>{body}<xacro:flange/>',
    )
    arm, plain = read_arm(path, ImportOptions("flange")), read_arm(write_bench(tmp_path), ImportOptions("flange"))
    assert [link.inertial for link in arm.links] == [link.inertial for link in plain.links]
    assert [link.X_PL.translation().tolist() for link in arm.links] == [
        link.X_PL.translation().tolist() for link in plain.links
    ]
    assert arm.tree.description.sources == (package / "flange.xacro",)
    away = parse_xacro([], [f"parts={package}"], trusts=False)
    (tmp_path / "far" / "away" / "off").mkdir(parents=True)
    moved = tmp_path / "far" / "away" / "off" / path.name
    moved.write_text(path.read_text())
    assert len(read_arm(moved, ImportOptions("flange", xacro=away)).links) == 6


@pytest.mark.parametrize(
    ("body", "options", "said"),
    [
        (
            '<xacro:include filename="$(find nowhere)/a.xacro"/>',
            AS_IT_IS,
            "needs the package 'nowhere', which is not near it",
        ),
        ('<xacro:include filename="$(find nowhere)/a.xacro"/>', AS_IT_IS, "--package nowhere=DIR says where it is"),
        ('<link name="$(arg side)"/>', AS_IT_IS, "needs a value for side: --xacro side:=VALUE sets it"),
        ('<xacro:include filename="gone.xacro"/>', AS_IT_IS, "/robot/gone.xacro, which does not exist"),
        ("<xacro:nothing/>", AS_IT_IS, "cannot be expanded by xacro: "),
        (
            "<link name=\"${xacro.load_yaml('../outside.yaml')['a']}\"/>",
            AS_IT_IS,
            "reads a file outside its own folder",
        ),
        ('<xacro:include filename="../outside.xacro"/>', AS_IT_IS, "reads a file outside its own folder"),
        ("<link name=\"${len('x' * 10**11)}\"/>", AS_IT_IS, "or 2 GB, to expand"),
        ('<link name="${[a for a in range(10**9)][0]}"/>', AS_IT_IS, "or 2 GB, to expand"),
        (
            '<link name="${len([0 for a in range(10**6) for b in range(10**6) if b == -1])}"/>',
            AS_IT_IS,
            "takes more than 2 s",
        ),
    ],
)
def test_templates_that_ask_too_much_are_refused_in_a_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, body: str, options: XacroOptions, said: str
) -> None:
    monkeypatch.setattr(xacro_file, "_SECONDS", 2)
    (tmp_path / "outside.yaml").write_text("a: secret")
    (tmp_path / "outside.xacro").write_text('<robot><link name="secret"/></robot>')
    told = refuse(expand, write_template(tmp_path / "robot", body), options, error=AffordanceError)
    assert said in told
    assert "secret" not in told


def test_limited_process_reads_its_folders_and_does_nothing_else(tmp_path: Path) -> None:
    """Whatever Python a template gets to run meets the limits of the kernel."""
    inside, outside = tmp_path / "inside", tmp_path / "outside"
    for folder in (inside, outside):
        folder.mkdir()
        (folder / "a").write_text("text")
    attempts = f"""
import json, os, socket, subprocess, sys
sys.path[:0] = [{str(Path(xacro_child.__file__).parent)!r}]
import xacro_child
assert xacro_child.restrict([{str(inside)!r}, sys.prefix, sys.base_prefix])
found = {{}}
def attempt(name, act):
    try:
        act(); found[name] = True
    except PermissionError:
        found[name] = False
server = socket.socket()
attempt("read inside", lambda: open({str(inside / "a")!r}).read())
attempt("read outside", lambda: open({str(outside / "a")!r}).read())
attempt("list outside", lambda: os.listdir({str(outside)!r}))
attempt("write inside", lambda: open({str(inside / "a")!r}, "w"))
attempt("make inside", lambda: open({str(inside / "b")!r}, "w"))
attempt("remove inside", lambda: os.remove({str(inside / "a")!r}))
attempt("execute", lambda: os.execv("/bin/true", ["true"]))
attempt("connect", lambda: socket.create_connection(("127.0.0.1", 9), timeout=1))
print(json.dumps(found))
"""
    done = subprocess.run([sys.executable, "-c", attempts], capture_output=True, text=True, check=False)
    if "AssertionError" in done.stderr:
        pytest.skip("this kernel has no Landlock")
    found = json.loads(done.stdout)
    assert {name for name, could in found.items() if could} == {"read inside"}


def test_without_the_extra_the_command_to_type_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write_template(tmp_path, "")
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    assert "which needs the extra [xacro]: pip install '.[xacro]' in a clone" in refuse(expand, path, AS_IT_IS)


def test_kernel_without_limits_expands_what_is_trusted_only(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write_template(tmp_path, "")
    monkeypatch.setattr(xacro_file, "_run", lambda job, folder: (xacro_child.UNLIMITED, b"", ""))
    assert "this kernel lacks Landlock to restrict it; if you trust it, --trust-xacro" in refuse(
        expand, path, AS_IT_IS
    )


@pytest.mark.parametrize(
    ("values", "packages", "said"),
    [(["side=left"], [], "must be a name, := and a value"), ([], ["parts"], "must be NAME=DIR, a folder")],
)
def test_options_have_a_form(values: list[str], packages: list[str], said: str) -> None:
    assert said in refuse(parse_xacro, values, packages, trusts=False)


def test_options_of_a_template_are_refused_for_other_files(tmp_path: Path) -> None:
    options = ImportOptions("flange", xacro=XacroOptions({"side": "left"}))
    assert "is no xacro template, must be one if NAME:=VALUE" in refuse(read_arm, write_bench(tmp_path), options)
