"""Tests if the lift after the odd object in Linear++ is harder than the other lifts of the family.

affordance run after_the_odd_one.py --repeats 12
"""

import pandas as pd

from affordance.experiments.shared.experiment import Experiment
from affordance.experiments.shared.observers import Setup
from affordance.experiments.shared.results import Results
from affordance.extensions.people.experiments import linear
from affordance.extensions.people.experiments.lifts import run_lifts, summarise_lifts
from affordance.extensions.people.participant import LiftSettings


def measure(lifts: pd.DataFrame) -> pd.Series:
    """Computes the mean of force minus weight, [N], after the odd object and in other lifts of the family."""
    error = lifts["force"] - lifts["weight"]
    is_odd = lifts["object"] == "test"
    follows = is_odd.shift(fill_value=False) & ~is_odd
    rest = (lifts["block"] == "odd member") & ~is_odd & ~follows
    return pd.Series({"after_N": error[follows].mean(), "rest_N": error[rest].mean()})


def run(setup: Setup) -> Results:
    """Runs the experiment."""
    lifts = run_lifts("after_the_odd_one", setup, linear.make_objects("linear_plus_plus"), linear.design)
    numbers = summarise_lifts(lifts, measure, setup)
    found = numbers["learners"]["density"]
    return Results(
        title="The lift after the odd one",
        summary="Linear++ once more.",
        finding=f"Too strong by {found['after_N']:.2f} N after it, by {found['rest_N']:.2f} N else (one density).",
        data=lifts,
        numbers=numbers,
        claims=[],
        lifts=lifts,
        learners=[*numbers["learners"]],
    )


EXPERIMENT = Experiment(run, observers=12, every_learner=True, settings=LiftSettings)
