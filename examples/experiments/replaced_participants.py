"""Example of exclusion: observers that have not learned the family are replaced.

affordance run replaced_participants.py --repeats 12
"""

from dataclasses import replace

import pandas as pd

from affordance.belief.learners import KINDS_DRAWN
from affordance.experiments.shared.experiment import Experiment
from affordance.experiments.shared.observers import Setup
from affordance.experiments.shared.results import Results
from affordance.extensions.people.experiments import linear
from affordance.extensions.people.experiments.lifts import run_lifts, summarise_lifts

OBSERVERS, MOST = 12, 100  # number of analysed observers, and largest number of tested observers
LIMIT = 0.02  # largest mean error in the family's third cycle, relative to weight; people need a larger value


def has_learned(lifts: pd.DataFrame) -> bool:
    """Returns True if the forces of one observer or person follow the family's weights in the third cycle."""
    last = lifts[(lifts["block"] == "family") & (lifts["cycle"] == 3)]
    return bool(((last["force"] - last["weight"]).abs() / last["weight"]).mean() <= LIMIT)


def collect(setup: Setup) -> tuple[pd.DataFrame, int]:
    """Simulates observers until enough of them have learned. No observer is simulated twice."""
    tools, tested = linear.make_objects("linear_plus_plus"), setup.observers
    while True:
        more = replace(setup, observers=tested)
        lifts = run_lifts("replaced_participants", more, tools, linear.design, [KINDS_DRAWN])
        passed = [number for number, own in lifts.groupby("observer") if has_learned(own)]
        missing = setup.observers - len(passed)
        if missing <= 0 or tested >= MOST:
            return lifts[lifts["observer"].isin(passed[: setup.observers])], tested
        tested = min(tested + missing, MOST)


def run(setup: Setup) -> Results:
    """Runs the experiment."""
    lifts, tested = collect(setup)
    numbers = {
        **summarise_lifts(lifts, linear.measure, setup),
        "tested": tested,
        "analysed": lifts["observer"].nunique(),
    }
    return Results(
        title="Linear++ with participants replaced",
        summary=f"Observers whose third cycle of the family was off by more than {LIMIT:.0%} were replaced.",
        finding=f"{tested} were tested for {numbers['analysed']}; f = {numbers['f']:.2f}.",
        data=lifts,
        numbers=numbers,
        claims=[],
        lifts=lifts,
        learners=["kinds_drawn"],
    )


EXPERIMENT = Experiment(run)
