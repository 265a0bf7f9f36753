"""Tables of the study of speed: what their options select, and that folders of results are compared."""

import json

import pytest

from affordance.cli import main
from studies.speed import command, convergence
from studies.study import import_part


@pytest.mark.parametrize("name", [*command.MEASURED, *command.TABLES])
def test_every_part_makes_a_table(name):
    part = import_part(f"studies.speed.{name}")
    assert len(set(part.HEADER)) == len(part.HEADER)
    assert callable(part.measure)


def test_named_tables_are_printed_and_nothing_is_written(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(convergence, "measure", lambda: iter([["radau3", "1e-02", "5", "1", "2", "9.0"]]))
    assert main(["study", "speed", "--only", "convergence", "--out", str(tmp_path / "out")]) == 0
    assert capsys.readouterr().out.splitlines()[2] == "| radau3 | 1e-02 | 5 | 1 | 2 | 9.0 |"
    assert not (tmp_path / "out").exists()


def test_a_table_of_arms_needs_arms(capsys):
    assert main(["study", "speed", "--only", "stiff_arms"]) == 2
    assert "--arms: is missing, must be folders that import-arm wrote" in capsys.readouterr().err


def test_numbers_of_two_folders_are_compared(tmp_path, capsys):
    for folder, numbers in {"a": {"old": 1.0, "wall_s": 1.0}, "b": {"new": 1.0, "wall_s": 2.0}}.items():
        (tmp_path / folder / "run").mkdir(parents=True)
        (tmp_path / folder / "run" / "metrics.json").write_text(json.dumps(numbers), encoding="utf-8")
    words = ["study", "speed", "--compare", str(tmp_path / "a"), str(tmp_path / "b")]
    assert main(words) == 1
    assert "run: 0 numbers identical, 2 not" in capsys.readouterr().out
    assert main([*words, "old=new"]) == 0
    assert main(words[:-1]) == 2
    assert "--compare: must be two folders of results" in capsys.readouterr().err
