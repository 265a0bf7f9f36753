"""Links, targets and pictures of the README and of the pages of first use work as they are shown."""

import re
from pathlib import Path

import pytest

from affordance.experiments.shared.observers import Setup
from affordance.experiments.shared.suite import run_suite

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
# Pages of pictures, where a folder of the reader's is in capitals.
GALLERY = "\n".join(path.read_text(encoding="utf-8") for path in sorted((ROOT / "docs").glob("gallery*.md")))
OBJECTS_PAGE = (ROOT / "docs" / "objects.md").read_text(encoding="utf-8")


@pytest.mark.usefixtures("unrendered")
def test_own_objects_make_an_experiment(tmp_path, models):
    (block,) = (each for each in re.findall(r"```yaml\n(.*?)```", OBJECTS_PAGE, re.DOTALL) if "decoy" in each)
    (models / "tools" / "weight.yaml").write_text(block, encoding="utf-8")
    report, *_ = run_suite("weight", Setup(observers=1, models=models, out=tmp_path / "results"))
    assert "dumb-bell" in report.read_text(encoding="utf-8")
    assert (tmp_path / "results" / "weight" / "metrics.json").exists()


def test_kept_pictures_are_in_the_gallery():
    pictures = {path.name for path in (ROOT / "docs" / "images").iterdir()}
    assert pictures == set(re.findall(r"\bimages/([\w.]+)", GALLERY))


def list_pages():
    pages = [page for way in ("*.md", "docs/**/*.md", "affordance/tutorials/*.ipynb") for page in ROOT.glob(way)]
    return [*pages, ROOT / "models" / "README.md"]


def test_targets_of_make_exist():
    targets = re.findall(r"^([a-z-]+):.*##", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
    for page in list_pages():
        named = re.findall(r"(?:^    |`)make ([a-z-]+)", page.read_text(encoding="utf-8"), re.MULTILINE)
        assert set(named) <= set(targets), page


def test_readme_is_read_in_some_minutes():
    assert README.count("\n") <= 115


def list_anchors(page):
    """Headings as links name them: in small letters, spaces as hyphens, without punctuation."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return [re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings]


def test_linked_files_and_headings_exist():
    for page in list_pages():
        for target, heading in re.findall(r"\]\(([^)#:]*)#?([^):]*)\)", page.read_text(encoding="utf-8")):
            linked = page.parent / target if target else page
            assert linked.exists(), f"{page}: {target}"
            if heading:
                assert heading in list_anchors(linked), f"{page}: {target}#{heading}"
