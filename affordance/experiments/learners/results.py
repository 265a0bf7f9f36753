"""Comparison of the learners in the paper's simulations: numbers, figures and section of the report."""

import json
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from affordance.belief.learner import Learner
from affordance.belief.learners import KAPPA
from affordance.exceptions import BadValueError
from affordance.experiments.learners import decoy_again, honest_objects
from affordance.experiments.learners.decoy_again import HeldObjects
from affordance.experiments.learners.honest_objects import TestedObjects
from affordance.files.atomic import write_json
from affordance.reporting.figures import save_figure
from affordance.reporting.report import write_report, write_section
from affordance.reporting.section import Section, render_section
from affordance.runs.repeats import list_versions

FIGURE, MEMORY = "decoy_again", "memory"
# Index of the observer whose memory is drawn.
_SHOWN = 0
LABELS = {
    Learner.DENSITY: "one density for each colour",
    Learner.KINDS_MAP: "kinds, most probable",
    Learner.KINDS_DRAWN: "kinds, drawn",
}
SECTION = Path(__file__).parents[1] / "sections" / "learners.yaml"


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
    save_figure(decoy_again.draw(weight, arrays, list(LABELS.values())), folder, FIGURE)
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


def add_to_simulation(numbers: Mapping[str, Any], folder: Path) -> bool:
    """Adds the densities of brass to the numbers of Simulation I; returns False if its folder has no numbers.

    Raises:
        BadValueError: The file is damaged.
    """
    path = folder / "metrics.json"
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return False
    except ValueError as error:
        raise BadValueError(path, "", f"is not JSON: {error}") from error
    write_json(path, {**found, "brass_after_decoy": numbers["brass_after_decoy"]})
    return True


def describe(numbers: Mapping[str, Any], repeats: int) -> Section:
    """Says what changes and what does not."""
    return render_section(SECTION, numbers, list_facts(repeats))


def list_facts(repeats: int) -> dict[str, Any]:
    """Returns the facts of the run, as prose and claims name them."""
    return {"repeats": repeats, "num_decoys": decoy_again.NUM_DECOYS, "shown": _SHOWN}
