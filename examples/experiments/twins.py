"""Twins: does a decoy that looks like an honest object take that object's place?

The two objects of Simulation II are held three times each, in turn; then the decoy, which looks like the first and is
made like the second, is held twelve times. Steel is denser than wood; who believes so at the end?

affordance run twins.py --repeats 200
"""

import numpy as np
import pandas as pd

from affordance.belief.density_belief import DENSITY_FLOOR
from affordance.belief.learner import Learner
from affordance.belief.learners import label_learner, list_learners
from affordance.experiments import com
from affordance.experiments.observers import Setup
from affordance.experiments.results import Results
from affordance.runs.random_streams import Stream
from affordance.simulation.static_lifts import StaticLifter

OBSERVERS, EVERY_LEARNER = 50, True
HONEST, DECOY = 3, 12  # holds of each honest object, and of the decoy


def hold(setup: Setup, learner: Learner, decoys: int) -> np.ndarray:
    """Lets observers hold the objects; returns their most probable densities of wood and steel, (observers, 2)."""
    lifter = StaticLifter(com.read(setup), setup.change(learner=learner).settings)
    objects = np.repeat(np.array([0, 1] * HONEST + [2] * decoys)[:, None], setup.observers, axis=1)
    drawn, felt = (
        [(setup.seed, i, stream) for i in range(setup.observers)] for stream in (Stream.KINDS, Stream.LIFT)
    )
    record = lifter.run(objects, lifter.start(drawn), lifter.draw_errors(felt, len(objects)), drawn)
    return learner.believe(record.after.state).compute_mode(DENSITY_FLOOR)


def run(setup: Setup) -> Results:
    """Runs it."""
    rows = []
    for learner in list_learners(setup.settings.learner):
        for decoys in (0, DECOY):
            wood, steel = hold(setup, learner, decoys).T
            rows.append((learner.name, decoys, np.median(wood), np.median(steel), (steel > wood).mean()))
    table = pd.DataFrame(rows, columns=["learner", "decoys", "wood", "steel", "steel_denser"])
    last = table[table["decoys"] == DECOY]
    shares = [f"{row.steel_denser:.2f} ({label_learner(str(row.learner))})" for row in last.itertuples()]
    return Results(
        title="Twins: a decoy that looks like an honest object",
        summary=f"{HONEST} holds of each honest object of Simulation II, then {DECOY} of its decoy, in closed form.",
        finding=f"After {DECOY} holds of the decoy, steel is still believed denser than wood by {', '.join(shares)}.",
        data=table,
        numbers={"beliefs": table.to_dict("records")},
        claims=[],
        tables={"Median of the most probable densities, kg/m³, and share of observers": table.set_index("learner")},
        learners=[*dict.fromkeys(table["learner"])],
    )
