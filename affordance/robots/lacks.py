"""Record of infeasible tasks in the folder of models of an imported arm, so that no run plans them."""

import hashlib
from collections.abc import Mapping
from pathlib import Path

import yaml

from affordance.files.atomic import write_text

LACKS = "cannot_do.yaml"
# Files of a folder of models that determine which tasks are feasible.
_DECISIVE = ("*.sdf", "*.dmd.yaml", "materials.yaml", "nail.yaml", "paths/*.yaml", "tools/*.yaml")
_NOTE = """# Tasks that the arm of this folder cannot do, as import-arm found, with the reason of each. This holds for
# the files of the digest: once arm, nail, paths, objects or materials are changed, affordance run tries again.
"""


def write_lacks(models: Path, lacks: Mapping[str, str]) -> None:
    """Writes the reasons why tasks are infeasible, by name, into a folder of models; nothing if there are none."""
    if lacks:
        content = {"tasks": dict(lacks), "digest": _compute_digest(models)}
        write_text(models / LACKS, _NOTE + yaml.safe_dump(content, sort_keys=False, width=110))


def read_lacks(models: Path) -> dict[str, str]:
    """Reads the reasons why tasks are infeasible, by name: ``objects``, ``path`` or ``blow``.

    Returns: Reasons by name; empty if the folder has no record, or its files have changed since.
    """
    try:
        content = yaml.safe_load((models / LACKS).read_text(encoding="utf-8"))
        tasks = {str(name): str(why) for name, why in content["tasks"].items()}
        return tasks if content["digest"] == _compute_digest(models) else {}
    except (OSError, ValueError, TypeError, LookupError, AttributeError, yaml.YAMLError):
        return {}  # an unreadable record is determined again


def _compute_digest(models: Path) -> str:
    digest = hashlib.sha256()
    for pattern in _DECISIVE:
        for path in sorted(models.glob(pattern)):
            digest.update(path.relative_to(models).as_posix().encode())
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]
