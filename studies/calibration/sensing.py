"""Choices of Simulation III with other measurement errors.

The simulation is repeated with other noise structures, to find out how much its results depend on a single
measurement error per trial. Costs and the correct grip do not depend on measurement errors.
"""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from affordance.experiments import reach
from affordance.experiments.shared.experience import gain_experience, recall
from affordance.experiments.shared.grips import (
    choose_before_experience,
    compute_probabilities,
    estimate_probability,
    find_cheaper_grip,
)
from affordance.experiments.shared.observers import Setup
from affordance.named_settings import change_settings
from affordance.objects.tool import list_colours

# Changed settings, by name: noise structures, and large Weber fractions from the literature on force perception with
# hand and arm (studies/robustness/assumptions.yaml).
CHANGES: Mapping[str, Mapping[str, Any]] = {
    "independent_5": {"noise.independent_samples": True, "sample_period": 0.6},
    "independent_30": {"noise.independent_samples": True},
    "white": {"noise.model": "white"},
    "weber_10": {"noise.weber_fraction": 0.10},
    "weber_13": {"noise.weber_fraction": 0.13},
}


def measure(folder: Path, *, repeats: int = 200, jobs: int) -> dict[str, Any]:
    """Simulates and caches observers with each of the changed settings.

    Returns: Probability of the correct choice for the first novel tool at each moment, by key of CHANGES.
    """
    setup = Setup(observers=repeats, jobs=jobs, out=folder)
    held, (tool, *_), task = reach.read(setup)
    choices, motions = reach.plan(setup, [tool], task)
    choice, simulated = choices[tool.name], motions[tool.name]
    correct = list(simulated).index(find_cheaper_grip(simulated))
    before = choose_before_experience(choice, list_colours(held), setup.seed)
    found = {}
    for name, changes in CHANGES.items():
        changed = replace(setup, out=folder / name, settings=change_settings(setup.settings, changes))
        experience = gain_experience(changed, held)
        moments = range(experience.sizes["trial"] + 1)
        right = [
            compute_probabilities(
                choice, [recall(changed, experience, observer, k) for k in moments], (setup.seed, observer)
            )[:, correct]
            for observer in range(repeats)
        ]
        found[name] = estimate_probability(np.array(right), before, correct).mean
    return found
