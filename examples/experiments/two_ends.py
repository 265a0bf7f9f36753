"""Tests which end of a stick of two unknown materials people choose to hold, to reach and to hit.

A participant sees two new colours. One belongs to a material that is eleven times as dense as the other. Participants
can only feel these materials in the two objects of Simulation II, which weigh the same, with their steel far from or
near the hand. After 0, 1, 2 and 6 lifts, the participant points to one end of a novel stick of both materials, once
to reach along a path and once to hit a nail. The stick is never lifted. Nobody has done this experiment yet.

Expected: choices are at chance at first; later the proportion of correct choices depends on the learner.
``read_choices`` reads the answers from a completed data sheet.

    affordance run examples/experiments/two_ends.py

The trial table was frozen before anybody took part. A change of its SHA-256 is an error.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from scipy.special import binom, ndtri

from affordance.arrays import Array
from affordance.belief.learner import Learner
from affordance.belief.learners import list_learners
from affordance.choice.tasks import load_task
from affordance.exceptions import AffordanceError, BadValueError
from affordance.experiments.shared.experiment import Experiment
from affordance.experiments.shared.observer_numbers import ObserverNumbers
from affordance.experiments.shared.observers import Setup
from affordance.experiments.shared.results import Results
from affordance.extensions.people.experiments.frozen_plan import hash_trials
from affordance.extensions.people.experiments.table_lifts import TableExperiment, check_can_be_presented
from affordance.extensions.people.experiments.trial_cells import PEOPLE
from affordance.extensions.people.experiments.trials import TrialTable, check_trials
from affordance.extensions.people.participant import LiftSettings
from affordance.extensions.people.rivals import RIVALS, label_learner
from affordance.files.atomic import write_text
from affordance.objects.colour import parse_colour
from affordance.objects.load import load_tools
from affordance.objects.materials import Material
from affordance.objects.tool import Tool
from affordance.plant.load import load_arm
from affordance.reporting.claims import ClaimResult, check, claim
from affordance.reporting.figures import FONT_SIZE, OBJECT_COLOURS, tidy
from affordance.reporting.statistics import estimate_proportion

PARTICIPANTS = 48  # six for each of the eight orders
COLOURS = {"blue": "#3f7fbf", "orange": "#c06a30"}  # each can be the colour of the dense material
ASKED = (0, 1, 2, 6)  # numbers of lifts after which an end is chosen for both tasks
TASKS = ("reach", "hammer")
SEED = 20261127  # seed of the trial table only
FROZEN = "af41ac041244c904c8506824be9db914c16e57dfe44a3e0b93c849ee0dcc8106"  # SHA-256 of the trial table as CSV
# Columns of the data sheet that the experimenter completes.
FILLED_IN = ("chosen_end", "push_N", "response_time", "remark")  # response_time in seconds, as in BIDS
INSTRUCTIONS = {
    "": "Lift the object as in practice, and put it down.",
    "reach": "Point to the end, left or right, by which you would hold the stick to reach along the path with it.",
    "hammer": "Point to the end, left or right, by which you would hold the stick to hit the nail with it.",
}
ALPHA, POWER = 0.05, 0.8  # significance level and power of one-sided tests
MOST_EXACT = 200  # largest number of participants (per group) for which tests are exact


def build_trials() -> pd.DataFrame:
    """Builds the trial table. Dense colour, first object and first task are balanced, and sides are random."""
    rng, tables = np.random.default_rng(SEED), []
    places = np.concatenate([rng.permutation(8) for _ in range(PARTICIPANTS // 8)])
    for participant, place in enumerate(places, start=1):
        dense, first, task = (
            list(each)[(place >> bit) % 2] for bit, each in enumerate((COLOURS, ("far", "near"), TASKS))
        )
        second = "near" if first == "far" else "far"
        rows: list[tuple[str, str, str, str]] = []
        for lifts in range(ASKED[-1] + 1):
            if lifts in ASKED:
                for number in range(2):
                    asked = TASKS[(TASKS.index(task) + number) % 2]
                    side = ("left", "right")[int(rng.integers(2))]
                    rows.append((f"after {lifts}", f"stick, {dense} dense", asked, side))
            if lifts < ASKED[-1]:
                rows.append(("lifts", f"{(first, second)[lifts % 2]}, {dense} dense", "", ""))
        table = pd.DataFrame(rows, columns=["phase", "object", "task", "dense_end_is"])
        table.insert(0, "participant", f"P{participant:02d}")
        table.insert(1, "group", f"{dense} dense")
        table.insert(4, "do", np.where(table["task"] == "", "lift", "choose"))
        tables.append(table)
    return pd.concat(tables, ignore_index=True)


def build_data_sheet() -> pd.DataFrame:
    """Builds the data sheet: numbered instructions, and empty columns for the experimenter."""
    table = build_trials()
    table.insert(1, "trial", table.groupby("participant").cumcount() + 1)
    table["instruction"] = table["task"].map(INSTRUCTIONS)
    return table.assign(**dict.fromkeys(FILLED_IN, ""))


def make_objects(models: Path) -> list[Tool]:
    """Builds the two objects to lift and the stick, for both colours of the dense material."""
    far, near = load_tools(models / "tools" / "com.yaml")[:2]
    stick = load_tools(models / "tools" / "novel.yaml")[0]
    heaviest = max(part.material.density for part in stick.components)
    tools = []
    for dense in COLOURS:
        (light,) = (each for each in COLOURS if each != dense)
        for name, tool in (("far", far), ("near", near), ("stick", stick)):
            parts = []
            for part in tool.components:
                is_dense = part.material.density == heaviest
                colour = dense if is_dense else light
                material = Material(
                    colour, parse_colour(COLOURS[colour]), part.material.density, source="as it is made"
                )
                parts.append(replace(part, material=material, looks_like=material))
            grips = tuple(replace(grip, name={"steel": "dense", "wood": "light"}[grip.name]) for grip in tool.grips)
            tools.append(replace(tool, name=f"{name}, {dense} dense", components=tuple(parts), grips=grips))
    return tools


def read(setup: Setup) -> TrialTable:
    """Reads the rows of the first participants in the frozen table.

    This checks that the arm can hold all objects.
    """
    trials = build_trials()
    if (found := hash_trials(trials)) != FROZEN:
        raise AffordanceError(f"two_ends: the trial table has SHA-256 {found}, must have {FROZEN}, which is frozen")
    trials = trials[trials["participant"].isin(trials["participant"].unique()[: setup.observers])]
    table = check_trials(trials, make_objects(setup.models), tasks=TASKS, name="two_ends")
    check_can_be_presented(table, setup.settings)
    return table


def collect(setup: Setup) -> pd.DataFrame:
    """Simulates the trials with observers of each learner. Returns choices, with ``right`` for correct choices."""
    arm = load_arm(setup.settings.arm)
    tasks = {task: load_task(setup.models, task, arm) for task in TASKS}
    repeats = max(1, math.ceil(setup.observers / PARTICIPANTS))
    experiment = TableExperiment("two_ends", read(setup), tasks, repeats, tuple(_list_learners(setup)))
    lifts = experiment.collect(setup)
    chosen = lifts[lifts["do"] == "choose"].copy()
    # The stick is easier to move with its mass near the hand, and needs less work to hit with its mass far from it.
    chosen["right"] = chosen["chosen"] == chosen["task"].map({"reach": "dense", "hammer": "light"})
    chosen["lifts"] = chosen["phase"].str.removeprefix("after ").astype(int)
    return chosen


def _list_learners(setup: Setup) -> Sequence[Learner]:
    return [*list_learners(setup.settings.learner), *RIVALS.values()]


def read_choices(path: Path) -> pd.DataFrame:
    """Reads the choices in a completed data sheet, one row per answer, with the columns of simulated choices.

    Rows may be in any order, and participants may be missing. Choices without an answer are omitted. ``observer``
    numbers the participants in the order of the sheet.

    Raises:
        BadValueError: A trial is not registered or was changed, or an answer is neither left nor right.
    """
    registered = build_data_sheet().astype({"trial": str}).set_index(["participant", "trial"])
    sheet = pd.read_csv(path, sep=None, engine="python", dtype=str, keep_default_na=False)
    rows = []
    for number, given in enumerate(sheet.to_dict("records"), start=2):
        key = given["participant"], given["trial"]
        if key not in registered.index:
            raise BadValueError(path, f"row {number}", f"is trial {key[1]} of {key[0]}, which is not registered")
        row, end = registered.loc[key], given["chosen_end"]
        for column in ("group", "phase", "object", "do", "task", "dense_end_is"):
            if given[column] != row[column]:
                problem = f"is {given[column]!r}, must be {row[column]!r}, as it was registered"
                raise BadValueError(path, f"row {number}, {column}", problem)
        if end and (row["do"] != "choose" or end not in ("left", "right")):
            problem = f"is {end!r}, must be left or right for a choice and empty for a lift"
            raise BadValueError(path, f"row {number}, chosen_end", problem)
        if end:
            chosen = "dense" if end == row["dense_end_is"] else "light"
            rows.append((key[0], int(row["phase"].removeprefix("after ")), row["task"], chosen))
    choices = pd.DataFrame(rows, columns=["participant", "lifts", "task", "chosen"])
    choices["right"] = choices["chosen"] == choices["task"].map({"reach": "dense", "hammer": "light"})
    return choices.assign(learner=PEOPLE, observer=pd.factorize(choices["participant"])[0])


def measure(choices: pd.DataFrame) -> pd.DataFrame:
    """Computes the proportions of observers with correct choices in each task, and with both or neither correct."""
    wide = choices.pivot(index=["learner", "observer", "lifts"], columns="task", values="right")
    wide["agree"] = (wide["reach"] == wide["hammer"]).where(wide.notna().all(axis=1))
    rows = []
    for (learner, lifts), own in wide.groupby(["learner", "lifts"], sort=False):
        for name in (*TASKS, "agree"):
            answers = own[name].dropna()
            hits, count = int(answers.sum()), len(answers)
            if not count:
                continue
            share, low, high = (float(each) for each in estimate_proportion(np.array(hits), count))
            rows.append((learner, lifts, name, share, low, high, count))
    return pd.DataFrame(rows, columns=["learner", "lifts", "measure", "share", "low", "high", "observers"])


def count_people(one: float, other: float | None = None) -> float:
    """Computes the number of participants needed to detect a proportion of correct choices.

    Tests are one-sided and exact: the binomial test against chance, or Fisher's test between two groups. If more than
    ``MOST_EXACT`` participants are needed, the normal approximation is used.

    Args:
        one: Proportion of correct choices.
        other: Proportion in another group, for which the number is per group; None to compare with chance.
    """
    low, high = (0.5, max(one, 1.0 - one)) if other is None else sorted((one, other))
    if low == high:
        return math.inf
    for count in range(1, MOST_EXACT + 1):
        hits = np.arange(count + 1)
        of_low, of_high = (binom(count, hits) * p**hits * (1.0 - p) ** (count - hits) for p in (low, high))
        from_chance = np.cumsum(of_low[::-1])[::-1] <= ALPHA
        power = of_high @ (from_chance if other is None else _mark_significant(count) @ of_low)
        if power >= POWER:
            return float(count)
    variances = low * (1.0 - low), high * (1.0 - high)
    mean = 0.5 * (low + high)
    if other is None:
        error = ndtri(1.0 - ALPHA) * math.sqrt(variances[0]) + ndtri(POWER) * math.sqrt(variances[1])
    else:
        error = ndtri(1.0 - ALPHA) * math.sqrt(2.0 * mean * (1.0 - mean)) + ndtri(POWER) * math.sqrt(sum(variances))
    return float(math.ceil((error / (high - low)) ** 2))


@cache
def _mark_significant(count: int) -> Array:
    """Marks the pairs of hits for which Fisher's one-sided test finds more hits in the first group.

    Returns:
        A mask, (count + 1, count + 1).
    """
    first, total = np.arange(count + 1), np.arange(2 * count + 1)[:, None]
    probability = binom(count, first) * binom(count, total - first) / binom(2 * count, total)
    p_value = np.cumsum(probability[:, ::-1], axis=1)[:, ::-1]
    marked: Array = p_value[first[:, None] + first, first[:, None]] <= ALPHA
    return marked


def contrast(shares: pd.DataFrame) -> pd.DataFrame:
    """Compares learners with chance and with each other.

    Contrasts are sorted by the required number of participants.
    """
    rows = []
    for (name, lifts), own in shares[shares["measure"] != "agree"].groupby(["measure", "lifts"], sort=False):
        by_learner = dict(zip(own["learner"], own["share"], strict=True))
        names = list(by_learner)
        for place, one in enumerate(names):
            rows.append((name, lifts, one, "chance", by_learner[one], 0.5, count_people(by_learner[one])))
            for other in names[place + 1 :]:
                pair = by_learner[one], by_learner[other]
                rows.append((name, lifts, one, other, *pair, count_people(*pair)))
    columns = ["measure", "lifts", "one", "other", "share_one", "share_other", "people"]
    return pd.DataFrame(rows, columns=columns).sort_values("people", kind="stable", ignore_index=True)


def judge(shares: pd.DataFrame) -> list[ClaimResult]:
    """Tests the predictions, which data from people may contradict."""

    def get(column: str, lifts: int, *learners: str, task: str | None = None) -> Array:
        is_meant = shares["measure"].isin([task] if task else TASKS) & (shares["lifts"] == lifts)
        found: Array = shares.loc[is_meant & (shares["learner"].isin(learners) | (not learners)), column].to_numpy()
        return found

    by_look, own = ("density", "kinds_drawn", "kinds_map"), "own_memory"
    advantage = get("share", 1, "density", task="reach") - get("share", 1, "density", task="hammer")
    return [
        claim("by_chance", "ours, a prediction", "Before anything is lifted, every learner is at chance.",
              check("lower end of the interval of the share of right choices, 0 lifts", get("low", 0), at_most=0.5),
              check("upper end", get("high", 0), at_least=0.5)),
        claim("by_look", "ours, a prediction",
              "After two lifts, learners with densities by look choose right to reach.",
              check("lower end of the interval of the share of right choices",
                    get("low", 2, *by_look, task="reach"), above=0.5)),
        claim("by_object", "ours, a prediction", "A memory of single objects does not help with the stick.",
              check("lower end of the interval, own memory, after 6 lifts", get("low", 6, own), at_most=0.5),
              check("upper end", get("high", 6, own), at_least=0.5)),
        claim("reach_first", "ours, seen in a run first",
              "After one lift, one density for each colour leads to right choices more often to reach than to hit.",
              check("share of right choices to reach minus that to hit", advantage, above=0.1)),
    ]  # fmt: skip


def run(setup: Setup) -> Results:
    """Runs the experiment."""
    choices = collect(setup)
    shares = measure(choices)
    contrasts = contrast(shares)
    count = min(setup.observers, PARTICIPANTS)
    numbers: dict[str, Any] = {"participants": count, "sha256": FROZEN, "shares": {}}
    for row in shares.itertuples():
        own = numbers["shares"].setdefault(str(row.learner), {}).setdefault(str(row.measure), {})
        own[str(row.lifts)] = [row.share, row.low, row.high]
    finite = contrasts[np.isfinite(contrasts["people"])]
    numbers["contrasts"] = finite.head(50).to_dict("records")
    return Results(
        title="Two ends of a stick that was never lifted",
        summary=(
            f"{count} participants, simulated with each learner, choose an end of a stick of two unknown"
            f" materials to reach and to hit, after {', '.join(map(str, ASKED))} lifts of two other objects."
        ),
        finding="; ".join(_describe(shares)) + ".",
        data=choices,
        numbers=numbers,
        claims=judge(shares),
        figures={
            "shares": ("Share of observers that choose the right end, with 95 % intervals.", partial(draw, shares))
        },
        tables={
            "Shares with 95 % intervals.": tabulate(shares),
            "Participants (per group) that an exact one-sided test needs, .05, power .8.": tabulate_contrasts(
                finite.head(30)
            ),
        },
        files={
            name: partial(_write_table, name, build)
            for name, build in (("trials.csv", build_trials), ("data_sheet.csv", build_data_sheet))
        },
        learners=[*dict.fromkeys(shares["learner"])],
    )


def _write_table(name: str, build: Callable[[], pd.DataFrame], folder: Path) -> None:
    write_text(folder / name, build().to_csv(index=False, lineterminator="\n"))


def predict(setup: Setup) -> ObserverNumbers:
    """Tests if each observer's choices are correct, by task and number of lifts, for every learner."""
    choices, values = collect(setup), dict[str, Mapping[str, Any]]()
    for learner, own in choices.groupby("learner", sort=False):
        wide = own.pivot(index="observer", columns=["task", "lifts"], values="right").astype(float)
        values[str(learner)] = {f"{task}_{lifts}": wide[task, lifts].to_numpy() for task in TASKS for lifts in ASKED}
    meanings = {f"{task}_{lifts}": f"right end to {task} after {lifts} lifts" for task in TASKS for lifts in ASKED}
    return ObserverNumbers(values, meanings)


def tabulate(shares: pd.DataFrame) -> pd.DataFrame:
    """Tabulates proportions with intervals. Rows are learners and measures; columns are numbers of lifts."""
    shown = shares.assign(
        cell=[f"{row.share:.2f} [{row.low:.2f}, {row.high:.2f}]" for row in shares.itertuples()],
        who=[label_learner(str(learner)) for learner in shares["learner"]],
    )
    table = shown.pivot(index=["who", "measure"], columns="lifts", values="cell").reset_index()
    return table.set_index("who").rename(columns={each: f"after {each}" for each in ASKED})


def tabulate_contrasts(contrasts: pd.DataFrame) -> pd.DataFrame:
    """Tabulates differences in the proportion of correct choices, between learners or from chance."""
    titles = {"one": "learner", "other": "compared with", "share_one": "its share", "share_other": "other share"}
    shown = contrasts.assign(
        one=contrasts["one"].map(label_learner),
        other=contrasts["other"].map(label_learner),
        people=contrasts["people"].astype(int),
    )
    return shown.rename(columns=titles).set_index("measure").round(2)


def _describe(shares: pd.DataFrame) -> list[str]:
    last = shares[(shares["measure"] == "reach") & shares["lifts"].isin((1, 2))]
    found = []
    for learner, own in last.groupby("learner", sort=False):
        percent = ", ".join(f"{share:.0%}" for share in own["share"])
        found.append(f"{label_learner(str(learner))}: right to reach in {percent} of cases after 1 and 2 lifts")
    return found


def draw(shares: pd.DataFrame) -> Figure:
    """Plots proportions against the number of lifts, in one panel for each task and one for agreement."""
    figure = Figure(figsize=(10.0, 3.6))
    panels = figure.subplots(1, 3, sharey=True)
    titles = {"reach": "right end to reach", "hammer": "right end to hit", "agree": "both right, or both wrong"}
    for panel, (name, title) in zip(panels, titles.items(), strict=True):
        own = shares[shares["measure"] == name]
        for shift, (learner, rows) in enumerate(own.groupby("learner", sort=False)):
            error = np.maximum(0.0, [rows["share"] - rows["low"], rows["high"] - rows["share"]])
            colour = OBJECT_COLOURS[shift % len(OBJECT_COLOURS)]
            place, name = rows["lifts"] + 0.06 * shift, label_learner(str(learner))
            panel.errorbar(
                place, rows["share"], error, fmt="o-", markersize=3.5, capsize=2.0, color=colour, label=name
            )
        panel.axhline(0.5, color="0.7", linewidth=0.8, label="chance")
        panel.set_xticks(ASKED)
        panel.set_title(title, fontsize=FONT_SIZE)
        panel.set_xlabel("lifts of other objects")
        panel.set_ylim(0.0, 1.02)
        tidy(panel)
    panels[0].set_ylabel("share of participants")
    panels[-1].legend(fontsize=FONT_SIZE - 2, frameon=False, loc="lower right")
    return figure


EXPERIMENT = Experiment(
    run,
    read,
    predict,
    observers=48,
    no_memory="in which participants know neither material",
    every_learner=True,
    settings=LiftSettings,
)
