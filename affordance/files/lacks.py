"""Records the tasks that are infeasible for an arm, so that later runs skip them."""

import hashlib
from collections.abc import Mapping
from pathlib import Path

import yaml

from affordance.exceptions import BadValueError
from affordance.files.atomic import write_text
from affordance.files.bounded import read_yaml

LACKS = "cannot_do.yaml"
# Files of a model folder on which the feasibility of tasks depends.
_DECISIVE = ("*.sdf", "*.dmd.yaml", "materials.yaml", "nail.yaml", "paths/*.yaml", "tools/*.yaml")
_NOTE = """# Tasks that import-arm found to be infeasible for the arm of this folder, each with the reason. The digest
# tells whether arm, nail, paths, objects or materials have changed since; if so, affordance run tries them again.
"""


def write_lacks(models: Path, lacks: Mapping[str, str]) -> None:
    """Writes a record of infeasible tasks into a model folder, unless all tasks are feasible.

    Args:
        models: Model folder.
        lacks: Reason why each infeasible task cannot be done, by the task's name.
    """
    if lacks:
        content = {"tasks": dict(lacks), "digest": _compute_digest(models)}
        write_text(models / LACKS, _NOTE + yaml.safe_dump(content, sort_keys=False, width=110))


def read_lacks(models: Path) -> dict[str, str]:
    """Reads the record of infeasible tasks: the reason for each task, by name.

    The result is empty if there is no record, or if the folder's files have changed since the record was written.
    """
    try:
        content = read_yaml(models / LACKS)
        tasks = {str(name): str(why) for name, why in content["tasks"].items()}
        return tasks if content["digest"] == _compute_digest(models) else {}
    except (BadValueError, OSError, TypeError, LookupError, AttributeError):
        return {}  # without a valid record, all tasks are tried again


def _compute_digest(models: Path) -> str:
    digest = hashlib.sha256()
    for pattern in _DECISIVE:
        for path in sorted(models.glob(pattern)):
            digest.update(path.relative_to(models).as_posix().encode())
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]
