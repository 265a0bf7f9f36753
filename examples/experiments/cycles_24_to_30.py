"""Compares the family's lift errors in Linear+ between cycles 24 to 30 and earlier cycles.

affordance run cycles_24_to_30.py --repeats 12
"""

import pandas as pd

from affordance.experiments.shared.experiment import Experiment
from affordance.experiments.shared.observers import Setup
from affordance.experiments.shared.results import Results
from affordance.extensions.people.experiments import linear
from affordance.extensions.people.experiments.lifts import run_lifts, summarise_lifts
from affordance.extensions.people.participant import LiftSettings


def measure(lifts: pd.DataFrame) -> pd.Series:
    """Computes the mean force error in two ranges of cycles, [N]."""
    family = lifts[lifts["block"] == "family"]
    error = (family["force"] - family["weight"]).abs()
    late = family["cycle"].between(24, 30)
    return pd.Series({"early_N": error[family["cycle"] <= 7].mean(), "late_N": error[late].mean()})


def run(setup: Setup) -> Results:
    """Runs the experiment."""
    lifts = run_lifts("cycles_24_to_30", setup, linear.make_objects("linear_plus"), linear.design)
    numbers = summarise_lifts(lifts, measure, setup)
    found = numbers["learners"]["kinds_drawn"]
    return Results(
        title="Cycles 24 to 30 of the family",
        summary="Linear+ once more.",
        finding=f"Off by {found['early_N']:.2f} N in cycles 1 to 7, by {found['late_N']:.2f} N in cycles 24 to 30.",
        data=lifts,
        numbers=numbers,
        claims=[],
        lifts=lifts,
        learners=[*numbers["learners"]],
    )


EXPERIMENT = Experiment(run, observers=12, every_learner=True, settings=LiftSettings)
