"""Every section of the studies and of the package can be filled in as far as its templates allow."""

from pathlib import Path

import pytest

import affordance
import studies
from affordance.reporting.section import find_template_names, load_claims

SECTIONS = sorted(
    path
    for root in (Path(str(affordance.__file__)).parent, Path(str(studies.__file__)).parent)
    for path in root.rglob("*.yaml")
    if path.name == "section.yaml" or path.parent.name == "sections"
)


@pytest.mark.parametrize("path", SECTIONS, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_every_template_is_one_and_every_claim_has_criteria(path):
    find_template_names(path)  # parses every text
    assert all(claim.criteria for claim in load_claims(path))


def test_all_studies_with_a_report_are_looked_at():
    assert {path.parent.name for path in SECTIONS} >= {
        "active",
        "arms",
        "learners",
        "loop",
        "recorded",
        "robustness",
        "vision",
        "tools",
    }
