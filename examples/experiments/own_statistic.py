"""Example of a statistic with its plot: the slope of force over weight in Linear+, one value per observer.

affordance run own_statistic.py --repeats 12
"""

from functools import partial

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from affordance.experiments.shared.experiment import Experiment
from affordance.experiments.shared.observers import Setup
from affordance.experiments.shared.results import Results
from affordance.extensions.people.experiments import linear
from affordance.extensions.people.experiments.lifts import measure_each, run_lifts, summarise_lifts
from affordance.extensions.people.participant import LiftSettings


def measure(lifts: pd.DataFrame) -> pd.Series:
    """Computes the slope of force over weight in the family's first cycles. It is 1 if all weights are known."""
    family = lifts[(lifts["block"] == "family") & (lifts["cycle"] <= 3)]
    slope, _ = np.polyfit(family["weight"], family["force"], 1)
    return pd.Series({"slope": slope})


def draw(lifts: pd.DataFrame) -> Figure:
    """Plots the slopes of all observers, by learner."""
    figure = Figure(figsize=(6, 3), layout="constrained")
    axes = figure.subplots()
    for row, (learner, found) in enumerate(measure_each(lifts, measure).items()):
        axes.plot(found["slope"], np.full(len(found["slope"]), row), "o", alpha=0.5, label=learner)
    axes.set(xlabel="slope of force over weight", yticks=[])
    axes.legend(frameon=False)
    return figure


def run(setup: Setup) -> Results:
    """Runs the experiment."""
    lifts = run_lifts("own_statistic", setup, linear.make_objects("linear_plus"), linear.design)
    numbers = summarise_lifts(lifts, measure, setup)
    return Results(
        title="Slope of force over weight",
        summary="Linear+ once more.",
        finding=f"The slope over the first three cycles is {numbers['slope']:.2f} with one density.",
        data=lifts,
        numbers=numbers,
        claims=[],
        figures={"slopes": ("Slope of force over weight, one dot for each observer.", partial(draw, lifts))},
        lifts=lifts,
        learners=[*numbers["learners"]],
    )


EXPERIMENT = Experiment(run, observers=12, every_learner=True, settings=LiftSettings)
