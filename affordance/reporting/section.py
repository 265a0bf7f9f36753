"""Sections of the report: prose as templates and claims as data, filled in with the numbers of an experiment.

A section file is YAML with the keys of ``SectionEntry``. A claim may have ``given``, an expression: where it is
false the claim is not made. Every text is a Jinja2 template over the numbers and facts; a figure, table or remark
that comes out empty is left out.

A template is a program, so section files are part of this one; files of users are never read here (SECURITY.md).
Templates are sandboxed as a second line of defence.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import jinja2
import jinja2.meta
import jinja2.sandbox

from affordance.exceptions import AffordanceError, name_object
from affordance.files.data_model import load_model
from affordance.reporting import formatting
from affordance.reporting.claims import ClaimResult, judge_claims
from affordance.reporting.expressions import evaluate
from affordance.reporting.section_entries import Claim, ReportFigure, SectionEntry

_METRES_TO_CM = 100.0
# Order of a section that gives none.
LAST = 100
# Replaces a bar in a text that is filled into a table, so that it does not end the cell; from Unicode's private use
# area.
_BAR = "\ue000"


class Table(NamedTuple):
    """Table of the report.

    Attributes:
        caption: Caption.
        header: Titles of the columns.
        rows: Cells of the rows.
    """

    caption: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]


class Section(NamedTuple):
    """Report of an experiment.

    Attributes:
        order: Position among the sections.
        title: Heading.
        summary: Summary of the experiment, in a few sentences.
        figures: Figures, in order.
        claims: Claims with their results.
        tables: Tables of numbers.
        remarks: Differences from the paper with their reasons, and further remarks.
    """

    order: int
    title: str
    summary: str
    figures: Sequence[ReportFigure]
    claims: Sequence[ClaimResult]
    tables: Sequence[Table]
    remarks: Sequence[str]


def load_claims(path: Path) -> tuple[Claim, ...]:
    """Reads the claims of a section file, with their texts as templates."""
    return tuple(load_model(path, SectionEntry).claims)


def render_section(path: Path, numbers: Mapping[str, Any], facts: Mapping[str, Any]) -> Section:
    """Renders a section file.

    Args:
        path: Section file.
        numbers: Numbers of metrics.json, with lists or arrays.
        facts: Other values for its templates.

    Raises:
        AffordanceError: A template or an expression uses an unknown name or cannot be evaluated.
    """
    content, known = load_model(path, SectionEntry), {**numbers, **facts}
    environment = _build_environment()

    def render(text: str) -> str:
        try:
            return environment.from_string(text).render(known)
        except (jinja2.TemplateError, LookupError, TypeError, ValueError, ArithmeticError) as error:
            raise AffordanceError(f"{path.name}: {text!r} cannot be filled in: {error}") from error

    def fill(text: str) -> str:
        return " ".join(render(text).replace(_BAR, "|").split())

    def fill_rows(text: str) -> list[list[str]]:
        lines = [line for line in render(text).split("\n") if line.strip()]
        return [[" ".join(cell.replace(_BAR, "|").split()) for cell in line.split("|")] for line in lines]

    captions = [(each.file, fill(each.caption)) for each in content.figures]
    tables = [
        Table(fill(each.caption), [fill(title) for title in each.header], fill_rows(each.rows))
        for each in content.tables
    ]
    claims = [
        claim.model_copy(
            update={
                "text": fill(claim.text),
                "criteria": [each.model_copy(update={"name": fill(each.name)}) for each in claim.criteria],
            }
        )
        for claim in content.claims
        if evaluate(claim.given, known)
    ]
    remarks = [fill(text) for text in content.remarks]
    return Section(
        order=LAST if content.order is None else content.order,
        title=fill(content.title),
        summary=fill(content.summary),
        figures=[ReportFigure(file=file, caption=caption) for file, caption in captions if caption],
        claims=judge_claims(claims, known),
        tables=[table for table in tables if table.rows],
        remarks=[remark for remark in remarks if remark],
    )


def find_names(path: Path) -> dict[str, frozenset[str]]:
    """Finds the undeclared names (numbers and facts) in the templates of a section file, by the template's key."""
    environment = _build_environment()

    def find(content: Any) -> frozenset[str]:
        if isinstance(content, Mapping | list):
            entries = content.values() if isinstance(content, Mapping) else content
            return frozenset().union(*(find(each) for each in entries))
        text = content if isinstance(content, str) else ""
        return frozenset(jinja2.meta.find_undeclared_variables(environment.parse(text))) - {*environment.globals}

    content = load_model(path, SectionEntry).model_dump(exclude_unset=True)
    return {key: find(each) for key, each in content.items()}


def _build_environment() -> jinja2.Environment:
    environment = jinja2.sandbox.ImmutableSandboxedEnvironment(
        undefined=jinja2.StrictUndefined, autoescape=False, finalize=_protect
    )
    environment.filters.update(
        number=formatting.format_number,
        beside=formatting.format_beside,
        list=formatting.format_list,
        the=name_object,
        capitalise=lambda text: text[:1].upper() + text[1:],
        by_name=formatting.format_by_name,
        observers=formatting.count_observers,
        fixed=lambda value, digits=2: f"{value:.{digits}f}",
        cm=lambda value, digits=2: f"{_METRES_TO_CM * value:.{digits}f} cm",
        percent=lambda value, digits=0: f"{100.0 * value:.{digits}f} %",
    )
    environment.globals["enough_observers"] = formatting.ENOUGH_OBSERVERS
    return environment


def _protect(value: Any) -> Any:
    """Protects a value that is filled in, so that it stays within its cell and its row."""
    return " ".join(value.replace("|", _BAR).split("\n")) if isinstance(value, str) else value
