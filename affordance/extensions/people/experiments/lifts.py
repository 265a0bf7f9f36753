"""Simulated lift experiments with one table row per lift, in the same format as human data.

A design is a function that draws the trials of one observer. It returns a table with the columns block, cycle and
object, in the order of the lifts. ``run_lifts`` adds simulated results. In each lift the observer pushes upward with
the believed weight while the object is clamped, and then measures joint torques at rest. Both are computed in closed
form.
"""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from affordance.arguments import check_number
from affordance.arrays import Array, about
from affordance.belief.learner import Learner
from affordance.belief.learners import list_learners
from affordance.exceptions import BadArgumentError, BadValueError
from affordance.experiments.shared.experiment import Experiment
from affordance.experiments.shared.holds import compute_surprise, compute_volume, select_columns, show_kinds
from affordance.experiments.shared.objects import check_can_be_held
from affordance.experiments.shared.observer_numbers import ObserverNumbers, PeopleSpread
from affordance.experiments.shared.observers import Setup, run_observers
from affordance.experiments.shared.results import Results
from affordance.extensions.people.participant import (
    LiftSettings,
    Participant,
    compute_heaviness,
    draw_participants,
    list_own_values,
    with_participant,
)
from affordance.extensions.people.static_lifts import NOTHING, StaticLifter, check_closed_form
from affordance.objects.colour import COLOUR_FORM, is_colour, parse_colour
from affordance.objects.inertia import DENSITY_MAX, DENSITY_MIN
from affordance.objects.materials import Material
from affordance.objects.primitives import Cylinder
from affordance.objects.tool import Component, Tool
from affordance.proprioception.faults import NO_FAULTS
from affordance.reporting.claims import with_interval
from affordance.runs.random_streams import ObserverDraws, Stream
from affordance.settings import Settings

# Largest number of lifts of all observers and learners, which limits the size of tables in memory (SECURITY.md).
MOST_LIFTS = 2_000_000
# Largest number of observers that are simulated together. Little is lost if a run is interrupted.
AT_ONCE = 250
# Function that draws the trials of an observer, given the observer's number and a random generator.
type Design = Callable[[int, np.random.Generator], pd.DataFrame]


def repeat(
    objects: Sequence[str],
    repetitions: int,
    rng: np.random.Generator,
    *,
    block: str,
    order: str = "shuffled",
    first: Sequence[str] = (),
    times: int = 1,
    row: int = 0,
) -> pd.DataFrame:
    """Draws a block of trials with all objects in each repetition.

    Args:
        objects: Names of the objects.
        repetitions: Number of repetitions.
        rng: Random generator.
        block: Name of the block.
        order: Order within a repetition: "shuffled", "fixed", or "latin square" (balanced for position and preceding
            object).
        first: Names of the objects at the start of each repetition, in this order.
        times: Number of consecutive trials with the same object.
        row: Row of the Latin square for the first repetition, usually the number of the observer.

    Returns: Table with the columns ``block``, ``cycle`` (the repetition, from 1) and ``object``.
    """
    others = [name for name in objects if name not in first]
    rows = []
    for cycle in range(repetitions):
        names = [*first, *_order(others, order, rng, row + cycle)]
        rows += [(block, cycle + 1, name) for name in names for _ in range(times)]
    return pd.DataFrame(rows, columns=["block", "cycle", "object"])


def _order(names: Sequence[str], order: str, rng: np.random.Generator, row: int) -> list[str]:
    if order == "shuffled":
        return [names[int(place)] for place in rng.permutation(len(names))]
    if order == "latin square":
        return [names[place] for place in build_row(len(names), row % count_rows(len(names)))] if names else []
    if order == "fixed":
        return list(names)
    raise ValueError(f"order is {order!r}, must be 'shuffled', 'fixed' or 'latin square'")


def count_rows(count: int) -> int:
    """Computes the number of rows of a balanced Latin square: ``count`` if it is even, otherwise twice as many."""
    return count if count % 2 == 0 else 2 * count


def build_row(count: int, row: int) -> list[int]:
    """Builds a row of the balanced Latin square of Williams (1949). Entries are indices of objects."""
    zigzag = [(place + 1) // 2 if place % 2 else (count - place // 2) % count for place in range(count)]
    places = [(place + row) % count for place in zigzag]
    return places if row < count else places[::-1]


def counterbalance[T](values: Sequence[T], participant: int) -> list[T]:
    """Orders values for a participant with a Latin square, so that orders are balanced over participants."""
    return [values[place] for place in build_row(len(values), participant % count_rows(len(values)))]


def build_table(
    design: Design, participants: int, *, groups: Sequence[str] = ("all",), seed: int = 0
) -> pd.DataFrame:
    """Builds a trial table for ``trials.check_trials`` from a design.

    Participants P1, P2, ... have the same trials as observers 0, 1, ... of an experiment with this design and seed.

    Args:
        design: Function that draws the trials of one participant.
        participants: Number of participants.
        groups: Names of groups, to which participants are assigned in turn.
        seed: Seed of the random draws.
    """
    tables = []
    for number in range(participants):
        trials = design(number, np.random.default_rng([seed, number, Stream.LIFT_ORDER]))
        tables.append(trials.assign(participant=f"P{number + 1}", group=groups[number % len(groups)]))
    table = pd.concat(tables, ignore_index=True).rename(columns={"block": "phase"})
    return table[["participant", "group", *(name for name in table if name not in ("participant", "group"))]]


def run_lifts(
    name: str, setup: Setup, tools: Sequence[Tool], design: Design, learners: Sequence[Learner] = ()
) -> pd.DataFrame:
    """Simulates lifts of objects by observers with each learner.

    Args:
        name: Name of the experiment.
        setup: Setup of the experiment.
        tools: Objects.
        design: Function that draws the trials of an observer.
        learners: Learners; empty for the built-in learners and the learner of the settings.

    Returns: Table with one row per lift and the columns of ``select_columns``, including ``weight``, [N]; ``mass``,
        [kg]; ``size``, the volume, [m^3]; ``force``, the upward force before release, [N]; ``expected``, [kg];
        ``believed_density``, [kg/m^3].

    Raises:
        BadValueError: There are more than ``MOST_LIFTS`` lifts, or the closed form does not support a setting.
        InfeasibleError: An object is too heavy for the arm.
    """
    check_can_be_lifted(name, tools, setup.settings)
    learners = learners or list_learners(setup.settings.learner)
    count = len(learners) * len(design(0, np.random.default_rng(setup.seed)))
    if setup.observers * count > MOST_LIFTS:
        most = MOST_LIFTS // count
        problem = f"is {setup.observers}, must be at most {most} with {count} lifts each; the nearest is {most}"
        raise BadValueError("--repeats", "", problem)
    mass = {tool.name: tool.mass for tool in tools}
    size = {tool.name: compute_volume(tool) for tool in tools}
    tables = []
    for learner in learners:
        data = run_observers(name, setup.change(learner=learner), lift, tuple(tools), design, at_once=AT_ONCE)
        table = data.drop_vars("p_value").to_dataframe().reset_index().assign(learner=learner.name)
        table["lift"] += 1
        table["mass"], table["size"] = table["object"].map(mass), table["object"].map(size)
        table["kind"] = show_kinds(data.kind.values.ravel())
        table["surprise"] = compute_surprise(data.p_value.values.ravel())
        tables.append(select_columns(table).assign(weight=table["weight"]))
    return pd.concat(tables, ignore_index=True)


def check_can_be_lifted(name: str, tools: Sequence[Tool], settings: Settings) -> None:
    """Checks that the arm can hold the objects, and that the closed form supports the settings.

    Raises:
        BadArgumentError, BadValueError: The closed form does not support a setting.
        InfeasibleError: An object is too heavy for the arm.
    """
    check_closed_form(settings)
    if settings.eye is not None:
        raise BadValueError(
            "--vision", "", f"is 'pixels', must be 'features' for {name}, whose lifts are in closed form"
        )
    if settings.faults != NO_FAULTS:
        problem = f"is given, must be omitted for {name}, whose lifts in closed form do not support faults"
        raise BadValueError("--fault", "", problem)
    check_can_be_held(Path(name), tools, settings)


def lift(setup: Setup, tools: Sequence[Tool], design: Design, observers: Sequence[int]) -> list[xr.Dataset]:
    """Simulates observers that lift the objects of their trials in order and learn from each lift."""
    names = [tool.name for tool in tools]
    trials = [
        design(observer, np.random.default_rng([setup.seed, observer, Stream.LIFT_ORDER])) for observer in observers
    ]
    num_lifts = max(map(len, trials))
    objects = np.full((num_lifts, len(observers)), NOTHING)
    for row, table in enumerate(trials):
        objects[: len(table), row] = [names.index(each) for each in table["object"]]
    drawn, felt, who = (
        [(setup.seed, observer, stream) for observer in observers]
        for stream in (Stream.KINDS, Stream.LIFT, Stream.PERSON)
    )
    settings = with_participant(setup.settings)
    pushes, learner = draw_participants(settings.participant, settings.learner, observers, ObserverDraws(who))
    lifter = StaticLifter(tools, setup.change(learner=learner).settings)
    record = lifter.run(objects, lifter.start(drawn), lifter.draw_errors(felt, num_lifts), drawn, pushes=pushes)
    heaviness = compute_heaviness(record.felt, record.expected_by_look, settings.participant.heaviness_exponent)
    own = list_own_values(pushes, learner) if do_differ(settings) else {}
    found = []
    for row, table in enumerate(trials):
        variables = (
            ("block", table["block"].to_numpy(dtype=str), "1", "block"),
            ("cycle", table["cycle"].to_numpy(), "1", "repetition within the block, from 1"),
            ("object", table["object"].to_numpy(dtype=str), "1", "object"),
            ("force", record.force, "N", "upward force before release"),
            ("weight", record.weight, "N", "true weight"),
            ("expected", record.expected, "kg", "mass at the most probable densities, before the lift"),
            ("believed_density", record.believed_density, "kg/m^3", "most probable density of the colour, before"),
            ("kind", record.kind, "1", "kind of the object after the lift; 0 if the learner has no kinds"),
            ("p_value", record.p_value, "1", "p-value of what was felt, under the belief before the lift"),
            ("felt", record.felt, "N", "believed weight after the object was felt"),
            (
                "expected_by_look",
                record.expected_by_look,
                "N",
                "weight that the object's look predicts, before the lift",
            ),
            ("heaviness", heaviness, "N", "judged heaviness"),
            *((name, np.tile(values, (num_lifts, 1)), "", "of the observer") for name, values in own.items()),
        )
        found.append(
            xr.Dataset(
                {
                    name: ("lift", values[: len(table), row] if values.ndim > 1 else values, about(unit, meaning))
                    for name, values, unit, meaning in variables
                }
            )
        )
    return found


def do_differ(settings: Settings) -> bool:
    """Returns True if parameters of participants or of the learner vary between observers."""
    values = vars(settings.learner.parameters).values()
    return with_participant(settings).participant != Participant() or any(isinstance(each, tuple) for each in values)


def summarise_lifts(
    lifts: pd.DataFrame,
    measure: Callable[[pd.DataFrame], pd.Series],
    setup: Setup,
    *,
    without_interval: Sequence[str] = (),
) -> dict[str, Any]:
    """Computes means over observers with 95 % intervals for each learner.

    Args:
        lifts: Table of lifts of all observers.
        measure: Function that computes the measures of one observer from its lifts.
        setup: Setup of the experiment.
        without_interval: Names of measures that are the same for all observers.

    Returns: Measures of the first learner, and measures of all learners under ``learners``, as in metrics.json.
    """
    learners: dict[str, dict[str, Any]] = {}
    for learner, found in measure_each(lifts, measure).items():
        learners[learner] = {}
        for name, values in found.items():
            numbers = with_interval(name, values)
            learners[learner] |= {name: numbers[name]} if name in without_interval else numbers
    parameters = {each.name: each.parameters for each in list_learners(setup.settings.learner)}
    kappa = {name: each.kappa for name, each in parameters.items() if hasattr(each, "kappa")}
    return {**next(iter(learners.values())), "learners": learners, "people": {}, "kappa": kappa}


def measure_each(lifts: pd.DataFrame, measure: Callable[[pd.DataFrame], pd.Series]) -> dict[str, dict[str, Array]]:
    """Computes the measures of each observer from its lifts, (observers,), by learner and name."""
    found = {}
    for learner, of_one in lifts.groupby("learner", sort=False):
        rows = pd.DataFrame([measure(own) for _, own in of_one.groupby("observer")])
        found[str(learner)] = {str(name): rows[name].to_numpy() for name in rows}
    return found


def build_lift_experiment(
    name: str,
    make_objects: Callable[[], Sequence[Tool]],
    design: Design,
    measure: Callable[[pd.DataFrame], pd.Series],
    describe: Callable[[Setup, pd.DataFrame, dict[str, Any]], Mapping[str, Any]],
    *,
    meanings: Mapping[str, str],
    list_spreads: Callable[[Mapping[str, float]], Mapping[str, PeopleSpread]] = lambda means: {},
    list_learners: Callable[[Setup], Sequence[Learner]] = lambda setup: (),
    without_interval: Sequence[str] = (),
    observers: int = 50,
) -> Experiment:
    """Builds an experiment in which observers with each learner lift objects.

    Args:
        name: Name of the experiment.
        make_objects: Function that creates the objects.
        design: Function that draws the trials of an observer.
        measure: Function that computes the measures of an observer or participant from its lifts.
        describe: Function that describes setup, lifts and measures (see ``summarise_lifts``) with texts, claims,
            figures and tables.
        meanings: Description of each measure, by name.
        list_spreads: Function that computes standard deviations between participants from predicted means, by name.
        list_learners: Function that lists the learners; if the list is empty, they are the built-in learners and the
            learner of the settings.
        without_interval: Names of measures that are the same for all observers.
        observers: Default number of observers of each learner.
    """

    def read(setup: Setup) -> list[Tool]:
        tools = list(make_objects())
        check_can_be_lifted(name, tools, setup.settings)
        return tools

    def collect(setup: Setup) -> pd.DataFrame:
        return run_lifts(name, setup, read(setup), design, list_learners(setup))

    def run(setup: Setup) -> Results:
        lifts = collect(setup)
        numbers = summarise_lifts(lifts, measure, setup, without_interval=without_interval)
        parts = describe(setup, lifts, numbers)
        learners = [*numbers["learners"]]
        return Results(data=lifts, numbers=numbers, lifts=select_columns(lifts), learners=learners, **parts)

    def predict(setup: Setup) -> ObserverNumbers:
        return ObserverNumbers(measure_each(collect(setup), measure), meanings, list_spreads)

    # Closed-form lifts have no torques over time for a lasting memory.
    no_memory = "in which nothing is felt"
    return Experiment(run, read, predict, observers, (), no_memory, every_learner=True, settings=LiftSettings)


def cylinder(name: str, *, radius: float, height: float, mass: float, colour: str = "#8c8c8c") -> Tool:
    """Creates a homogeneous cylinder that is held at its middle.

    Args:
        name: Name of the object.
        radius: Radius, [m].
        height: Height, [m].
        mass: Mass, [kg].
        colour: Colour in hexadecimal.

    Raises:
        BadArgumentError: A size, mass or density is out of bounds, or the colour is invalid.
    """
    solid = Cylinder(check_number("radius", radius, 1e-3, 0.5, "m"), check_number("height", height, 1e-3, 1.0, "m"))
    density = check_number("mass", mass, 1e-3, 100.0, "kg") / solid.volume
    check_number(f"density of {name}", density, DENSITY_MIN, DENSITY_MAX, "kg/m^3")
    if not is_colour(colour):
        raise BadArgumentError("colour", "", f"is {colour!r}, {COLOUR_FORM}")
    material = Material(name, parse_colour(colour), density, source="ours")
    return Tool(name, (Component(solid, np.eye(4), material, material),))
