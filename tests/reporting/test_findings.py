"""Sections of studies, whose claims are judged where their numbers are computed."""

from affordance.reporting.findings import Finding, build_section
from affordance.reporting.report import write_report, write_section


def test_findings_stand_in_the_report_with_value_and_bound(tmp_path):
    findings = [
        Finding("Mass is known.", "relative error, at most", 0.05, 0.021, True),
        Finding("Intervals are honest.", "coverage, within", (0.83, 0.97), 0.99, False),
    ]
    section = build_section(
        order=1, title="A study", summary="Done.", captions={}, findings=findings, remarks=["By the way."]
    )
    assert [claim.met for claim in section.claims] == [True, False]
    assert section.claims[1].criteria[0].bound == "0.830 to 0.970"
    write_section(tmp_path / "study", section)
    page = write_report(tmp_path).read_text(encoding="utf-8")
    for text in ("A study", "Intervals are honest.", "0.990", "0.830 to 0.970", "By the way."):
        assert text in page
