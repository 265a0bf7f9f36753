"""Promises of SECURITY.md: a stranger's file is refused in one line or harmless, and writes nothing elsewhere.

Each file is given to the command that a user would give it to. Details are tested where they belong: tests/files,
tests/objects, tests/extensions.
"""

import json
import logging
import os
import re
import sqlite3
import time
from pathlib import Path

import pytest
from helpers.answers import answer
from helpers.changed_files import change_file
from helpers.generated_runs import write_urdf
from helpers.robot_files import SDF, build_urdf
from helpers.trials import hold_workshop

import affordance
from affordance.cli import ShownFormatter
from affordance.experiments import weight
from affordance.extensions.memory import ledger
from affordance.extensions.memory.ledger import open_memory
from affordance.extensions.people.experiments import trial_cells
from affordance.files import bounded
from affordance.plant.arm import name_robot

PACKAGE = Path(affordance.__file__).parent
PAGE = (Path(__file__).parents[2] / "SECURITY.md").read_text(encoding="utf-8")
# No file takes longer to be refused; far more than is needed on a loaded machine.
PATIENCE = 120.0
ENTITIES = '<!DOCTYPE a [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;">]>'
FOREVER = "CREATE VIEW schema AS WITH RECURSIVE a(x) AS (SELECT 1 UNION ALL SELECT x FROM a) SELECT x FROM a;"
TOOLS = """tools:
  - name: thing
    components: [{{mesh: {}, unit: m, material: oak, looks_like: oak}}]
  - name: other
    components: [{{semi_axes: [0.05, 0.02, 0.02], position: [0.05, 0, 0], material: oak}}]
"""


PLAIN = """tools:
  - name: thing
    components: [{semi_axes: [0.05, 0.02, 0.02], position: [0.05, 0, 0], material: oak}]
"""


def change(old, new, text):
    assert old in text, old
    return text.replace(old, new, 1)


# Tools files, and messages that refuse them.
TOOL_FILES = {
    "tags": ("a: !!python/object/apply:os.system ['touch owned']", "could not determine a constructor"),
    "deep": ("[" * 50_000, "is not YAML: maximum recursion depth exceeded"),
    "calculation": (change("0.05", "9 ** 9 ** 9", PLAIN), "semi_axes[0]: is '9 ** 9 ** 9'"),
    "template": (change("thing", "{{ 7 * 7 }}", PLAIN), "is not YAML"),
    "escape sequences": (change("thing", '"\\e[2J"', PLAIN), "must be without the hidden character U+001B"),
    "nan": (change("0.05", ".nan", PLAIN), "semi_axes[0]: is nan"),
}
# Tools with a mesh, and messages that refuse them.
MESHES = {
    "promises": ("a.ply", f"ply\nformat ascii 1.0\nelement vertex {10**12}\nend_header\n", f"promises {10**12}"),
    "indices": ("a.obj", "v 0 0 0\nf 1 2 999999999999\n", "is no readable OBJ file"),
    "device": ("/dev/zero", "", "must be one of .obj, .ply, .stl"),
}  # fmt: skip
# Robots, and messages that refuse them.
ROBOTS = {
    "entities": ("a.urdf", change("<robot", ENTITIES + "<robot", build_urdf()), "line 1: defines the entity 'a'"),
    "entity of a file": (
        "a.xml",
        '<!DOCTYPE a [<!ENTITY a SYSTEM "file:///etc/passwd">]><mujoco model="&a;"/>',
        "line 1: defines the entity 'a'",
    ),
    "include": (
        "a.sdf",
        change("<link", "<include><uri>package://drake_models/x.sdf</uri></include><link", SDF),
        "include: is not supported",
    ),
}
# Files that `identify` reads, by option, and messages that refuse them.
RECORDINGS = {
    "row": ("loaded.csv", "time,q_1\n" + "1," * 60_000, "row 2: has 60001 values, must have 2"),
    "arrays": ("loaded.npz", b"PK\x03\x04" + b"\xff" * 100, "is not a .npz file of numbers"),
    "database": ("loaded.db3", FOREVER, "cannot be read as a ROS bag: "),
    "memory": ("memory.json", "{" * 100_000, "memory.json: is not an SQLite file, must be a memory"),
    "ledger": ("ledger.db3", FOREVER, "is a database of another program or version (tables: none)"),
    "hidden column": (
        "loaded.csv",
        "time,q_1,tau_\u202e1\n0,0,1\n",
        "columns: is 'tau_\\u202e1', must be without the hidden",
    ),
}
OPTIONS = {"memory.json": "--memory", "ledger.db3": "--memory"}


@pytest.fixture
def refuse(tmp_path, monkeypatch):
    """Runs a command in a folder of its own; it must end in one line, and leave everything as it was."""
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")

    def refuse(*words):
        before, begin = sorted(tmp_path.rglob("*")), time.monotonic()
        answered = answer(*words, status=2)
        assert time.monotonic() - begin < PATIENCE
        assert answered.out == ""
        assert answered.err.count("\n") == 1
        assert answered.err[:-1].isprintable()
        assert len(answered.err) < 2100
        assert sorted(tmp_path.rglob("*")) == before
        return answered.err

    return refuse


def rank(path, tmp_path):
    """Words of a command that reads a tools file."""
    return ("rank", "reach", "--tools", path, "--out", tmp_path / "out")


@pytest.mark.parametrize("case", TOOL_FILES)
def test_hostile_tools_are_refused(tmp_path, refuse, case):
    text, problem = TOOL_FILES[case]
    path = tmp_path / "thing.yaml"
    path.write_text(text, encoding="utf-8")
    said = refuse(*rank(path, tmp_path))
    assert problem in said
    assert "thing.yaml: " in said


def test_tools_of_a_hundred_megabytes_are_refused(tmp_path, refuse):
    path = tmp_path / "thing.yaml"
    with path.open("wb") as file:
        file.truncate(100_000_000)
    assert "thing.yaml: has 100 MB, must have at most 1 MB" in refuse(*rank(path, tmp_path))


@pytest.mark.parametrize("path", ["/dev/zero", "pipe.yaml"])
def test_tools_that_are_read_for_ever_are_refused(tmp_path, refuse, path):
    os.mkfifo(tmp_path / "pipe.yaml")
    assert "cannot be read: it is a device, a pipe or a socket" in refuse(*rank(tmp_path / path, tmp_path))


@pytest.mark.parametrize("case", MESHES)
def test_hostile_mesh_is_refused(tmp_path, refuse, case):
    name, content, problem = MESHES[case]
    (tmp_path / "things.yaml").write_text(TOOLS.format(name), encoding="utf-8")
    if content:
        (tmp_path / name).write_text(content, encoding="utf-8")
    assert problem in refuse(*rank(tmp_path / "things.yaml", tmp_path))


@pytest.mark.parametrize("case", ROBOTS)
def test_hostile_robot_is_refused(tmp_path, refuse, case):
    name, text, problem = ROBOTS[case]
    (tmp_path / name).write_text(text, encoding="utf-8")
    said = refuse("import-arm", tmp_path / name, "--tip", "right_tool", "--out", tmp_path / "out")
    assert f"{name}: {problem}" in said


@pytest.mark.parametrize("case", RECORDINGS)
def test_hostile_recording_is_refused(tmp_path, refuse, case):
    name, content, problem = RECORDINGS[case]
    robot = write_urdf(tmp_path)
    samples = "".join(f"{0.01 * k},{0.01 * k},1\n" for k in range(50))
    files = {"loaded.yaml": "signal: joint_torque\njoints: [joint_1]\n", "loaded.csv": f"time,q_1,tau_1\n{samples}"}
    for other, text in files.items():
        (tmp_path / other).write_text(text, encoding="utf-8")
    if name.endswith(".db3"):
        with sqlite3.connect(tmp_path / name) as database:
            database.executescript(content)
        database.close()
    else:
        (tmp_path / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    loaded = name if name.startswith("loaded") and not name.endswith(".yaml") else "loaded.csv"
    words = ["identify", robot, "--tip", "flange", "--loaded", tmp_path / loaded, "--out", tmp_path / "out"]
    option = OPTIONS.get(name)
    place = tmp_path / name
    said = refuse(*words, *([option, place] if option else []))
    assert problem in said
    assert "secret" not in said


@pytest.mark.parametrize(
    "words",
    [
        ("rank", "reach", "--materials", "materials.yaml"),
        ("import-arm", "a.urdf", "--tip", "right_tool", "--out", "./out"),
        ("memory", "import", "new.sqlite", "trials.jsonl"),
    ],
)
def test_names_with_characters_that_are_not_seen_are_refused(tmp_path, refuse, words):
    hidden = "\u202e"
    record = hold_workshop(1)[0].to_dict() | {"object": f"o{hidden}ak"}
    files = {
        "materials.yaml": f"o{hidden}ak: {{density: 700, colour: '#b07a45'}}\n",
        "a.urdf": change("right_j2", f"right_{hidden}j2", build_urdf()),
        "trials.jsonl": json.dumps(record),
    }
    for name, text in files.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    said = refuse(*(tmp_path / word if "." in word else word for word in words))
    assert "the hidden character U+202E" in said


def test_names_of_files_do_not_steer_the_terminal(tmp_path):
    """They cannot be refused, so they are replaced where they are printed."""
    place = tmp_path / "a\x1b[2J\udcffb.sqlite"
    with open_memory(place) as ledger:
        ledger.append(hold_workshop(3))
    for words in (("show", place), ("verify", place), ("forget", place, "--object", "bar")):
        said = answer("memory", *words).out
        assert "a\ufffd[2J\ufffdb.sqlite: " in said
        assert said.replace("\n", "").isprintable()
    answer("memory", "show", place, "--out", tmp_path / "out")
    assert (tmp_path / "out" / "memory.txt").read_text(encoding="utf-8").replace("\n", "").isprintable()
    assert name_robot(tmp_path / "a\x1b[2J.urdf", "tool0") == "a\ufffd[2J-tool0"
    record = logging.LogRecord("", logging.WARNING, "", 0, "%s: is damaged", ("a\x1b[2J.ply",), None)
    assert ShownFormatter().format(record) == "a\ufffd[2J.ply: is damaged"


NAMES = ("<script>alert(1)</script>", '\\"><img src=x onerror=alert(1)>', "javascript:alert(1) | & ' -->")


@pytest.mark.usefixtures("vectors")
def test_names_are_shown_as_they_are_and_do_nothing(tmp_path, models, monkeypatch):
    """Names of objects and materials are shown as text in the page, its links and the pictures."""
    monkeypatch.setattr(weight, "DURATION", 0.1)
    rod, decoy, brass = (json.dumps(name) for name in NAMES)
    change_file(models / "tools" / "weight.yaml", "rod_10cm", rod, "name: decoy", f"name: {decoy}", "brass", brass)
    change_file(models / "materials.yaml", "\nbrass:", f"\n{brass}:")
    answer("run", "weight", "--robot", models, "--repeats", 1, "--jobs", 1, "--out", tmp_path / "out")
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "&lt;script&gt;alert(1)&lt;/script&gt;" in page
    check_page(page)
    pictures = list((tmp_path / "out" / "weight").glob("*.svg"))
    assert pictures
    for picture in pictures:
        check_page(picture.read_text(encoding="utf-8"))


def check_page(page):
    """Asserts that nothing of the names became a tag, an attribute or the target of a link."""
    tags = re.findall(r"<[^!>][^>]*>", page)
    assert not any("alert(1)" in tag.replace("&gt;", "") and "alt=" not in tag for tag in tags)
    assert "<script>alert" not in page
    assert "<img src=x" not in page
    assert not re.search(r"""(href|src)=["']?\s*javascript:""", page)


def test_links_of_an_imported_arm_are_shown_as_they_are(tmp_path):
    """Hostile names of joints and links are shown as text in the report of an import and in the arm's own files."""
    hostile = "&lt;img src=x onerror=alert(1)&gt;&quot;-->"
    text = build_urdf().replace('"right_j2"', f'"{hostile}"').replace('"right_2"', f'"{hostile}b"')
    path = tmp_path / "a.urdf"
    path.write_text(text, encoding="utf-8")
    out = tmp_path / "out"
    answer("import-arm", path, "--tip", "right_tool", "--out", out, "--tasks", "keep")
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "&lt;img src=x onerror=alert(1)&gt;" in page
    check_page(page)


def show_size(number):
    return f"{number / 1e9:g} GB" if number >= 1e9 else f"{number / 1e6:g} MB"


@pytest.mark.parametrize(
    ("row", "bound"),
    [
        ("YAML", bounded.SETTINGS),
        ("robot's file", bounded.ROBOT),
        ("mesh (OBJ, PLY, STL; DAE of robots)", bounded.MESH),
        ("recording (CSV, .npz, Parquet, bag)", bounded.RECORDING),
        ("results, and payloads in JSON", bounded.RESULTS),
        ("table of trials", trial_cells.LARGEST),
        ("memory", ledger.LARGEST_FILE),
    ],
)
def test_bounds_on_the_page_are_those_of_the_program(row, bound):
    (found,) = [line.split("|") for line in PAGE.splitlines() if line.startswith(f"| {row} |")]
    assert {*re.findall(r"\d+ [MG]B", found[2])} == {show_size(bound)}
    for place in re.findall("`(.*?)`", found[3]):
        assert (PACKAGE / place).is_file()
