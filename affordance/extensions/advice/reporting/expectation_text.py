"""Formats the expected inertia of objects that have not been held, as text and as JSON."""

import textwrap
from collections.abc import Sequence
from typing import Any

from affordance.choice.pricing import Amount
from affordance.extensions.advice.expected_inertia import Expectation, ExpectedBody
from affordance.reporting.formatting import format_number, tabulate_within

# Columns to drop if the table is too wide, in this order: moments, then y, z and x.
_LESS_IMPORTANT = (7, 6, 5, 3, 4, 2)
_HEADER = ("", "mass (kg)", "x (mm)", "y (mm)", "z (mm)", "Ixx (kg cm²)", "Iyy", "Izz")
# Intervals narrower than this fraction of the mean, or than this length, [m], are not shown, because drawings
# themselves are no more precise.
_EXACT, _EXACT_LENGTH = 0.02, 1e-3


def describe_expectations(expected: Sequence[Expectation], width: int = 0, *, by_part: bool = False) -> list[str]:
    """Formats expected masses, centres of mass and moments of inertia, with 90 % intervals, one line per object.

    With ``by_part`` each part has a line too. Centres of mass, and moments of inertia about them, are in the axes of
    the object's own frame.
    """
    rows = [list(_HEADER)]
    for each in expected:
        rows.append(_list_cells(each.whole.name, each.whole))
        if by_part and len(each.parts) > 1:
            rows += [_list_cells(f"  {number}: {part.name}", part) for number, part in enumerate(each.parts, start=1)]
    title = "Expected before anything is held: mass, centre of mass, moments of inertia about it (90 % intervals)."
    lines = textwrap.wrap(title, width) if width else [title]
    inner = max(width - 2, 1) if width else 0
    return [*lines, *(f"  {line}" for line in tabulate_within(rows, inner, _LESS_IMPORTANT))]


def build_expectations(expected: Sequence[Expectation]) -> list[dict[str, Any]]:
    """Builds the JSON content of the expected inertia of objects and their parts, in SI units."""
    return [
        {**_build(each.whole), "parts": [_build(part) for part in each.parts]}  # the order is that of the tools file
        for each in expected
    ]


def _build(body: ExpectedBody) -> dict[str, Any]:
    axes = ("Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")
    return {
        "name": body.name,
        "mass": body.mass._asdict(),
        "com": {axis: each._asdict() for axis, each in zip("xyz", body.com, strict=True)},
        "inertia": {axis: each._asdict() for axis, each in zip(axes, body.inertia, strict=True)},
    }


def _list_cells(name: str, body: ExpectedBody) -> list[str]:
    centre = [_show(each, 1e3, _EXACT_LENGTH, fixed=True) for each in body.com]
    return [name, _show(body.mass), *centre, *(_show(each, 1e4) for each in body.inertia[:3])]


def _show(amount: Amount, scale: float = 1.0, exact: float = 0.0, *, fixed: bool = False) -> str:
    mean, low, high = (f"{scale * value:z.0f}" if fixed else format_number(scale * value) for value in amount)
    is_exact = amount.p95 - amount.p05 <= max(exact, _EXACT * abs(amount.mean) if not fixed else 0.0)
    return mean if is_exact else f"{mean} ({low} to {high})"
