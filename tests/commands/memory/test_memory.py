"""``affordance memory``: its output, and changes of the ledger, of which nothing else changes."""

import json
import shutil
import sqlite3
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.answers import answer
from helpers.refusals import refuse_command
from helpers.trials import STEEL, WOOD, hold, hold_workshop

from affordance.belief.density_belief import Prior
from affordance.commands.memory.memory import draw_memory, list_weighed_trials
from affordance.extensions.memory.ledger import export_trials, open_memory
from affordance.extensions.memory.summary import ExperienceSummary, KnownMaterial, KnownThing, MemorySummary
from affordance.objects.colour import show_colour
from affordance.objects.load import load_tools


@pytest.fixture
def memory(tmp_path):
    path = tmp_path / "workshop.sqlite"
    with open_memory(path) as ledger:
        ledger.append(hold_workshop(9))
    return path


def test_show_prints_and_draws_materials_and_things(memory, tmp_path):
    text = answer("memory", "show", memory, "--out", tmp_path / "shown").out
    assert "9 trials" in text
    things = {"bar", "rod", "hammer"}
    assert {line.split()[0] for line in text.split("\n") if line.startswith(tuple(things))} == things
    assert "arm, other" in text
    assert (tmp_path / "shown" / "memory.png").stat().st_size > 1000
    content = json.loads((tmp_path / "shown" / "memory.json").read_text())
    assert answer("memory", "show", memory, "--json").content == content
    wood, steel = content["materials"]
    assert wood["interval90"][0] < 640.0 < wood["interval90"][1]
    assert steel["interval90"][0] < 7750.0 < steel["interval90"][1]
    assert wood["things"] == ["bar", "hammer"]
    assert wood["trials"] == 6
    assert wood["since"] == "2026-01-01T00:00:00.000000Z"
    bar, rod, hammer = content["things"]
    for thing, mass in ((bar, 0.6), (rod, 7.8), (hammer, 0.65 + 7.7)):
        assert abs(thing["mass"] - mass) < 3.0 * thing["mass_sd"]
        assert thing["trials"] == 3
    # A litre held three times is better known than its material, whose pieces differ by 0.06 of 640 kg/m^3.
    assert bar["mass_sd"] < 0.06 * 0.64 < (wood["interval90"][1] - wood["interval90"][0]) / 3.29 * 1e-3


def test_an_empty_memory_says_so(tmp_path):
    open_memory(tmp_path / "new.sqlite").close()
    assert "The memory is empty." in answer("memory", "show", tmp_path / "new.sqlite").out


def test_forget_merge_export_import_verify(memory, tmp_path):
    other, file = tmp_path / "other.sqlite", tmp_path / "trials.jsonl"
    with open_memory(other) as ledger:
        ledger.append([*hold_workshop(3), hold("plank", (WOOD,), (610.0,), 77)])
    assert "1 of 4 trials new, 10 in all" in answer("memory", "merge", memory, other).out
    answer("memory", "export", memory, file)
    answer("memory", "import", tmp_path / "again.sqlite", file)
    with open_memory(memory) as one, open_memory(tmp_path / "again.sqlite") as two:
        assert [trial.to_dict() for trial in one.list_trials()] == [trial.to_dict() for trial in two.list_trials()]
    assert "1 trial forgotten, 9 remain" in answer("memory", "forget", memory, "--object", "plank").out
    assert "9 trials, all sound" in answer("memory", "verify", memory).out
    assert answer("memory", "verify", memory, "--json").content == {"faults": [], "trials": 9}
    assert answer("memory", "merge", memory, other, "--json").content["trials"] >= 9
    assert answer("memory", "export", memory, tmp_path / "all.json", "--json").content["written"] >= 9


@pytest.mark.parametrize("action", ["merge", "import"])
def test_records_that_an_earlier_one_replaces_are_counted(memory, tmp_path, action):
    """The recording was read before with another size of the object."""
    trial = replace(hold("plank", (WOOD,), (610.0,), 77), source_hash="recording")
    before = replace(trial, time="2026-01-01", parts=(trial.parts[0]._replace(sizes=(0.06, 0.05, 0.05)),))
    other, file = tmp_path / "other.sqlite", tmp_path / "trials.jsonl"
    with open_memory(memory) as one, open_memory(other) as two:
        one.append([trial])
        two.append([before, *hold_workshop(10)])
        export_trials(two, file)
    given = {"merge": other, "import": file}[action]
    wanted = "1 of 11 trials new, 1 replaced by an earlier record, 11 in all"
    assert wanted in answer("memory", action, memory, given).out
    assert "0 of 11 trials new, 11 in all" in answer("memory", action, memory, given).out


def test_commands_that_are_refused_make_no_memory(memory, tmp_path):
    (tmp_path / "bad.jsonl").write_text("[]")
    shutil.copy(memory, tmp_path / "bad.sqlite")
    with closing(sqlite3.connect(tmp_path / "bad.sqlite", autocommit=True)) as connection:
        connection.execute("UPDATE trials SET content = json_set(content, '$.p_value', 0.5) WHERE object = 'hammer'")
    for words in (
        ("memory", "import", tmp_path / "new.sqlite", tmp_path / "bad.jsonl"),
        ("memory", "merge", tmp_path / "new.sqlite", memory, tmp_path / "bad.jsonl"),
        ("memory", "merge", tmp_path / "new.sqlite", memory, tmp_path / "bad.sqlite"),
        ("run", "vision", "--memory", tmp_path / "new.sqlite", "--out", tmp_path / "out"),
    ):
        answer(*words, status=2)
        assert not list(tmp_path.glob("new.sqlite*"))


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("show nowhere.sqlite", "nowhere.sqlite: does not exist"),
        ("shwo workshop.sqlite", "did you mean 'show'"),
        ("show workshop.sqlite more", "show: is given the file 'more', must be given none"),
        ("show workshop.sqlite --object bar", "--object: has no effect on show"),
        ("show workshop.sqlite --set noise.sd=1", "--set: noise.sd"),
        ("join workshop.sqlite red=blue", "join: is 'red=blue', must be two colours"),
        (
            "join workshop.sqlite #b38050=#b07a45",
            "workshop.sqlite: has no part of the second colour of #b38050=#b07a45; the nearest is #b2804c",
        ),
        ("forget workshop.sqlite", "forget: selects no trials, must be given --robot, --object"),
        ("forget workshop.sqlite --since noon", "since: is 'noon', must be a time"),
        (
            "forget workshop.sqlite --robot arn",
            "--robot: is 'arn', must be one of arm, other; did you mean 'arm'",
        ),
        (
            "forget workshop.sqlite --robot arm --object hamer",
            "--object: is 'hamer', must be one of bar, hammer, rod; did you mean 'hammer'",
        ),
        ("merge workshop.sqlite", "merge: is given 0 files, must be given at least one memory"),
        ("merge workshop.sqlite nowhere.sqlite", "nowhere.sqlite: does not exist"),
        ("export workshop.sqlite a b", "export: is given 2 files, must be given one file"),
        ("import workshop.sqlite nowhere.jsonl", "nowhere.jsonl: cannot be read"),
    ],
)
def test_mistake_is_refused_and_changes_nothing(memory, monkeypatch, words, said):
    monkeypatch.chdir(memory.parent)
    assert said in refuse_command("memory", *words.split())


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("once upon a time", "given: line 1: is not JSON"),
        ("\n{half\n", "given: line 2: is not JSON"),
    ],
)
def test_file_that_is_no_memory_is_not_imported(memory, monkeypatch, text, said):
    monkeypatch.chdir(memory.parent)
    (memory.parent / "given").write_text(text)
    assert said in refuse_command("memory", "import", "workshop.sqlite", "given")


def test_joined_colours_are_shown_and_can_be_separated(memory):
    wood, steel = (show_colour(colour) for colour in (WOOD, STEEL))
    said = f"{steel} is read as {wood}"
    assert answer("memory", "join", memory, f"{wood}={steel}").lines == [f"{memory}: {said}"]
    assert said in answer("memory", "show", memory).lines
    assert len(answer("memory", "show", memory, "--json").content["materials"]) == 1
    assert answer("memory", "join", memory, "--json").content == {"joins": {}}
    assert len(answer("memory", "show", memory, "--json").content["materials"]) == 2


_FELT = ExperienceSummary(3, ("arm",), "2026-01-01T00:00:00.000000Z")


def test_a_memory_of_many_things_is_drawn_in_part():
    materials = tuple(KnownMaterial((i / 300, 0.0, 0.0), 700.0, (600.0, 800.0), ("bar",), _FELT) for i in range(50))
    things = tuple(KnownThing(f"bar {i}", 0.5, 0.1, (700.0,), _FELT) for i in range(3000))
    names = {each.colour: "wood" for each in materials}
    figure = draw_memory(MemorySummary(materials, things), names)
    assert figure.get_size_inches()[1] < 40.0
    of_materials, of_things = figure.axes
    assert (of_materials.get_title(), of_things.get_title()) == ("", "the first 100; 2900 more are not drawn")
    assert len(of_materials.get_yticks()) == 50
    assert of_things.get_yticklabels()[-1].get_text() == "bar 99 (3)"


TOOLS = """tools:
  - name: club
    mass: 1.2
    mass_sd: 0.02
    components:
      - {cylinder: [0.02, 0.3], material: oak, mass: 0.28}
      - {semi_axes: [0.03, 0.03, 0.03], position: [0, 0, 0.18], material: steel}
"""


def test_memory_learns_what_bayes_rule_says_of_masses(tmp_path: Path) -> None:
    """Densities of both materials, given the mass of the whole and of a part, from the prior: normal, by hand."""
    path = tmp_path / "club.yaml"
    path.write_text(TOOLS)
    (tool,) = load_tools(path)
    handle, head = (part.shape.volume for part in tool.components)
    with open_memory(tmp_path / "m.sqlite") as ledger:
        assert ledger.append(list(list_weighed_trials([tool], path))) == 2
        assert ledger.append(list(list_weighed_trials([tool], path))) == 0  # a weighing counts once
        belief = ledger.recall().belief
    prior = Prior()
    # The whole and the part are two things, each with a deviation of its own from the means.
    variances = [
        0.02**2 + prior.deviation**2 * (handle**2 + head**2),
        0.0028**2 + (prior.deviation * handle) ** 2,
    ]
    volumes = np.array([[handle, head], [handle, 0.0]])
    precision = np.eye(2) / prior.sd**2 + volumes.T @ np.diag(1.0 / np.array(variances)) @ volumes
    information = prior.mode / prior.sd**2 + volumes.T @ (np.array([1.2, 0.28]) / variances)
    np.testing.assert_allclose(
        np.sort(belief.untruncated_mean), np.sort(np.linalg.solve(precision, information)), rtol=0.02
    )


def test_command_teaches_weighings_to_a_memory(tmp_path: Path) -> None:
    path = tmp_path / "club.yaml"
    path.write_text(TOOLS)
    place = str(tmp_path / "m.sqlite")
    assert answer("memory", "weigh", place, path).lines == [f"{place}: 2 of 2 trials new, 2 in all"]
    said = answer("memory", "show", place).out
    assert "part 1 of club" in said
    assert "a scale" in said


def test_mass_of_an_objects_own_urdf_is_a_weighing(tmp_path: Path) -> None:
    path = tmp_path / "cube.urdf"
    path.write_text(
        '<robot name="cube"><link name="cube"><inertial><mass value="1"/>'
        '<inertia ixx=".0017" iyy=".0017" izz=".0017" ixy="0" ixz="0" iyz="0"/></inertial>'
        '<visual><geometry><box size=".1 .1 .1"/></geometry></visual></link></robot>'
    )
    place = str(tmp_path / "m.sqlite")
    assert answer("memory", "weigh", place, path).lines == [f"{place}: 1 of 1 trial new, 1 in all"]
    (thing,) = answer("memory", "show", place, "--json").content["things"]
    assert thing["mass"] == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            "    mass: 1.2\n    mass_sd: 0.02\n",
            "    mass_sd: 0.02\n",
            "tools[0].mass_sd: is the standard deviation of a mass, which is missing",
        ),
        (", mass: 0.28", ", mass: 0", "mass: is 0, must be"),
        (", mass: 0.28", ", mass: heavy", "mass: is 'heavy', must be"),
    ],
)
def test_wrong_weighings_are_refused(tmp_path: Path, old: str, new: str, said: str) -> None:
    path = tmp_path / "club.yaml"
    path.write_text(TOOLS.replace(old, new))
    assert said in answer("memory", "weigh", tmp_path / "m.sqlite", path, status=2).err
    assert not (tmp_path / "m.sqlite").exists()


def test_file_without_weighings_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "club.yaml"
    path.write_text(TOOLS.replace(", mass: 0.28", "").replace("    mass: 1.2\n    mass_sd: 0.02\n", ""))
    said = "has no weighing, must have the mass (kg) of a tool or of a part"
    assert said in answer("memory", "weigh", tmp_path / "m.sqlite", path, status=2).err
