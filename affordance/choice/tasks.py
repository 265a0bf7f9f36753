"""Loads tasks by name from a model folder, or from any file."""

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

from affordance.choice.carry import Carry, CarryEntry, Keep, KeepEntry
from affordance.choice.hammer import Hammer, HammerEntry
from affordance.choice.inner_simulation import TaskCostModel
from affordance.choice.reach import Reach
from affordance.control.task import check_start
from affordance.control.timed_path import PathEntry
from affordance.exceptions import BadValueError, describe_choice
from affordance.files.bounded import read_yaml
from affordance.files.constraints import StrPath, check_path
from affordance.files.data_model import check_content
from affordance.plant.arm import Arm

# Task files in a model folder.
TASK_FILES = {
    "hammer": "nail.yaml",
    "reach": "paths/reach.yaml",
    "mash": "paths/mash.yaml",
    "carry": "tasks/carry.yaml",
    "hold": "tasks/hold.yaml",
}
# Key of the kind of task in a task file.
_KIND = "kind"


def list_tasks(models: Path) -> tuple[str, ...]:
    """Lists the names of tasks whose files exist in a model folder."""
    return tuple(name for name, file in TASK_FILES.items() if (models / file).is_file())


def load_task(models: Path, name: str, arm: Arm | None = None) -> TaskCostModel:
    """Loads a task from a model folder by its name, which is also the default of its kind.

    Args:
        models: Model folder.
        name: Name of the task.
        arm: Arm for which the start posture is checked; None to skip the check.

    Raises:
        BadValueError: The folder has no task of this name, or ``load_task_file`` fails.
    """
    names = list_tasks(models)
    if name not in names:
        raise BadValueError(models, "task", describe_choice(name, names))
    return _load(models / TASK_FILES[name], name, arm)


def load_task_file(path: StrPath, arm: Arm | None = None) -> TaskCostModel:
    """Loads a task from a file with the ``kind`` hammer, reach, mash, carry or hold.

    Args:
        path: Task file.
        arm: Arm for which the start posture is checked; None to skip the check.

    Raises:
        BadValueError: The file or one of its values is invalid, the kind is missing, or the start posture has an
            unknown joint or violates joint limits. The message contains file, key and reason.
    """
    return _load(check_path("path", path), None, arm)


def _load(path: Path, default: str | None, arm: Arm | None) -> TaskCostModel:
    """Loads a task from a file, and checks its start posture. The kind is optional if there is a default."""
    task = _build(path, default)
    if arm is not None:
        match task:
            case Reach() | Carry():
                check_start(path, "start", task.path.start, arm)
            case Hammer():
                check_start(path, "blow.start", task.start, arm)
            case Keep():
                check_start(path, "posture", task.posture, arm)
    return task


def _build(path: Path, default: str | None) -> TaskCostModel:
    content = read_yaml(path)
    if isinstance(content, Mapping):
        kind = content.get(_KIND, default)
        content = {key: value for key, value in content.items() if key != _KIND}
        if kind is None:
            raise BadValueError(path, _KIND, f"is missing, must be one of {', '.join(_BUILDERS)}")
        if not isinstance(kind, str) or kind not in _BUILDERS:
            raise BadValueError(path, _KIND, describe_choice(kind, _BUILDERS))
    else:
        kind = default or "reach"  # the check of its entry reports the error
    return _BUILDERS[kind](path, content)


def _build_reach(path: Path, content: Any) -> TaskCostModel:
    return Reach(check_content(path, "", content, PathEntry).build())


_BUILDERS: Mapping[str, Callable[[Path, Any], TaskCostModel]] = {
    "hammer": lambda path, content: check_content(path, "", content, HammerEntry).build_task(),
    "reach": _build_reach,
    "mash": _build_reach,
    "carry": lambda path, content: check_content(path, "", content, CarryEntry).build_task(),
    "hold": lambda path, content: check_content(path, "", content, KeepEntry).build_task(),
}


def is_any_still(tasks: Iterable[TaskCostModel]) -> bool:
    """Returns True if any task is a holding task, which requires no work."""
    return any(isinstance(task, Keep) for task in tasks)
