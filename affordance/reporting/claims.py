"""Judgement of claims: each is met if the numbers of an experiment meet all its criteria.

A criterion compares an expression over the numbers with a bound. It is kept apart from the prose, so that it can be
read on its own and tested with numbers that contradict it.
"""

import operator
from collections.abc import Callable, Mapping, Sequence
from typing import Annotated, Any, NamedTuple

import numpy as np
from pydantic import Field

from affordance.exceptions import AffordanceError
from affordance.reporting.expressions import comes_of_numbers, evaluate
from affordance.reporting.formatting import format_beside
from affordance.reporting.section_entries import Claim, Criterion

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


class CriterionResult(NamedTuple):
    """Criterion with the value found.

    Attributes:
        name: Description of the measured quantity.
        value: Measured number or numbers, as text.
        bound: Bound, as text.
        met: True if the criterion is met.
    """

    name: str
    value: str
    bound: str
    met: bool


class ClaimResult(NamedTuple):
    """Claim with the results of its criteria.

    Attributes:
        key: Key of the claim.
        source: Source of the claim.
        text: Statement of the claim.
        met: True if all criteria are met.
        criteria: Results of the criteria; the first is the headline.
    """

    key: str
    source: str
    text: str
    met: bool
    criteria: Annotated[tuple[CriterionResult, ...], Field(min_length=1)]


def judge_claims(claims: Sequence[Claim], numbers: Mapping[str, Any]) -> tuple[ClaimResult, ...]:
    """Compares claims with the numbers of an experiment.

    Args:
        claims: Claims to judge.
        numbers: Numbers of metrics.json.

    Raises:
        AffordanceError: An expression is invalid or names an unknown number.
    """
    results = []
    for claim in claims:
        found = tuple(_judge_criterion(claim.key, criterion, numbers) for criterion in claim.criteria)
        results.append(ClaimResult(claim.key, claim.source, claim.text, all(each.met for each in found), found))
    return tuple(results)


def _judge_criterion(key: str, criterion: Criterion, numbers: Mapping[str, Any]) -> CriterionResult:
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


def _show(criterion: Criterion, value: Any, bound: Any) -> str:
    """The value in its unit, with decimals that show on which side of the bound it lies."""
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


def _show_bound(criterion: Criterion, bound: Any, *, is_computed: bool) -> str:
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
