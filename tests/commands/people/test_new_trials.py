"""Tables of trials are written with balanced orders, and go out to PsychoPy, jsPsych and BIDS and come back."""

import csv
import itertools
import json
import re
import runpy
import sys
from collections import Counter
from types import ModuleType, SimpleNamespace

import pandas as pd
import pytest
from helpers.answers import answer
from helpers.browser import open_page
from helpers.refusals import refuse_command

from affordance.extensions.people.pushes import read_lifts
from affordance.objects.load import load_tools
from affordance.objects.materials import MATERIALS, load_materials

OBJECTS = """tools:
  - name: small
    components: [{cylinder: [0.04, 0.06], position: [0, 0, 0], material: beech}]
  - name: '<b>middle</b>'
    components: [{cylinder: [0.04, 0.09], position: [0, 0, 0], material: beech}]
  - name: large
    components: [{cylinder: [0.04, 0.12], position: [0, 0, 0], material: beech}]
    grips:
      top: {position: [0, 0, 0.03]}
      end: {position: [0, 0, -0.03]}
"""
# The release of jsPsych that a laboratory has, as far as the page uses it: it keeps the timeline and runs it.
STUB = """
const answers = ["5.2", "", "6,1", "7"];
function initJsPsych(options) {
  const rows = [];
  return {
    data: { get: () => ({ localSave: (format, name) => { window.saved = { format, name, rows }; } }) },
    run: (timeline) => {
      window.timeline = timeline;
      for (const trial of timeline) {
        const given = answers[rows.length % answers.length];
        const data = { ...trial.data, rt: 1500, response: trial.questions ? { answer: given } : 1 };
        trial.on_finish(data);
        rows.push(data);
      }
      options.on_finish();
    },
  };
}
class jsPsychSurveyText {}
class jsPsychHtmlButtonResponse {}
"""


@pytest.fixture
def lab(tmp_path, monkeypatch):
    """A folder with an objects file."""
    (tmp_path / "objects.yaml").write_text(OBJECTS, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def make(*words):
    return answer("new-trials", "t.csv", "--objects", "objects.yaml", *words).out


def read(name="t.csv"):
    return pd.read_csv(name, dtype=str, keep_default_na=False)


def test_orders_are_a_latin_square_over_the_participants_of_each_group(lab):
    said = make("--participants", 12, "--groups", "A", "B", "--block", "learn: all")
    assert said == "t.csv: 36 trials of 12 participants. Orders are balanced over the participants of each group.\n"
    for _, own in read().groupby("group"):
        orders = own.groupby("participant")["object"].apply(tuple)
        places = Counter(place for order in orders for place in enumerate(order))
        follows = Counter(pair for order in orders for pair in itertools.pairwise(order))
        assert set(places.values()) == {2}
        assert len(follows) == 6
        assert set(follows.values()) == {2}


def test_unbalanced_orders_are_said_with_the_number_that_would_balance_them(lab):
    assert "not balanced: 4 participants in a group, not a multiple of 6. Try 6 in all." in make(
        "--participants", 4, "--block", "learn: all"
    )
    (lab / "t.csv").unlink()
    assert "Orders are shuffled, and not balanced" in make("--block", "learn: all", "--order", "shuffled")


def test_blocks_differ_between_groups_in_masses_and_first_objects(lab):
    blocks = ("learn: small, large=0.6 x 2", "A/test: large=0.9 > small", "B/test: large=0.2 > small")
    make("--participants", 2, "--groups", "A", "B", *(word for block in blocks for word in ("--block", block)))
    table = read()
    assert list(table.columns) == ["participant", "group", "phase", "cycle", "object", "mass", "do"]
    test = table[table["phase"] == "test"]
    assert test["object"].tolist() == ["large", "small"] * 2
    assert test["mass"].tolist() == ["0.9", "", "0.2", ""]
    assert Counter(table.loc[table["phase"] == "learn", "mass"]) == {"": 4, "0.6": 4}


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--block", "learn: samll"], "object is 'samll', must be one of small, <b>middle</b>, large, all; did you"),
        (["--block", "learn small"], "is 'learn small', must be '[GROUP/]PHASE: "),
        (["--block", "C/learn: all"], "group is 'C', must be one of all"),
        (["--block", "learn: all > small"], "has an object twice in a cycle; use x CYCLES"),
        (["--block", "learn: small > large > small"], "has more than one ' > '"),
        (["--block", "learn: all x 0"], "has 0 cycles, must have at least 1"),
        (["--block", "learn: small=900"], "mass: is 900, must be from 0.001 to 100 kg; 0.9 if g were meant"),
        (["--block", "learn: all x 9999"], "would give up to 239976 trials, must give at most 200000"),
        (["--block", "A/learn: all", "--groups", "A", "B"], "is missing for group B, must be given once at least"),
        (["--block", "learn: all", "--groups", "A", "B", "--participants", "1"], "is 1, must be at least 2"),
        (["--block", "learn: all", "--participants", "20000"], "--participants: is 20000, must be from 1 to 10000"),
        (["--order", "latin"], "--order: is for a new table, must be given with --block"),
        ([], "--block: is missing, must describe a block"),
        (["--for", "bids"], "t.csv: cannot be read: No such file"),
    ],
)
def test_bad_designs_are_refused(lab, words, said):
    assert said in refuse_command("new-trials", "t.csv", "--objects", "objects.yaml", *words)


def test_nothing_is_overwritten(lab):
    make("--block", "learn: all", "--for", "bids")
    for words in (["--block", "learn: all"], ["--for", "bids"]):
        assert "exists already, must be a new" in refuse_command(
            "new-trials", "t.csv", "--objects", "objects.yaml", *words
        )


def import_conditions(path):
    """Reads conditions as ``importConditions`` of PsychoPy 2023 does: as pandas reads CSV; brackets are Python."""
    table = pd.read_csv(path, encoding="utf-8-sig", sep=",", decimal=".")
    assert all(re.fullmatch("[A-Za-z][A-Za-z0-9_]*", name) for name in table.columns)
    rows = [dict(zip(table.columns, record, strict=True)) for record in table.to_records(index=False).tolist()]
    assert not any(isinstance(cell, str) and cell.startswith("[") for row in rows for cell in row.values())
    return rows


DESIGN = ("--participants", 2, "--block", "learn: small=0.3, large", "--block", "test: <b>middle</b>=0.9")
CHOICES = """participant,phase,object,do,task,duration,teaches
é/1,learn,small,lift,,,
é/1,learn,large,hold,,2,
é/1,learn,small,lift,,,no
é/1,test,large,choose,reach,,
"""


def test_psychopys_conditions_are_the_table(lab):
    make(*DESIGN, "--for", "psychopy")
    rows, trials = import_conditions("t_psychopy/t.csv"), read()
    assert [row["object"] for row in rows] == trials["object"].tolist()
    assert [row["trial"] for row in rows] == [1, 2, 3, 1, 2, 3]
    assert [row["mass"] for row in rows if row["object"] == "small"] == [0.3, 0.3]
    answer("new-trials", "t_psychopy/t.csv", "--objects", "objects.yaml", "--for", "psychopy")  # our reader reads it
    assert read("t_psychopy/t_psychopy/t.csv").equals(read("t_psychopy/t.csv"))


@pytest.mark.parametrize(
    ("cell", "said"),
    [
        (
            "[__import__('os').system('touch owned')]",
            "row 2, remark: is \"[__import__('os').system('touch owned')]\"",
        ),
        ("1", ""),
    ],
)
def test_psychopy_is_given_nothing_that_it_would_run(lab, cell, said):
    (lab / "t.csv").write_text(f"object,remark\nsmall,{cell}\n", encoding="utf-8")
    words = ("new-trials", "t.csv", "--objects", "objects.yaml", "--for", "psychopy")
    assert said in (refuse_command(*words) if said else answer(*words).out)


def test_a_column_that_psychopy_cannot_name_is_refused(lab):
    (lab / "t.csv").write_text("object,how heavy\nsmall,1\n", encoding="utf-8")
    assert "row 1: is 'how heavy', must be letters, digits and '_'" in refuse_command(
        "new-trials", "t.csv", "--objects", "objects.yaml", "--for", "psychopy"
    )


def build_psychopy(keys, shown):
    """Builds a stand-in for PsychoPy, whose experimenter presses these keys."""
    psychopy = ModuleType("psychopy")

    def quit():
        raise SystemExit

    class Stimulus(SimpleNamespace):
        def draw(self):
            shown.append(self.text)

    def build_dialogue(fields, title):
        fields["participant"] = fields["participant"][0]
        return SimpleNamespace(OK=True)

    psychopy.core = SimpleNamespace(Clock=lambda: SimpleNamespace(getTime=lambda: 1.25), quit=quit)
    psychopy.event = SimpleNamespace(waitKeys=lambda: [keys.pop(0)])
    psychopy.gui = SimpleNamespace(DlgFromDict=build_dialogue)
    window = SimpleNamespace(flip=lambda: None, close=lambda: None)
    psychopy.visual = SimpleNamespace(
        Window=lambda **options: window, TextStim=lambda win, **options: Stimulus(win=win, text="")
    )
    return psychopy


def run_script(monkeypatch, keys):
    shown = []
    monkeypatch.setitem(sys.modules, "psychopy", build_psychopy(keys, shown))
    with pytest.raises(SystemExit):
        runpy.run_path("t_psychopy/t.py", run_name="__main__")
    return shown


def test_psychopys_script_records_what_is_typed(lab, monkeypatch):
    (lab / "t.csv").write_text(CHOICES, encoding="utf-8")
    make("--for", "psychopy")
    keys = ["5", "period", "num_2", "x", "return"]
    keys += ["4", "return", "backspace", "return"]  # a hold has no number
    keys += ["3", "return", "return", "9", "return", "backspace", "2", "return"]  # there is no ninth grip
    shown = run_script(monkeypatch, keys)
    assert shown[0].startswith("Lift:  small\n")
    (path,) = (lab / "t_psychopy" / "data").iterdir()
    assert path.name == "sub-é-1_beh.tsv"
    with path.open(encoding="utf-8", newline="") as file:
        found = list(csv.DictReader(file, delimiter="\t"))
    assert [row["force"] for row in found] == ["5.2", "n/a", "3", "n/a"]
    assert [row["chosen"] for row in found] == ["n/a", "n/a", "n/a", "end"]
    assert {row["response_time"] for row in found} == {"1.250"}
    tools = load_tools(lab / "objects.yaml", load_materials(MATERIALS))
    (person,) = read_lifts(path, tools=tools).people
    assert person.pushes[[0, 2]].tolist() == [5.2, 3.0]
    assert person.teaches.tolist() == [True, True, False, False]


def test_psychopys_script_keeps_trials_until_escape_and_overwrites_nothing(lab, monkeypatch):
    make(*DESIGN, "--for", "psychopy")
    run_script(monkeypatch, ["7", "return", "escape"])
    path = lab / "t_psychopy" / "data" / "sub-P1_beh.tsv"
    assert [row.split("\t")[-3] for row in path.read_text(encoding="utf-8").splitlines()] == ["force", "7"]
    with pytest.raises(FileExistsError):
        run_script(monkeypatch, ["7", "return", "escape"])


def test_jspsychs_timeline_runs_in_a_browser(lab):
    (lab / "t.csv").write_text(
        CHOICES.replace("é/1,learn,small,lift,,,no", "é/1,learn,<b>middle</b>,lift,,,no"), "utf-8"
    )
    make("--for", "jspsych")
    folder = lab / "t_jspsych" / "jspsych"
    folder.mkdir()
    for name in ("jspsych.css", "plugin-survey-text.js", "plugin-html-button-response.js"):
        (folder / name).write_text("", encoding="utf-8")
    (folder / "jspsych.js").write_text(STUB, encoding="utf-8")
    with open_page() as page:
        errors = []
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.goto((lab / "t_jspsych" / "t.html").as_uri())
        page.click("text=é/1")
        page.wait_for_function("window.saved")
        saved = page.evaluate("window.saved")
        types = page.evaluate("window.timeline.map((trial) => trial.type.name)")
        prompts = page.evaluate("window.timeline.map((trial) => trial.stimulus ?? trial.questions[0].prompt)")
    assert errors == []
    assert types == ["jsPsychSurveyText"] * 3 + ["jsPsychHtmlButtonResponse"]
    assert prompts[0] == "Lift: small<br>Force before the release (N)"
    assert prompts[2].startswith("Lift: &lt;b&gt;middle&lt;/b&gt;<br>")
    assert (saved["format"], saved["name"]) == ("csv", "sub---1_beh.csv")
    assert [row.get("force") for row in saved["rows"]] == ["5.2", "n/a", "6.1", None]
    assert saved["rows"][3]["chosen"] == "end"
    assert {row["response_time"] for row in saved["rows"]} == {1.5}


def test_a_page_cannot_be_broken_by_the_table(lab):
    (lab / "t.csv").write_text("object,remark\nsmall,</script><script>alert(1)</script>\n", encoding="utf-8")
    make("--for", "jspsych")
    assert "alert(1)</script>" not in (lab / "t_jspsych" / "t.html").read_text(encoding="utf-8")


def test_bids_describes_every_column_and_comes_back(lab):
    make(*DESIGN, "--for", "bids")
    folder = lab / "t_bids"
    described = json.loads((folder / "task-t_beh.json").read_text(encoding="utf-8"))
    assert json.loads((folder / "dataset_description.json").read_text(encoding="utf-8"))["Name"] == "t"
    people = pd.read_csv(folder / "participants.tsv", sep="\t")["participant_id"]
    assert people.tolist() == ["sub-P1", "sub-P2"]
    tools = load_tools(lab / "objects.yaml", load_materials(MATERIALS))
    for label in people:
        path = folder / label / "beh" / f"{label}_task-t_beh.tsv"
        table = pd.read_csv(path, sep="\t", na_values="n/a")
        assert set(table.columns) < set(described)
        assert described["force"] == {"Description": "Upward force before the release of a lift", "Units": "N"}
        table.assign(force=[1.0, 2.0, 3.0]).to_csv(path, sep="\t", index=False, na_rep="n/a")
        (person,) = read_lifts(path, tools=tools).people
        assert (person.name, person.pushes.tolist()) == (label[4:], [1.0, 2.0, 3.0])


def test_participants_that_bids_could_not_tell_apart_are_refused(lab):
    (lab / "t.csv").write_text("participant,object\na-1,small\na_1,small\n", encoding="utf-8")
    assert "participant: has 'a_1', which BIDS would call 'sub-a1'" in refuse_command(
        "new-trials", "t.csv", "--objects", "objects.yaml", "--for", "bids"
    )
