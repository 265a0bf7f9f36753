"""People's results for the numbers of a protocol: published values, single lifts, and derived expressions."""

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import t as student_t

from affordance.arrays import Array
from affordance.exceptions import AffordanceError, BadValueError, suggest
from affordance.protocols.block_entries import BlockEntry
from affordance.protocols.measured import MeasuredObservers, compute_of_observers
from affordance.protocols.number_entries import OF_OBJECTS, Measure, NumberEntry
from affordance.protocols.object_entries import ProtocolObjects
from affordance.protocols.people_tables import PeopleLifts, PersonLifts, Published, PublishedTable
from affordance.reporting.expressions import evaluate, find_names
from affordance.reporting.learner_predictions import PeopleSpread
from affordance.reporting.statistics import CONFIDENCE, estimate_mean

# Row of a table with the number of people.
NUM_PEOPLE = "num_people"
# Step of the derivatives by which errors propagate, as a fraction of a standard error.
_STEP = 1e-4
# Gravitational acceleration where people lift, [m/s^2].
_GRAVITY = 9.81


class People(NamedTuple):
    """Results of people, if there are any: a table of published values, and single lifts."""

    table: PublishedTable | None = None
    lifts: PeopleLifts | None = None


def check_table(table: PublishedTable, entries: Mapping[str, NumberEntry]) -> None:
    """Raises a BadValueError for a row that belongs to no number, or a number of people less than 2."""
    for quantity in table.values:
        if quantity == NUM_PEOPLE:
            if table.get(quantity).value < 2.0:
                problem = f"is {table.get(quantity).value:g}, must be at least 2"
                raise BadValueError(table.path, f"{NUM_PEOPLE}, value", problem)
        elif quantity not in entries:
            known = ", ".join([NUM_PEOPLE, *entries])
            problem = f"is {quantity!r}, which is not a number of the protocol: {known}{suggest(quantity, entries)}"
            raise BadValueError(table.path, "quantity", problem)


def list_people(
    entries: Mapping[str, NumberEntry],
    people: People,
    objects: ProtocolObjects | None = None,
    blocks: Sequence[BlockEntry] = (),
) -> dict[str, Published]:
    """Lists people's values of the numbers of a protocol: published, from single lifts, and by expressions of these.

    Errors of published values propagate to first order; they are assumed independent, as their covariances are rarely
    published. Objects and blocks are needed for single lifts. Too few lifts of a person raise a BadValueError, a
    wrong expression an AffordanceError.
    """
    known: dict[str, Published] = {}
    if people.lifts is not None and objects is not None:
        source = f"{len(people.lifts.people)} people, {people.lifts.path.name}"
        for name, values in measure_people(entries, people.lifts, objects, blocks).items():
            mean, low, high = (float(each) for each in estimate_mean(values))
            known[name] = Published(mean, low, high, "", source)
    if people.table is None:
        return known
    for name, entry in entries.items():
        if name in people.table.values:
            known[name] = people.table.get(name)
        elif entry.expression is not None and name not in known:
            names = find_names(entry.expression)
            used = {other: value for other, value in known.items() if other in names}
            missing = [other for other in names if other in entries and other not in known]
            if used and not missing:
                known[name] = _propagate(entry.expression, used)
    return known


def describe_people(people: Mapping[str, Published]) -> dict[str, Any]:
    """Returns people's values as in metrics.json: NAME, and NAME_ci95 where an interval is known."""
    numbers: dict[str, Any] = {}
    for name, value in people.items():
        numbers[name] = value.value
        if math.isfinite(value.low):
            numbers[f"{name}_ci95"] = [value.low, value.high]
    return numbers


def measure_people(
    entries: Mapping[str, NumberEntry], lifts: PeopleLifts, objects: ProtocolObjects, blocks: Sequence[BlockEntry]
) -> dict[str, Array]:
    """Computes numbers of force and weight of every person, (P,), but lists; too few lifts raise a BadValueError."""
    chosen: dict[str, NumberEntry] = {}
    for name, entry in entries.items():
        measures = {entry.measure, entry.correlated_with} - {None}
        if entry.expression is not None:
            fits = find_names(entry.expression) <= chosen.keys()
        else:
            fits = measures <= {Measure.FORCE, Measure.WEIGHT, *OF_OBJECTS}
        if fits:
            chosen[name] = entry
    rows = [_measure_person(chosen, lifts, name, person, objects, blocks) for name, person in lifts.people.items()]
    return {
        name: np.array([row[name] for row in rows])
        for name in chosen
        if name in rows[0] and all(row[name].ndim == 0 for row in rows)
    }


def list_spreads(
    entries: Mapping[str, NumberEntry],
    people: People,
    means: Mapping[str, float],
    objects: ProtocolObjects | None = None,
    blocks: Sequence[BlockEntry] = (),
) -> dict[str, PeopleSpread]:
    """Lists the standard deviations between people of the numbers of a protocol, where they are known.

    The protocol's own value comes first, then the standard deviation of people's single lifts, then that implied by a
    published interval and the number of people. That of an expression follows from its parts to first order about the
    predicted means, taken as independent; since people who push hard do so for every object, it is too large for a
    ratio.
    """
    measured: dict[str, Array] = {}
    if people.lifts is not None and objects is not None and len(people.lifts.people) > 1:
        measured = measure_people(entries, people.lifts, objects, blocks)
    table = people.table if people.table is not None and NUM_PEOPLE in people.table.values else None
    published = list_people(entries, People(table)) if table is not None else {}
    found: dict[str, PeopleSpread] = {}
    for name, entry in entries.items():
        if entry.people is not None:
            found[name] = PeopleSpread(entry.people.sd, entry.people.source)
        elif name in measured and people.lifts is not None:
            found[name] = PeopleSpread(float(measured[name].std(ddof=1)), people.lifts.path.name)
        elif table is not None and name in published and math.isfinite(published[name].low):
            count = table.get(NUM_PEOPLE).value
            half = 0.5 * (published[name].high - published[name].low)
            quantile = float(student_t.ppf(0.5 + CONFIDENCE / 2.0, count - 1.0))
            found[name] = PeopleSpread(half * math.sqrt(count) / quantile, published[name].source)
        elif entry.expression is not None:
            names = [other for other in entries if other in find_names(entry.expression)]
            moving = [other for other in names if entries[other].measure not in (Measure.WEIGHT, *OF_OBJECTS)]
            if moving and all(other in found for other in moving) and all(other in means for other in names):
                sds = {other: found[other].sd for other in moving}
                sd = compute_error(entry.expression, {other: means[other] for other in names}, sds)
                found[name] = PeopleSpread(sd, "calculated from the others")
    return found


def compute_error(expression: str, means: Mapping[str, float], errors: Mapping[str, float]) -> float:
    """Computes the error of an expression from those of its numbers, to first order, taken as independent."""
    changes = []
    for name, error in errors.items():
        if error > 0.0:
            up, down = (
                float(evaluate(expression, {**means, name: means[name] + sign * _STEP * error}))
                for sign in (1.0, -1.0)
            )
            changes.append((up - down) / (2.0 * _STEP))
    return float(np.linalg.norm(changes)) if changes else 0.0


def _measure_person(
    entries: Mapping[str, NumberEntry],
    lifts: PeopleLifts,
    name: str,
    person: PersonLifts,
    objects: ProtocolObjects,
    blocks: Sequence[BlockEntry],
) -> dict[str, Array]:
    """Computes the numbers of one person from the lifts in measured blocks with a known force."""
    unmeasured = [index for index, block in enumerate(blocks) if not block.measured]
    kept = np.isfinite(person.force) & ~np.isin(person.block, unmeasured)
    tool, force, mass = person.tool[kept], person.force[kept], person.mass[kept]
    usual = np.array([each.mass for each in objects.tools])[tool]
    arrays = {Measure.FORCE: force, Measure.WEIGHT: _GRAVITY * np.where(np.isnan(mass), usual, mass)}
    for number, entry in entries.items():
        if entry.measure in arrays:
            count = int(np.isin(tool, objects.groups[entry.of]).sum())
            asked = entry.first or entry.last or 1
            if count < asked:
                problem = f"has {count} lifts of {entry.of!r} by {name!r}, must have {asked} for the number {number}"
                raise BadValueError(lifts.path, "", problem)
    measured = MeasuredObservers(objects, tool[None], lambda measure, quantile: arrays[measure][None])
    try:
        return {key: np.asarray(values[0]) for key, values in compute_of_observers(entries, measured).items()}
    except AffordanceError as error:
        raise BadValueError(lifts.path, "", f"{name!r}: {error}") from error


def _propagate(expression: str, used: Mapping[str, Published]) -> Published:
    """Computes the value of an expression, with the interval that follows from those of its operands."""
    means = {name: value.value for name, value in used.items()}
    halves = {name: 0.5 * (value.high - value.low) for name, value in used.items() if math.isfinite(value.low)}
    middle = float(evaluate(expression, means))
    half = compute_error(expression, means, halves) if halves else math.nan
    return Published(middle, middle - half, middle + half, "1", "calculated from the others")
