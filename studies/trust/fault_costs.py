"""Cost of every fault in models/faults.yaml for beliefs and for the choices that follow from them.

Observers hold the objects of Simulation II with a fault switched on, and choose a grip of the novel object as in
Simulation III. The correct grip is the one that is correct for an arm without faults. If a fault makes trials 5-sigma
outliers, the fault is run once more with observers that learn nothing from such trials.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from affordance.arrays import about
from affordance.belief.density_belief import DensityBelief
from affordance.belief.material_memory import MaterialMemory
from affordance.choice.inner_simulation import Choice
from affordance.choice.picking import NO_OPTION, pick_cheapest
from affordance.experiments import experience, reach
from affordance.experiments.grips import find_cheaper_grip
from affordance.experiments.observers import Setup, run_observers
from affordance.files.data_model import load_model
from affordance.files.model_folder import MODELS
from affordance.objects.tool import Tool, list_colours, list_densities
from affordance.plant.load import load_arm
from affordance.proprioception.faults import Faults, FaultsFile, load_faults
from studies.random_streams import StudyStream

NUM_OBSERVERS = 50
# Number of densities drawn for each observer; its choices by the paper's rule are averaged over them.
NUM_CHOICES = 200
# Name of the run without a fault.
NO_FAULT = "none"
HEADER = [
    "fault",
    "density error, %",
    "correct after 1 trial",
    "after 6",
    "samples rejected, %",
    "5-sigma outliers, % of trials",
    "beyond a joint's range, mrad",
    "largest velocity, % of limit",
    "largest torque, % of limit",
    "beliefs valid",
]


def hold_objects(setup: Setup, held: Sequence[Tool], observer: int) -> xr.Dataset:
    """Runs an observer's trials; returns beliefs before the first trial and after each, and the fault's effects."""
    limits = load_arm(setup.settings.arm).limits
    _, memories, records = experience.hold(setup, held, observer)
    beyond = [np.maximum(limits.q_lower - each.q, each.q - limits.q_upper).max() for each in records]
    rates = [(np.abs(each.v) / limits.v_max).max() for each in records]
    loads = [(np.abs(each.tau) / limits.tau_max).max() for each in records]
    precision = [memory.belief.precision for memory in memories]
    vector = [memory.belief.information_vector for memory in memories]
    return xr.Dataset(
        {
            "precision": (("moment", "row", "column"), precision, about("m^6/kg^2", "precision of the densities")),
            "information_vector": (("moment", "row"), vector, about("m^3/kg", "information vector of the densities")),
            "rejected": ("trial", [each.samples.rejected for each in records], about("1", "samples rejected")),
            "accepted": ("trial", [each.samples.accepted for each in records], about("1", "samples accepted")),
            "outlier": (
                "trial",
                [each.is_outlier for each in records],
                about("1", "whether it is a 5-sigma outlier"),
            ),
            "violation": ("trial", np.maximum(beyond, 0.0), about("rad", "largest violation of a joint's range")),
            "rate": ("trial", rates, about("1", "largest fraction of a velocity limit")),
            "load": ("trial", loads, about("1", "largest fraction of a torque limit")),
        }
    )


def compute_cost(held: Sequence[Tool], choice: Choice, correct: int, data: xr.Dataset) -> dict[str, Any]:
    """Computes the cost of a fault from the results of all observers with the held objects."""
    colours, densities = list_colours(held), list_densities(held)
    true = np.array([densities[look] for look in colours])
    precision, vector = data.precision.values, data.information_vector.values
    num_observers, num_moments = vector.shape[:2]
    right, medians, valid = np.empty((num_observers, num_moments)), np.empty((num_observers, len(true))), True
    for observer in range(num_observers):
        for moment in range(num_moments):
            belief = DensityBelief(precision[observer, moment], vector[observer, moment])
            rng = np.random.default_rng([observer, moment, StudyStream.FAULT_CHOICES])
            parameters = choice.draw_parameters(MaterialMemory.from_belief(colours, belief), rng, NUM_CHOICES)
            chosen = pick_cheapest(choice.compute_costs(parameters), rng)
            hits = (chosen == correct) + 0.5 * (chosen == NO_OPTION)  # without a usable option the observer guesses
            right[observer, moment] = hits.sum() / NUM_CHOICES
            percentiles = belief.compute_percentiles([0.05, 0.5, 0.95])
            valid &= bool(np.linalg.eigvalsh(belief.precision)[0] > 0.0)
            valid &= bool(np.isfinite(percentiles).all() and (percentiles > 0.0).all())
        medians[observer] = percentiles[1]
    rejected, accepted = (data[name].values for name in ("rejected", "accepted"))
    return {
        "density_error": float(np.median(np.abs(medians / true - 1.0))),
        "p_correct": right.mean(axis=0),
        "samples_rejected": float(rejected.sum() / (rejected + accepted).sum()),
        "trials_outlier": float(data.outlier.values.mean()),
        "violation_rad": float(data["violation"].max()),
        "velocity_of_limit": float(data["rate"].max()),
        "torque_of_limit": float(data["load"].max()),
        "beliefs_valid": valid,
    }


def measure(folder: Path, *, observers: int = NUM_OBSERVERS, jobs: int) -> tuple[list[list[str]], dict[str, Any]]:
    """Runs every fault; returns the rows of a table, and the cost of each fault by its name."""
    setup = Setup(observers=observers, jobs=jobs, out=folder)
    held, (tool, *_), task = reach.read(setup)
    choices, motions = reach.plan(setup, [tool], task)
    choice, simulated = choices[tool.name], motions[tool.name]
    correct = list(simulated).index(find_cheaper_grip(simulated))
    path = MODELS / "faults.yaml"
    joint_names = load_arm(setup.settings.arm).joint_names
    costs: dict[str, dict[str, Any]] = {}

    def run(name: str, faults: Faults, learns_from_outliers: bool = True) -> None:
        faulty = setup.change(faults=faults, learns_from_outliers=learns_from_outliers)
        costs[name] = compute_cost(held, choice, correct, run_observers(name, faulty, hold_objects, tuple(held)))

    run(NO_FAULT, setup.settings.faults)
    for name in load_model(path, FaultsFile).root:
        faults = load_faults(path, [name], joint_names)
        run(name, faults)
        if costs[name]["trials_outlier"] > 0.0:
            run(f"{name}, outliers not learned", faults, learns_from_outliers=False)
    return [_describe(name, cost) for name, cost in costs.items()], costs


def _describe(name: str, cost: Mapping[str, Any]) -> list[str]:
    correct = cost["p_correct"]
    return [
        name,
        f"{100 * cost['density_error']:.1f}",
        f"{correct[1]:.2f}",
        f"{correct[-1]:.2f}",
        f"{100 * cost['samples_rejected']:.1f}",
        f"{100 * cost['trials_outlier']:.1f}",
        f"{1e3 * cost['violation_rad']:.2f}",
        f"{100 * cost['velocity_of_limit']:.0f}",
        f"{100 * cost['torque_of_limit']:.0f}",
        "yes" if cost["beliefs_valid"] else "no",
    ]
