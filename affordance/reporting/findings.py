"""Sections of the report whose claims were judged where their numbers were computed, as those of studies are."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from affordance.reporting.claims import ClaimResult, CriterionResult
from affordance.reporting.formatting import format_number
from affordance.reporting.section import ReportFigure, Section


class Finding(NamedTuple):
    """Something a study was to show.

    Attributes:
        text: What.
        criterion: How that is judged, in words, with the bound.
        bound: The number it is judged by, or the two ends of an interval.
        value: What was found.
        met: Whether it holds.
    """

    text: str
    criterion: str
    bound: float | Sequence[float]
    value: float
    met: bool


def build_section(
    *,
    order: int,
    title: str,
    summary: str,
    captions: Mapping[str, str],
    findings: Sequence[Finding],
    remarks: Sequence[str] = (),
) -> Section:
    """Builds a section.

    Args:
        order: Place among the sections.
        title: Heading.
        summary: What was done.
        captions: Of figures, by the name of their file.
        findings: The claims.
        remarks: What else is to be known.
    """
    return Section(
        order=order,
        title=title,
        summary=summary,
        figures=[ReportFigure(file, caption) for file, caption in captions.items()],
        claims=[_show(place, finding) for place, finding in enumerate(findings)],
        tables=[],
        remarks=remarks,
    )


def _show(place: int, finding: Finding) -> ClaimResult:
    ends = finding.bound if isinstance(finding.bound, Sequence) else (finding.bound,)
    bound = " to ".join(format_number(float(end)) for end in ends)
    found = CriterionResult(finding.criterion, format_number(float(finding.value)), bound, finding.met)
    return ClaimResult(f"claim_{place + 1}", "ours", finding.text, finding.met, (found,))
