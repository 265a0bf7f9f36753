"""Tests if one odd member spoils a family. This design is ours and has not been tested with people.

Four cylinders of one look become familiar. Then an odd object of the same look is lifted six times in a row. Its size
is between theirs, but it weighs a third of the mass predicted from its size. Then the family is lifted again.

Expected: with one density per colour, observers lift the whole family as if it had become lighter. With kinds, they
lift the odd object correctly from its second lift on, and the family as before. The design was made before any result
was seen. Of three such designs, this design and ``two_families`` were kept, because learners differed most in them.

    affordance run examples/experiments/spoilt_family.py
"""

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

FAMILY = {"family_60mm": 0.06, "family_75mm": 0.075, "family_105mm": 0.105, "family_120mm": 0.12}  # heights, [m]
RADIUS, DENSITY = 0.0461, 10.0  # radius of all cylinders, [m], and mass of the family by height, [kg/m]
ODD_HEIGHT, ODD_MASS = 0.09, 0.3  # height, [m], and mass, [kg], of the odd object, for which its size predicts 0.9 kg
SOURCE = "Cesanek and others 2021: SD of Linear+ and Linear++ pooled, by the published intervals"
SPREADS = {
    "odd_first_N": PeopleSpread(1.95, f"{SOURCE}, first lift of one object"),
    "odd_last_N": PeopleSpread(1.75, f"{SOURCE}, last 16 lifts of one object"),
    "family_before_N": PeopleSpread(1.03, f"{SOURCE}, familiar objects, 64 lifts"),
    "family_after_N": PeopleSpread(1.75, f"{SOURCE}, last 16 lifts of one object"),
}
MEANINGS = {
    "odd_weight_N": "true weight of the odd object, N",
    "odd_first_N": "force in the first lift of the odd object, N",
    "odd_last_N": "mean force in the second to sixth lift of the odd object, N",
    "family_before_N": "mean force for the family before the odd object, N",
    "family_after_N": "mean force for the family after it, N",
    "family_weight_N": "mean true weight of the family, N",
    "spoilt": "share of its weight by which the force for the family is too low afterwards",
}


def describe(setup: Setup, lifts: pd.DataFrame, numbers: Mapping[str, Any]) -> dict[str, Any]:
    """Describes the results in texts, claims and figures."""
    shares = [f"{found['spoilt']:.0%} ({label_learner(learner)})" for learner, found in numbers["learners"].items()]
    return {
        "title": "Does one odd member spoil a family?",
        "summary": (
            f"{count_observers(setup.observers)} of each learner lifted four objects of one look ten times each, then"
            " six times an odd one that weighs a third of what its size predicts, then the four once more. Nobody has"
            " done this experiment yet."
        ),
        "finding": (
            "After the light odd object, the force for its family is too low by this share of its weight: "
            f"{', '.join(shares)}."
        ),
        "claims": judge(numbers["learners"]),
        "figures": {
            "odd": (
                "Force before each lift of the odd object.",
                partial(
                    draw_forces, lifts, ["odd"], title="Six lifts of an odd object, a third as heavy as it looks"
                ),
            ),
            "family": (
                "Force before each lift of a family member, divided by its true weight.",
                partial(
                    draw_forces,
                    lifts,
                    [*FAMILY],
                    title="The rest of the family; the last four lifts come after the odd object",
                ),
            ),
        },
    }


def make_objects() -> list[Tool]:
    """Builds the objects."""
    tools = [cylinder(name, radius=RADIUS, height=height, mass=DENSITY * height) for name, height in FAMILY.items()]
    tools.append(cylinder("odd", radius=RADIUS, height=ODD_HEIGHT, mass=ODD_MASS))
    return tools


def list_spreads(means: Mapping[str, float]) -> dict[str, PeopleSpread]:
    """Lists the SDs between people. The SD of the relative deficit is computed from the SD of the force."""
    share = SPREADS["family_after_N"].sd / means["family_weight_N"]
    return {**SPREADS, "spoilt": PeopleSpread(share, "calculated from the others")}


def design(observer: int, rng: np.random.Generator) -> pd.DataFrame:
    """Draws the trials of one observer: the family, six lifts of the odd object, and the family again."""
    return pd.concat(
        [
            repeat([*FAMILY], 10, rng, block="family"),
            repeat(["odd"], 1, rng, block="odd member", times=6),
            repeat([*FAMILY], 1, rng, block="family again", order="latin square", row=observer),
        ]
    )


def measure(lifts: pd.DataFrame) -> pd.Series:
    """Computes the outcome measures of one observer or person from its lifts in order."""
    odd, family = lifts[lifts["object"] == "odd"], lifts[lifts["object"] != "odd"]
    after, weight = family["force"].tail(4).to_numpy().mean(), family["weight"].tail(4).to_numpy().mean()
    return pd.Series(
        {
            "odd_weight_N": odd["weight"].iloc[0],
            "odd_first_N": odd["force"].iloc[0],
            "odd_last_N": odd["force"].tail(5).to_numpy().mean(),
            "family_before_N": family["force"].head(40).to_numpy().mean(),
            "family_after_N": after,
            "family_weight_N": weight,
            "spoilt": 1.0 - after / weight,
        }
    )


def judge(n: Mapping[str, Mapping[str, Any]]) -> list[ClaimResult]:
    """Tests the prediction."""
    difference = n["density"]["spoilt"] - n["kinds_map"]["spoilt"]
    return [
        claim("apart", "ours, a prediction", "Learners differ in the force for the family after the odd object.",
              check("missing fraction of the force, one density for each colour minus kinds",
                    difference, at_least=0.2)),
    ]  # fmt: skip


EXPERIMENT = build_lift_experiment(
    "spoilt_family",
    make_objects,
    design,
    measure,
    describe,
    meanings=MEANINGS,
    list_spreads=list_spreads,
    without_interval=["odd_weight_N", "family_weight_N"],
)
