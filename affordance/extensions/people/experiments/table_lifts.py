"""Simulation of the trials in a table, with one or more observers per participant.

Lifts and looks are computed in closed form; holds are simulated. The memory of an observer is updated trial by trial.
Random draws depend on the root seed, the index of the participant and, from the second repeat on, its number.
"""

import itertools
import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from affordance.arrays import Array, about
from affordance.belief.learner import Learner
from affordance.belief.learners import LEARNERS
from affordance.belief.material_memory import MaterialMemory
from affordance.choice.inner_simulation import Choice, TaskCostModel
from affordance.choice.picking import NO_OPTION
from affordance.exceptions import InfeasibleError
from affordance.experiments.shared.grips import choose_by_expectation, plan_grips
from affordance.experiments.shared.holds import OWN_VALUES, compute_surprise, compute_volume, expect, show_kinds
from affordance.experiments.shared.observer_numbers import ObserverNumbers, PeopleSpread
from affordance.experiments.shared.observers import Setup, run_observers
from affordance.experiments.shared.results import Results
from affordance.extensions.people.experiments.lift_figures import draw_by_object
from affordance.extensions.people.experiments.lifts import AT_ONCE, check_can_be_lifted, do_differ
from affordance.extensions.people.experiments.planned_contrasts import (
    PlannedContrast,
    compute_effects,
    describe_effects,
    list_content,
)
from affordance.extensions.people.experiments.trial_cells import PEOPLE
from affordance.extensions.people.experiments.trials import DOINGS, TrialTable
from affordance.extensions.people.participant import (
    compute_heaviness,
    draw_participants,
    list_own_values,
    with_participant,
)
from affordance.extensions.people.static_lifts import NOTHING, StaticLifter
from affordance.objects.tool import Tool
from affordance.reporting.formatting import count_observers, format_number, tabulate
from affordance.reporting.statistics import estimate_mean
from affordance.runs.random_streams import ObserverDraws, Stream
from affordance.settings import Settings
from affordance.simulation.trial import get_runner

# Upward force that 95 % of men can exert with the outstretched right arm, [N], according to MIL-STD-1472D (quoted
# from memory). With a bent elbow it is up to 107 N.
STRENGTH = 62.0
# Unit and description of each measure; values are NaN in trials to which a measure does not apply.
MEASURED = {
    "force": ("N", "upward force before the release of a lift"),
    "expected": ("kg", "mass at the most probable densities, before the trial"),
    "believed_density": ("kg/m^3", "most probable density of the first part's colour, before the trial"),
    "felt": ("N", "believed weight after the object was felt, in a lift"),
    "expected_by_look": ("N", "weight that the object's look predicts, before a lift or look"),
    "heaviness": ("N", "judged heaviness, in a lift that teaches"),
    "kind": ("1", "kind of the object after the trial; 0 if the learner has no kinds"),
    "p_value": ("1", "p-value of what was felt, under the belief before the trial"),
    "moved": ("m", "largest movement of the object's centre from where it was given, positive upward, in a hold"),
    "chosen": ("1", "index of the chosen grip among the object's grips; -1 if none can be used"),
}


class Trials(NamedTuple):
    """Trials of all participants in order, as arrays (N,), and their objects."""

    place: NDArray[np.intp]  # index of the participant
    do: NDArray[np.intp]  # index in DOINGS
    tool: NDArray[np.intp]  # index in ``tools``
    duration: Array  # [s]
    teaches: NDArray[np.bool_]  # True if the observer learns from the trial
    choice: NDArray[np.intp]  # index of the planned choice; -1 for other trials
    tools: tuple[Tool, ...]


@dataclass(frozen=True)
class TableExperiment:
    """Experiment with trials from a table.

    Attributes:
        name: Name of the results folder.
        table: Trial table.
        tasks: Tasks for which grips are chosen, by name.
        repeats: Number of observers per participant and learner.
        learners: Learners.
        people_sd: Standard deviation of the force between human participants, [N]; None if unknown.
        contrasts: Planned contrasts.
    """

    name: str
    table: TrialTable
    tasks: Mapping[str, TaskCostModel] = field(default_factory=dict)
    repeats: int = 1
    learners: tuple[Learner, ...] = tuple(LEARNERS.values())
    people_sd: float | None = None
    contrasts: tuple[PlannedContrast, ...] = ()

    @property
    def observers(self) -> int:
        """Number of observers of each learner."""
        return self.repeats * len(self.table.participants)

    def read(self, setup: Setup) -> None:
        """Checks that the arm can hold the objects."""
        check_can_be_presented(self.table, setup.settings)

    def collect(self, setup: Setup) -> pd.DataFrame:
        """Simulates the trials with observers of each learner. The number of observers in the setup is ignored.

        Returns: Rows of the table with simulated measures for each learner and observer, followed by human lifts.
        """
        trials, choices = _plan(setup, self.table, self.tasks)
        places = [np.flatnonzero(trials.place == place) for place in range(len(self.table.participants))]
        # Simulating holds takes long. Only one observer should be lost if a run is interrupted.
        at_once = AT_ONCE if self.table.rows["do"].isin(("lift", "look")).all() else 1
        tables = []
        for learner in self.learners:
            data = run_observers(
                self.name,
                setup.change(learner=learner),
                observe,
                trials,
                choices,
                follows_from=(trials, [self.tasks[each] for each in sorted(self.tasks)]),
                count=self.observers,
                at_once=at_once,
            )
            rows = _repeat(self.table, places, self.repeats)
            kept = np.concatenate([np.arange(len(each)) for each in places * self.repeats])
            for each in MEASURED:
                rows[each] = data[each].values[rows["observer"], kept]
            for name in [str(each) for each in data if str(each).startswith(OWN_VALUES)]:
                rows[name] = data[name].values[rows["observer"]]
            tables.append(rows.assign(learner=learner.name, chosen=_name_grips(self.table, rows)))
        lifts = pd.concat(tables, ignore_index=True)
        lifts["force"] = lifts["force"].where(lifts["do"] == "lift")
        if self.table.rows["force"].notna().any():
            people = _repeat(self.table, places, 1).assign(learner=PEOPLE, chosen="")
            lifts = pd.concat([lifts, people[people["force"].notna()]], ignore_index=True)
        return _finish(lifts, self.table, get_runner(setup.settings).gravity)

    def run(self, setup: Setup) -> Results:
        """Runs the experiment."""
        lifts = self.collect(setup)
        means = average(lifts)
        groups, objects = lifts["group"].unique(), lifts["object"].unique()
        figures = {
            column: (
                f"{title}, trial by trial. Thin lines: single observers; bands: 95 % intervals of means.",
                partial(draw_by_object, lifts[lifts["measured"]], column, title),
            )
            for column, title in (("force", "force (N)"), ("moved", "movement of the object's centre (m)"))
            if lifts.loc[lifts["measured"], column].notna().any()
        }
        effects = compute_effects(self.contrasts, lifts)
        sentences = [*map(describe_effects, self.contrasts, effects), describe_too_strong(lifts)]
        numbers = {
            "means": means,
            "participants": len(self.table.participants),
            "repeats_of_each": self.repeats,
            "trials": len(self.table.rows),
            "contrasts": list_content(self.contrasts, effects),
        }
        return Results(
            order=60,
            title=f"Trials of {self.table.source.name}",
            summary=(
                f"{count_observers(self.observers)} of each of {len(self.learners)} learners did the trials of"
                f" {len(self.table.participants)} participants in {len(groups)} groups, with {len(objects)} objects."
            ),
            finding="\n".join(filter(None, sentences)),
            data=lifts,
            numbers=numbers,
            claims=(),
            figures=figures,
            tables={"Means over observers, with 95 % intervals.": tabulate_means(means)},
            lifts=lifts,
            learners=[each.name for each in self.learners],
        )

    def predict(self, setup: Setup) -> ObserverNumbers:
        """Computes the mean measures of each observer and learner, by group, phase and object."""
        values, spreads = list_numbers(self.collect(setup), self.people_sd)
        return ObserverNumbers(values, {}, lambda means: spreads)


def check_can_be_presented(table: TrialTable, settings: Settings) -> None:
    """Checks that the arm can hold all objects. An InfeasibleError contains the row of the first heavy object."""
    with suppress(InfeasibleError):  # only the slow loop below identifies the object
        check_can_be_lifted(table.source.name, table.tools, settings)
        return
    for number, tool in enumerate(table.tools):
        try:
            check_can_be_lifted(table.source.name, [tool], settings)
        except InfeasibleError as error:
            row = table.numbers[int((table.rows["tool"] == number).to_numpy().argmax())]
            raise InfeasibleError(
                table.source, f"row {row}, object", f"is {tool.name!r}, which {error.problem}"
            ) from error


def _plan(setup: Setup, table: TrialTable, tasks: Mapping[str, TaskCostModel]) -> tuple[Trials, list[Choice]]:
    """Converts trials to arrays, and plans all grips of each choice."""
    rows, planned, choices = table.rows, dict[tuple[int, str], int](), list[Choice]()
    chosen = np.full(len(rows), NO_OPTION)
    for place in np.flatnonzero(rows["do"] == "choose"):
        tool, task = int(rows["tool"].iloc[place]), str(rows["task"].iloc[place])
        if (tool, task) not in planned:
            planned[tool, task] = len(choices)
            found = plan_grips(
                [table.tools[tool]], tasks[task], setup.settings, seed=setup.seed, jobs=setup.jobs, description=task
            )
            choices += found.values()
        chosen[place] = planned[tool, task]
    do = np.array([DOINGS.index(each) for each in rows["do"]])
    arrays = (rows["place"].to_numpy(), do, rows["tool"].to_numpy(), rows["duration"].to_numpy(float))
    return Trials(*arrays, rows["teaches"].to_numpy(bool), chosen, table.tools), choices


def observe(setup: Setup, trials: Trials, choices: Sequence[Choice], observers: Sequence[int]) -> list[xr.Dataset]:
    """Simulates observers that perform the trials of participants.

    Several observers with the same objects are simulated together. Their trials must be in closed form. Results equal
    separate runs except for rounding.

    Returns: Measures of each observer, padded with NaN after the last trial.
    """
    counts = np.bincount(trials.place)
    alike: dict[tuple[int, ...], list[int]] = {}
    for observer in observers:
        own = trials.tool[trials.place == observer % len(counts)]
        alike.setdefault(tuple(np.unique(own).tolist()), []).append(observer)
    found: dict[int, xr.Dataset] = {}
    for presented, some in alike.items():
        found |= zip(some, _observe_alike(setup, trials, choices, some, presented), strict=True)
    return [found[observer] for observer in observers]


def _observe_alike(
    setup: Setup, trials: Trials, choices: Sequence[Choice], observers: Sequence[int], presented: Sequence[int]
) -> list[xr.Dataset]:
    """Simulates observers with the same objects together, trial by trial."""
    counts = np.bincount(trials.place)
    repeats, places = np.divmod(observers, len(counts))
    who = [
        (place, Stream.REPEAT, repeat + 1) if repeat else (place,)
        for repeat, place in zip(repeats.tolist(), places.tolist(), strict=True)
    ]
    rows = [np.flatnonzero(trials.place == place) for place in places]
    shape = max(map(len, rows)), len(rows)
    lifted, teaches = np.full(shape, NOTHING), np.zeros(shape, dtype=bool)
    for column, own in enumerate(rows):
        lifted[: len(own), column] = np.searchsorted(presented, trials.tool[own])
        teaches[: len(own), column] = trials.teaches[own]
    found = {name: np.full((counts.max(), len(rows)), np.nan) for name in MEASURED}
    tools = [trials.tools[each] for each in presented]
    participant = with_participant(setup.settings).participant
    person = ObserverDraws([(setup.seed, *each, Stream.PERSON) for each in who])
    pushes, learner = draw_participants(participant, setup.settings.learner, places.tolist(), person)
    settings = setup.change(learner=learner).settings
    lifter, drawn = StaticLifter(tools, settings), [(setup.seed, *each, Stream.KINDS) for each in who]
    knows, num_learned = lifter.start(drawn), 0
    errors = lifter.draw_errors([(setup.seed, *each, Stream.LIFT) for each in who], shape[0])
    closed = [DOINGS[trials.do[row]] in ("lift", "look") for row in max(rows, key=len)]
    for is_closed, group in itertools.groupby(range(shape[0]), key=closed.__getitem__):
        numbers = list(group)
        if is_closed:
            later = (0, numbers[0]) if numbers[0] else ()  # only the first lift has the number 0
            seeds = [(*each, *later) for each in drawn]
            record = lifter.run(lifted[numbers], knows, errors[numbers], seeds, teaches[numbers], pushes)
            knows, num_learned = record.after, num_learned + int(teaches[numbers, 0].sum())
            for name in found.keys() & set(record._fields):
                found[name][numbers] = np.where(lifted[numbers] == NOTHING, np.nan, getattr(record, name))
            continue
        for number in numbers:
            row, seed, tool = rows[0][number], (setup.seed, *who[0], number), tools[lifted[number, 0]]
            memory = MaterialMemory(settings.learner, drawn[0], tuple(lifter.colours), knows.state, (), num_learned)
            if trials.choice[row] >= 0:
                memory = after = replace(memory, things=lifter.list_things(knows))
                found["chosen"][number] = choose_by_expectation(choices[trials.choice[row]], [memory], seed)[0][0]
            else:
                noted = lifter.mark_met(knows, int(lifted[number, 0]))
                memory = replace(memory, things=lifter.list_things(noted))
                held = get_runner(settings).run_hold(tool, memory, duration=float(trials.duration[row]), seed=seed)
                heights, after = held.height_centre, held.memory
                found["p_value"][number] = held.p_value
                found["moved"][number] = heights[np.abs(heights).argmax()]
                if trials.teaches[row]:
                    knows, num_learned = noted._replace(state=after.state), num_learned + 1
            for name, value in expect(tool, memory, after, settings).items():
                found[name][number] = value
    found["heaviness"] = compute_heaviness(found["felt"], found["expected_by_look"], participant.heaviness_exponent)
    values = list_own_values(pushes, learner) if do_differ(setup.settings) else {}
    return [
        xr.Dataset({name: ("lift", found[name][:, column], about(*MEASURED[name])) for name in MEASURED}).assign(
            {name: float(value[column]) for name, value in values.items()}
        )
        for column in range(len(rows))
    ]


def _repeat(table: TrialTable, places: Sequence[NDArray[np.intp]], repeats: int) -> pd.DataFrame:
    """Repeats the rows of each participant for each observer, in the order of observers."""
    rows = table.rows.iloc[np.concatenate([*places] * repeats)].reset_index(drop=True)
    sizes = np.array([len(each) for each in places] * repeats)
    observer = np.repeat(np.arange(len(sizes)), sizes)
    lift = np.concatenate([np.arange(size) + 1 for size in sizes])
    return rows.assign(observer=observer, repeat=observer // len(places) + 1, lift=lift)


def _name_grips(table: TrialTable, rows: pd.DataFrame) -> list[str]:
    """Lists the name of the chosen grip in each row, which is empty without a choice or a usable grip."""
    names = []
    for tool, place in zip(rows["tool"], rows["chosen"], strict=True):
        has_chosen = not (math.isnan(place) or place == NO_OPTION)
        names.append(table.tools[tool].grips[int(place)].name if has_chosen else "")
    return names


def _finish(lifts: pd.DataFrame, table: TrialTable, gravity: float) -> pd.DataFrame:
    """Adds mass, size and weight of the objects, and sorts the columns."""
    lifts["mass"] = np.array([tool.mass for tool in table.tools])[lifts["tool"]]
    lifts["size"] = np.array([compute_volume(tool) for tool in table.tools])[lifts["tool"]]
    lifts["weight"] = gravity * lifts["mass"]
    lifts["kind"] = show_kinds(lifts["kind"].fillna(0).to_numpy(dtype=np.intp))
    lifts["surprise"] = compute_surprise(lifts["p_value"].to_numpy())
    first = (
        *("observer", "learner", "participant", "repeat", "group", "phase", "cycle", "lift", "object", "do", "task"),
        *("duration", "mass", "size", "looks_like", "teaches", "measured", "force", "expected", "believed_density"),
        *("weight", "felt", "expected_by_look", "heaviness", "kind", "surprise", "moved", "chosen"),
    )
    further = [name for name in table.rows if name not in (*first, "place", "tool")]
    own = [name for name in lifts if str(name).startswith(OWN_VALUES)]
    return lifts[[*first, *further, *own]]


# Averaged columns with units and titles in tables, and columns for grouping.
AVERAGED = {
    "force": ("N", "force (N)"),
    "expected": ("kg", "expected (kg)"),
    "felt": ("N", "felt (N)"),
    "heaviness": ("N", "heaviness (N)"),
    "moved": ("m", "moved (m)"),
}
BY = ("learner", "group", "phase", "object")


def average(lifts: pd.DataFrame) -> list[dict[str, Any]]:
    """Averages measures over observers or human participants, by learner, group, phase and object.

    Rows are first averaged for each observer. Intervals cover 95 %. Missing measures are left out.
    """
    found = []
    for key, rows in lifts[lifts["measured"]].groupby([*BY], sort=False):
        mean: dict[str, Any] = dict(zip(BY, key, strict=True))
        mean |= {"observers": rows["observer"].nunique(), "rows": len(rows), "weight_N": rows["weight"].mean()}
        for column, (unit, _) in AVERAGED.items():
            of_each = rows.groupby("observer")[column].mean().dropna().to_numpy()
            if len(of_each):
                estimate = estimate_mean(of_each)
                mean[f"{column}_{unit}"] = estimate.mean
                if len(of_each) > 1:  # no interval for a single observer
                    mean[f"{column}_{unit}_ci95"] = estimate.ci95
        if (chosen := rows.loc[rows["do"] == "choose", "chosen"]).size:
            mean["chosen"] = chosen.value_counts(normalize=True, sort=False).to_dict()
        found.append(mean)
    return found


def describe_too_strong(lifts: pd.DataFrame) -> str:
    """Describes simulated pushes that exceed human strength, or returns an empty string if there are none."""
    pushes = lifts[lifts["learner"] != PEOPLE].groupby("object", sort=False)["force"].max()
    strong = [f"{name} up to {push:.0f} N" for name, push in pushes[pushes > STRENGTH].items()]
    if not strong:
        return ""
    return (
        f"Simulated pushes know no limit of a hand, and some exceed {STRENGTH:g} N, which one man in twenty cannot "
        f"exert upward with an outstretched arm: {', '.join(strong)}."
    )


def list_numbers(
    lifts: pd.DataFrame, people_sd: float | None
) -> tuple[dict[str, dict[str, Array]], dict[str, PeopleSpread]]:
    """Lists the mean of each observer by learner, quantity, group, phase and object.

    Args:
        lifts: Table of lifts.
        people_sd: Standard deviation of forces between human participants, [N]; None if unknown.

    Returns: Means, (observers,), by learner and measure, and standard deviations between human participants by
        measure. These come from the table or, for forces, from ``people_sd``.
    """
    values: dict[str, dict[str, Array]] = {}
    spreads: dict[str, PeopleSpread] = {}
    lifts = lifts[lifts["measured"]]
    for column in ("force", "moved"):
        for (learner, *where), rows in lifts[lifts[column].notna()].groupby([*BY], sort=False):
            number = f"{column}_{AVERAGED[column][0]}, {_name_place(where, lifts)}"
            of_each = rows.groupby("observer")[column].mean().to_numpy()
            if learner != PEOPLE:
                values.setdefault(str(learner), {})[number] = of_each
                if people_sd is not None and column == "force":
                    spreads[number] = PeopleSpread(people_sd, "as given")
            elif len(of_each) > 1 and people_sd is None:
                spreads[number] = PeopleSpread(float(of_each.std(ddof=1)), f"{len(of_each)} people of the table")
    return values, spreads


def tabulate_means(means: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    """Formats means as a table of strings, without empty columns and columns with a single group or phase."""
    rows = [
        {
            **{name: str(mean[name]) for name in BY},
            "observers": str(mean["observers"]),
            "weight (N)": format_number(mean["weight_N"]),
            **{title: _show(mean, f"{column}_{unit}") for column, (unit, title) in AVERAGED.items()},
            "chosen": ", ".join(f"{name or 'none'} {share:.0%}" for name, share in mean.get("chosen", {}).items()),
        }
        for mean in means
    ]
    table = pd.DataFrame(rows)
    idle = [name for name in table if not table[name].any() or (name in BY[1:3] and table[name].nunique() == 1)]
    return table.drop(columns=idle).set_index("learner")


def describe_means(means: Sequence[Mapping[str, Any]], width: int = 0) -> str:
    """Formats the table of means as text of at most ``width`` characters per line; 0 for no limit."""
    table = tabulate_means(means).reset_index()
    rows = [[str(name) for name in table], *table.to_numpy(str).tolist()]
    left = [number for number, name in enumerate(table) if name in (*BY, "chosen")]
    return "\n".join(tabulate(rows, [number for number in range(len(rows[0])) if number not in left], width))


def _show(mean: Mapping[str, Any], name: str) -> str:
    if name not in mean or math.isnan(float(mean[name])):
        return ""
    if f"{name}_ci95" not in mean:
        return f"{float(mean[name]):.3f}"
    low, high = mean[f"{name}_ci95"]
    return f"{float(mean[name]):.3f} [{low:.3f}, {high:.3f}]"


def _name_place(where: Sequence[Any], lifts: pd.DataFrame) -> str:
    """Joins the names of group, phase and object. A group or phase is left out if all rows share it."""
    pairs = zip(BY[1:], where, strict=True)
    return ", ".join(str(value) for name, value in pairs if name == "object" or lifts[name].nunique() > 1)
