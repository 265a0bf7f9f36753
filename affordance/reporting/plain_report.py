"""Report of a protocol: plain texts, a table of all numbers, claims, or the prose of a section of the program.

Texts of a protocol are never templates. Missing ones are made from its question, numbers and figures.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from affordance.exceptions import AffordanceError, BadValueError, describe_choice
from affordance.reporting.claims import judge_claims
from affordance.reporting.expressions import find_names
from affordance.reporting.formatting import format_number
from affordance.reporting.section import LAST, Section, Table, render_section
from affordance.reporting.section import find_names as find_names_of_section
from affordance.reporting.section_entries import Claim, ReportFigure

# Most entries of a list in a cell of the table of numbers.
_SHOWN = 12
_CI95 = "_ci95"


@dataclass(frozen=True)
class PlainReport:
    """Report settings of a protocol, before there are numbers.

    Attributes:
        source: Protocol file, for error messages.
        prose: Section file of the program that provides prose, figures and tables; None for none.
        title: Name of the protocol: the heading where ``given`` has none; that of ``prose`` follows it, or stands
            alone where it is of the same name.
        question: Question of the protocol; the summary where there is no other.
        figures: Figures where neither ``given`` nor ``prose`` has any.
        meanings: Description of each number, by its name; empty where the protocol gives none.
        given: Plain texts that replace others: ``order``, ``title``, ``summary``, ``figures``, ``remarks``.
        claims: Claims as plain texts and expressions.
    """

    source: Path
    prose: Path | None
    title: str
    question: str
    figures: tuple[ReportFigure, ...]
    meanings: Mapping[str, str]
    given: Mapping[str, Any]
    claims: tuple[Claim, ...]


def check_names(report: PlainReport, known: Collection[str]) -> None:
    """Rejects a report that names numbers or facts unknown to its protocol.

    Args:
        report: Report settings.
        known: Names of the numbers and facts that will be available.

    Raises:
        BadValueError: A template of its section or an expression of a claim uses another name.
    """
    if report.prose is not None:
        for key, names in find_names_of_section(report.prose).items():
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
    """Renders the report section of a protocol.

    Args:
        report: Report settings.
        numbers: Numbers of metrics.json, with lists or arrays.
        facts: Other values for templates and claims; needs ``camera_caption``, ``few_observers`` and ``faults``.

    Raises:
        AffordanceError: A template or an expression cannot be evaluated with these numbers.
    """
    remarks = [facts[name] for name in ("few_observers", "faults") if facts[name]]
    given = dict(report.given)
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
    who = {**numbers.get("learners", {}), **({"people": numbers["people"]} if numbers.get("people") else {})}
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
    return _shorten([format_number(float(entry)) for entry in np.ravel(value)])


def _show_intervals(value: Any) -> str:
    """Formats one interval, shape (2,), or one for each entry of a list, shape (..., 2)."""
    ends = np.reshape(np.asarray(value, dtype=float), (-1, 2))
    return _shorten([f"[{format_number(float(low))}, {format_number(float(high))}]" for low, high in ends])


def _shorten(entries: Sequence[str]) -> str:
    more = f", ... ({len(entries)} in all)" if len(entries) > _SHOWN else ""
    return ", ".join(entries[:_SHOWN]) + more
