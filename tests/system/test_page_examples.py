"""Examples of pages, and those in the folder of examples, print what is stated with them."""

import re
import runpy
import shlex
import textwrap

import pytest
import yaml
from helpers.answers import answer
from helpers.children import ROOT
from helpers.refusals import refuse_command

from affordance.cli import main
from affordance.files.model_folder import MODELS

EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
LEARNING = (ROOT / "docs" / "learning.md").read_text(encoding="utf-8")


def run_example(text, capsys):
    """Runs the one example of a page; returns what it prints."""
    (block,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    exec(block, {})
    return capsys.readouterr().out


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


@pytest.mark.parametrize(
    ("page", "said"), [("excite.md", r"It prints `(.*?)`"), ("next.md", r"print\(advice\.plan\)  # (.*)")]
)
def test_example_prints_what_its_page_says(page, said, capsys):
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    (expected,) = re.findall(said, text)
    assert run_example(text, capsys).strip() == expected


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


def test_example_of_the_library_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    said = run_example((ROOT / "docs" / "python.md").read_text(encoding="utf-8"), capsys)
    assert re.fullmatch(r"\d{4} kg/m\^3, standard deviation \d+, 90 % from \d{4} to \d{4,5}\n", said)


def test_example_of_a_logged_posterior_runs(capsys):
    lines = run_example(LEARNING, capsys).splitlines()
    assert [line.split(":")[0] for line in lines] == [f"{0.5 * k:.1f} s" for k in range(7)]
    widths = [float(high) - float(low) for low, _, high in (re.findall(r"(\d+)\.", line[5:]) for line in lines)]
    assert widths[1] < 0.5 * widths[0]


def test_table_of_the_page_of_experiments_is_lifted_and_its_mistakes_are_answered_so(tmp_path, monkeypatch):
    page = (ROOT / "docs" / "experiments.md").read_text(encoding="utf-8")
    table, mistakes, *_ = re.findall(r"```text\n(.*?)```", page, re.DOTALL)
    (objects,) = re.findall(r"```yaml\n(.*?)```", page, re.DOTALL)
    (tmp_path / "trials.csv").write_text(table, encoding="utf-8")
    (tmp_path / "objects.yaml").write_text(objects, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    words = ("lift", "--trials", "trials.csv", "--objects", "objects.yaml", "--learner", "density", "--jobs", 1)
    assert len(answer(*words).lines) == 9
    for line, (old, new) in zip(
        mistakes.splitlines(), (("0,9", "900"), ("P2;B;learn;large", "P2;B;learn;lrage")), strict=True
    ):
        (tmp_path / "trials.csv").write_text(table.replace(old, new), encoding="utf-8")
        assert refuse_command(*words) == f"affordance: {line}"
    code = re.findall(r"```python\n(.*?)```", page, re.DOTALL)[0]
    assert 'groupby(["learner", "observer"]).apply(linear.measure)' in code


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
