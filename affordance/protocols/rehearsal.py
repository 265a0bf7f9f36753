"""Rehearsal of a protocol's numbers on made-up measurements of the right shapes, before anything is simulated.

The objects of the presentations and their masses are those of the protocol; all other measurements are drawn. A
number that cannot be measured, counted or calculated is found within milliseconds, with its key.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.exceptions import BadValueError, describe_choice
from affordance.objects.tool import list_colours
from affordance.protocols.measured import (
    MeasuredObservers,
    compute_numbers,
    compute_volume,
    find_taken,
    select_presentations,
)
from affordance.protocols.number_entries import MOMENTS, OF_OBJECTS, Measure, NumberEntry
from affordance.protocols.object_entries import ProtocolObjects
from affordance.protocols.presentations import Layout, Presentation
from affordance.reporting.expressions import find_names


def imagine(objects: ProtocolObjects, layout: Layout, drawn: Sequence[Sequence[Presentation]]) -> MeasuredObservers:
    """Makes up the measurements of a few observers, who are given K measured presentations each."""
    presented = np.array([[each.tool for each in row] for row in drawn], dtype=np.intp).reshape(len(drawn), -1)
    usual = [tool.mass for tool in objects.tools]
    weighed = [[usual[each.tool] if each.mass is None else each.mass for each in row] for row in drawn]
    masses = np.array(weighed).reshape(presented.shape)
    rng = np.random.default_rng(0)
    num_colours = len(list_colours(objects.tools))

    def get(measure: Measure, quantile: float) -> Array:
        if measure is Measure.WEIGHT:
            return masses
        count = num_colours if measure is Measure.DENSITIES else presented.shape[1] + (measure in MOMENTS)
        return rng.uniform(0.5, 1.5, (len(drawn), count))

    return MeasuredObservers(objects, presented, get, layout.find_measured)


def rehearse(
    path: Path, entries: Mapping[str, NumberEntry], layout: Layout, imagined: MeasuredObservers
) -> dict[str, Any]:
    """Computes a protocol's numbers, of the right shapes, from made-up measurements.

    A number that refers to one which does not precede it, or cannot be measured or calculated, raises a
    BadValueError.
    """
    above: list[str] = []
    for name, entry in entries.items():
        if entry.measure is None:
            _check_expression(path, name, entry, above)
        elif entry.measure not in OF_OBJECTS:
            _check_measure(path, name, entry, layout, imagined)
        above.append(name)
    try:
        with np.errstate(all="ignore"):
            return compute_numbers(entries, imagined)
    except BadValueError as error:
        raise BadValueError(path, error.key, error.problem) from error


def _check_expression(path: Path, name: str, entry: NumberEntry, above: Sequence[str]) -> None:
    """Refuses an expression that refers to a number which does not precede it."""
    for other in sorted(find_names(entry.expression or "").difference(above)):
        problem = describe_choice(other, above) if above else f"is {other!r}, must be one above it, and there is none"
        raise BadValueError(path, f"numbers.{name}.expression", f"names a number that {problem}")


def _check_measure(path: Path, name: str, entry: NumberEntry, layout: Layout, imagined: MeasuredObservers) -> None:
    """Refuses a number that is measured nowhere, or less often than needed."""
    key = f"numbers.{name}"
    for at, measure in (("measure", entry.measure), ("correlated_with", entry.correlated_with)):
        if measure is not None and not layout.find_measured(measure).any():
            known = [each.value for each in layout.list_measures()]
            how = " in closed form" if layout.is_closed_form else ""
            problem = f"for these presentations{how} {describe_choice(measure.value, known)}"
            raise BadValueError(path, f"{key}.{at}", problem)
    assert entry.measure is not None
    taken = find_taken(entry, entry.measure, imagined)
    group = imagined.objects.groups[entry.of]
    presented = imagined.presented[:, taken]
    presented = select_presentations(presented, presented, group)
    count = presented.shape[1]
    if count == 0:
        problem = f"is {entry.of!r}, in no presentation of which the measure is taken"
        raise BadValueError(path, f"{key}.of", problem)
    count += entry.measure in MOMENTS
    count -= entry.growth
    for at in ("first", "last"):
        asked = getattr(entry, at)
        if asked is not None and asked > count:
            what = "changes" if entry.growth else "presentations"
            problem = f"is {asked}, must be at most {count}, the number of {what} of {entry.of!r} that are measured"
            raise BadValueError(path, f"{key}.{at}", problem)
    if count == 0:
        raise BadValueError(path, f"{key}.growth", f"is true, must be false of a single presentation of {entry.of!r}")
    if entry.predicted_for is not None:
        _check_prediction(path, key, entry, imagined, presented[0, entry.chosen])
    if entry.correlated_with is not None:
        _check_correlation(path, key, entry, imagined, taken)


def _check_prediction(
    path: Path, key: str, entry: NumberEntry, imagined: MeasuredObservers, presented: NDArray[np.intp]
) -> None:
    """Refuses a prediction from objects of one size."""
    volumes = {compute_volume(imagined.objects.tools[tool]) for tool in presented}
    if len(volumes) < 2:
        problem = f"is {entry.of!r}, must be objects of at least two sizes, as a line through them predicts another"
        raise BadValueError(path, f"{key}.of", problem)


def _check_correlation(
    path: Path, key: str, entry: NumberEntry, imagined: MeasuredObservers, taken: NDArray[np.bool_]
) -> None:
    """Refuses a correlation of measures that never change."""
    for at, measure in (("measure", entry.measure), ("correlated_with", entry.correlated_with)):
        assert measure is not None
        values = select_presentations(
            imagined.get(measure, entry.quantile)[:, taken],
            imagined.presented[:, taken],
            imagined.objects.groups[entry.of],
        )
        chosen = values[:, entry.chosen]
        if np.ptp(chosen, axis=1).max() <= 1e-12 * np.abs(chosen).max():
            problem = f"is {measure.value!r}, which does not change over these presentations of {entry.of!r}"
            raise BadValueError(path, f"{key}.{at}", f"{problem}, must change to be correlated")
