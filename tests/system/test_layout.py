"""Layout of the library: the paper is a trunk that knows no extension (decision 0029)."""

import ast
import os
import re
import shutil
import sys
import tomllib
from pathlib import Path

import pytest
from helpers.children import PATIENCE

import affordance

LIBRARY = Path(affordance.__file__).parent
TESTS = Path(__file__).parents[1]
MOST_LOOSE = 8


def test_few_modules_lie_loose_in_the_library():
    loose = {path.name for path in LIBRARY.glob("*.py")} - {"__init__.py", "__main__.py"}
    assert len(loose) <= MOST_LOOSE, sorted(loose)


def test_the_rest_is_imported_without_each_extension_and_the_paper_without_all(children):
    """Where an extension and what rests on it are gone, with their commands, all other modules are imported."""
    program = LIBRARY.parent / "tests" / "helpers" / "without_extensions.py"
    out, err = children([sys.executable, str(program)]).communicate(timeout=PATIENCE)
    assert not err
    assert len(out.splitlines()) == len([*(LIBRARY / "extensions").glob("*/__init__.py")]) + 1
    assert "without advice, memory, payload, people, pixels, robots, watch" in out


def test_an_experiment_runs_where_all_extensions_are_deleted(children, tmp_path):
    ignored = shutil.ignore_patterns("__pycache__")
    for name in ("affordance", "models"):
        shutil.copytree(LIBRARY.parent / name, tmp_path / name, ignore=ignored)
    shutil.copy(LIBRARY.parent / "run_experiments.py", tmp_path)
    shutil.rmtree(tmp_path / "affordance" / "extensions")
    words = [sys.executable, "run_experiments.py", "weight", "--repeats", "1", "--jobs", "1"]
    out, err = children(words, cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(tmp_path)}).communicate()
    assert "The report: results/report.html" in out, err
    assert (tmp_path / "results" / "weight" / "metrics.json").exists()


def test_every_folder_of_the_library_is_packaged():
    listed = tomllib.loads((LIBRARY.parent / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["setuptools"][
        "packages"
    ]
    files = [path for path in LIBRARY.rglob("*.*") if path.is_file() and "__pycache__" not in path.parts]
    folders = {".".join(path.parent.relative_to(LIBRARY.parent).parts) for path in files}
    assert sorted(folders - set(listed)) == []


@pytest.mark.parametrize(
    "path", [path for folder in ("affordance", "studies") for path in sorted((LIBRARY.parent / folder).rglob("*.py"))]
)
def test_progress_bars_are_for_terminals_only(path):
    tree = ast.parse(path.read_text(encoding="utf-8"))
    calls = [
        each for each in ast.walk(tree) if isinstance(each, ast.Call) and ast.unparse(each.func).endswith("tqdm")
    ]
    for call in calls:
        assert "disable=None" in ast.unparse(call), f"line {call.lineno}"


def test_every_slow_test_is_in_the_file_that_the_list_names():
    for line in (TESTS / "slow_tests.txt").read_text(encoding="utf-8").splitlines():
        file, name = re.fullmatch(r"([\w/]+\.py)::(\w+)(?:\[.*\])?", line).groups()
        assert f"def {name}(" in (TESTS / file).read_text(encoding="utf-8"), line
