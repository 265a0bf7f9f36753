"""What people did, beside the numbers of a protocol: published values, and what follows from them."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.stats import t as student_t

from affordance.protocols.number_entries import NumberEntry
from affordance.protocols.published import Published, PublishedTable
from affordance.reporting.expressions import evaluate, find_names
from affordance.reporting.statistics import CONFIDENCE

# Row of a table that says how many people there were.
NUM_PEOPLE = "num_people"
# Step of the derivatives by which errors propagate, as a fraction of a standard error.
_STEP = 1e-4


def list_people(entries: Mapping[str, NumberEntry], table: PublishedTable) -> dict[str, Published]:
    """Published values of the numbers of a protocol, and what its expressions make of them.

    Errors propagate to first order; values are taken as independent, for whether they covary is rarely published.

    Raises:
        BadValueError: The table does not say how many people there were where an error propagates.
        AffordanceError: An expression is wrong.
    """
    known: dict[str, Published] = {}
    for name, entry in entries.items():
        if table.has(name):
            known[name] = table.get(name)
        elif entry.expression is not None:
            names = find_names(entry.expression)
            used = {other: value for other, value in known.items() if other in names}
            missing = names.intersection(entries) - set(known)
            if used and not missing:
                known[name] = _propagate(entry.expression, used, table)
    return known


def describe_people(people: Mapping[str, Published]) -> dict[str, Any]:
    """The same as metrics.json has them: NAME, and NAME_ci95 where an interval is known."""
    numbers: dict[str, Any] = {}
    for name, value in people.items():
        numbers[name] = value.value
        if math.isfinite(value.low):
            numbers[f"{name}_ci95"] = [value.low, value.high]
    return numbers


def _propagate(expression: str, used: Mapping[str, Published], table: PublishedTable) -> Published:
    """The value of an expression, with the interval that follows from those of what it is calculated from."""
    quantile = float(student_t.ppf(0.5 + CONFIDENCE / 2.0, table.get(NUM_PEOPLE).value - 1.0))
    means = {name: value.value for name, value in used.items()}
    ses = {
        name: 0.5 * (value.high - value.low) / quantile for name, value in used.items() if math.isfinite(value.low)
    }
    middle = float(evaluate(expression, means))
    changes = []
    for name, se in ses.items():
        up, down = (
            float(evaluate(expression, {**means, name: means[name] + sign * _STEP * se})) for sign in (1.0, -1.0)
        )
        changes.append((up - down) / (2.0 * _STEP))
    half = quantile * float(np.linalg.norm(changes)) if changes else math.nan
    return Published(middle, middle - half, middle + half, "1", "calculated from the others")
