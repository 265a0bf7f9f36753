"""Computation of a protocol's numbers from the measurements of observers."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.exceptions import AffordanceError, BadValueError
from affordance.objects.tool import Tool, list_colours, list_densities
from affordance.protocols.number_entries import MOMENTS, OF_OBJECTS, Measure, NumberEntry
from affordance.protocols.object_entries import ProtocolObjects
from affordance.reporting.expressions import evaluate
from affordance.reporting.statistics import estimate_mean

_COMPUTE_OF_OBJECTS: Mapping[Measure, Callable[[Sequence[Tool]], Any]] = {
    Measure.TRUE_MASS: lambda tools: [tool.mass for tool in tools],
    Measure.TRUE_CENTRE_OF_MASS: lambda tools: [float(tool.p_TTcm[0]) for tool in tools],
    Measure.TRUE_DENSITY: lambda tools: tools[0].components[0].material.density,
    Measure.TRUE_DENSITIES: lambda tools: {
        name: list_densities(tools)[colour] for name, colour in list_materials(tools).items()
    },
}


class MeasuredObservers(NamedTuple):
    """Measurements of R observers in K presentations of a protocol's objects."""

    objects: ProtocolObjects
    presented: NDArray[np.intp]  # indices of the presented objects, (R, K)
    # Function that returns a measure in all presentations, (R, K), or at the moments between them, (R, K + 1), given
    # the quantile of a belief; DENSITIES of all M colours, (R, M).
    get: Callable[[Measure, float], Array]
    # Function that returns a mask of the presentations in which a measure is taken, (K,); None if every measure is
    # taken in all.
    find_measured: Callable[[Measure], NDArray[np.bool_]] | None = None


def list_materials(tools: Sequence[Tool]) -> dict[str, Any]:
    """Lists the shown colours of tools by the name of the material of each part, in the order of their components."""
    return {part.material.name: part.looks_like.colour for tool in tools for part in tool.components}


def compute_numbers(entries: Mapping[str, NumberEntry], measured: MeasuredObservers) -> dict[str, Any]:
    """Computes all numbers of a protocol; an expression that cannot be evaluated raises a BadValueError."""
    of_observers = compute_of_observers(entries, measured)
    numbers: dict[str, Any] = {}
    for name, entry in entries.items():
        if entry.measure in OF_OBJECTS:
            numbers[name] = compute_of_objects(entry, measured.objects)
        elif entry.measure is Measure.DENSITIES:
            colours = list_colours(measured.objects.tools)
            medians = np.median(of_observers[name], axis=0)
            materials = list_materials(measured.objects.select(entry.of))
            numbers[name] = {material: medians[colours.index(colour)] for material, colour in materials.items()}
        else:
            numbers.update(_summarise(name, entry, of_observers[name]))
    return numbers


def compute_of_objects(entry: NumberEntry, objects: ProtocolObjects) -> Any:
    """Computes a number of the objects alone."""
    assert entry.measure is not None  # it is a measure of the objects
    number = _COMPUTE_OF_OBJECTS[entry.measure](objects.select(entry.of))
    return number[0] if entry.single and isinstance(number, list) else number


def compute_of_observers(entries: Mapping[str, NumberEntry], measured: MeasuredObservers) -> dict[str, Array]:
    """Computes the numbers of each observer, (R, ...), but those of objects; a BadValueError names no file."""
    found: dict[str, Array] = {}
    same: dict[str, Any] = {}  # for all observers
    for name, entry in entries.items():
        if entry.measure is None:
            found[name] = _evaluate(name, entry, found, same, len(measured.presented))
        elif entry.measure in OF_OBJECTS:
            same[name] = compute_of_objects(entry, measured.objects)
        elif entry.measure is Measure.DENSITIES:
            found[name] = measured.get(entry.measure, entry.quantile)
        else:
            found[name] = _measure(entry, entry.measure, measured)
    return found


def _evaluate(
    name: str, entry: NumberEntry, found: Mapping[str, Array], same: Mapping[str, Any], num_observers: int
) -> Array:
    """Evaluates an expression of earlier numbers for each observer, (R, ...)."""
    expression = entry.expression or ""
    rows = []
    for observer in range(num_observers):
        known = {**same, **{other: values[observer] for other, values in found.items()}}
        try:
            rows.append(np.asarray(evaluate(expression, known), dtype=float))
        except (AffordanceError, TypeError, ValueError) as error:
            raise BadValueError("", f"numbers.{name}.expression", str(error)) from error
    return np.stack(rows)


def select_presentations[T: np.generic](
    values: NDArray[T], presented: NDArray[np.intp], group: Sequence[int]
) -> NDArray[T]:
    """Selects the columns of the presentations of a group of objects, in their order, (R, n)."""
    chosen = np.isin(presented, group)
    if (chosen == chosen[0]).all():
        return np.ascontiguousarray(values[:, chosen[0]])
    return np.stack([row[own] for row, own in zip(values, chosen, strict=True)])


def _measure(entry: NumberEntry, measure: Measure, measured: MeasuredObservers) -> Array:
    """Computes one number for each observer."""
    group = measured.objects.groups[entry.of]
    values, presented = measured.get(measure, entry.quantile), measured.presented
    if measure in MOMENTS:
        after = select_presentations(values[:, 1:], presented, group)
        values = np.concatenate([values[:, :1], after], axis=1)
    else:
        taken = find_taken(entry, measure, measured)
        values, presented = _take(values, taken), _take(presented, taken)
        values = select_presentations(values, presented, group)
    if entry.growth:
        values = np.diff(values, axis=1)
    if entry.single:
        return values[:, 0]
    if entry.first is None and entry.last is None and entry.predicted_for is None and entry.correlated_with is None:
        return values
    values = values[:, entry.chosen]
    if entry.correlated_with is not None:
        others = _take(measured.get(entry.correlated_with, entry.quantile), taken)
        pairs = zip(values, select_presentations(others, presented, group)[:, entry.chosen], strict=True)
        return np.array([np.corrcoef(row, other)[0, 1] for row, other in pairs])
    if entry.predicted_for is None:
        return np.array([row.mean() for row in values])
    tools = select_presentations(presented, presented, group)[:, entry.chosen]
    target = measured.objects.select(entry.predicted_for)[0]
    return np.array(
        [predict_from_line(row, of, measured.objects.tools, target) for row, of in zip(values, tools, strict=True)]
    )


def find_taken(entry: NumberEntry, measure: Measure, measured: MeasuredObservers) -> NDArray[np.bool_]:
    """Returns a mask of the presentations in which a number is measured, whatever the object, (K,)."""
    taken = np.ones(measured.presented.shape[1], dtype=bool)
    if measured.find_measured is not None:
        taken &= measured.find_measured(measure)
        if entry.correlated_with is not None:
            taken &= measured.find_measured(entry.correlated_with)
    return taken


def _take[T: np.generic](values: NDArray[T], taken: NDArray[np.bool_]) -> NDArray[T]:
    """Selects the taken columns; returns the array itself if all are taken."""
    return values if taken.all() else values[:, taken]


def predict_from_line(values: Array, presented: NDArray[np.intp], tools: Sequence[Tool], target: Tool) -> float:
    """Predicts the value of another object from a line fitted to values over the volumes of the presented objects."""
    volumes = np.array([compute_volume(tool) for tool in tools])
    slope, intercept = np.polyfit(volumes[presented], values, 1)
    return float(intercept + slope * compute_volume(target))


def compute_volume(tool: Tool) -> float:
    """Computes the volume of all parts, [m^3]."""
    return sum(part.shape.volume for part in tool.components)


def _summarise(name: str, entry: NumberEntry, values: Array) -> dict[str, Any]:
    """Summarises a number over observers."""
    if entry.over == "median":
        return {name: np.median(values, axis=0)}
    if entry.over == "median of all":
        return {name: np.median(values)}
    if entry.over == "sum":
        return {name: values.sum(axis=0)}
    if not entry.interval:
        return {name: values.mean(axis=0)}
    estimate = estimate_mean(values)
    return {name: estimate.mean, f"{name}_ci95": estimate.ci95}
