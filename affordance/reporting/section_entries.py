"""Schema of a report's section: figures, tables, remarks, and claims with criterion and bound.

Section files of the program and reports of protocols have the same entries; only in the former are texts templates.
"""

from typing import Annotated, Any, NamedTuple

from pydantic import Field, model_validator

from affordance.files.data_model import DataModel, Text, Whole, Within, complain
from affordance.files.file_name import FileName
from affordance.reporting.claims import COMPARISONS, Claim, Criterion
from affordance.reporting.expression_entries import Bound

Order = Annotated[int, Whole(0, 10_000)]


class ReportFigure(NamedTuple):
    """Figure of the report.

    Attributes:
        file: File name in the experiment's folder.
        caption: Caption.
    """

    file: str
    caption: str


class CriterionEntry(DataModel):
    """Criterion: an expression over the numbers, and its bound, which every entry of a list must satisfy."""

    name: Annotated[str, Text(), Field(description="Meaning of the expression in words.")]
    value: Bound
    above: Bound = None
    at_least: Bound = None
    at_most: Bound = None
    below: Bound = None
    is_: Annotated[Bound, Field(alias="is")] = None
    unit: Annotated[str, Field(description="Unit of value and bound as shown.")] = ""
    scale: Annotated[float, Within(), Field(description="Factor from SI to that unit.")] = 1.0
    digits: Annotated[int, Whole(0, 12)] = 2

    @model_validator(mode="before")
    @classmethod
    def check_bound(cls, content: Any) -> Any:
        """Refuses a criterion without a bound.

        Raises:
            PydanticCustomError: There is no bound.
        """
        if isinstance(content, dict) and not any(name in content for name in COMPARISONS):
            raise complain(f"has no bound, must have one of {', '.join(COMPARISONS)}")
        return content

    def build(self) -> Criterion:
        """Builds the criterion to be judged."""
        fields = {name: getattr(self, "is_" if name == "is" else name) for name in COMPARISONS}
        bounds = {name: bound for name, bound in fields.items() if bound is not None}
        return Criterion(self.name, self.value, bounds, self.unit, self.scale, self.digits)


class ClaimEntry(DataModel):
    """Claim with its source, and the criteria that decide whether it is met."""

    key: Annotated[str, Text()]
    source: Annotated[str, Text(), Field(description="Source of the claim; 'ours' for a claim of the author's own.")]
    text: Annotated[str, Text()]
    criteria: Annotated[list[CriterionEntry], Field(min_length=1)]

    def build(self) -> Claim:
        """Builds the claim to be judged."""
        return Claim(self.key, self.source, self.text, tuple(each.build() for each in self.criteria))


class ReportFigureEntry(DataModel):
    """Figure of the report with its caption."""

    file: Annotated[str, FileName(), Field(description="File name in the folder of results, as 'heights.png'.")]
    caption: Annotated[str, Text()]

    def build(self) -> ReportFigure:
        """Builds the figure, its caption as written."""
        return ReportFigure(self.file, self.caption)


class TableEntry(DataModel):
    """Table of a section file; rows are lines, whose cells stand between bars."""

    caption: Annotated[str, Text()]
    header: Annotated[list[str], Field(min_length=1)]
    rows: Annotated[str, Text()]


class SectionClaimEntry(ClaimEntry):
    """Claim of a section file, made only where an expression is true."""

    given: Bound = True


class SectionEntry(DataModel):
    """Section file, whose texts are templates."""

    order: Order | None = None
    title: Annotated[str, Text()]
    summary: Annotated[str, Text()]
    figures: list[ReportFigureEntry] = Field(default_factory=list)
    claims: list[SectionClaimEntry] = Field(default_factory=list)
    tables: list[TableEntry] = Field(default_factory=list)
    remarks: list[Annotated[str, Text()]] = Field(default_factory=list)
