"""Two families of one look: small dense cylinders, and large light cylinders that weigh less.

This design is ours, and nobody has tested it yet. Expected: with one density per colour, the force stays too high for
large objects and too low for small objects. With kinds, both forces become correct.

    affordance run examples/experiments/two_families.py
"""

import math
from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from affordance.experiments.shared.observer_numbers import PeopleSpread
from affordance.experiments.shared.observers import Setup
from affordance.extensions.people.experiments.lift_figures import draw_forces
from affordance.extensions.people.experiments.lifts import build_lift_experiment, cylinder, repeat
from affordance.extensions.people.rivals import label_learner
from affordance.objects.tool import Tool
from affordance.reporting.claims import ClaimResult, check, claim
from affordance.reporting.formatting import count_observers

RADIUS = 0.0461  # of all cylinders, [m]
SMALL = {"small_60mm": (0.06, 0.9), "small_70mm": (0.07, 1.05)}  # height, [m], and mass, [kg]: 15 kg/m
LARGE = {"large_140mm": (0.14, 0.7), "large_160mm": (0.16, 0.8)}  # 5 kg/m
REPETITIONS = 16  # of lifting each object
SOURCE = (
    "Cesanek and others 2021: SD of Linear+ and Linear++ pooled, by the published intervals, last 16 lifts of one"
    " object"
)
SPREADS = {name: PeopleSpread(1.75, SOURCE) for name in ("small_N", "large_N")}
MEANINGS = {
    "small_weight_N": "mean true weight of the small objects, N",
    "large_weight_N": "mean true weight of the large objects, N",
    "small_N": "mean force for the small objects, last 8 repetitions, N",
    "large_N": "mean force for the large objects, last 8 repetitions, N",
    "illusion": "ratio of force over true weight, large over small objects; 1 if both forces are right",
}


def describe(setup: Setup, lifts: pd.DataFrame, numbers: Mapping[str, Any]) -> dict[str, Any]:
    """Describes the results in texts, claims and figures."""
    ratios = [f"{found['illusion']:.2f} ({label_learner(learner)})" for learner, found in numbers["learners"].items()]
    return {
        "title": "Two families of one look",
        "summary": (
            f"{count_observers(setup.observers)} of each learner lifted two small dense and two large light objects"
            " of one look sixteen times each. Nobody has done this experiment yet."
        ),
        "finding": (
            f"Force over true weight, ratio of large to small objects of the same look: {', '.join(ratios)}; 1 if"
            " both are right."
        ),
        "claims": judge(numbers["learners"]),
        "figures": {
            "small": (
                "Force before each lift of a small object, divided by its true weight.",
                partial(draw_forces, lifts, [*SMALL], title="Small objects, dense: 15 kg per metre of height"),
            ),
            "large": (
                "Force before each lift of a large object, divided by its true weight.",
                partial(draw_forces, lifts, [*LARGE], title="Large objects, light: 5 kg per metre of height"),
            ),
        },
    }


def make_objects() -> list[Tool]:
    """Builds the objects."""
    sizes = {**SMALL, **LARGE}
    tools = [cylinder(name, radius=RADIUS, height=height, mass=mass) for name, (height, mass) in sizes.items()]
    return tools


def list_spreads(means: Mapping[str, float]) -> dict[str, PeopleSpread]:
    """Lists the SDs between people. The SD of the ratio is to first order, for independent forces."""
    shares = [SPREADS[name].sd / means[name] for name in ("small_N", "large_N")]
    ratio = (means["large_N"] / means["large_weight_N"]) / (means["small_N"] / means["small_weight_N"])
    return {**SPREADS, "illusion": PeopleSpread(ratio * math.hypot(*shares), "calculated from the others")}


def design(observer: int, rng: np.random.Generator) -> pd.DataFrame:
    """Draws the trials of one observer: cycles of all objects in random order."""
    return repeat([*SMALL, *LARGE], REPETITIONS, rng, block="all")


def measure(lifts: pd.DataFrame) -> pd.Series:
    """Computes the outcome measures of one observer or person from its lifts in order."""
    small, large = (lifts[lifts["object"].isin(names)].tail(REPETITIONS) for names in (SMALL, LARGE))
    forces = [each["force"].to_numpy().mean() for each in (small, large)]
    weights = [each["weight"].to_numpy().mean() for each in (small, large)]
    return pd.Series(
        {
            "small_weight_N": weights[0],
            "large_weight_N": weights[1],
            "small_N": forces[0],
            "large_N": forces[1],
            "illusion": (forces[1] / weights[1]) / (forces[0] / weights[0]),
        }
    )


def judge(n: Mapping[str, Mapping[str, Any]]) -> list[ClaimResult]:
    """Tests the prediction."""
    ratio = n["density"]["illusion"] / n["kinds_map"]["illusion"]
    return [
        claim("apart", "ours, a prediction",
              "With one density for each colour, the force stays too high for large objects and too low for small "
              "ones; with kinds it does not.",
              check("ratio of large to small, one density for each colour divided by kinds", ratio, at_least=1.5)),
    ]  # fmt: skip


EXPERIMENT = build_lift_experiment(
    "two_families",
    make_objects,
    design,
    measure,
    describe,
    meanings=MEANINGS,
    list_spreads=list_spreads,
    without_interval=["small_weight_N", "large_weight_N"],
)
