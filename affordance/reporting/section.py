"""Section of a report: figures, claims, tables and text of one experiment."""

from collections.abc import Sequence
from typing import Annotated, NamedTuple

from pydantic import Field

from affordance.files.constraints import FileName, Text
from affordance.files.data_model import DataModel
from affordance.reporting.claims import ClaimResult


class ReportFigure(DataModel):
    """Figure of a report with its caption."""

    file: Annotated[str, FileName(), Field(description="File name in the results folder, for example 'heights.png'.")]
    caption: Annotated[str, Text(), Field(description="Text below the figure.")]


class Table(NamedTuple):
    """Table of a report."""

    caption: str
    header: Sequence[str]  # titles of the columns
    rows: Sequence[Sequence[str]]


class Section(NamedTuple):
    """Section of a report on one experiment.

    Attributes:
        order: Position among the sections.
        title: Title of the section.
        summary: Description of the experiment.
        figures: Figures with captions.
        claims: Claims, each met or not met.
        tables: Tables of numbers.
        remarks: Differences from the paper, with reasons.
        finding: Result in one sentence; may be empty.
        caution: Warning next to the finding if there are few observers; may be empty.
    """

    order: int
    title: str
    summary: str
    figures: Sequence[ReportFigure]
    claims: Sequence[ClaimResult]
    tables: Sequence[Table]
    remarks: Sequence[str]
    finding: str = ""
    caution: str = ""
