"""Sections of the report, filled in with the numbers of an experiment: of section files, and of protocols.

A section file is YAML with the keys of ``SectionEntry``. A claim may have ``given``, an expression: where it is
false the claim is not made. Every text is a Jinja2 template over the numbers and facts; a figure, table or remark
that comes out empty is left out.

A template is a program, so section files are part of this one; files of users are never read here (SECURITY.md).
Templates are sandboxed as a second line of defence. Texts of a protocol are never templates; missing ones are made
from its question, numbers and figures.
"""

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import jinja2
import jinja2.meta
import jinja2.sandbox
import numpy as np

from affordance.belief.learners import label_learner
from affordance.exceptions import AffordanceError, BadValueError, describe_choice, name_object
from affordance.files.data_model import load_model
from affordance.reporting import formatting
from affordance.reporting.claims import Claim, ClaimResult, ReportFigure, SectionEntry, judge_claims
from affordance.reporting.expressions import evaluate, find_names

_METRES_TO_CM = 100.0
# Order of a section that gives none.
LAST = 100
# Replaces a bar in a text that is filled into a table, so that it does not end the cell; from Unicode's private use
# area.
_BAR = "\ue000"
# Most entries of a list in a cell of the table of numbers.
_SHOWN = 12
_CI95 = "_ci95"
# Name of an object, a material or a grip.
_NAME = re.compile(r"[A-Za-z0-9]+(_[A-Za-z0-9]+)+")


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


def load_claims(path: Path) -> tuple[Claim, ...]:
    """Reads the claims of a section file, with their texts as templates."""
    return tuple(load_model(path, SectionEntry).claims)


def render_section(path: Path, numbers: Mapping[str, Any], facts: Mapping[str, Any]) -> Section:
    """Renders a section file with numbers of metrics.json and facts; unknown names raise an AffordanceError."""
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
        finding=fill(content.finding or ""),
    )


def find_template_names(path: Path) -> dict[str, frozenset[str]]:
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
        list=formatting.format_list,
        the=name_object,
        capitalise=lambda text: text[:1].upper() + text[1:],
        by_name=formatting.format_by_name,
        observers=formatting.count_observers,
        fixed=lambda value, digits=2: f"{value:z.{digits}f}",
        cm=lambda value, digits=2: f"{_METRES_TO_CM * value:z.{digits}f} cm",
        percent=lambda value, digits=0: f"{100.0 * value:z.{digits}f} %",
    )
    environment.globals["enough_observers"] = formatting.ENOUGH_OBSERVERS
    return environment


def _protect(value: Any) -> Any:
    """Protects a value that is filled in, so that it stays within its cell and row; a name loses its underscores."""
    if not isinstance(value, str):
        return value
    value = value.replace("_", " ") if _NAME.fullmatch(value) else value
    return " ".join(value.replace("|", _BAR).split("\n"))


@dataclass(frozen=True)
class PlainReport:
    """Report settings of a protocol, before there are numbers."""

    source: Path  # protocol file, for error messages
    prose: Path | None  # section file of the program that provides prose, figures and tables; None for none
    # Name of the protocol: the heading where ``given`` has none; that of ``prose`` follows it, or stands alone where
    # it is of the same name.
    title: str
    question: str  # question of the protocol; the summary where there is no other
    figures: tuple[ReportFigure, ...]  # figures where neither ``given`` nor ``prose`` has any
    meanings: Mapping[str, str]  # description of each number, by its name; empty where the protocol gives none
    # Plain texts that replace others: ``order``, ``title``, ``summary``, ``figures``, ``remarks``.
    given: Mapping[str, Any]
    claims: tuple[Claim, ...]  # claims as plain texts and expressions


def check_names(report: PlainReport, known: Collection[str]) -> None:
    """Raises a BadValueError if a template of a report's section, or a claim, uses an unknown name."""
    if report.prose is not None:
        for key, names in find_template_names(report.prose).items():
            unknown = sorted(names.difference(known))
            if unknown and key not in report.given:
                problem = (
                    f"is {report.prose.stem!r}, whose {key} names {unknown[0]!r}, which this protocol does not have; "
                    "give it that number, or leave 'section' out: the report is then made from question and numbers"
                )
                raise BadValueError(report.source, "report.section", problem)
    for i, claim in enumerate(report.claims):
        for j, criterion in enumerate(claim.criteria):
            for key, expression in (("value", criterion.value), *criterion.bounds.items()):
                for name in sorted(find_names(expression).difference(known)):
                    problem = f"names a number that {describe_choice(name, sorted(known))}"
                    raise BadValueError(report.source, f"report.claims[{i}].criteria[{j}].{key}", problem)


def render_report(report: PlainReport, numbers: Mapping[str, Any], facts: Mapping[str, Any]) -> Section:
    """Renders a protocol's report with numbers and facts; a bad template or expression raises an AffordanceError."""
    remarks = [facts["faults"]] if facts["faults"] else []
    given = {**report.given, "caution": facts["few_observers"]}
    if "remarks" in given:
        given["remarks"] = [*given["remarks"], *remarks]
    if report.prose is not None:
        section = render_section(report.prose, numbers, facts)
        if report.prose.stem != report.title:  # an experiment of a user's own, after one of the program
            section = section._replace(title=f"{report.title} (as in {section.title})")
    else:
        seen = [ReportFigure(file="seen.png", caption=facts["camera_caption"])] if facts["camera_caption"] else []
        tables = [_list_numbers(report.meanings, numbers)] if report.meanings else []
        section = Section(
            LAST, report.title, report.question, [*report.figures, *seen], claims=(), tables=tables, remarks=remarks
        )
    known = {**numbers, **facts}
    try:
        return section._replace(**given, claims=judge_claims(report.claims, known))
    except AffordanceError as error:
        raise BadValueError(report.source, "report.claims", str(error)) from error


def _list_numbers(meanings: Mapping[str, str], numbers: Mapping[str, Any]) -> Table:
    """Builds a table with a row per number, or per number and owner for several learners or human data."""
    who = {label_learner(name): found for name, found in numbers.get("learners", {}).items()}
    who |= {"people": numbers["people"]} if numbers.get("people") else {}
    header = ["number", *(["meaning"] if any(meanings.values()) else []), *(["of"] if who else [])]
    rows: list[Sequence[str]] = []
    for name, meaning in meanings.items():
        for owner, found in (who or {"": numbers}).items():
            if name in found:
                cells = [name, *([meaning] if any(meanings.values()) else []), *([owner] if who else [])]
                interval = found.get(name + _CI95)
                rows.append([*cells, _show(found[name]), "" if interval is None else _show_intervals(interval)])
    return Table("Every number; over observers as the protocol says.", [*header, "value", "95 % interval"], rows)


def _show(value: Any) -> str:
    """Formats a number, a list of numbers, or numbers by name."""
    if isinstance(value, Mapping):
        return ", ".join(f"{name}: {_show(entry)}" for name, entry in value.items())
    if value is None or isinstance(value, str):
        return value or "none"
    return _shorten([formatting.format_number(float(entry)) for entry in np.ravel(value)])


def _show_intervals(value: Any) -> str:
    """Formats one interval, shape (2,), or one for each entry of a list, shape (..., 2)."""
    ends = np.reshape(np.asarray(value, dtype=float), (-1, 2))
    return _shorten(
        [f"[{formatting.format_number(float(low))}, {formatting.format_number(float(high))}]" for low, high in ends]
    )


def _shorten(entries: Sequence[str]) -> str:
    more = f", ... ({len(entries)} in all)" if len(entries) > _SHOWN else ""
    return ", ".join(entries[:_SHOWN]) + more
