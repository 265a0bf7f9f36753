"""Examples of pages, and those in the folder of examples, print what is stated with them."""

import re
import runpy
import shlex
import textwrap

import pytest
import yaml
from helpers.children import ROOT

from affordance.cli import main
from affordance.files.model_folder import MODELS

EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
LEARNING = (ROOT / "docs" / "learning.md").read_text(encoding="utf-8")


def test_yaml_of_each_page_parses():
    pages = [*(ROOT / "docs").rglob("*.md"), *ROOT.glob("*.md")]
    blocks = [
        (page, block)
        for page in sorted(pages)
        for block in re.findall(r"```ya?ml\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)
    ]
    assert len(blocks) > 5
    for page, block in blocks:
        try:
            yaml.safe_load(block)
        except yaml.YAMLError as error:
            pytest.fail(f"{page.relative_to(ROOT)}: {error}")


def test_commands_from_a_recording_to_a_choice_print_what_their_page_says(tmp_path, monkeypatch, capsys):
    """All but the ranking, which is made of few samples of one hammer, and the day on which a trial is appended."""
    page = (ROOT / "docs" / "loop.md").read_text(encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "models").symlink_to(MODELS)
    commands, *_ = re.findall(r"```\n(affordance.*?)```", page, re.DOTALL)
    lines = commands.replace("\\\n", "").splitlines()
    said = ""
    for line in lines:
        few = ["--samples", "200", "--only", "machinist hammer"] if " rank " in line else []
        assert main([*shlex.split(line)[1:], *few]) == 0, line
        said += capsys.readouterr().out
    shown = [line for block in re.findall(r"```console\n(.*?)```", page, re.DOTALL) for line in block.splitlines()]
    said, shown = (re.sub(r"\d{4}-\d{2}-\d{2}", "DAY", text).splitlines() for text in (said, "\n".join(shown)))
    assert len(shown) > 10
    assert [line for line in shown if line not in said] == []


def test_systems_and_ports_that_learning_names_are_those_of_the_diagram():
    drawn = (ROOT / "diagrams" / "weight.svg").read_text(encoding="utf-8")
    names = ("material_memory", "visual_prior", "density_estimator", "mpc_controller", "proprioception", "posterior")
    for name in names:
        assert name in LEARNING
        assert name in drawn


@pytest.mark.parametrize("path", [each for each in EXAMPLES if each.stem != "forgetting"], ids=lambda path: path.stem)
def test_example_prints_what_stands_at_its_top(path, capsys):
    said = runpy.run_path(str(path))["__doc__"]
    assert capsys.readouterr().out == textwrap.dedent(said.partition("Prints:\n\n")[2])


def test_examples_are_few_and_short():
    assert len(EXAMPLES) == 6
    assert max(len(path.read_text(encoding="utf-8").splitlines()) for path in EXAMPLES) <= 60
