"""From what was measured of observers to the numbers that a protocol asks for."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.exceptions import AffordanceError
from affordance.objects.tool import Tool, list_densities
from affordance.protocols.number_entries import Measure, NumberEntry
from affordance.protocols.object_entries import ProtocolObjects
from affordance.reporting.expressions import evaluate
from affordance.reporting.statistics import estimate_mean

# Numbers of the objects, whatever observers do.
OF_OBJECTS: Mapping[Measure, Callable[[Sequence[Tool]], Any]] = {
    Measure.TRUE_MASS: lambda tools: [tool.mass for tool in tools],
    Measure.TRUE_CENTRE_OF_MASS: lambda tools: [float(tool.p_TTcm[0]) for tool in tools],
    Measure.TRUE_DENSITY: lambda tools: tools[0].components[0].material.density,
    Measure.TRUE_DENSITIES: lambda tools: {
        name: list_densities(tools)[colour] for name, colour in list_materials(tools).items()
    },
}
# Of the moments before the first presentation and after each.
MOMENTS = (Measure.DENSITY, Measure.DENSITY_MODE)


class MeasuredObservers(NamedTuple):
    """What was measured of R observers in K presentations.

    Attributes:
        objects: Those of the protocol.
        presented: Which object was presented, (R, K).
        get: A measure of all presentations, (R, K), or of the moments between them, (R, K + 1), with the quantile of
            a belief; of DENSITIES of all M materials, (R, M).
    """

    objects: ProtocolObjects
    presented: NDArray[np.intp]
    get: Callable[[Measure, float], Array]


def list_materials(tools: Sequence[Tool]) -> dict[str, Any]:
    """Colours of what tools are made of, by the material's name, in the order of their components."""
    return {part.material.name: part.looks_like.colour for tool in tools for part in tool.components}


def compute_numbers(entries: Mapping[str, NumberEntry], measured: MeasuredObservers) -> dict[str, Any]:
    """Computes all numbers of a protocol.

    Raises:
        AffordanceError: An expression is wrong.
    """
    of_observers = compute_of_observers(entries, measured)
    numbers: dict[str, Any] = {}
    for name, entry in entries.items():
        if entry.measure is not None and entry.measure in OF_OBJECTS:
            tools = measured.objects.select(entry.of)
            numbers[name] = OF_OBJECTS[entry.measure](tools)
            if entry.single and isinstance(numbers[name], list):
                numbers[name] = numbers[name][0]
        elif entry.measure is Measure.DENSITIES:
            names = list_materials(measured.objects.select(entry.of))
            medians = np.median(of_observers[name], axis=0)
            numbers[name] = dict(zip(names, medians, strict=True))
        else:
            numbers.update(_summarise(name, entry, of_observers[name]))
    return numbers


def compute_of_observers(entries: Mapping[str, NumberEntry], measured: MeasuredObservers) -> dict[str, Array]:
    """Computes the numbers of each observer, (R, ...), but for those of the objects alone.

    Raises:
        AffordanceError: An expression is wrong.
    """
    found: dict[str, Array] = {}
    for name, entry in entries.items():
        if entry.measure is None:
            try:
                found[name] = np.asarray(evaluate(entry.expression or "", found), dtype=float)
            except (AffordanceError, TypeError, ValueError) as error:
                raise AffordanceError(f"numbers.{name}.expression: {error}") from error
        elif entry.measure is Measure.DENSITIES:
            found[name] = measured.get(entry.measure, entry.quantile)
        elif entry.measure not in OF_OBJECTS:
            found[name] = _measure(entry, entry.measure, measured)
    return found


def select_presentations[T: np.generic](
    values: NDArray[T], presented: NDArray[np.intp], group: Sequence[int]
) -> NDArray[T]:
    """The columns of those presentations that are of a group, in their order, (R, n)."""
    columns = [np.flatnonzero(np.isin(row, group)) for row in presented]
    if all(np.array_equal(columns[0], other) for other in columns):
        return np.ascontiguousarray(values[:, columns[0]])
    return np.stack([row[chosen] for row, chosen in zip(values, columns, strict=True)])


def _measure(entry: NumberEntry, measure: Measure, measured: MeasuredObservers) -> Array:
    """One number of each observer."""
    group = measured.objects.groups[entry.of]
    values = measured.get(measure, entry.quantile)
    if measure in MOMENTS:
        after = select_presentations(values[:, 1:], measured.presented, group)
        return np.concatenate([values[:, :1], after], axis=1)
    values = select_presentations(values, measured.presented, group)
    if entry.growth:
        values = np.diff(values, axis=1)
    if entry.single:
        return values[:, 0]
    if entry.first is None and entry.last is None and entry.predicted_for is None and entry.correlated_with is None:
        return values
    chosen = slice(None, entry.first) if entry.last is None else slice(-entry.last, None)
    values = values[:, chosen]
    if entry.correlated_with is not None:
        others = select_presentations(measured.get(entry.correlated_with, entry.quantile), measured.presented, group)
        pairs = zip(values, others[:, chosen], strict=True)
        return np.array([np.corrcoef(row, other)[0, 1] for row, other in pairs])
    if entry.predicted_for is None:
        return np.array([row.mean() for row in values])
    tools = select_presentations(measured.presented, measured.presented, group)[:, chosen]
    target = measured.objects.select(entry.predicted_for)[0]
    return np.array(
        [predict_from_line(row, of, measured.objects.tools, target) for row, of in zip(values, tools, strict=True)]
    )


def predict_from_line(values: Array, presented: NDArray[np.intp], tools: Sequence[Tool], target: Tool) -> float:
    """What a line through values and the volumes of the objects presented says for another object."""
    volumes = np.array([compute_volume(tool) for tool in tools])
    slope, intercept = np.polyfit(volumes[presented], values, 1)
    return float(intercept + slope * compute_volume(target))


def compute_volume(tool: Tool) -> float:
    """Volume of all parts, [m^3]."""
    return sum(part.shape.volume for part in tool.components)


def _summarise(name: str, entry: NumberEntry, values: Array) -> dict[str, Any]:
    """Takes observers together."""
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
