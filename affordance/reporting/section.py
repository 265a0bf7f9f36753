"""Section of the report: figures, claims, tables and words of an experiment."""

from collections.abc import Sequence
from typing import Annotated, NamedTuple

from pydantic import Field

from affordance.files.constraints import FileName, Text
from affordance.files.data_model import DataModel
from affordance.reporting.claims import ClaimResult


class ReportFigure(DataModel):
    """Figure of the report with its caption."""

    file: Annotated[str, FileName(), Field(description="File name in the folder of results, as 'heights.png'.")]
    caption: Annotated[str, Text(), Field(description="Text below the figure.")]


class Table(NamedTuple):
    """Table of the report: cells row by row, below the titles of the columns."""

    caption: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]


class Section(NamedTuple):
    """Report of an experiment; tables are of numbers, remarks on differences from the paper with their reasons.

    The order is its position among the sections. The finding is the outcome in one sentence, for visitors; the
    caution next to it warns of few observers. Either may be empty.
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
