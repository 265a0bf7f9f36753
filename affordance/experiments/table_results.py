"""An experiment made of a trial table: means over observers and people, figures, and what tells learners apart."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import pandas as pd

from affordance.arrays import Array
from affordance.belief.learner import Learner
from affordance.choice.inner_simulation import TaskCostModel
from affordance.experiments.observers import Setup
from affordance.experiments.prediction import ObserverNumbers
from affordance.experiments.results import Results
from affordance.experiments.table_lifts import PEOPLE, check_can_be_presented, check_cost, collect
from affordance.experiments.trials import TrialTable
from affordance.reporting.formatting import count_observers, format_number, tabulate
from affordance.reporting.learner_predictions import PeopleSpread
from affordance.reporting.lift_figures import draw_by_object
from affordance.reporting.statistics import estimate_mean

# What is averaged, with its unit and its name in tables; also by which rows a mean is one.
AVERAGED = {
    "force": ("N", "force (N)"),
    "expected": ("kg", "expected (kg)"),
    "felt": ("N", "felt (N)"),
    "moved": ("m", "moved (m)"),
}
BY = ("learner", "group", "phase", "object")


@dataclass(frozen=True)
class TableExperiment:
    """Experiment whose trials are a table.

    Attributes:
        name: Name of its folder in that of the results.
        table: Trials.
        tasks: Tasks for which grips are chosen, by name.
        repeats: Number of observers of each learner for each participant.
        learners: Learners.
        people_sd: Standard deviation of the force between people, [N]; None if it is not known.
    """

    name: str
    table: TrialTable
    tasks: Mapping[str, TaskCostModel] = field(default_factory=dict)
    repeats: int = 1
    learners: tuple[Learner, ...] = tuple(Learner)
    people_sd: float | None = None
    needs: tuple[str, ...] = ()  # of an arm: nothing but to hold the objects, which is checked
    no_memory: str = "in which participants are observers of their own"
    every_learner: bool = True

    @property
    def observers(self) -> int:
        """Number of observers of each learner."""
        return self.repeats * len(self.table.participants)

    def read(self, setup: Setup) -> None:
        """Checks what the trials cost, and that the arm can hold the objects."""
        check_cost(self.table, self.repeats, len(self.learners))
        check_can_be_presented(self.table, setup.settings)

    def collect(self, setup: Setup) -> pd.DataFrame:
        """Lets observers of each learner do the trials."""
        return collect(self.name, setup, self.table, self.tasks, repeats=self.repeats, learners=self.learners)

    def run(self, setup: Setup) -> Results:
        """Runs it."""
        lifts = self.collect(setup)
        means = average(lifts)
        groups, objects = lifts["group"].unique(), lifts["object"].unique()
        figures = {
            column: (
                f"{title}, trial by trial. Thin lines are single observers, bands 95 % intervals of means.",
                partial(draw_by_object, lifts[lifts["measured"]], column, title),
            )
            for column, title in (("force", "force (N)"), ("moved", "movement of the object's centre (m)"))
            if lifts.loc[lifts["measured"], column].notna().any()
        }
        numbers = {
            "means": means,
            "participants": len(self.table.participants),
            "repeats_of_each": self.repeats,
            "trials": len(self.table.rows),
        }
        return Results(
            order=60,
            title=f"Trials of {self.table.source.name}",
            summary=(
                f"{count_observers(self.observers)} of each of {len(self.learners)} learners did the trials of"
                f" {len(self.table.participants)} participants in {len(groups)} groups, with {len(objects)} objects."
            ),
            finding="",
            data=lifts,
            numbers=numbers,
            claims=(),
            figures=figures,
            tables={"Means over observers, with 95 % intervals.": tabulate_means(means)},
            lifts=lifts,
            learners=[each.value for each in self.learners],
        )

    def predict(self, setup: Setup) -> ObserverNumbers:
        """Computes the mean force of each observer of every learner, by group, phase and object."""
        lifts = self.collect(setup)
        lifts = lifts[lifts["measured"]]
        values: dict[str, dict[str, Array]] = {}
        spreads: dict[str, PeopleSpread] = {}
        columns = [each for each in ("force", "moved") if lifts[each].notna().any()]
        for column in columns:
            for (learner, *where), rows in lifts[lifts[column].notna()].groupby([*BY], sort=False):
                number = f"{column}_{AVERAGED[column][0]}, {_name_place(where, lifts)}"
                of_each = rows.groupby("observer")[column].mean().to_numpy()
                if learner == PEOPLE:
                    if len(of_each) > 1:
                        spreads[number] = PeopleSpread(
                            float(of_each.std(ddof=1)), f"{len(of_each)} people of the table"
                        )
                    continue
                values.setdefault(str(learner), {})[number] = of_each
                if self.people_sd is not None and column == "force":
                    spreads.setdefault(number, PeopleSpread(self.people_sd, "--people-sd"))
        return ObserverNumbers(values, {}, lambda means: spreads)


def average(lifts: pd.DataFrame) -> list[dict[str, Any]]:
    """Averages the measured rows over observers or people, by learner, group, phase and object.

    Each observer counts once, with the mean of its rows; intervals are of 95 %. What no row has is left out.
    """
    found = []
    for key, rows in lifts[lifts["measured"]].groupby([*BY], sort=False):
        mean: dict[str, Any] = dict(zip(BY, key, strict=True))
        mean |= {"observers": rows["observer"].nunique(), "rows": len(rows), "weight_N": rows["weight"].mean()}
        for column, (unit, _) in AVERAGED.items():
            of_each = rows.groupby("observer")[column].mean().dropna().to_numpy()
            if len(of_each):
                estimate = estimate_mean(of_each)
                mean |= {f"{column}_{unit}": estimate.mean, f"{column}_{unit}_ci95": estimate.ci95}
        if (chosen := rows.loc[rows["do"] == "choose", "chosen"]).size:
            mean["chosen"] = chosen.value_counts(normalize=True, sort=False).to_dict()
        found.append(mean)
    return found


def tabulate_means(means: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    """Tabulates means as texts; columns that are empty everywhere, or all of one group or phase, are left out."""
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


def describe_means(means: Sequence[Mapping[str, Any]]) -> str:
    """Formats the table of means as text."""
    table = tabulate_means(means).reset_index()
    rows = [[str(name) for name in table], *table.to_numpy(str).tolist()]
    left = [number for number, name in enumerate(table) if name in (*BY, "chosen")]
    return "\n".join(tabulate(rows, right=[number for number in range(len(rows[0])) if number not in left]))


def _show(mean: Mapping[str, Any], name: str) -> str:
    if name not in mean or math.isnan(float(mean[name])):
        return ""
    low, high = mean[f"{name}_ci95"]
    return f"{float(mean[name]):.3f} [{low:.3f}, {high:.3f}]"


def _name_place(where: Sequence[Any], lifts: pd.DataFrame) -> str:
    """Names group, phase and object; a group or phase that all rows have is left out."""
    pairs = zip(BY[1:], where, strict=True)
    return ", ".join(str(value) for name, value in pairs if name == "object" or lifts[name].nunique() > 1)
