"""The harness of studies: findings are checked, kept, written and printed alike."""

import dataclasses
import os
import sys

import numpy as np
import pytest
from helpers.results_files import OF_STUDY, read_numbers
from helpers.study_runs import run_study

from affordance.cli import main
from affordance.commands.arguments import add_out, add_seed, add_set
from affordance.exceptions import BadValueError
from affordance.files.model_folder import import_study, list_studies
from affordance.reporting.claims import Unit, check, claim
from affordance.reporting.section import Section
from studies.study import Findings, Study, Task, run_kept

NUMBERS = {"count": 4}
SECTION = Section(
    order=99,
    title="Invented",
    summary="Of four people.",
    figures=[],
    claims=[
        claim("many", "ours", "Many came.", check("people", 4, Unit(digits=0), at_least=3)),
        claim("few", "ours", "Few came.", check("people", 4, Unit(digits=0), at_most=3)),
    ],
    tables=[],
    remarks=["They left early."],
)


def add_arguments(parser):
    for add in (add_out, add_seed, add_set):
        add(parser)


def build_study(plan, **options):
    return Study("helps", add_arguments, plan, "invented", {("learner",): "nobody learns"}, **options)


def find(*found):
    """A study that finds something, once or more."""
    return build_study(lambda arguments: lambda folder: found)


def test_last_findings_are_written_and_their_claims_printed(tmp_path, capsys):
    out = tmp_path / "out"
    assert run_study(find(Findings({"count": 3}), Findings(NUMBERS, SECTION)), "--out", out) == 0
    numbers = read_numbers(out / "invented")
    assert numbers.keys() == {"count", *OF_STUDY}
    assert numbers["count"] == 4
    assert "Invented" in (out / "report.html").read_text(encoding="utf-8")
    many, few, summary, remark, report = capsys.readouterr().out.splitlines()
    assert many.startswith("met     Many came. people 4")
    assert few.startswith("not met Few came.")
    assert (summary, remark) == ("Of four people.", "They left early.")
    assert report == f"The report: {out / 'report.html'}"


def test_without_a_section_only_the_numbers_are_written(tmp_path, capsys):
    assert run_study(find(Findings(NUMBERS)), "--out", tmp_path / "out") == 0
    assert [path.name for path in (tmp_path / "out").rglob("*")] == ["invented", "metrics.json"]
    assert capsys.readouterr().out == f"The numbers: {tmp_path / 'out' / 'invented' / 'metrics.json'}\n"


@pytest.mark.parametrize(("folder", "place"), [("", "metrics.json"), (None, "studies/metrics.json")])
def test_results_are_in_the_named_folder_or_in_one_of_the_name_of_the_study(tmp_path, folder, place):
    study = dataclasses.replace(find(Findings(NUMBERS)), folder=folder)
    run_study(study, "--out", tmp_path)
    assert (tmp_path / place).is_file()


def test_a_task_has_an_exit_status_and_no_folder(tmp_path):
    study = build_study(lambda arguments: Task(lambda: 1))
    assert run_study(study, "--out", tmp_path / "out") == 1
    assert not (tmp_path / "out").exists()


def test_versions_of_further_libraries_join_the_programs(tmp_path):
    run_study(find(Findings({**NUMBERS, "versions": {"peer": "1.0"}})), "--out", tmp_path / "out")
    assert {"peer", "drake"} <= read_numbers(tmp_path / "out" / "invented")["versions"].keys()


def test_a_study_on_one_thread_starts_anew_unless_it_has_one(monkeypatch):
    started = []
    monkeypatch.setattr("os.execv", lambda path, words: started.append(words))
    study = build_study(lambda arguments: Task(lambda: 0), on_one_thread=True)
    run_study(study)
    assert not started
    monkeypatch.delenv("OMP_NUM_THREADS")
    run_study(study)
    assert started == [[sys.executable, *sys.orig_argv[1:]]]
    assert os.environ["OMP_NUM_THREADS"] == "1"


def refuse(arguments):
    raise BadValueError("--data", "", "is missing")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([], "--data: is missing"),
        (["--seed", -1], "--seed: is -1"),
        (["--set", "learner=density"], "--set: learner: has no effect here: nobody learns"),
    ],
)
def test_what_cannot_be_run_leaves_nothing(tmp_path, words, message):
    with pytest.raises(BadValueError, match=message):
        run_study(build_study(refuse), "--out", tmp_path / "out", *words)
    assert not (tmp_path / "out").exists()


@dataclasses.dataclass(frozen=True)
class Config:
    offset: int


def count_up(config, repeat):
    return {"sum": np.array(config.offset + repeat)}


def test_repeats_of_another_configuration_are_kept_apart(tmp_path):
    for offset in (0, 10, 0):
        found = run_kept(Config(offset), count_up, tmp_path, [], repeats=2, jobs=1, description="counts")
        np.testing.assert_array_equal(found["sum"], [offset, offset + 1])
    assert len(list((tmp_path / "repeats").iterdir())) == 2


@pytest.mark.parametrize("name", list_studies())
def test_every_study_is_a_command(name, capsys):
    with pytest.raises(SystemExit) as ended:
        main(["study", name, "--help"])
    assert ended.value.code == 0
    assert import_study(name).HELP in " ".join(capsys.readouterr().out.split())


def test_without_a_clone_one_line_says_that_studies_need_one(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("affordance.files.model_folder._CLONE", tmp_path)
    assert main(["study", "payload", "--out", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert "unavailable here (studies need a clone of the repository)" in said
    assert said.count("\n") == 1
    assert not (tmp_path / "out").exists()
    assert main(["study"]) == 0
    assert "they need a clone" in capsys.readouterr().out
