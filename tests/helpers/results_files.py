"""Files that every experiment leaves behind."""

import json
import re
import types
from pathlib import Path

_DOCS = Path(__file__).parents[2] / "docs"
PAGES = _DOCS / "results.md", _DOCS / "reference" / "study_results.md"
# Entries of every study's metrics.json, in addition to the numbers.
OF_STUDY = {"versions", "commit", "finished"}


def find_documented_keys(*headings):
    """Keys in the tables below headings of the pages of results: words between backticks in their first column."""
    text = "\n".join(page.read_text(encoding="utf-8") for page in PAGES)
    parts = re.split(r"^### (.*)\n", text, flags=re.MULTILINE)
    sections = dict(zip(parts[1::2], parts[2::2], strict=True))
    rows = [line.split("|")[1] for heading in headings for line in sections[heading].splitlines() if line[:1] == "|"]
    return {key for row in rows for key in re.findall(r"`(.+?)`", row)}


def check_keys(numbers, *headings):
    """Asserts that the pages of results name every key of a metrics.json, and no other."""
    assert set(numbers) == find_documented_keys("Every experiment", *headings)


def read_numbers(folder):
    """Returns the content of the metrics.json of a folder."""
    return json.loads((folder / "metrics.json").read_text(encoding="utf-8"))


def read_section(folder):
    """The section that an experiment left in its folder; claims by their keys."""
    content = json.loads((folder / "section.json").read_text(encoding="utf-8"))
    content["claims"] = {claim["key"]: types.SimpleNamespace(**claim) for claim in content["claims"]}
    return types.SimpleNamespace(**content)
