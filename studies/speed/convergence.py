"""Accuracy of the integrator against the height trajectory, with a far tighter reference.

The first trial of experiment ``weight`` (the arm drops) and its last (the decoy rises, with the density believed as
learned) are simulated with controller and loggers in place. The error is the largest difference in the height of the
object's centre, over the three seconds, from the same trial with an explicit integrator of fifth order at 1e-11.
"""

import dataclasses
import time
from collections.abc import Iterator

import numpy as np

from affordance.belief.density_belief import DensityBelief
from affordance.belief.material_memory import MaterialMemory
from affordance.experiments.protocol_runs import load_hold_experiment
from affordance.experiments.shared.presented import PresentationExperiment
from affordance.settings import Integrator, Settings
from affordance.simulation.trial import TrialRunner
from affordance.simulation.trial_record import TrialRecord

HEADER = [
    "integrator",
    "accuracy",
    "largest step (ms)",
    "error, first object (m)",
    "error, decoy (m)",
    "times real time",
]
SCHEMES = ("radau3", "cenic", "implicit_euler", "radau1")
ACCURACIES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7)
# One integrator of first order needs hours where another needs a second; one that takes longer than this is not run
# at tighter accuracy, [s].
PATIENCE = 10.0
# Largest steps of the chosen scheme below the control period, which bounds them all, [s].
MAX_STEPS = (2.5e-3, 1.25e-3, 0.5e-3)


def run_trials(experiment: PresentationExperiment, settings: Settings) -> tuple[list[TrialRecord], float]:
    """Runs the two trials; returns their records and the wall time of both, without building, [s]."""
    runner = TrialRunner(settings)
    unknown = MaterialMemory()
    density = experiment.tools[0].components[0].material.density
    known = MaterialMemory(experiment.colours, DensityBelief(np.array([[1e-4]]), np.array([1e-4 * density])))
    cases = ((experiment.tools[0], unknown), (experiment.tools[-1], known))
    runner.get_diagram(experiment.duration)
    start = time.perf_counter()
    records = [runner.run_hold(tool, memory, duration=experiment.duration, seed=(0,)) for tool, memory in cases]
    return records, time.perf_counter() - start


def measure() -> Iterator[list[str]]:
    """Measures every scheme at every accuracy; yields rows of a table."""
    experiment = load_hold_experiment("weight")
    reference, _ = run_trials(
        experiment,
        dataclasses.replace(experiment.settings, integrator=Integrator(scheme="runge_kutta5", accuracy=1e-11)),
    )
    control_period = experiment.settings.control_period
    cases = [(scheme, accuracy, control_period) for scheme in SCHEMES for accuracy in ACCURACIES]
    cases += [
        (experiment.settings.integrator.scheme, experiment.settings.integrator.accuracy, step) for step in MAX_STEPS
    ]
    given_up: set[str] = set()
    for scheme, accuracy, step in cases:
        if scheme in given_up:
            continue
        settings = dataclasses.replace(
            experiment.settings, integrator=Integrator(scheme=scheme, accuracy=accuracy, max_step=step)
        )
        records, wall = run_trials(experiment, settings)
        errors = [
            np.abs(record.height_centre - true.height_centre).max()
            for record, true in zip(records, reference, strict=True)
        ]
        cells = [f"{1e3 * step:g}", *(f"{error:.1e}" for error in errors), f"{6.0 / wall:.1f}"]
        yield [scheme, f"{accuracy:.0e}", *cells]
        if wall > PATIENCE:
            given_up.add(scheme)
