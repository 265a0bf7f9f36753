"""Experiments Linear+ and Linear++ (Cesanek, Zhang, Ingram, Wolpert and Flanagan 2021, eLife 10:e71627).

Observers first lift a family of cylinders that look alike and whose weight is proportional to their size. Then a test
object of intermediate size is added. It weighs a third (Linear+) or two thirds (Linear++) more than its size
predicts. Before each lift the object is clamped, and the hand pushes upward to match the weight. In humans, the force
for the test object stays at the prediction from the family in Linear+, and covers two thirds of the difference to the
true weight in Linear++. Kappa, the breadth of a category, was fitted to these two groups.
"""

import math
from collections.abc import Mapping
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import scipy  # not scipy.stats, which takes half a second to import: it is imported on first use

from affordance.experiments.shared.observer_numbers import PeopleSpread
from affordance.experiments.shared.observers import Setup
from affordance.extensions.people.experiments.lift_figures import PeopleMark, draw_forces, predict_by_size
from affordance.extensions.people.experiments.lifts import build_lift_experiment, cylinder, repeat
from affordance.extensions.people.rivals import label_learner
from affordance.objects.tool import Tool
from affordance.reporting.claims import ClaimResult, check, claim
from affordance.reporting.formatting import count_observers
from affordance.reporting.statistics import CONFIDENCE

TRAINING = {
    "training_60mm": 0.06,
    "training_75mm": 0.075,
    "training_105mm": 0.105,
    "training_120mm": 0.12,
}  # heights, [m]
RADIUS, HEIGHT = 0.0461, 0.09  # radius of all cylinders, and height of the test object, [m]
DENSITY = 10.0  # mass per height of the family, [kg/m]
PREDICTED = 8.826  # weight predicted from the size of the test object, [N]
FAMILIAR, MIXED = 30, 40  # number of cycles with the training objects, and with all five objects
SOURCE = "Cesanek and others 2021"
MEANINGS = {
    "weight_N": "true weight of the test object, N",
    "first_N": "force in the first lift of the test object, N",
    "end_N": "mean force in the last 16 lifts of the test object, N",
    "family_N": "force predicted by the family at the end, N",
    "f": "learned fraction: 0 as the family predicts, 1 as the test object weighs",
    "training_correlation": "correlation of force and weight over the training lifts",
}


class Published(NamedTuple):
    """Published human mean with 95 % interval, in SI units. The interval is NaN if unpublished."""

    value: float
    low: float = math.nan
    high: float = math.nan


class Group(NamedTuple):
    """Group of human participants with their test object and published results."""

    name: str  # name in the paper
    mass: float  # mass of the test object, [kg]
    more: str  # relative difference between true and predicted weight, in words
    num_people: int
    people: Mapping[str, Published]


GROUPS = {
    "linear_plus": Group(
        "Linear+", 1.2, "a third", 14,
        {"weight_N": Published(11.77), "first_N": Published(9.00, 7.68, 10.32), "end_N": Published(9.15, 8.27, 10.03),
         "family_N": Published(9.09, 8.64, 9.54), "training_correlation": Published(0.76, 0.66, 0.83)},
    ),
    "linear_plus_plus": Group(
        "Linear++", 1.5, "two thirds", 9,
        {"weight_N": Published(14.72), "first_N": Published(8.13, 7.19, 9.08),
         "end_N": Published(13.15, 11.56, 14.74), "family_N": Published(9.65, 8.62, 10.68),
         "training_correlation": Published(0.85, 0.72, 0.92)},
    ),
}  # fmt: skip


def describe(name: str, setup: Setup, lifts: pd.DataFrame, numbers: dict[str, Any]) -> dict[str, Any]:
    """Describes the results of one group with texts, claims, figure and table, and compares them with human data."""
    group = GROUPS[name]
    people = list_people(group)
    numbers["people"] = describe_people(people)
    learned = [f"{found['f']:z.0%} by {label_learner(learner)}" for learner, found in numbers["learners"].items()]
    marks = [
        PeopleMark(MEANINGS["first_N"], *people["first_N"], 1, 1),
        PeopleMark(MEANINGS["end_N"], *people["end_N"], MIXED - 15, MIXED),
        PeopleMark(MEANINGS["family_N"], *people["family_N"], MIXED + 1, MIXED + 1),
    ]
    title = f"{group.name}: the test object weighs {group.mass:g} kg, its family predicts {DENSITY * HEIGHT:g} kg"
    return {
        "order": 40 if name == "linear_plus" else 41,
        "title": f"{group.name}: an odd member of a family ({SOURCE})",
        "summary": (
            f"{count_observers(setup.observers)} of each learner lifted four objects of one look {FAMILIAR} times"
            f" each, then a test object of {group.mass:g} kg, whose size predicts {DENSITY * HEIGHT:g} kg, {MIXED}"
            " times among them. The force is exerted against a stiff clamp before release. Kappa, the breadth of a"
            " category, was fitted to this group and the other one; nothing else was fitted."
        ),
        "finding": (
            "Learned share of the difference between the weight of the test object and what its family predicts: "
            f"{', '.join(learned)}."
        ),
        "claims": judge(numbers["learners"], people),
        "figures": {
            "test_object": (
                (
                    "Force before each lift of the test object. Thin lines are single observers; black marks are"
                    " people's means with 95 % intervals."
                ),
                partial(draw_forces, lifts, ["test"], title=title, predicted_by=[*TRAINING], people=marks),
            )
        },
        "tables": {"Means over observers and people, with 95 % intervals.": tabulate(numbers)},
        "remarks": [
            "The interval of people's f follows from the published intervals of its two forces, as if independent.",
            (
                "Observers differ in their sensory noise and in their random draws; people also differ in how hard"
                " they push. The score that people saw after each lift is not modelled; feeling the weight takes its"
                " place."
            ),
        ],
    }


def make_objects(name: str) -> list[Tool]:
    """Creates the objects of a group."""
    tools = [cylinder(each, radius=RADIUS, height=height, mass=DENSITY * height) for each, height in TRAINING.items()]
    tools.append(cylinder("test", radius=RADIUS, height=HEIGHT, mass=GROUPS[name].mass))
    return tools


def design(observer: int, rng: np.random.Generator) -> pd.DataFrame:
    """Draws the trials of one observer: first only the family, then cycles of the test object and the family."""
    family = repeat([*TRAINING], FAMILIAR, rng, block="family")
    mixed = repeat([*TRAINING, "test"], MIXED, rng, block="odd member", first=["test"])
    return pd.concat([family, mixed])


def measure(lifts: pd.DataFrame) -> pd.Series:
    """Computes the measures of one observer or participant from its lifts."""
    test, family = lifts[lifts["object"] == "test"], lifts[lifts["object"] != "test"]
    weight, end = test["weight"].iloc[0], test["force"].tail(16).to_numpy().mean()
    by_family = predict_by_size(family.tail(64), test["size"].iloc[0])  # last 16 cycles
    early = family.head(120)  # before the first test object
    return pd.Series(
        {
            "weight_N": weight,
            "first_N": test["force"].iloc[0],
            "end_N": end,
            "family_N": by_family,
            "f": (end - by_family) / (weight - by_family),
            "training_correlation": np.corrcoef(early["force"], early["weight"])[0, 1],
        }
    )


def list_people(group: Group) -> dict[str, Published]:
    """Lists human measures. The interval of f is propagated from two forces, assuming independence."""
    people = dict(group.people)
    weight, end, family = people["weight_N"].value, people["end_N"], people["family_N"]
    f = (end.value - family.value) / (weight - family.value)
    by_end = (end.high - end.low) / (weight - family.value)
    by_family = (family.high - family.low) * (end.value - weight) / (weight - family.value) ** 2
    half = 0.5 * math.hypot(by_end, by_family)
    people["f"] = Published(f, f - half, f + half)
    return {name: people[name] for name in MEANINGS}


def describe_people(people: Mapping[str, Published]) -> dict[str, Any]:
    """Returns human means as NAME and published intervals as NAME_ci95, with names as in metrics.json."""
    numbers: dict[str, Any] = {}
    for name, each in people.items():
        numbers[name] = each.value
        if math.isfinite(each.low):
            numbers[f"{name}_ci95"] = [each.low, each.high]
    return numbers


def find_spread(published: Published, count: int, source: str) -> PeopleSpread:
    """Computes the SD between participants from the confidence interval of their mean (Student's t)."""
    quantile = float(scipy.stats.t.ppf(0.5 + CONFIDENCE / 2.0, count - 1.0))
    return PeopleSpread(0.5 * (published.high - published.low) * math.sqrt(count) / quantile, source)


def judge(n: Mapping[str, Mapping[str, Any]], people: Mapping[str, Published]) -> list[ClaimResult]:
    """Tests which learners reproduce the human results."""
    first = [
        check(f"first force divided by the force that the size predicts, {label_learner(learner)}",
              found["first_N"] / PREDICTED, at_least=0.85, at_most=1.15)
        for learner, found in n.items()
    ]  # fmt: skip
    f = people["f"]
    return [
        claim("first_lift", SOURCE,
              "With each learner, the first force for the test object is what its family predicts.", *first),
        claim("fraction", f"{SOURCE}; kappa was fitted to it",
              "Observers with drawn kinds learn the same fraction of the test object's own weight as people.",
              check("learned fraction, drawn kinds", n["kinds_drawn"]["f"], at_least=f.low, at_most=f.high)),
    ]  # fmt: skip


def tabulate(numbers: Mapping[str, Any]) -> pd.DataFrame:
    """Tabulates forces and learned fractions of all learners and of humans."""
    columns = {
        "first_N": "first lift (N)",
        "end_N": "end (N)",
        "family_N": "predicted by the family (N)",
        "f": "learned fraction f",
    }
    who = {label_learner(learner): found for learner, found in numbers["learners"].items()}
    rows = {
        name: {
            title: f"{found[key]:z.2f} [{found[f'{key}_ci95'][0]:z.2f}, {found[f'{key}_ci95'][1]:z.2f}]"
            for key, title in columns.items()
        }
        for name, found in {**who, "people": numbers["people"]}.items()
    }
    return pd.DataFrame.from_dict(rows, orient="index").rename_axis("who")


def list_spreads(name: str, means: Mapping[str, float]) -> dict[str, PeopleSpread]:
    """Lists SDs between participants that follow from published intervals."""
    group = GROUPS[name]
    known = {key: each for key, each in list_people(group).items() if math.isfinite(each.low)}
    return {key: find_spread(each, group.num_people, f"{SOURCE}, {group.name}") for key, each in known.items()}


LINEAR_PLUS, LINEAR_PLUS_PLUS = (
    build_lift_experiment(
        name,
        partial(make_objects, name),
        design,
        measure,
        partial(describe, name),
        meanings=MEANINGS,
        list_spreads=partial(list_spreads, name),
        without_interval=["weight_N"],
    )
    for name in GROUPS
)
