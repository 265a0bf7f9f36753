"""Report of a protocol: plain texts, and claims with criterion and bound."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from affordance.exceptions import describe_choice
from affordance.files.constraints import Text, complain
from affordance.files.data_model import DataModel
from affordance.reporting.claims import Claim, Order, ReportFigure
from affordance.reporting.section import PlainReport

# Prose of the program's own protocols and studies: templates, which are trusted.
_SECTIONS = Path(__file__).parents[1] / "experiments" / "sections"


@dataclass(frozen=True)
class OneSection(Text):
    """Annotation of a text that is the name of a section of the program."""

    def check(self, value: Any) -> str:
        """Returns the name of the section."""
        known = sorted(path.stem for path in _SECTIONS.glob("*.yaml"))
        if value not in known:
            raise complain(describe_choice(value, known))
        return str(value)


class ReportEntry(DataModel):
    """Section of the report in plain texts; omitted parts are made from question, numbers and figures."""

    section: Annotated[
        Annotated[str, OneSection()] | None,
        Field(description="A section of the program whose prose, figures and tables are used."),
    ] = None
    order: Annotated[Order | None, Field(description="Place among the sections.")] = None
    title: Annotated[
        Annotated[str, Text()] | None,
        Field(description="Title of the section; the name of the protocol if left out."),
    ] = None
    summary: Annotated[
        Annotated[str, Text()] | None, Field(description="Summary of what was done; the question if left out.")
    ] = None
    figures: Annotated[
        list[ReportFigure] | None,
        Field(description="Figures of the report; all of the protocol, by their titles, if left out."),
    ] = None
    claims: list[Claim] = Field(default_factory=list)
    remarks: Annotated[
        list[Annotated[str, Text()]] | None, Field(description="Sentences that no run can contradict.")
    ] = None

    def build(self, source: Path, title: str, question: str, *, numbers: Any, figures: Any) -> PlainReport:
        """Builds the report of a protocol, whose name is the title, from its entries."""
        plain = {name: getattr(self, name) for name in ("order", "title", "summary", "figures", "remarks")}
        return PlainReport(
            source=source,
            prose=None if self.section is None else _SECTIONS / f"{self.section}.yaml",
            title=title,
            question=" ".join(question.split()),
            figures=tuple(
                ReportFigure(file=f"{name}.png", caption=each.title or each.draw) for name, each in figures.items()
            ),
            meanings={name: each.meaning for name, each in numbers.items()},
            given={name: value for name, value in plain.items() if value is not None},
            claims=tuple(self.claims),
        )
