"""Every example prints the output that is stated at its top."""

import runpy
import textwrap
from pathlib import Path

import pytest

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.py"))


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_example_prints_what_stands_at_its_top(path, capsys):
    said = runpy.run_path(str(path))["__doc__"]
    assert capsys.readouterr().out == textwrap.dedent(said.partition("Prints:\n\n")[2])


def test_examples_are_few_and_short():
    assert len(EXAMPLES) == 5
    assert max(len(path.read_text(encoding="utf-8").splitlines()) for path in EXAMPLES) <= 60
