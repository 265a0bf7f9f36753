"""Comparison of the learners in the paper's simulations: numbers, figures and section of the report."""

import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from affordance.belief.learner import Learner
from affordance.belief.learners import KAPPA
from affordance.files.atomic import write_json
from affordance.reporting.figures import save_figure
from affordance.reporting.report import write_report, write_section
from affordance.reporting.section import Section, render_section
from affordance.runs.repeats import list_versions
from studies.learners import decoy_again, honest_objects
from studies.learners.decoy_again import HeldObjects
from studies.learners.honest_objects import TestedObjects

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
    save_figure(decoy_again.draw(weight, arrays, [learner.label for learner in Learner]), folder, FIGURE)
    save_figure(decoy_again.draw_memory(weight, _SHOWN), folder, MEMORY)
    numbers["honest"] = honest_objects.run(com, models, folder, repeats=repeats, jobs=jobs)
    numbers.update(
        kappa={learner.value: KAPPA[learner.pick] for learner in Learner if learner.pick is not None},
        seed=weight.seed,
        repeats=repeats,
        versions=list_versions(),
        wall_s=time.perf_counter() - start,
    )
    write_section(folder, describe(numbers, repeats))
    write_json(folder / "metrics.json", numbers)  # last: it marks a complete run
    write_report(folder.parent)
    return numbers


def describe(numbers: Mapping[str, Any], repeats: int) -> Section:
    """Says what changes and what does not."""
    return render_section(SECTION, numbers, list_facts(repeats))


def list_facts(repeats: int) -> dict[str, Any]:
    """Returns the facts of the run, as prose and claims name them."""
    return {"repeats": repeats, "num_decoys": decoy_again.NUM_DECOYS, "shown": _SHOWN}
