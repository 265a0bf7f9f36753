"""Harness of studies: what a study found is written in one way."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from matplotlib.figure import Figure

from affordance.files.atomic import write_json
from affordance.reporting.figures import save_figure
from affordance.reporting.report import write_report, write_section
from affordance.reporting.section import Section, render_section


class Findings(NamedTuple):
    """Findings of a study.

    Attributes:
        numbers: Content of metrics.json, which claims and templates of the section name.
        facts: Further facts that the section names.
        figures: Functions that draw figures, by name of the file without suffix.
        details: Content of details.json, further numbers that explain; None for no file.
        writers: Functions that write further files into the study's folder.
    """

    numbers: Mapping[str, Any]
    facts: Mapping[str, Any] = {}
    figures: Mapping[str, Callable[[], Figure]] = {}
    details: Mapping[str, Any] | None = None
    writers: tuple[Callable[[Path], None], ...] = ()


def write_findings(findings: Findings, folder: Path, section: Path | Section) -> Path:
    """Writes the findings of a study, and the report of all that lies next to its folder.

    Args:
        findings: Findings of the study.
        folder: Folder of the study.
        section: File of the study's section of the report, or the section.

    Returns: Path of the report.
    """
    for name, draw in findings.figures.items():
        save_figure(draw(), folder, name)
    for write in findings.writers:
        write(folder)
    if findings.details is not None:
        write_json(folder / "details.json", findings.details)
    if isinstance(section, Path):
        section = render_section(section, findings.numbers, findings.facts)
    write_section(folder, section)
    write_json(folder / "metrics.json", findings.numbers)  # last: it marks a complete run
    return write_report(folder.parent)
