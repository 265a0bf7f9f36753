"""``affordance tutorials``, and output of the lessons; all of them are executed by ``make docs``."""

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

LESSONS = sorted(tutorials.TUTORIALS.glob("*.md"))


def list_cells(path):
    found = re.findall(r"^```\{code-cell\} ipython3\n(?::tags:[^\n]*\n)?(.*?)^```$", path.read_text(), re.S | re.M)
    assert found
    return found


def without(monkeypatch, *missing):
    there = tutorials.importlib.util.find_spec
    monkeypatch.setattr(tutorials.importlib.util, "find_spec", lambda name: None if name in missing else there(name))


def test_lessons_are_numbered_and_each_names_the_next():
    assert [path.stem[:2] for path in LESSONS] == [f"{k}_" for k in range(1, 10)]
    for path, following in itertools.pairwise(LESSONS):
        assert "## One number" in path.read_text()
        assert f"({following.name})" in path.read_text().partition("**Next**")[2]


def test_lessons_are_copied_as_they_are_without_jupytext_and_kept_when_they_are_there(tmp_path, monkeypatch):
    without(monkeypatch, "jupytext", "jupyterlab", "notebook")
    out = tmp_path / "lessons"
    said = answer("tutorials", "--out", out)
    assert [path.name for path in sorted(out.iterdir())] == [path.name for path in LESSONS]
    first = out / LESSONS[0].name
    assert first.read_text() == LESSONS[0].read_text()
    first.write_text("mine")
    assert said.lines[-1].startswith("To open them as notebooks: pip install jupyterlab jupytext, then")
    assert f"{first}: exists, not changed" in answer("tutorials", "--out", out).out
    assert first.read_text() == "mine"


def test_only_what_is_missing_is_named(tmp_path, monkeypatch):
    without(monkeypatch, "jupyterlab", "notebook")
    assert (
        answer("tutorials", "--out", tmp_path)
        .lines[-1]
        .startswith("To open them as notebooks: pip install jupyterlab, then")
    )


def test_notebooks_link_to_notebooks():
    text, suffix = tutorials.convert(LESSONS[0].read_text())
    cells = json.loads(text)["cells"]
    assert suffix == ".ipynb"
    assert [cell["cell_type"] for cell in cells].count("code") == len(list_cells(LESSONS[0]))
    assert f"({LESSONS[1].stem}.ipynb)" in "".join(cells[-1]["source"])


@pytest.mark.parametrize(("words", "opened"), [([], 1), (["--copy-only"], 0)])
def test_jupyter_is_opened_in_the_folder_if_it_is_there(tmp_path, monkeypatch, words, opened):
    without(monkeypatch, "jupytext")
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


def test_a_lesson_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (path,) = (path for path in LESSONS if path.stem == "6_your_tool")
    names = {}
    for cell in list_cells(path):
        exec(cell, names)
    assert re.search(r"By its bowl the ladle takes \d+ % less work", capsys.readouterr().out)


def test_folder_below_a_file_is_refused(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "notes.txt").touch()
    said = refuse_command("tutorials", "--out", "notes.txt")
    assert said == "affordance: --out: is 'notes.txt', which is a file or is inside one, must be a folder"
