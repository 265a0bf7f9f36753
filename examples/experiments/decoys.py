"""Computes beliefs about the apparent material of a decoy that is held many times.

Observers hold each object of Simulation I once, or each object of Simulation II three times. Then they hold the decoy
of this simulation. The second decoy looks exactly like a normal object.

    affordance run decoys.py --repeats 200
"""

from types import ModuleType

import numpy as np
import pandas as pd

from affordance.belief.density_belief import DENSITY_FLOOR
from affordance.belief.learner import Learner
from affordance.belief.learners import list_learners
from affordance.experiments import com, weight
from affordance.experiments.shared.experiment import Experiment
from affordance.experiments.shared.observers import Setup
from affordance.experiments.shared.results import Results
from affordance.extensions.people.rivals import label_learner
from affordance.extensions.people.static_lifts import StaticLifter
from affordance.runs.random_streams import Stream

DECOYS = (0, 1, 2, 6, 12)  # numbers of holds of a decoy


def hold(setup: Setup, learner: Learner, simulation: ModuleType, order: list[int]) -> tuple[np.ndarray, ...]:
    """Simulates the holds of several observers.

    Returns:
        Densities, (observers, colours), [kg/m^3]; force errors, (observers,), [N], and p-values, (observers,), of the
        last hold.
    """
    lifter = StaticLifter(simulation.read(setup), setup.change(learner=learner).settings)
    drawn, felt = (
        [(setup.seed, number, stream) for number in range(setup.observers)] for stream in (Stream.KINDS, Stream.LIFT)
    )
    errors = lifter.draw_errors(felt, len(order))
    record = lifter.run(np.tile(np.array(order)[:, None], setup.observers), lifter.start(drawn), errors, drawn)
    believed = learner.believe(record.after.state).compute_mode(DENSITY_FLOOR)
    return believed, record.force[-1] / record.weight[-1] - 1.0, record.p_value[-1]


def run(setup: Setup) -> Results:
    """Simulates several holds of each decoy with each learner."""
    rows = []
    for learner in list_learners(setup.settings.learner):
        for count in DECOYS:
            brass, error, _ = hold(setup, learner, weight, [0, 1, 2, 3] + [4] * count)
            (wood, steel), _, p = (each.T for each in hold(setup, learner, com, [0, 1] * 3 + [2] * count))
            medians = [float(np.median(each)) for each in (brass, error, wood, steel, p)]
            rows.append((learner.name, count, *medians, float(np.mean(steel > wood))))
    table = pd.DataFrame(rows, columns=["learner", "decoys", "brass", "error", "wood", "steel", "p", "steel_denser"])
    last = [f"{row.steel_denser:.2f} ({label_learner(str(row.learner))})" for row in table[4::5].itertuples()]
    return Results(
        title="Holds of a decoy",
        summary="Medians: densities, kg/m³; error of the force (Simulation I) and p-value (II) in the last hold.",
        finding=f"After 12 holds of the twin, steel is still believed denser than wood by {', '.join(last)}.",
        data=table,
        numbers={"beliefs": table.to_dict("records")},
        claims=[],
        tables={"Beliefs after holds of the decoy.": table.round(3).set_index("learner")},
    )


EXPERIMENT = Experiment(run, observers=50, every_learner=True)
