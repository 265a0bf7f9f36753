"""Choices under other errors of measurement: how much the curve of Simulation III rests on one measurement a trial.

The observers of Simulation III, with settings changed; costs, and so which grip is right, do not depend on them.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from affordance.experiments.runner import run_observers
from affordance.experiments.suite import DEFAULT_REPEATS, load_experiment

# Settings that differ from the default, by name of the key: structures of the errors, and Weber fractions from the
# upper end of those that force felt by hand and arm has in the literature (studies/robustness/assumptions.yaml).
CHANGES: Mapping[str, Mapping[str, Any]] = {
    "independent_5": {"noise.independent_samples": True, "sample_period": 0.6},
    "independent_30": {"noise.independent_samples": True},
    "white": {"noise.model": "white"},
    "weber_10": {"noise.weber_fraction": 0.10},
    "weber_13": {"noise.weber_fraction": 0.13},
}


def measure(folder: Path, *, repeats: int = DEFAULT_REPEATS, jobs: int) -> dict[str, list[float]]:
    """Simulates the observers, kept in a folder, with each change.

    Returns: Proportions of correct choices about the first novel tool at every moment, by key of CHANGES.
    """
    found = {}
    plan = load_experiment("reach").plan(jobs)
    for name, changes in CHANGES.items():
        experiment: Any = load_experiment("reach", changes=changes)
        experience, arrays = run_observers(experiment, plan, folder / name, repeats=repeats, jobs=jobs)
        numbers = experiment.compute_metrics(plan, experience, arrays)
        found[name] = numbers["tools"][experiment.novel[0].name]["p_correct"]
    return found
