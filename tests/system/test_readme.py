"""What the README shows works as it says."""

import re
import shutil
from pathlib import Path

from affordance.experiments.suite import run_suite
from affordance.files.model_folder import MODELS

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def find_blocks(language):
    return re.findall(rf"```{language}\n(.*?)```", README, re.DOTALL)


def run_block(block, capsys):
    exec(block, {})
    return capsys.readouterr().out


def test_first_example_prints_what_stands_below_it(capsys):
    before, _ = README.split("```text\n")
    assert before.count("\n") + find_blocks("text")[0].count("\n") < 40
    assert run_block(find_blocks("python")[0], capsys) == find_blocks("text")[0]


def test_example_of_ranking_runs(capsys):
    lines = run_block(find_blocks("python")[1], capsys).splitlines()
    assert len(lines) == 4
    assert re.fullmatch(r"stick by steel: \d+\.\d J, best with probability 1\.00", lines[0])


def test_own_objects_make_an_experiment(tmp_path):
    models = tmp_path / "my_models"
    shutil.copytree(MODELS, models)
    (models / "tools" / "weight.yaml").write_text(find_blocks("yaml")[0], encoding="utf-8")
    report, _ = run_suite(["weight"], tmp_path / "results", models=models, seed=0, repeats=1, jobs=1)
    assert "dumb-bell" in report.read_text(encoding="utf-8")
    assert (tmp_path / "results" / "weight" / "metrics.json").exists()


def list_anchors(page):
    """Headings as links name them: in small letters, spaces as hyphens, without punctuation."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return [re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings]


def test_linked_files_and_headings_exist():
    pages = [
        ROOT / "README.md",
        ROOT / "CONTRIBUTING.md",
        *(ROOT / "docs").rglob("*.md"),
        ROOT / "models" / "README.md",
    ]
    for page in pages:
        for target, heading in re.findall(r"\]\(([^)#:]*)#?([^):]*)\)", page.read_text(encoding="utf-8")):
            linked = page.parent / target if target else page
            assert linked.exists(), f"{page}: {target}"
            if heading:
                assert heading in list_anchors(linked), f"{page}: {target}#{heading}"
