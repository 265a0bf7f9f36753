"""Freezes the plan of an experiment before data collection, for a preregistration.

A plan is a JSON file with the trial table's and the objects' SHA-256, the learner and settings, the claims and the
number of participants, and a SHA-256 of all of this. The plan and the files suffice to check that nothing changed.
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

# Key of the plan's own hash.
_OWN = "sha256"


def hash_trials(table: pd.DataFrame) -> str:
    """Computes the SHA-256 of a trial table, written as CSV with line feeds."""
    return hashlib.sha256(table.to_csv(index=False, lineterminator="\n").encode()).hexdigest()


def hash_file(path: Path) -> str:
    """Computes the SHA-256 of a file."""
    return hashlib.sha256(read_bytes(path, LARGEST)).hexdigest()


def describe_plan(
    table: TrialTable,
    objects: Path,
    learner: Learner,
    settings: Mapping[str, Any],
    contrasts: Sequence[str],
    claims: Sequence[str],
) -> dict[str, Any]:
    """Describes a plan, with hashes of its files and of itself.

    Args:
        table: Trial table.
        objects: Tools file of its objects.
        learner: Learner whose predictions are registered, with its parameters.
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
        objects: Tools file; None for the one named in the plan, next to the table.

    Raises:
        BadValueError: The plan is not one, or was changed, or the table or the objects were.
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
