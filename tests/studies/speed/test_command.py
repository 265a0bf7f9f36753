"""Tables of the study of speed: what their options select, and that folders of results are compared."""

import json

import pytest
from helpers.answers import answer

from studies.speed import command, convergence
from studies.study import import_part


@pytest.mark.parametrize("name", [*command.MEASURED, *command.TABLES])
def test_every_part_makes_a_table(name):
    part = import_part(f"studies.speed.{name}")
    assert len(set(part.HEADER)) == len(part.HEADER)
    assert callable(part.measure)


def test_named_tables_are_printed_and_nothing_is_written(tmp_path, monkeypatch):
    monkeypatch.setattr(convergence, "measure", lambda: iter([["radau3", "1e-02", "5", "1", "2", "9.0"]]))
    assert (
        answer("study", "speed", "--only", "convergence", "--out", tmp_path / "out").lines[2]
        == "| radau3 | 1e-02 | 5 | 1 | 2 | 9.0 |"
    )
    assert not (tmp_path / "out").exists()


def test_a_table_of_arms_needs_arms():
    said = answer("study", "speed", "--only", "stiff_arms", status=2).err
    assert "--arms: is missing, must be folders that import-arm wrote" in said


def test_numbers_of_two_folders_are_compared(tmp_path):
    for folder, numbers in {"a": {"old": 1.0, "wall_s": 1.0}, "b": {"new": 1.0, "wall_s": 2.0}}.items():
        (tmp_path / folder / "run").mkdir(parents=True)
        (tmp_path / folder / "run" / "metrics.json").write_text(json.dumps(numbers), encoding="utf-8")
    words = ["study", "speed", "--compare", tmp_path / "a", tmp_path / "b"]
    assert "run: 0 numbers identical, 2 not" in answer(*words, status=1).out
    answer(*words, "old=new")
    assert "--compare: must be two folders of results" in answer(*words[:-1], status=2).err
