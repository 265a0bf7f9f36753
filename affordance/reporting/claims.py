"""Claims of a report's section, their schema in files, and their judgement by the numbers of an experiment.

A claim is met if all its criteria are, each of which compares an expression over the numbers of metrics.json with a
bound. It is kept apart from the prose, so that it can be read on its own and tested with numbers that contradict it.
Section files of the program and reports of protocols have the same entries; only in the former are texts templates.
"""

import math
import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple, override

import numpy as np
from pydantic import Field, model_validator
from pydantic.json_schema import JsonSchemaValue

from affordance.exceptions import AffordanceError, show_value
from affordance.files.constraints import FileName, Text, Whole, Within, complain
from affordance.files.data_model import DataModel
from affordance.reporting.expressions import comes_of_numbers, evaluate, parse_expression
from affordance.reporting.formatting import format_beside

Order = Annotated[int, Whole(0, 10_000)]
# Most entries of a list that are shown.
_SHOWN = 100

# Comparisons of a value with its bound, each with its wording.
COMPARISONS: Mapping[str, tuple[Callable[[Any, Any], Any], str]] = {
    "above": (operator.gt, "above"),
    "at_least": (operator.ge, "at least"),
    "at_most": (operator.le, "at most"),
    "below": (operator.lt, "below"),
    "is": (operator.eq, ""),
}


@dataclass(frozen=True)
class Expression(Text):
    """Annotation of a text that is an expression over numbers."""

    @override
    def check(self, value: Any) -> str:
        text: str = super().check(value)
        try:
            parse_expression(text)
        except AffordanceError as error:
            raise complain(str(error)) from error
        return text


@dataclass(frozen=True)
class ExpressionOrNumber(Text):
    """Annotation of a value that is an expression over the numbers, a number, or true or false."""

    @override
    def describe(self) -> JsonSchemaValue:
        return {"type": ["string", "number", "boolean"]}

    @override
    def check(self, value: Any) -> Any:
        if isinstance(value, str) and value.strip():
            return Expression().check(value)
        if not isinstance(value, bool | int | float):
            raise complain(f"is {show_value(value)}, must be an expression or a number")
        try:
            finite = math.isfinite(value)
        except OverflowError:  # a whole number of 400 digits
            finite = False
        if not finite:
            raise complain(f"is {show_value(value)}, must be finite")
        return value


type Bound = Annotated[Any, ExpressionOrNumber()]


class ClaimCriterion(DataModel):
    """Bound on an expression; every entry of a list must meet it.

    A missing, infinite or NaN value, bound or intermediate result, or a list without entries, meets none.
    """

    name: Annotated[str, Text(), Field(description="Meaning of the expression in words.")]
    value: Annotated[Bound, Field(description="Expression of numbers of metrics.json that is judged.")]
    above: Annotated[Bound, Field(description="Bound that the value must exceed.")] = None
    at_least: Annotated[Bound, Field(description="Least value.")] = None
    at_most: Annotated[Bound, Field(description="Largest value.")] = None
    below: Annotated[Bound, Field(description="Bound that the value must stay below.")] = None
    is_: Annotated[Bound, Field(alias="is", description="What the value must be.")] = None
    unit: Annotated[str, Field(description="Unit of value and bound as shown.")] = ""
    scale: Annotated[float, Within(), Field(description="Factor from SI to that unit.")] = 1.0
    digits: Annotated[int, Whole(0, 12), Field(description="Number of decimals that are shown.")] = 2

    @model_validator(mode="before")
    @classmethod
    def check_bound(cls, content: Any) -> Any:
        """Refuses a criterion without a bound."""
        if isinstance(content, dict) and not any(name in content for name in COMPARISONS):
            raise complain(f"has no bound, must have one of {', '.join(COMPARISONS)}")
        return content

    @property
    def bounds(self) -> Mapping[str, str | float | bool]:
        """Bounds by comparison; each is an expression too."""
        bounds = {name: getattr(self, "is_" if name == "is" else name) for name in COMPARISONS}
        return {name: bound for name, bound in bounds.items() if bound is not None}


class Claim(DataModel):
    """Statement with its source, and the criteria by which the numbers confirm or contradict it."""

    key: Annotated[str, Text(), Field(description="Name of the claim in metrics.json.")]
    source: Annotated[str, Text(), Field(description="Source of the claim; 'ours' for a claim of the author's own.")]
    text: Annotated[str, Text(), Field(description="Statement in words.")]
    criteria: Annotated[list[ClaimCriterion], Field(min_length=1, description="Bounds, all of which must be met.")]


class ReportFigure(DataModel):
    """Figure of the report with its caption."""

    file: Annotated[str, FileName(), Field(description="File name in the folder of results, as 'heights.png'.")]
    caption: Annotated[str, Text(), Field(description="Text below the figure.")]


class TableEntry(DataModel):
    """Table of a section file; rows are lines, whose cells stand between bars."""

    caption: Annotated[str, Text()]
    header: Annotated[list[str], Field(min_length=1)]
    rows: Annotated[str, Text()]


class SectionClaim(Claim):
    """Claim of a section file, made only where an expression is true."""

    given: Bound = True


class SectionEntry(DataModel):
    """Section file, whose texts are templates."""

    order: Order | None = None
    title: Annotated[str, Text()]
    summary: Annotated[str, Text()]
    finding: Annotated[str, Text(), Field(description="Outcome in one sentence, for visitors.")] | None = None
    figures: list[ReportFigure] = Field(default_factory=list)
    claims: list[SectionClaim] = Field(default_factory=list)
    tables: list[TableEntry] = Field(default_factory=list)
    remarks: list[Annotated[str, Text()]] = Field(default_factory=list)


class CriterionResult(NamedTuple):
    """Criterion with the value found and its bound as text, and whether it is met."""

    name: str
    value: str
    bound: str
    met: bool


class ClaimResult(NamedTuple):
    """Claim with the results of its criteria, the first being the headline; it is met if all of them are."""

    key: str
    source: str
    text: str
    met: bool
    criteria: Annotated[tuple[CriterionResult, ...], Field(min_length=1)]


def judge_claims(claims: Sequence[Claim], numbers: Mapping[str, Any]) -> tuple[ClaimResult, ...]:
    """Judges claims by the numbers of metrics.json; raises an AffordanceError for invalid expressions."""
    results = []
    for claim in claims:
        found = tuple(_judge_criterion(claim.key, criterion, numbers) for criterion in claim.criteria)
        results.append(ClaimResult(claim.key, claim.source, claim.text, all(each.met for each in found), found))
    return tuple(results)


def _judge_criterion(key: str, criterion: ClaimCriterion, numbers: Mapping[str, Any]) -> CriterionResult:
    value = evaluate(criterion.value, numbers)
    bounds = {how: evaluate(bound, numbers) for how, bound in criterion.bounds.items()}
    decided = all(comes_of_numbers(each, numbers) for each in (criterion.value, *criterion.bounds.values()))
    try:
        met = decided and all(bool(np.all(COMPARISONS[how][0](value, bound))) for how, bound in bounds.items())
        texts = [
            (COMPARISONS[how][1] + " " + _show_bound(criterion, bound, is_computed=isinstance(written, str))).strip()
            for (how, bound), written in zip(bounds.items(), criterion.bounds.values(), strict=True)
        ]
        nearest = next((bound for bound in bounds.values() if not isinstance(bound, str | bool)), None)
        return CriterionResult(criterion.name, _show(criterion, value, nearest), " and ".join(texts), met)
    except (TypeError, ValueError) as error:
        problem = f"the claim {key} cannot compare {criterion.value!r} with its bound: {error}"
        raise AffordanceError(problem) from error


def _show(criterion: ClaimCriterion, value: Any, bound: Any) -> str:
    """Formats the value in its unit, with decimals that show on which side of the bound it lies."""
    if value is None or not np.size(value):
        return "none"
    if isinstance(value, str):
        return value
    if isinstance(value, bool | np.bool_):
        return "yes" if value else "no"
    entries = np.ravel(value) * criterion.scale
    limits = np.broadcast_to(
        np.inf if bound is None or not np.size(bound) else np.asarray(bound) * criterion.scale, entries.shape
    )
    shown = [
        format_beside(float(entry), float(limit), criterion.digits)
        for entry, limit in zip(entries[:_SHOWN], limits, strict=False)
    ]
    return f"{_join(shown, len(entries))} {criterion.unit}".strip()


def _show_bound(criterion: ClaimCriterion, bound: Any, *, is_computed: bool) -> str:
    """Formats the bound in the unit of the value; a bound given as a number keeps the digits it was written with."""
    if isinstance(bound, str):
        return bound
    if isinstance(bound, bool | np.bool_):
        return "yes" if bound else "no"
    entries = np.unique(np.atleast_1d(bound) * criterion.scale)
    shown = [f"{entry:.{criterion.digits}f}" if is_computed else f"{entry:.4g}" for entry in entries[:_SHOWN]]
    return f"{_join(shown, len(entries))} {criterion.unit}".strip()


def _join(shown: Sequence[str], count: int) -> str:
    """Joins the entries shown, with the total count if some are omitted."""
    return ", ".join(shown) + (f", ... ({count} in all)" if count > len(shown) else "")
