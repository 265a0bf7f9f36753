"""Comparison of the learners in the paper's simulations: numbers, figures and section of the report."""

import time
from pathlib import Path
from typing import Any

from affordance.belief.learner import Learner
from affordance.belief.learners import KAPPA
from affordance.runs.repeats import list_versions
from studies.learners import decoy_again, honest_objects
from studies.learners.decoy_again import HeldObjects
from studies.learners.honest_objects import TestedObjects
from studies.study import Findings, write_findings

FIGURE, MEMORY = "decoy_again", "memory"
# Index of the observer whose memory is drawn.
_SHOWN = 0
SECTION = Path(__file__).with_name("section.yaml")


def run(
    weight: HeldObjects, com: TestedObjects, models: Path, folder: Path, *, repeats: int, jobs: int
) -> dict[str, Any]:
    """Runs everything, and writes metrics.json and the figures.

    Args:
        weight: Experiment of Simulation I.
        com: Experiment of Simulation II.
        models: Folder with the tasks of Simulations III and IV.
        folder: Folder for the files; observers that it holds already are not run again.
        repeats: Number of observers of each learner, at least 2.
        jobs: Number of processes.

    Returns: Numbers of metrics.json.
    """
    start = time.perf_counter()
    arrays, numbers = decoy_again.run(weight, folder, repeats=repeats, jobs=jobs)
    numbers["honest"] = honest_objects.run(com, models, folder, repeats=repeats, jobs=jobs)
    numbers.update(
        kappa={learner.value: KAPPA[learner.pick] for learner in Learner if learner.pick is not None},
        seed=weight.seed,
        repeats=repeats,
        versions=list_versions(),
        wall_s=time.perf_counter() - start,
    )
    figures = {
        FIGURE: lambda: decoy_again.draw(weight, arrays, [learner.label for learner in Learner]),
        MEMORY: lambda: decoy_again.draw_memory(weight, _SHOWN),
    }
    write_findings(Findings(numbers, list_facts(repeats), figures), folder, SECTION)
    return numbers


def list_facts(repeats: int) -> dict[str, Any]:
    """Returns the facts of the run, as prose and claims name them."""
    return {"repeats": repeats, "num_decoys": decoy_again.NUM_DECOYS, "shown": _SHOWN}
