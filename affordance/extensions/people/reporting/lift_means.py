"""Means of lifts over observers and people: as numbers, as a table, and for each observer."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd

from affordance.arrays import Array
from affordance.experiments.shared.observer_numbers import PeopleSpread
from affordance.reporting.formatting import format_number, tabulate
from affordance.reporting.statistics import estimate_mean

# Value of the column ``learner`` for people.
PEOPLE = "people"
# Columns that are averaged, with their units and titles in tables; and the columns that form the groups.
AVERAGED = {
    "force": ("N", "force (N)"),
    "expected": ("kg", "expected (kg)"),
    "felt": ("N", "felt (N)"),
    "moved": ("m", "moved (m)"),
}
BY = ("learner", "group", "phase", "object")


def average(lifts: pd.DataFrame) -> list[dict[str, Any]]:
    """Averages the measured rows over observers or people for each learner, group, phase and object.

    Each observer counts once, with the mean of its rows. Intervals are 95 % intervals. Quantities that no row has
    are left out.
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
                if len(of_each) > 1:  # one observer tells nothing of the others
                    mean[f"{column}_{unit}_ci95"] = estimate.ci95
        if (chosen := rows.loc[rows["do"] == "choose", "chosen"]).size:
            mean["chosen"] = chosen.value_counts(normalize=True, sort=False).to_dict()
        found.append(mean)
    return found


def list_numbers(
    lifts: pd.DataFrame, people_sd: float | None
) -> tuple[dict[str, dict[str, Array]], dict[str, PeopleSpread]]:
    """Lists the mean of each observer for each learner and measure (quantity, group, phase and object).

    Returns: Means, (observers,), by learner and measure; and by measure, the standard deviation between the people in
        the table, or for forces the given one, [N].
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
    """Formats means as a table of strings, without columns that are empty or have only one group or phase."""
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
    """Formats the table of means as text, within ``width`` characters unless it is 0."""
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
    """Names group, phase and object, without a group or phase that all rows share."""
    pairs = zip(BY[1:], where, strict=True)
    return ", ".join(str(value) for name, value in pairs if name == "object" or lifts[name].nunique() > 1)
