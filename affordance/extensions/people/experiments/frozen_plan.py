"""Plan of an experiment that is frozen for preregistration.

A plan is a JSON file with the learner, its settings, contrasts, claims, the number of participants, and SHA-256
hashes of the trial table, of the tools file, and of the plan itself. The hashes detect later changes.
"""

import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from affordance.belief.learner import Learner
from affordance.exceptions import BadValueError
from affordance.extensions.people.experiments.trial_cells import LARGEST
from affordance.extensions.people.experiments.trials import TrialTable
from affordance.files.atomic import to_plain
from affordance.files.bounded import read_bytes, read_json
from affordance.version import __version__

# Key of the hash of the plan itself.
_OWN = "sha256"


def hash_trials(table: pd.DataFrame) -> str:
    """Computes the SHA-256 hash of a trial table, formatted as CSV with line feeds."""
    return hashlib.sha256(table.to_csv(index=False, lineterminator="\n").encode()).hexdigest()


def hash_file(path: Path) -> str:
    """Computes the SHA-256 hash of a file."""
    return hashlib.sha256(read_bytes(path, LARGEST)).hexdigest()


def describe_plan(
    table: TrialTable,
    objects: Path,
    learner: Learner,
    settings: Mapping[str, Any],
    contrasts: Sequence[str],
    claims: Sequence[str],
) -> dict[str, Any]:
    """Builds the JSON content of a plan, including all hashes.

    Args:
        table: Trial table.
        objects: Tools file with the objects of the table.
        learner: Learner whose predictions are registered, including its parameters.
        settings: Changed settings, by name.
        contrasts: Planned contrasts.
        claims: Claims in words.
    """
    people = table.rows.drop_duplicates("participant")
    plan = {
        "table": {"file": table.source.name, "sha256": hash_file(table.source), "trials": len(table.rows)},
        "objects": {"file": objects.name, "sha256": hash_file(objects)},
        "participants": people.groupby("group", sort=False).size().to_dict(),
        "learner": {"name": learner.name, "parameters": learner.parameters},
        "settings": dict(settings),
        "contrasts": list(contrasts),
        "claims": list(claims),
        "affordance": __version__,
    }
    plain: dict[str, Any] = to_plain(plan)
    return {**plain, _OWN: _hash(plain)}


def check_plan(path: Path, trials: Path, objects: Path | None) -> dict[str, Any]:
    """Checks that the files of a plan are unchanged, and returns the plan.

    Args:
        path: File of the plan.
        trials: Trial table.
        objects: Tools file; None for the file that is named in the plan, in the folder of the table.

    Raises:
        BadValueError: The file is not a plan, or the plan, table or tools file was changed.
    """
    plan = read_json(path)
    parts = ("table", "objects")
    if not isinstance(plan, dict) or not all(isinstance(plan.get(each), dict) for each in parts):
        raise BadValueError(path, "", "is not a plan, must be a file that affordance freeze has written")
    if (found := _hash({key: value for key, value in plan.items() if key != _OWN})) != plan.get(_OWN):
        raise BadValueError(path, _OWN, f"is {plan.get(_OWN)!r}, but the plan has {found}: it was changed")
    for part, file in zip(parts, (trials, objects or trials.parent / plan["objects"]["file"]), strict=True):
        if (found := hash_file(file)) != (frozen := plan[part][_OWN]):
            raise BadValueError(file, "", f"has SHA-256 {found}, must have {frozen}, which is frozen in {path}")
    return plan


def _hash(plan: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(plan, sort_keys=True, ensure_ascii=False).encode()).hexdigest()
