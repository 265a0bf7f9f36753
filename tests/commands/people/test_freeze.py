"""A frozen plan names what it was made from, and refuses files that changed since."""

import hashlib
import json

import pytest
from helpers.answers import answer
from helpers.changed_files import change_file
from helpers.refusals import refuse_command

OBJECTS = """tools:
  - name: small
    components: [{cylinder: [0.04, 0.06], position: [0, 0, 0], material: beech}]
"""
WORDS = ("freeze", "t.csv", "--objects", "objects.yaml")


@pytest.fixture
def lab(tmp_path, monkeypatch):
    """A folder with a table of trials and its objects."""
    (tmp_path / "objects.yaml").write_text(OBJECTS, encoding="utf-8")
    (tmp_path / "t.csv").write_text(
        "participant,group,object\nP1,A,small\nP2,B,small\nP3,A,small\n", encoding="utf-8"
    )
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_plan_has_the_hashes_that_sha256sum_would_print(lab):
    said = answer(*WORDS, "--learner", "kinds_drawn", "--set", "learner.kappa=0.3", "--claim", "It is so.").out
    plan = json.loads((lab / "t.plan.json").read_text(encoding="utf-8"))
    assert plan["table"]["sha256"] == hashlib.sha256((lab / "t.csv").read_bytes()).hexdigest()
    assert plan["objects"]["sha256"] == hashlib.sha256((lab / "objects.yaml").read_bytes()).hexdigest()
    assert plan["participants"] == {"A": 2, "B": 1}
    assert plan["learner"]["name"] == "kinds_drawn"
    assert plan["learner"]["parameters"]["kappa"] == 0.3
    assert plan["claims"] == ["It is so."]
    assert said.endswith(f"to register: {plan['sha256']}\n")
    assert plan["sha256"] in answer("freeze", "t.csv", "--check").out


def test_planned_contrasts_are_checked_and_frozen(lab):
    assert "is 'C', must be one of small, A, B, all" in refuse_command(*WORDS, "--contrast", "force: A - C")
    answer(*WORDS, "--contrast", "force: A - B")
    assert json.loads((lab / "t.plan.json").read_text(encoding="utf-8"))["contrasts"] == ["force: A - B"]


@pytest.mark.parametrize(
    ("file", "old", "new", "said"),
    [
        ("t.csv", "P3,A", "P3,B", "t.csv: has SHA-256 "),
        ("objects.yaml", "0.06", "0.07", "objects.yaml: has SHA-256 "),
        ("t.plan.json", "It is so.", "It is not so.", "t.plan.json: sha256: is "),
    ],
)
def test_what_changed_since_is_refused_by_name(lab, file, old, new, said):
    answer(*WORDS, "--claim", "It is so.")
    change_file(lab / file, old, new)
    assert refuse_command("freeze", "t.csv", "--check").startswith(f"affordance: {said}")


def test_a_plan_is_written_once(lab):
    answer(*WORDS)
    assert "t.plan.json: exists already, must be a new file; --check compares with it" in refuse_command(*WORDS)


@pytest.mark.parametrize("text", ["[]", "{}", '{"table": 1, "objects": {}}'])
def test_what_is_no_plan_is_refused(lab, text):
    (lab / "t.plan.json").write_text(text, encoding="utf-8")
    assert "is not a plan" in refuse_command("freeze", "t.csv", "--check")
