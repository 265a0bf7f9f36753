"""Mistakes that first users make: each is answered in one line with what was read, and what was expected."""

import sqlite3

import pytest

from affordance.cli import main
from affordance.files.model_folder import MODELS

DEMO = MODELS / "demo"
ROBOT, EMPTY = str(MODELS / "arm.dmd.yaml"), str(DEMO / "empty.csv")
BAR = "tools:\n  - name: bar\n    components:\n      - {semi_axes: %s, position: [0.1, 0, 0], material: %s}\n"
URDF = """<robot name="r"><link name="a"/><link name="b"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link><joint name="j" type="revolute">
<parent link="a"/><child link="b"/><axis xyz="0 0 1"/></joint></robot>"""
FILES = {
    "weight_2.yaml": "",
    "millimetres.yaml": BAR % ("[100, 15, 15]", "brass"),
    "misspelt.yaml": BAR % ("[0.1, 0.015, 0.015]", "bras"),
    "heavy.yaml": BAR % ("[0.1, 0.015, 0.015]", "brass, density: 8.5"),
    "open.yaml": "tools:\n  - name: [bar\n",
    "key.yaml": (MODELS / "protocols" / "weight.yaml")
    .read_text(encoding="utf-8")
    .replace("name: weight", "name: key", 1)
    .replace("\nblocks:", "\nblock:"),
    "robot.urdf": URDF,
    "loaded.csv": "time\n0\n",
}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    for name, text in FILES.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    with sqlite3.connect(tmp_path / "notes.sqlite") as database:
        database.execute("CREATE TABLE notes (x INT)")
    database.close()
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    ("words", "read", "expected"),
    [
        ("rnu weight", "the command is 'rnu'", "did you mean 'run'?"),
        ("run wieght", "experiment: is 'wieght'", "did you mean 'weight'?"),
        ("run weight --repets 3", "--repets: is no option", "did you mean '--repeats'?"),
        ("run weight --seed -1", "--seed: is -1", "must be from 0 to"),
        ("run weight --repeats 0", "--repeats: is 0", "must be from 1 to"),
        ("run weight --repeats 1.5", "--repeats: is '1.5'", "must be a whole number"),
        ("run weight --set prior.ds=3", "is 'prior.ds'", "did you mean 'prior.sd'?"),
        ("run weight2.yaml", "weight2.yaml: cannot be read: No such file", "did you mean 'weight_2.yaml'?"),
        ("run key.yaml", "blocks: is missing", "is 'block' misspelt?"),
        ("rank reach --tools .", "cannot be read: Is a directory", "must be a file"),
        ("rank reach --tools open.yaml", "open.yaml: line 3", "is not YAML: expected ',' or ']'"),
        ("rank reach --tools millimetres.yaml", "semi_axes[0]: is 100", "must be from 0.0001 to 1"),
        ("rank reach --tools misspelt.yaml", "material: is 'bras'", "did you mean 'brass'?"),
        ("rank reach --tools heavy.yaml", "density: is not a key known here", "(known: semi_axes, "),
        ("import-arm robot.urdf --tip b --out x", "joint j: has no limit of torque", "must have one of more than 0"),
        ("import-arm robot.urdf --tip c --out x", "--tip: is 'c'", "it has a, b"),
        ("memory show notes.sqlite", "notes.sqlite: is a database of another program", "tables: notes"),
        (f"identify {ROBOT} --empty {EMPTY} --loaded loadde.csv", "loadde.csv: does not exist", "'loaded.csv'?"),
        (f"identify {ROBOT} --empty {EMPTY} --loaded loaded.csv", "has no description", "must name at least"),
    ],
)
def test_answer_says_what_was_read_and_what_was_expected(folder, capsys, words, read, expected):
    before = sorted(folder.iterdir())
    try:
        status = main(words.split())
    except SystemExit as ended:  # of the parser of options
        status = ended.code
    answer = capsys.readouterr().err
    assert status == 2
    assert answer.count("\n") == 1
    assert read in answer
    assert expected in answer
    assert sorted(folder.iterdir()) == before
