"""Trial tables of the command line: means, files, refusals, and what tells learners apart."""

import json
import re

import pandas as pd
import pytest
from helpers.answers import answer
from helpers.refusals import refuse_command

pytestmark = pytest.mark.usefixtures("unrendered")
OBJECTS = """tools:
  - name: small
    components: [{cylinder: [0.04, 0.06], position: [0, 0, 0], material: beech}]
  - name: large
    components: [{cylinder: [0.04, 0.12], position: [0, 0, 0], material: beech}]
"""
TABLE = """subj;group;phase;stim;mass;session
P1;A;learn;small;0,2;s1
P1;A;test;large;0,4;s1
P2;B;learn;small;0,4;s2
P2;B;test;large;0,8;s2
"""
NAMED = ("--columns", "participant=subj", "object=stim")


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """Working folder with a table and its objects."""
    (tmp_path / "objects.yaml").write_text(OBJECTS, encoding="utf-8")
    (tmp_path / "trials.csv").write_text("\ufeff" + TABLE, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_table_is_lifted_and_written_with_what_was_done(folder):
    words = ("--trials", "trials.csv", "--objects", "objects.yaml", *NAMED, "--learner", "density", "--jobs", 1)
    said = answer("lift", *words, "--repeats", 2)
    assert said.lines[0].split()[:4] == ["learner", "group", "phase", "object"]
    assert [line.split()[:4] for line in said.lines[1:5]] == [
        ["density", "A", "learn", "small"],
        ["density", "A", "test", "large"],
        ["density", "B", "learn", "small"],
        ["density", "B", "test", "large"],
    ]
    lifts = pd.read_csv(folder / "results" / "trials" / "lifts.csv")
    assert len(lifts) == 8
    assert lifts["participant"].tolist() == ["P1", "P1", "P2", "P2"] * 2
    assert lifts["session"].tolist() == ["s1", "s1", "s2", "s2"] * 2
    assert lifts["mass"].tolist() == pytest.approx([0.2, 0.4, 0.4, 0.8] * 2)
    assert {"force", "expected", "weight", "felt", "kind", "surprise", "learner"} <= set(lifts)
    assert (folder / "results" / "trials" / "force.png").is_file()
    assert "Trials of trials.csv" in (folder / "results" / "report.html").read_text(encoding="utf-8")
    again = answer("lift", *words, "--repeats", 2, "--json").content
    numbers = json.loads((folder / "results" / "trials" / "metrics.json").read_text(encoding="utf-8"))
    assert again == numbers["means"]
    assert (numbers["participants"], numbers["repeats_of_each"], numbers["repeats"]) == (2, 2, 4)
    of_p1 = lifts[(lifts["participant"] == "P1") & (lifts["object"] == "large")]["force"]
    assert again[1]["force_N"] == pytest.approx(of_p1.mean(), rel=1e-6)


def test_push_too_strong_for_a_hand_is_said(folder):
    """A light object of the size of a bucket is expected to weigh as much as any of its size."""
    (folder / "objects.yaml").write_text(OBJECTS.replace("0.04, 0.12", "0.1, 0.3"), encoding="utf-8")
    words = (
        "lift",
        "--trials",
        "trials.csv",
        "--objects",
        "objects.yaml",
        *NAMED,
        "--learner",
        "density",
        "--jobs",
        1,
    )
    said = [line for line in answer(*words).lines if line.startswith("Simulated pushes know no limit of a hand")]
    assert len(said) == 1
    assert re.search(r": large up to \d+ N\.$", said[0])
    assert "Simulated pushes know no limit of a hand" in (folder / "results" / "report.html").read_text(
        encoding="utf-8"
    )


def test_learners_are_told_apart_by_a_table(folder):
    said = answer(
        "predict", "trials.csv", "--objects", "objects.yaml", *NAMED, "--repeats", 2, "--people-sd", 1.9, "--details"
    ).out
    assert "force_N, A, test, large" in said
    assert "SD between people 1.9 (as given)" in said
    assert "density and kinds_map are " in said
    found = json.loads((folder / "results" / "trials" / "predictions.json").read_text(encoding="utf-8"))
    assert set(found["numbers"]) == {f"force_N, {place}" for place in (
        "A, learn, small", "A, test, large", "B, learn, small", "B, test, large"
    )}  # fmt: skip
    assert {each["power"] for each in found["contrasts"]} == {0.9}
    assert found["repeats"] == 4


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (
            ["--objects", "objects.yaml"],
            "trials.csv: row 1: is 'subj'; did you mean 'participant'?",
        ),
        (
            ["--objects", "objects.yaml", "--columns", "stim"],
            "--columns: is 'stim', must be OURS=THEIRS, for example",
        ),
        (
            ["--objects", "objects.yaml", "--columns", "objct=stim"],
            "--columns: is 'objct', must be one of participant",
        ),
        ([*NAMED], "--objects: is missing, must be a tools file with the objects of trials.csv"),
        (["--objects", "objects.yaml", *NAMED, "--repeats", 0], "--repeats: is 0, must be from 1 to 100000"),
        (["--objects", "objects.yaml", *NAMED, "--repeats", 100_000], "--repeats: is 100000, must be at most 50000"),
        (
            ["--objects", "objects.yaml", *NAMED, "--learner", "kind"],
            "must be one of density, kinds_map, kinds_drawn",
        ),
        (["--objects", "objects.yaml", *NAMED, "--set", "learner=density"], "--set: learner: has no effect here"),
        (["--objects", "objects.yaml", *NAMED, "--set", "noise.model=white"], "noise"),
        (
            ["--objects", "object.yaml", *NAMED],
            "object.yaml: cannot be read: No such file or directory; did you mean",
        ),
    ],
)
def test_what_cannot_be_lifted_is_refused(words, said):
    assert said in refuse_command("lift", "--trials", "trials.csv", *words)


def test_table_does_not_write_to_the_results_of_an_experiment(folder):
    (folder / "trials.csv").rename(folder / "weight.csv")
    said = refuse_command("lift", "--trials", "weight.csv", "--objects", "objects.yaml", *NAMED)
    assert "weight.csv: would write to the results of weight, must have another name, such as my_weight.csv" in said
    (folder / "weight.csv").rename(folder / ".csv")
    assert "names the folder of its results" in refuse_command(
        "lift", "--trials", ".csv", "--objects", "objects.yaml"
    )


def test_options_of_tables_are_for_tables():
    said = refuse_command("predict", "linear_plus", "--people-sd", 2)
    assert "--people-sd: is for a table of trials, must be omitted for linear_plus" in said
    said = refuse_command("predict", "trials.csv", "--objects", "objects.yaml", *NAMED, "--power", 2)
    assert "--power: is 2.0, must be from 0.5 to 0.999" in said


def test_file_of_data_runs_no_code(folder):
    """A table that says it is Python, or names a file that is, is read as cells."""
    (folder / "evil.py").write_text("open('ran', 'w')\n", encoding="utf-8")
    (folder / "evil.csv").write_text("import os\nopen('ran', 'w')\n", encoding="utf-8")
    refuse_command("lift", "--trials", "evil.csv", "--objects", "objects.yaml")
    refuse_command("lift", "--trials", "trials.csv", "--objects", "evil.py", *NAMED)
    refuse_command("lift", "--trials", "evil.py", "--objects", "objects.yaml")
    assert not (folder / "ran").exists()


def test_participants_of_experiments_whose_objects_are_held_are_refused():
    said = refuse_command("run", "weight", "--set", "participant.push_error=0.2")
    assert said.startswith("affordance: settings: participant.push_error: is not a setting")


def test_parameter_and_slip_of_ones_own_learner(folder):
    """A parameter of the one learner is changed, and a mistake in its file is named by file and line."""
    own = folder / "slip.py"
    own.write_text(
        "from affordance.belief.one_density import OneDensity\n\n\n"
        "class Mine(OneDensity):\n"
        "    def learn(self, state, seen, felt, rng):\n"
        '        return state["gian"]\n'
    )
    words = ("lift", "--trials", "trials.csv", "--objects", "objects.yaml", *NAMED, "--jobs", 1)
    said = refuse_command(*words, "--learner", f"{own}:Mine")
    assert said.endswith("slip.py: line 6, in learn: KeyError: 'gian'")
    changed = ("--set", "learner.kappa=0.3")
    assert "belongs to one learner, must be given with exactly one --learner" in refuse_command(*words, *changed)
    assert answer(*words, "--learner", "kinds_map", *changed).lines


CONTRAST = ("--contrast", "force: large - small")


def test_planned_contrast_is_the_answer_and_the_means_are_details(folder):
    words = ("--trials", "trials.csv", "--objects", "objects.yaml", *NAMED, "--learner", "density", "--jobs", 1)
    said = answer("lift", *words, "--repeats", 2, *CONTRAST)
    assert said.out.startswith("force: large - small: density ")
    assert "observers" not in said.out
    lifts = pd.read_csv(folder / "results" / "trials" / "lifts.csv").pivot(
        index="observer", columns="object", values="force"
    )
    (contrast,) = answer("lift", *words, "--repeats", 2, *CONTRAST, "--json").content["contrasts"]
    found = contrast["effects"]["density"]
    assert found["mean"] == pytest.approx((lifts["large"] - lifts["small"]).mean(), rel=1e-5)
    assert found["persons"] == [4]
    assert "heaviness" in answer("lift", *words, "--repeats", 2, *CONTRAST, "--details").out


def test_people_that_planned_contrasts_need_are_predicted_and_written(folder):
    words = ("trials.csv", "--objects", "objects.yaml", *NAMED, "--jobs", 1, "--repeats", 2, "--people-sd", 2.0)
    said = " ".join(answer("predict", *words, *CONTRAST, "--contrast", "heaviness: A - 3 in test").out.split())
    assert said.count("To find it, a ") == 2
    assert "paired t test (two-sided .025, power .9, SD 2 N) needs" in said
    content = json.loads((folder / "results" / "trials" / "predictions.json").read_text(encoding="utf-8"))
    force, heaviness = content["planned_contrasts"]
    assert (force["test"], heaviness["test"]) == ("paired t test", "one-sample t test")
    assert force["sd_between_people"] == 2.0
    assert set(force["people_to_find"]) == set(force["effects"])


@pytest.mark.parametrize("command", [("lift", "--trials", "trials.csv"), ("predict", "trials.csv")])
def test_contrasts_that_the_table_cannot_answer_are_refused(command):
    words = (*command, "--objects", "objects.yaml", *NAMED, "--contrast", "force: lagre - small")
    assert "--contrast: is 'force: lagre - small': is 'lagre', must be one of small, large, " in refuse_command(
        *words
    )


def test_contrast_of_an_experiment_without_a_table_is_refused():
    assert "--contrast: is for a table of trials" in refuse_command("predict", "linear_plus", *CONTRAST)
