"""Loads tasks from files, by name from a model folder or from any file."""

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
# Key in a task file that contains the kind of task.
_KIND = "kind"


def list_tasks(models: Path) -> tuple[str, ...]:
    """Lists the tasks whose files exist in a model folder, by name."""
    return tuple(name for name, file in TASK_FILES.items() if (models / file).is_file())


def load_task(models: Path, name: str, arm: Arm | None = None) -> TaskCostModel:
    """Loads a task from a model folder by its name, which is also the default kind.

    Other arguments and errors are as in ``load_task_file``.

    Raises:
        BadValueError: If the folder has no task of this name.
    """
    names = list_tasks(models)
    if name not in names:
        raise BadValueError(models, "task", describe_choice(name, names))
    return _load(models / TASK_FILES[name], name, arm)


def load_task_file(path: StrPath, arm: Arm | None = None) -> TaskCostModel:
    """Loads a task from a file with the ``kind`` hammer, reach, mash, carry or hold.

    Args:
        path: Task file.
        arm: Arm that will do the task, whose start posture is checked; None to skip the check.

    Raises:
        BadValueError: The file or one of its values is invalid, the kind is missing, or the arm lacks a joint or
            cannot take an angle that the file names. The message names file, key and fault.
    """
    return _load(check_path("path", path), None, arm)


def _load(path: Path, default: str | None, arm: Arm | None) -> TaskCostModel:
    """Loads a task from a file and checks its start posture. ``default`` is the kind if the file has none."""
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
        kind = default or "reach"  # its entry will report what is wrong
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
    """Returns True if a task is to hold still, which takes no work."""
    return any(isinstance(task, Keep) for task in tasks)
