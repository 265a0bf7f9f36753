"""Examples of pages, and those in the folder of examples, print what is stated with them."""

import re
import runpy
import textwrap

import pytest
import yaml
from helpers.children import ROOT

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
