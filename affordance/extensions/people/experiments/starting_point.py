"""starting_point: is an odd member of a family lifted with the force for its own weight, or for its family's?

Try it with ``affordance run FILE --repeats 4`` and ``affordance predict FILE``, then change what you like: objects,
trials, numbers, claims, figures.
"""

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from affordance.experiments.shared.observers import Setup
from affordance.extensions.people.experiments.lift_figures import draw_forces
from affordance.extensions.people.experiments.lifts import build_lift_experiment, cylinder, repeat
from affordance.reporting.claims import check, claim

NAME = "starting_point"  # name of the cache folder for finished observers
FAMILY = {"short": 0.06, "middle": 0.09, "long": 0.12}  # heights, [m]
TOOLS = [cylinder(name, radius=0.04, height=height, mass=10.0 * height) for name, height in FAMILY.items()]
TOOLS.append(cylinder("odd", radius=0.04, height=0.105, mass=1.8))  # [m], [kg]; its family predicts 1.05 kg


def design(observer: int, rng: np.random.Generator) -> pd.DataFrame:
    """Draws the trials of one observer. They can depend on the observer's number: ``if observer % 2: ...``."""
    family = repeat([*FAMILY], 10, rng, block="family")
    return pd.concat([family, repeat([*FAMILY, "odd"], 10, rng, block="odd member", first=["odd"])])


def measure(lifts: pd.DataFrame) -> pd.Series:
    """Computes the measures of one observer or participant from its lifts."""
    odd = lifts[lifts["object"] == "odd"]
    return pd.Series({"first_N": odd["force"].iloc[0], "last_N": odd["force"].tail(3).mean()})


def describe(setup: Setup, lifts: pd.DataFrame, numbers: Mapping[str, Any]) -> dict[str, Any]:
    """Describes the results with texts, claims and figures."""
    first = {learner: found["first_N"] for learner, found in numbers["learners"].items()}
    text = "In its first lift, the odd object is lifted with the force that its family predicts."
    bounds = [
        check(f"first lift, {learner} (N)", force, at_least=9.0, at_most=11.5) for learner, force in first.items()
    ]
    return {
        "title": "My experiment",
        "summary": "Three objects of one look were lifted ten times each, then ten times more with an odd one.",
        "finding": f"The odd object weighs 17.7 N, and is first lifted with {first['density']:.1f} N.",
        "claims": [claim("first_lift", "ours", text, *bounds)],
        "figures": {
            "odd": ("Force before each lift.", partial(draw_forces, lifts, ["odd"], title="The odd object")),
        },
    }


MEANINGS = {"first_N": "force in the first lift of the odd object, N", "last_N": "mean of its last 3 lifts, N"}
EXPERIMENT = build_lift_experiment(NAME, lambda: TOOLS, design, measure, describe, meanings=MEANINGS, observers=20)
