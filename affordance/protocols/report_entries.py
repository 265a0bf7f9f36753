"""Report of a protocol: plain texts, and claims with criterion and bound."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, model_validator

from affordance.exceptions import describe_choice
from affordance.files.constraints import Text, Whole, Within, complain
from affordance.files.data_model import DataModel
from affordance.files.file_name import FileName
from affordance.protocols.expression_entries import Bound
from affordance.reporting.claims import Claim, Criterion
from affordance.reporting.plain_report import PlainReport
from affordance.reporting.section import ReportFigure

# Prose of the program's own protocols and studies: templates, which are trusted.
_SECTIONS = Path(__file__).parents[1] / "experiments" / "sections"


@dataclass(frozen=True)
class OneSection(Text):
    """Annotation of a text that is the name of a section of the program."""

    def check(self, value: Any) -> str:
        """Returns the name of the section.

        Raises:
            PydanticCustomError: There is no section of that name.
        """
        known = sorted(path.stem for path in _SECTIONS.glob("*.yaml"))
        if value not in known:
            raise complain(describe_choice(value, known))
        return str(value)


_BOUNDS = ("above", "at_least", "at_most", "below", "is")


class CriterionEntry(DataModel):
    """Criterion: an expression over the numbers, and its bound, which every entry of a list must satisfy."""

    name: Annotated[str, Text(), Field(description="What the expression is, in words.")]
    value: Bound
    above: Bound = None
    at_least: Bound = None
    at_most: Bound = None
    below: Bound = None
    is_: Annotated[Bound, Field(alias="is")] = None
    unit: Annotated[str, Field(description="Of value and bound as they are shown.")] = ""
    scale: Annotated[float, Within(), Field(description="From SI to that unit.")] = 1.0
    digits: Annotated[int, Whole(0, 12)] = 2

    @model_validator(mode="before")
    @classmethod
    def check_bound(cls, content: Any) -> Any:
        """Refuses a criterion without a bound.

        Raises:
            PydanticCustomError: There is no bound.
        """
        if isinstance(content, dict) and not any(name in content for name in _BOUNDS):
            raise complain(f"has no bound, must have one of {', '.join(_BOUNDS)}")
        return content

    def build(self) -> Criterion:
        """Builds the criterion to be judged."""
        fields = {name: getattr(self, "is_" if name == "is" else name) for name in _BOUNDS}
        bounds = {name: bound for name, bound in fields.items() if bound is not None}
        return Criterion(self.name, self.value, bounds, self.unit, self.scale, self.digits)


class ClaimEntry(DataModel):
    """Claim with its source, and the criteria that decide whether it is met."""

    key: Annotated[str, Text()]
    source: Annotated[str, Text(), Field(description="Who says it and where; 'ours' for what we ask of ourselves.")]
    text: Annotated[str, Text()]
    criteria: Annotated[list[CriterionEntry], Field(min_length=1)]


class ReportFigureEntry(DataModel):
    """Figure of the report with its caption."""

    file: Annotated[str, FileName(), Field(description="Its name in the folder of results, as 'heights.png'.")]
    caption: Annotated[str, Text()]


class ReportEntry(DataModel):
    """Section of the report in plain texts; omitted parts are made from question, numbers and figures."""

    section: Annotated[
        Annotated[str, OneSection()] | None,
        Field(description="A section of the program whose prose, figures and tables are used."),
    ] = None
    order: Annotated[Annotated[int, Whole(0, 10_000)] | None, Field(description="Place among the sections.")] = None
    title: Annotated[str, Text()] | None = None
    summary: Annotated[
        Annotated[str, Text()] | None, Field(description="What was done; else the question is asked.")
    ] = None
    figures: Annotated[
        list[ReportFigureEntry] | None, Field(description="Else all of the protocol, by their titles.")
    ] = None
    claims: list[ClaimEntry] = Field(default_factory=list)
    remarks: list[Annotated[str, Text()]] | None = None

    def build(self, source: Path, title: str, question: str, *, numbers: Any, figures: Any) -> PlainReport:
        """Builds the report from its entry.

        Args:
            source: Path of the protocol's file, for errors.
            title: Name of the protocol.
            question: Question of the protocol.
            numbers: Numbers of the protocol, entries by name.
            figures: Figures of the protocol, entries by name.
        """
        plain = {name: getattr(self, name) for name in ("order", "title", "summary", "remarks")}
        given: dict[str, Any] = {name: value for name, value in plain.items() if value is not None}
        if self.figures is not None:
            given["figures"] = [ReportFigure(each.file, each.caption) for each in self.figures]
        return PlainReport(
            source=source,
            prose=None if self.section is None else _SECTIONS / f"{self.section}.yaml",
            title=title,
            question=" ".join(question.split()),
            figures=tuple(ReportFigure(f"{name}.png", each.title or each.draw) for name, each in figures.items()),
            meanings={name: each.meaning for name, each in numbers.items()},
            given=given,
            claims=self.list_claims(),
        )

    def list_claims(self) -> tuple[Claim, ...]:
        """Lists the claims to be judged."""
        return tuple(
            Claim(claim.key, claim.source, claim.text, tuple(each.build() for each in claim.criteria))
            for claim in self.claims
        )
