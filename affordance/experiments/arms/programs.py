"""The experiments as this study uses them: whether one can be run with a folder of models, and what it finds."""

import json
import logging
from pathlib import Path
from typing import Any

from affordance.exceptions import AffordanceError
from affordance.experiments import com, reach, weight
from affordance.experiments.hammer import experiment as hammer
from affordance.experiments.suite import run_suite

OK = "ok"
_PROGRAMS = {module.NAME: module for module in (weight, com, reach, hammer)}
NAMES = tuple(_PROGRAMS)
_LOG = logging.getLogger(__name__)


def find_lack(name: str, models: Path) -> str:
    """Says why an experiment cannot be run with a folder of models, in a line; ``ok`` if it can."""
    try:
        _PROGRAMS[name].load_config(models)
    except AffordanceError as error:
        return str(error).replace(f"{models}/", "")
    return OK


def run_program(name: str, models: Path, out: Path, *, seed: int, repeats: int, jobs: int) -> dict[str, Any] | str:
    """Runs an experiment into a folder; one that was run before is not run again.

    Returns: Its metrics, with its claims under ``claims``; or why it cannot be run.
    """
    try:
        run_suite([name], out, models=models, seed=seed, repeats=repeats, jobs=jobs)
    except AffordanceError as error:
        return str(error).replace(f"{models}/", "")
    metrics: dict[str, Any] = json.loads((out / name / "metrics.json").read_text())
    section: dict[str, Any] = json.loads((out / name / "section.json").read_text())
    return {**metrics, "claims": {claim["text"]: claim["met"] for claim in section["claims"]}}
