"""``affordance tutorials``, and outputs of lessons, of which ``make release-check`` compares all."""

import ast
import itertools
import json
import re
import shlex
import subprocess
import sys

import pytest
from helpers.answers import answer
from helpers.imports import can_import
from helpers.refusals import refuse_command

from affordance.commands import tutorials
from affordance.commands.catalogue import load_command
from affordance.commands.parser import OneLineParser
from docs import lessons

LESSONS = sorted(tutorials.TUTORIALS.glob("*.ipynb"))


def list_cells(path, kind="code"):
    cells = json.loads(path.read_text())["cells"]
    return ["".join(cell["source"]) for cell in cells if cell["cell_type"] == kind]


def without(monkeypatch, *missing):
    there = tutorials.importlib.util.find_spec
    monkeypatch.setattr(tutorials.importlib.util, "find_spec", lambda name: None if name in missing else there(name))


def test_lessons_are_numbered_and_each_names_the_next():
    assert [path.stem[:2] for path in LESSONS] == [f"{k}_" for k in range(1, 10)]
    for path, following in itertools.pairwise(LESSONS):
        assert "## One number" in path.read_text()
        assert f"({following.name})" in path.read_text().partition("**Next**")[2]


def test_lessons_are_copied_and_kept_when_they_are_there(tmp_path, monkeypatch):
    without(monkeypatch, "jupyterlab", "notebook")
    out = tmp_path / "lessons"
    said = answer("tutorials", "--out", out)
    assert [path.read_text() for path in sorted(out.iterdir())] == [path.read_text() for path in LESSONS]
    first = out / LESSONS[0].name
    first.write_text("mine")
    assert said.lines[-1] == "To open them: pip install jupyterlab, then run this again."
    assert f"{first}: exists, not changed" in answer("tutorials", "--out", out).out
    assert first.read_text() == "mine"


@pytest.mark.parametrize(("words", "opened"), [([], 1), (["--copy-only"], 0)])
def test_jupyter_is_opened_in_the_folder_if_it_is_there(tmp_path, monkeypatch, words, opened):
    monkeypatch.setattr(tutorials, "_PROGRAMS", ("json",))  # a module that is always there
    calls = []
    monkeypatch.setattr(subprocess, "call", lambda command: calls.append(command) or 0)
    answer("tutorials", "--out", tmp_path, *words)
    assert calls == [[sys.executable, "-m", "json", str(tmp_path)]] * opened


@pytest.mark.parametrize("path", LESSONS, ids=lambda path: path.stem)
def test_code_of_a_lesson_is_python_or_commands_that_exist(path):
    for cell in list_cells(path):
        if not cell.startswith("%%bash"):
            for node in ast.walk(ast.parse(cell)):
                if isinstance(node, ast.ImportFrom) and node.module.startswith("affordance"):
                    assert all(can_import(node.module, each.name) for each in node.names), ast.unparse(node)
            continue
        for line in re.findall(r"^affordance ([^|>\n]*)", cell, re.MULTILINE):
            name, *words = shlex.split(line)
            parser = OneLineParser(prog=name)
            load_command(name).add_arguments(parser)
            parser.parse(words)


def test_lesson_prints_what_it_shows(monkeypatch):
    (path,) = (path for path in LESSONS if path.stem == "6_your_tool")
    monkeypatch.setattr(sys, "argv", ["lessons", "--check", str(path)])
    assert lessons.main() == 0


def test_lesson_whose_output_is_stale_is_found_and_mended(tmp_path, monkeypatch, capsys):
    path = tmp_path / "lesson.ipynb"
    cell = {"cell_type": "code", "execution_count": 7, "id": "x", "metadata": {}, "source": ["print(1 + 1)\n", "2.0"]}
    stale = {"name": "stdout", "output_type": "stream", "text": ["3\n"]}
    notebook = {"cells": [cell | {"outputs": [stale]}], "metadata": {}, "nbformat": 4, "nbformat_minor": 5}
    path.write_text(json.dumps(notebook))
    monkeypatch.setattr(sys, "argv", ["lessons", "--check", str(path)])
    assert lessons.main() == 1
    assert "-3\n+2\n+2.0" in capsys.readouterr().out
    monkeypatch.setattr(sys, "argv", ["lessons", str(path)])
    assert lessons.main() == 0
    (cell,) = json.loads(path.read_text())["cells"]
    assert (cell["id"], cell["execution_count"], cell["metadata"]) == ("cell-1", 1, {})
    assert [output.get("text") or output["data"]["text/plain"] for output in cell["outputs"]] == [["2\n"], ["2.0"]]


def test_lessons_name_no_folder_of_a_machine():
    for path in LESSONS:
        assert not re.search(r"/(tmp|home|root|Users)/", path.read_text()), path
        assert path.stat().st_size < 300_000


def test_folder_below_a_file_is_refused(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "notes.txt").touch()
    said = refuse_command("tutorials", "--out", "notes.txt")
    assert said == "affordance: --out: is 'notes.txt', which is a file or is inside one, must be a folder"
