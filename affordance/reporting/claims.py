"""Tests claims of a report. A claim has criteria, each with a value and bounds."""

import operator
from collections.abc import Callable, Mapping, Sequence
from typing import Annotated, Any, NamedTuple

import numpy as np
import xarray as xr
from pydantic import Field

from affordance.reporting.formatting import format_beside
from affordance.reporting.statistics import estimate_mean

# Largest number of entries of a value that are shown.
_SHOWN = 100

# Comparisons of a value with its bound, and their wording.
COMPARISONS: Mapping[str, tuple[Callable[[Any, Any], Any], str]] = {
    "above": (operator.gt, "above"),
    "at_least": (operator.ge, "at least"),
    "at_most": (operator.le, "at most"),
    "below": (operator.lt, "below"),
}


class Unit(NamedTuple):
    """Unit of displayed values."""

    name: str = ""
    scale: float = 1.0  # factor from SI units
    digits: int = 2  # number of decimals


NONE, KG, KG_PER_M3 = Unit(), Unit("kg"), Unit("kg/m³", 1.0, 0)
CM, MM, PERCENT = Unit("cm", 100.0), Unit("mm", 1000.0), Unit("%", 100.0, 1)


class Criterion(NamedTuple):
    """Value with bounds that all its entries must satisfy."""

    name: str
    value: Any
    unit: Unit
    bounds: Mapping[str, Any]  # by comparison: a number, or an array of the value's shape


class CriterionResult(NamedTuple):
    """Result of a criterion, with value and bound as texts."""

    name: str
    value: str
    bound: str
    met: bool


class ClaimResult(NamedTuple):
    """Result of a claim, which is met if all its criteria are met. The first criterion is the most important."""

    key: str
    source: str
    text: str
    met: bool
    criteria: Annotated[tuple[CriterionResult, ...], Field(min_length=1)]


def check(name: str, value: Any, unit: Unit = NONE, **bounds: Any) -> Criterion:
    """Creates a criterion, such as ``check("last drop over the first", drop[-1] / drop[0], at_most=0.25)``.

    Args:
        name: Description of the value in words.
        value: Number, or array of numbers that must all satisfy the bounds, in SI units.
        unit: Unit in which value and bounds are shown.
        bounds: ``above``, ``at_least``, ``at_most`` or ``below``. Each is a number, or an array of the value's shape,
            in SI units.
    """
    unknown = [name for name in bounds if name not in COMPARISONS]
    if unknown or not bounds:
        raise TypeError(f"bounds are {', '.join(bounds) or 'missing'}, must be among {', '.join(COMPARISONS)}")
    return Criterion(name, value, unit, bounds)


def confirm(name: str, value: bool) -> Criterion:
    """Creates a criterion that is met if a value is True. The value is shown as yes or no."""
    return Criterion(name, value, NONE, {"is": True})


def claim(key: str, source: str, text: str, *criteria: Criterion) -> ClaimResult:
    """Tests a claim, which is met if all its criteria are met.

    A value that is infinite, undefined or empty does not meet any criterion.
    """
    judged = tuple(_judge(each) for each in criteria)
    return ClaimResult(key, source, text, all(each.met for each in judged), judged)


def _judge(criterion: Criterion) -> CriterionResult:
    if "is" in criterion.bounds:
        met = bool(criterion.value)
        return CriterionResult(criterion.name, "yes" if met else "no", "yes", met)
    known = [np.asarray(each, dtype=float) for each in (criterion.value, *criterion.bounds.values())]
    decided = all(each.size and np.isfinite(each).all() for each in known)
    met = decided and all(
        bool(np.all(COMPARISONS[how][0](known[0], bound))) for how, bound in criterion.bounds.items()
    )
    shown = [f"{COMPARISONS[how][1]} {_show_bound(criterion.unit, bound)}" for how, bound in criterion.bounds.items()]
    return CriterionResult(criterion.name, _show(criterion.unit, *known[:2]), " and ".join(shown), met)


def _show(unit: Unit, value: Any, bound: Any) -> str:
    """Formats a value in its unit, with enough decimals to show if it is above or below the bound."""
    if not value.size:
        return "none"
    entries = np.ravel(value) * unit.scale
    limits = np.broadcast_to(bound * unit.scale if bound.size else np.inf, entries.shape)
    pairs = zip(entries[:_SHOWN], limits, strict=False)
    return _join(
        [format_beside(float(entry), float(limit), unit.digits) for entry, limit in pairs], unit, len(entries)
    )


def _show_bound(unit: Unit, bound: Any) -> str:
    """Formats a bound in the unit of its value. Bounds that are not computed keep their digits."""
    entries = np.unique(np.atleast_1d(bound) * unit.scale)
    is_computed = isinstance(bound, np.ndarray | np.generic | xr.DataArray)
    shown = [f"{entry:.{unit.digits}f}" if is_computed else f"{entry:.4g}" for entry in entries[:_SHOWN]]
    return _join(shown, unit, len(entries))


def _join(shown: Sequence[str], unit: Unit, count: int) -> str:
    more = f", ... ({count} in all)" if count > len(shown) else ""
    return f"{', '.join(shown)}{more} {unit.name}".strip()


def with_interval(name: str, values: Any) -> dict[str, Any]:
    """Computes the mean over observers (first axis) and its 95 % interval, named ``NAME_ci95``."""
    estimate = estimate_mean(np.asarray(values))
    return {name: estimate.mean, f"{name}_ci95": estimate.ci95}
