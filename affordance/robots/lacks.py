"""Tasks that an imported arm cannot do, kept in its folder of models, so that no run plans them in vain."""

import hashlib
from collections.abc import Mapping
from pathlib import Path

import yaml

from affordance.files.atomic import write_text

LACKS = "cannot_do.yaml"
# What decides what an arm can do, of a folder of models.
_DECISIVE = ("*.sdf", "*.dmd.yaml", "materials.yaml", "nail.yaml", "paths/*.yaml", "tools/*.yaml")
_NOTE = """# Tasks that the arm of this folder cannot do, as import-arm found, with the reason of each. This holds for
# the files of the digest: once arm, nail, paths, objects or materials are changed, affordance run tries again.
"""


def write_lacks(models: Path, lacks: Mapping[str, str]) -> None:
    """Keeps why tasks cannot be done, by their names, in a folder of models; nothing if all can be done."""
    if lacks:
        content = {"tasks": dict(lacks), "digest": _compute_digest(models)}
        write_text(models / LACKS, _NOTE + yaml.safe_dump(content, sort_keys=False, width=110))


def read_lacks(models: Path) -> dict[str, str]:
    """Reads why tasks cannot be done, by their names: ``objects``, ``path`` or ``blow``.

    Returns: Nothing if the folder says nothing, or the files it was found with have changed since.
    """
    try:
        content = yaml.safe_load((models / LACKS).read_text(encoding="utf-8"))
        tasks = {str(name): str(why) for name, why in content["tasks"].items()}
        return tasks if content["digest"] == _compute_digest(models) else {}
    except (OSError, ValueError, TypeError, LookupError, AttributeError, yaml.YAMLError):
        return {}  # what cannot be read is found out anew


def _compute_digest(models: Path) -> str:
    digest = hashlib.sha256()
    for pattern in _DECISIVE:
        for path in sorted(models.glob(pattern)):
            digest.update(path.relative_to(models).as_posix().encode())
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]
