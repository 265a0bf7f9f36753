"""What observers do in the trials of a table: each participant of the table is an observer, repeated if asked for.

Lifts and looks are computed in closed form, holds are simulated; one memory goes through all trials of an observer in
their order. The seed is made of the root and the place of the participant; of a repeat after the first, its number
too.
"""

import itertools
import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from affordance.arrays import Array, about
from affordance.belief.learner import Learner
from affordance.choice.inner_simulation import Choice, TaskCostModel
from affordance.choice.picking import NO_OPTION
from affordance.exceptions import BadValueError, InfeasibleError
from affordance.experiments.grips import choose_by_expectation, plan_grips
from affordance.experiments.holds import compute_surprise, compute_volume, expect, show_kinds
from affordance.experiments.lifts import check_can_be_lifted, lift_objects
from affordance.experiments.observers import Setup, run_observers
from affordance.experiments.trials import DOINGS, TrialTable
from affordance.objects.tool import Tool
from affordance.runs.random_streams import Stream
from affordance.settings import Settings
from affordance.simulation.static_lifts import Lift, StaticLifter
from affordance.simulation.trial import get_runner

# Name of people among the learners, where a table has their forces.
PEOPLE = "people"
# What is measured in a trial, with unit and meaning; NaN where there is nothing of it.
MEASURED = {
    "force": ("N", "upward force before release, of a lift"),
    "expected": ("kg", "mass at the most probable densities, before the trial"),
    "believed_density": ("kg/m^3", "most probable density of the first part's colour, before the trial"),
    "felt": ("N", "weight believed of the object once it was felt, of a lift"),
    "kind": ("1", "kind of the object after the trial; 0 without kinds"),
    "p_value": ("1", "p-value of what was felt, by the belief before the trial"),
    "moved": ("m", "largest movement of the object's centre from where it was given, upward, of a hold"),
    "chosen": ("1", "place of the chosen grip among the object's; -1 if none can be used"),
}
# Bounds by cost (SECURITY.md): a lift takes 2 ms, a second of a hold 0.05 s, and a row of the result a kilobyte.
_MOST_LIFTS, _MOST_SECONDS = 1_000_000, 200_000.0


class Trials(NamedTuple):
    """Trials of all participants in their order, (N,) each, with what they name."""

    place: NDArray[np.intp]  # of the participant
    do: NDArray[np.intp]  # place in DOINGS
    tool: NDArray[np.intp]
    duration: Array  # [s]
    teaches: NDArray[np.bool_]
    choice: NDArray[np.intp]  # place of the choice; -1 where nothing is chosen
    tools: tuple[Tool, ...]


def check_cost(table: TrialTable, repeats: int, num_learners: int) -> None:
    """Raises a BadValueError for more trials, or longer holds, than can be computed in some hours."""
    trials, seconds = len(table.rows) * num_learners, float(table.rows["duration"].sum()) * num_learners
    most = min(_MOST_LIFTS // trials, math.inf if seconds == 0.0 else int(_MOST_SECONDS / seconds))
    if repeats > most:
        cost = f"{len(table.rows)} trials, {seconds / num_learners:g} s of holds and {num_learners} learners"
        if most == 0:
            raise BadValueError(table.source, "", f"has {cost}, which take too long, must be several tables")
        raise BadValueError(
            "--repeats", "", f"is {repeats}, must be at most {most} with {cost}; the nearest is {most}"
        )


def check_can_be_presented(table: TrialTable, settings: Settings) -> None:
    """Checks that the arm can hold every object; an InfeasibleError names the row of one that it cannot."""
    try:
        check_can_be_lifted(table.source.name, table.tools, settings)
    except InfeasibleError:
        for number, tool in enumerate(table.tools):
            try:
                check_can_be_lifted(table.source.name, [tool], settings)
            except InfeasibleError as error:
                row = table.numbers[int((table.rows["tool"] == number).to_numpy().argmax())]
                problem = f"is {tool.name!r}, which {error.problem}"
                raise InfeasibleError(table.source, f"row {row}, object", problem) from error
        raise


def collect(
    name: str,
    setup: Setup,
    table: TrialTable,
    tasks: Mapping[str, TaskCostModel] = {},
    *,
    repeats: int = 1,
    learners: Sequence[Learner] = tuple(Learner),
) -> pd.DataFrame:
    """Lets observers of each learner do the trials of a table, and people's own forces follow.

    Args:
        name: Name of the folder of results.
        setup: Setup; its number of observers does not count.
        table: Trials.
        tasks: Tasks for which grips are chosen, by name.
        repeats: Number of observers of each learner for each participant.
        learners: Learners.

    Returns: The rows of the table, once for each observer, with what is measured.
    """
    trials, choices = _plan(setup, table, tasks)
    places = [np.flatnonzero(trials.place == place) for place in range(len(table.participants))]
    tables = []
    for learner in learners:
        given = (trials, [tasks[each] for each in sorted(tasks)])
        data = run_observers(
            name,
            setup.change(learner=learner),
            observe,
            trials,
            choices,
            follows_from=given,
            count=repeats * len(places),
        )
        rows = _repeat(table, places, repeats)
        kept = np.concatenate([np.arange(len(each)) for each in places * repeats])
        for each in MEASURED:
            rows[each] = data[each].values[rows["observer"], kept]
        tables.append(rows.assign(learner=learner.value, chosen=_name_grips(table, rows)))
    lifts = pd.concat(tables, ignore_index=True)
    lifts["force"] = lifts["force"].where(lifts["do"] == "lift")
    if table.rows["force"].notna().any():
        people = _repeat(table, places, 1).assign(learner=PEOPLE, chosen="")
        lifts = pd.concat([lifts, people[people["force"].notna()]], ignore_index=True)
    return _finish(lifts, table, get_runner(setup.settings).gravity)


def _plan(setup: Setup, table: TrialTable, tasks: Mapping[str, TaskCostModel]) -> tuple[Trials, list[Choice]]:
    """Plans the tasks for which grips are chosen, and returns the trials as arrays."""
    rows, planned, choices = table.rows, dict[tuple[int, str], int](), list[Choice]()
    chosen = np.full(len(rows), -1)
    for place in np.flatnonzero(rows["do"] == "choose"):
        key = (int(rows["tool"].iloc[place]), str(rows["task"].iloc[place]))
        if key not in planned:
            planned[key] = len(choices)
            tool = table.tools[key[0]]
            plans = plan_grips([tool], tasks[key[1]], setup.settings, seed=setup.seed, jobs=1, description=key[1])
            choices += plans.values()
        chosen[place] = planned[key]
    do = np.array([DOINGS.index(each) for each in rows["do"]])
    arrays = (rows["place"].to_numpy(), do, rows["tool"].to_numpy(), rows["duration"].to_numpy(float))
    return Trials(*arrays, rows["teaches"].to_numpy(bool), chosen, table.tools), choices


def observe(setup: Setup, trials: Trials, choices: Sequence[Choice], observer: int) -> xr.Dataset:
    """Runs one observer, a repeat of a participant: what it does in each trial, NaN after its last."""
    counts = np.bincount(trials.place)
    repeat, place = divmod(observer, len(counts))
    who = (place,) if repeat == 0 else (place, Stream.REPEAT, repeat + 1)
    own = np.flatnonzero(trials.place == place)
    found = {name: np.full(counts.max(), np.nan) for name in MEASURED}
    memory = setup.start_memory(*who)
    presented = np.unique(trials.tool[own])
    tools = [trials.tools[each] for each in presented]
    lifter = StaticLifter(tools, setup.settings)
    lifts = [Lift(int(np.searchsorted(presented, trials.tool[row])), bool(trials.teaches[row])) for row in own]
    closed = [DOINGS[trials.do[row]] in ("lift", "look") for row in own]
    for is_closed, group in itertools.groupby(range(len(own)), key=closed.__getitem__):
        numbers = list(group)
        if is_closed:
            later = (0, numbers[0]) if numbers[0] else ()  # a number of a lift is never 0
            seed = (setup.seed, *who, Stream.LIFT, *later)
            record, felt = lift_objects(lifter, tools, [lifts[each] for each in numbers], memory, seed)
            memory = record.memories[-1]
            for name in found.keys() & {str(each) for each in felt}:
                found[name][numbers] = felt[name].values
            continue
        for number in numbers:
            row, seed, tool = own[number], (setup.seed, *who, number), tools[lifts[number].tool]
            after = memory
            if trials.choice[row] >= 0:
                found["chosen"][number] = choose_by_expectation(choices[trials.choice[row]], [memory], seed)[0][0]
            else:
                held = get_runner(setup.settings).run_hold(
                    tool, memory, duration=float(trials.duration[row]), seed=seed
                )
                heights, after = held.height_centre, held.memory
                found["p_value"][number] = held.p_value
                found["moved"][number] = heights[np.abs(heights).argmax()]
            for name, value in expect(tool, memory, after, setup.settings).items():
                found[name][number] = value
            memory = after if trials.teaches[row] else memory
    return xr.Dataset({name: ("lift", found[name], about(*MEASURED[name])) for name in MEASURED})


def _repeat(table: TrialTable, places: Sequence[NDArray[np.intp]], repeats: int) -> pd.DataFrame:
    """Repeats the rows of each participant for each of its observers, in the order of the observers."""
    rows = table.rows.iloc[np.concatenate([*places] * repeats)].reset_index(drop=True)
    sizes = np.array([len(each) for each in places] * repeats)
    observer = np.repeat(np.arange(len(sizes)), sizes)
    lift = np.concatenate([np.arange(size) + 1 for size in sizes])
    return rows.assign(observer=observer, repeat=observer // len(places) + 1, lift=lift)


def _name_grips(table: TrialTable, rows: pd.DataFrame) -> list[str]:
    """Names the chosen grip of each row; empty where nothing is chosen, or no grip can be used."""
    names = []
    for tool, place in zip(rows["tool"], rows["chosen"], strict=True):
        has_chosen = not (math.isnan(place) or place == NO_OPTION)
        names.append(table.tools[tool].grips[int(place)].name if has_chosen else "")
    return names


def _finish(lifts: pd.DataFrame, table: TrialTable, gravity: float) -> pd.DataFrame:
    """Adds mass, size and weight of what is presented, and puts the columns in order."""
    lifts["mass"] = np.array([tool.mass for tool in table.tools])[lifts["tool"]]
    lifts["size"] = np.array([compute_volume(tool) for tool in table.tools])[lifts["tool"]]
    lifts["weight"] = gravity * lifts["mass"]
    lifts["kind"] = show_kinds(lifts["kind"].fillna(0).to_numpy(dtype=np.intp))
    lifts["surprise"] = compute_surprise(lifts["p_value"].to_numpy())
    first = [
        "observer",
        "learner",
        "participant",
        "repeat",
        "group",
        "phase",
        "cycle",
        "lift",
        "object",
        "do",
        "task",
    ]
    first += [
        "duration",
        "mass",
        "size",
        "looks_like",
        "teaches",
        "measured",
        "force",
        "expected",
        "believed_density",
    ]
    first += ["weight", "felt", "kind", "surprise", "moved", "chosen"]
    further = [name for name in table.rows if name not in (*first, "place", "tool")]
    return lifts[[*first, *further]]
