"""Tests which learners can learn a family whose weight is linear in volume, with an offset.

Five cylinders of one look weigh .45 kg plus .75 g/cm^3 times volume, so small cylinders are denser than large
cylinders. Learners that use only density make lasting errors: with a single density, small cylinders seem too light
and large cylinders too heavy. A memory of each object makes no lasting errors. Nobody has done this experiment yet.
It is meant to be combined with ``two_ends``.

    affordance run examples/experiments/shallow_family.py
"""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from affordance.belief.learner import Learner
from affordance.belief.learners import list_learners
from affordance.experiments.shared.observers import Setup
from affordance.extensions.people.experiments.lift_figures import draw_forces
from affordance.extensions.people.experiments.lifts import build_lift_experiment, cylinder, repeat
from affordance.extensions.people.rivals import RIVALS, label_learner
from affordance.objects.tool import Tool
from affordance.reporting.formatting import count_observers

RADIUS, HEIGHTS = 0.0461, (0.06, 0.075, 0.09, 0.105, 0.12)  # [m]
INTERCEPT, DENSITY = 0.45, 750.0  # mass at zero volume, [kg], and its increase with volume, [kg/m^3]
CYCLES, LAST = 40, 16  # number of cycles of all objects, and number of final cycles that are averaged
SMALLEST, LARGEST = (f"cylinder_{1000 * each:.0f}mm" for each in (HEIGHTS[0], HEIGHTS[-1]))
MEANINGS = {
    "smallest": "force over weight, minus one, smallest cylinder, last 16 lifts",
    "largest": "force over weight, minus one, largest cylinder, last 16 lifts",
    "slope": "increase of force over increase of weight, from smallest to largest",
}


def describe(setup: Setup, lifts: pd.DataFrame, numbers: Mapping[str, Any]) -> dict[str, Any]:
    """Describes the results in texts, claims and figures."""
    return {
        "title": "A family whose weight grows with size from an offset",
        "summary": (
            f"{count_observers(setup.observers)} of each learner lifted five cylinders of one look, each"
            f" weighing {INTERCEPT:g} kg plus {DENSITY:g} kg/m³ times its volume, {CYCLES} times. Nobody has done"
            " this experiment yet."
        ),
        "finding": "; ".join(_describe(numbers["learners"])) + ".",
        "claims": (),
        "figures": {
            "smallest": (
                "Force before each lift of the smallest cylinder.",
                partial(draw_forces, lifts, [SMALLEST], title="Smallest cylinder of a shallow family"),
            ),
            "largest": (
                "Force before each lift of the largest cylinder.",
                partial(draw_forces, lifts, [LARGEST], title="Largest cylinder of a shallow family"),
            ),
        },
    }


def make_objects() -> list[Tool]:
    """Builds the objects."""
    tools = []
    for height in HEIGHTS:
        mass = INTERCEPT + DENSITY * np.pi * RADIUS**2 * height
        tools.append(cylinder(f"cylinder_{1000 * height:.0f}mm", radius=RADIUS, height=height, mass=float(mass)))
    return tools


def design(observer: int, rng: np.random.Generator) -> pd.DataFrame:
    """Draws the trials of one observer: cycles of all objects in random order."""
    return repeat([f"cylinder_{1000 * each:.0f}mm" for each in HEIGHTS], CYCLES, rng, block="all")


def measure(lifts: pd.DataFrame) -> pd.Series:
    """Computes the outcome measures of one observer or person from its lifts in order."""
    means = {
        name: lifts.loc[lifts["object"] == name, ["force", "weight"]].tail(LAST).mean()
        for name in (SMALLEST, LARGEST)
    }
    small, large = means[SMALLEST], means[LARGEST]
    return pd.Series(
        {
            "smallest": small["force"] / small["weight"] - 1.0,
            "largest": large["force"] / large["weight"] - 1.0,
            "slope": (large["force"] - small["force"]) / (large["weight"] - small["weight"]),
        }
    )


def list_all_learners(setup: Setup) -> Sequence[Learner]:
    """Lists all learners, including the memory of each object, which makes no lasting errors here."""
    return [*list_learners(setup.settings.learner), *RIVALS.values()]


def _describe(n: Mapping[str, Mapping[str, Any]]) -> list[str]:
    return [
        f"{label_learner(name)}: force error {found['smallest']:+z.0%} for the smallest, {found['largest']:+z.0%} for"
        " the largest"
        for name, found in n.items()
    ]


EXPERIMENT = build_lift_experiment(
    "shallow_family",
    make_objects,
    design,
    measure,
    describe,
    meanings=MEANINGS,
    list_learners=list_all_learners,
    observers=48,
)
