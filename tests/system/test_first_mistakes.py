"""Mistakes of a first hour are answered with what was read, what was expected and the nearest that fits."""

import contextlib
import shutil
import sqlite3
from pathlib import Path

import pytest
from helpers.refusals import refuse_command

from affordance.cli import main
from affordance.files.model_folder import MODELS

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "errors.md"
BAR = "tools:\n  - name: bar\n    components:\n      - {semi_axes: [0.1, 0.015, 0.015], position: [0.1, 0, 0], "
FILES = {
    "open.yaml": "tools:\n  - name: [bar\n",
    "millimetres.yaml": f"{BAR}material: brass}}\n".replace("0.1, 0.015, 0.015", "100, 15, 15"),
    "misspelt.yaml": f"{BAR}material: bras}}\n",
    "heavy.yaml": f"{BAR}material: brass, density: 8.5}}\n",
    "robot.urdf": """
        <robot name="r"><link name="a"/><link name="b"><inertial><mass value="1"/>
        <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link><joint name="j" type="revolute">
        <parent link="a"/><child link="b"/><axis xyz="0 0 1"/></joint></robot>""",
    "loaded.csv": "time\n0\n",
}
# What is typed, and two parts of the answer, in their order.
MISTAKES = [
    ("rnu weight", "the command is 'rnu'", "did you mean 'run'?"),
    ("versoin", "the command is 'versoin'", "did you mean 'version'?"),
    ("run wieght", "experiment: is 'wieght'", "did you mean 'weight'?"),
    ("run weight --repets 3", "--repets: is not an option", "did you mean '--repeats'?"),
    ("run weight --seed -1", "--seed: is -1", "must be from 0 to 4294967295; the nearest is 0"),
    ("run weight --repeats 0", "--repeats: is 0", "must be from 1 to 100000; the nearest is 1"),
    ("run weight --repeats 1.5", "--repeats: is '1.5'", "must be a whole number; the nearest is 2"),
    ("run weight --set prior.ds=3", "is 'prior.ds'", "did you mean 'prior.sd'?"),
    ("predict", "experiment: is missing", "one of weight, com, linear_plus"),
    (
        "rank reach hammer",
        "is given 'hammer'",
        "one argument too many: rank compares tools for one task; affordance next takes several",
    ),
    (
        "watch weight --point_estimate mean",
        "--point_estimate: is not an option",
        "point_estimate is a setting: --set point_estimate=mean",
    ),
    ("rank hammer --demo", "--demo: uses its own data", "must be given without a task"),
    ("rank reach --tools .", "cannot be read: Is a directory", "must be a file"),
    ("rank reach --tools open.yaml", "open.yaml: line 3", "is not YAML: expected ',' or ']'"),
    (
        "rank reach --tools millimetres.yaml",
        "semi_axes[0]: is 100",
        "must be from 0.0001 to 1; 0.1 if mm were meant",
    ),
    ("rank reach --tools misspelt.yaml", "material: is 'bras'", "did you mean 'brass'?"),
    (
        "rank reach --tools heavy.yaml",
        "density: is not a key known here",
        "a density belongs to a material, in materials.yaml",
    ),
    ("rank reach --robot robt.urdf", "--robot: is 'robt.urdf'", "did you mean 'robot.urdf'?"),
    (
        "import-arm robot.urdf --tip b --out x",
        "joint j: has no torque limit",
        "must have one of more than 0 N m; --effort VALUE sets limits (N m)",
    ),
    ("import-arm robot.urdf --tip c --out x", "--tip: is 'c'", "it has a, b"),
    ("import-arm robot.urdf --tip b", "--out: is missing", "must be new or empty"),
    ("memory show notes.sqlite", "notes.sqlite: is a database of another program", "tables: notes"),
    (
        "identify arm.dmd.yaml --empty empty.csv --loaded loadde.csv",
        "loadde.csv: does not exist",
        "did you mean 'loaded.csv'?",
    ),
    (
        "identify arm.dmd.yaml --empty empty.csv --loaded loaded.csv",
        "loaded.csv: has no description",
        "two lines such as 'joints: [joint_1, joint_2]' and 'signal: joint_torque'",
    ),
]


@pytest.mark.parametrize(("words", "said", "advice"), MISTAKES)
def test_mistake_of_a_first_hour_is_answered_with_advice(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: str, said: str, advice: str
) -> None:
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    for name in ("arm.dmd.yaml", "arm.sdf", "package.xml", "demo/empty.csv", "demo/empty.yaml"):
        shutil.copy(MODELS / name, tmp_path)
    with contextlib.closing(sqlite3.connect(tmp_path / "notes.sqlite")) as database:
        database.execute("CREATE TABLE notes (x INT)")
    monkeypatch.chdir(tmp_path)
    _, known, rest = refuse_command(*words.split()).partition(said)
    assert known
    assert advice in rest


def test_page_of_errors_lists_these_mistakes() -> None:
    listed = [line for line in PAGE.read_text(encoding="utf-8").splitlines() if line.startswith("| `affordance ")]
    assert listed == [f"| `affordance {words}` | `{said} ... {advice}` |" for words, said, advice in MISTAKES]


def test_program_tells_its_version_and_its_commands_however_it_is_asked(capsys):
    for same in (["--version", "version", "-V"], ["--help", "help", "-h"]):
        said = []
        for word in same:
            assert main([word]) == 0
            said.append(capsys.readouterr().out)
        assert len(set(said)) == 1
        assert said[0].startswith(("affordance ", "usage: affordance "))


def test_meant_command_comes_before_the_list_of_all():
    said = refuse_command("rnu", "weight")
    assert said.startswith("affordance: the command is 'rnu'; did you mean 'run'? It must be one of ")
