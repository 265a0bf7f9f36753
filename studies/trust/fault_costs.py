"""Cost of every fault of models/faults.yaml, in beliefs and in the choices that follow from them.

Observers hold the objects of Simulation II with a fault switched on, and choose a grip of the novel object as in
Simulation III. The correct grip is that of the arm without a fault. If trials were 5-sigma outliers, the fault is run
once more with observers who learn nothing from such trials.
"""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from affordance.belief.density_belief import DensityBelief
from affordance.belief.material_memory import MaterialMemory
from affordance.choice.inner_simulation import Choice
from affordance.choice.picking import pick_cheapest
from affordance.experiments.protocol_runs import load_choice_experiment
from affordance.experiments.shared.decisions import count_correct, find_cheaper_grip
from affordance.experiments.shared.experience import ExperienceConfig
from affordance.experiments.shared.gain_experience import run_trials
from affordance.files.data_model import load_model
from affordance.files.model_folder import MODELS
from affordance.objects.tool import list_densities
from affordance.plant.load import load_arm
from affordance.proprioception.faults import Faults, FaultsFile, load_faults
from studies.random_streams import StudyStream
from studies.study import run_kept

NUM_OBSERVERS = 50
# Number of densities drawn for each observer, over which choices by the paper's rule are averaged.
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
    "of a velocity limit, %",
    "of a torque limit, %",
    "beliefs valid",
]


def hold_objects(config: ExperienceConfig, repeat: int) -> dict[str, NDArray[Any]]:
    """Runs an observer's trials, and returns beliefs and the quantities that a fault may affect.

    Returns: ``precision`` (K + 1, M, M) and ``information_vector`` (K + 1, M); and over K trials, (K,) each, samples
        ``rejected`` and ``accepted``, ``outlier``, ``violation`` of a joint's range, [rad], and ``rate`` and
        ``load``, the largest fractions of a limit of velocity and of torque.
    """
    limits = load_arm(config.settings.arm).limits
    memories, records = run_trials(config, repeat)
    beyond = [np.maximum(limits.q_lower - record.q, record.q - limits.q_upper).max() for record in records]
    return {
        "precision": np.stack([memory.belief.precision for memory in memories]),
        "information_vector": np.stack([memory.belief.information_vector for memory in memories]),
        "rejected": np.array([record.samples.rejected for record in records]),
        "accepted": np.array([record.samples.accepted for record in records]),
        "outlier": np.array([record.is_outlier for record in records]),
        "violation": np.maximum(beyond, 0.0),
        "rate": np.array([(np.abs(record.v) / limits.v_max).max() for record in records]),
        "load": np.array([(np.abs(record.tau) / limits.tau_max).max() for record in records]),
    }


def compute_cost(
    config: ExperienceConfig, choice: Choice, correct: int, arrays: Mapping[str, NDArray[Any]]
) -> dict[str, Any]:
    """Computes the cost of a fault from the arrays of all observers."""
    colours = config.colours
    densities = list_densities(config.tools)
    true = np.array([densities[look] for look in colours])
    num_observers, num_moments = arrays["information_vector"].shape[:2]
    right, medians, valid = np.empty((num_observers, num_moments)), np.empty((num_observers, len(true))), True
    for repeat in range(num_observers):
        for moment in range(num_moments):
            belief = DensityBelief(arrays["precision"][repeat, moment], arrays["information_vector"][repeat, moment])
            rng = np.random.default_rng([repeat, moment, StudyStream.FAULT_CHOICES])
            parameters = choice.draw_parameters(MaterialMemory(colours, belief), rng, NUM_CHOICES)
            chosen = pick_cheapest(choice.compute_costs(parameters), rng)
            right[repeat, moment] = count_correct(chosen, correct) / NUM_CHOICES
            percentiles = belief.compute_percentiles([0.05, 0.5, 0.95])
            valid &= bool(np.linalg.eigvalsh(belief.precision)[0] > 0.0)
            valid &= bool(np.isfinite(percentiles).all() and (percentiles > 0.0).all())
        medians[repeat] = percentiles[1]
    return {
        "density_error": float(np.median(np.abs(medians / true - 1.0))),
        "p_correct": right.mean(axis=0),
        "samples_rejected": float(arrays["rejected"].sum() / (arrays["rejected"] + arrays["accepted"]).sum()),
        "trials_outlier": float(arrays["outlier"].mean()),
        "violation_rad": float(arrays["violation"].max()),
        "velocity_of_limit": float(arrays["rate"].max()),
        "torque_of_limit": float(arrays["load"].max()),
        "beliefs_valid": valid,
    }


def measure(folder: Path, *, observers: int = NUM_OBSERVERS, jobs: int) -> tuple[list[list[str]], dict[str, Any]]:
    """Runs every fault; returns rows of a table, and the cost of each by name."""
    experiment = load_choice_experiment("reach")
    first, config = experiment.novel[0], experiment.experience
    plan = experiment.plan(jobs)
    choice, simulated = plan.choices[first.name], plan.simulated[first.name]
    correct = list(simulated).index(find_cheaper_grip(simulated))
    path = MODELS / "faults.yaml"
    joint_names = load_arm(config.settings.arm).joint_names
    costs: dict[str, dict[str, Any]] = {}

    def run(name: str, faults: Faults, learns_from_outliers: bool = True) -> None:
        settings = replace(config.settings, faults=faults, learns_from_outliers=learns_from_outliers)
        faulty = replace(config, settings=settings)
        arrays = run_kept(faulty, hold_objects, folder, MODELS, repeats=observers, jobs=jobs, description=name)
        costs[name] = compute_cost(faulty, choice, correct, arrays)

    run(NO_FAULT, config.settings.faults)
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
