"""Runs of the experiments with a folder of models, for the study of arms."""

import json
from pathlib import Path
from typing import Any

from affordance.exceptions import AffordanceError
from affordance.experiments.suite import run_suite
from affordance.named_settings import NO_CHANGES, Changes

OK = "ok"
NAMES = ("weight", "com", "reach", "hammer")


def run_program(
    name: str,
    models: Path,
    out: Path,
    *,
    seed: int,
    repeats: int,
    jobs: int,
    changes: Changes = NO_CHANGES,
) -> dict[str, Any] | str:
    """Runs an experiment into a folder; observers that were simulated before are not simulated again.

    Returns: Metrics, with the claims under ``claims``; or the reason why the experiment cannot be run, in one line.
    """
    try:
        run_suite([name], out, models=models, seed=seed, repeats=repeats, jobs=jobs, changes=changes)
    except AffordanceError as error:
        return str(error).replace(f"{models}/", "")
    metrics: dict[str, Any] = json.loads((out / name / "metrics.json").read_text(encoding="utf-8"))
    section: dict[str, Any] = json.loads((out / name / "section.json").read_text(encoding="utf-8"))
    return {**metrics, "claims": {claim["text"]: claim["met"] for claim in section["claims"]}}
