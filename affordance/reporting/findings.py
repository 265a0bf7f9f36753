"""Report sections of studies, whose claims are judged where their numbers are computed."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from affordance.reporting.claims import ClaimResult, CriterionResult
from affordance.reporting.formatting import format_number
from affordance.reporting.section import ReportFigure, Section


class Finding(NamedTuple):
    """Claim of a study with its result.

    Attributes:
        text: Statement.
        criterion: Description of the criterion and its bound, in words.
        bound: Number that the value is compared with, or the two ends of an interval.
        value: Value found.
        met: True if the claim holds.
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
    """Builds a report section.

    Args:
        order: Position among the sections.
        title: Heading.
        summary: Summary of the study.
        captions: Captions of figures, by file name.
        findings: Claims with their results.
        remarks: Further remarks.
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
