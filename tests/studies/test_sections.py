"""Every section of the studies and of the package can be filled in as far as its templates allow."""

import pytest
from helpers.section_files import find_sections

from affordance.reporting.section import find_template_names, load_claims

SECTIONS = find_sections()


@pytest.mark.parametrize("path", SECTIONS.values(), ids=SECTIONS)
def test_every_template_is_one_and_every_claim_has_criteria(path):
    find_template_names(path)  # parses every text
    assert all(claim.criteria for claim in load_claims(path))


def test_all_studies_with_a_report_are_looked_at():
    names = {"active", "arms", "loop", "recorded", "robustness", "tools"}
    assert names <= SECTIONS.keys()
