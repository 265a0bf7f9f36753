"""Tasks as files of a folder of models, by name."""

from pathlib import Path

from affordance.choice.hammer import load_hammer
from affordance.choice.inner_simulation import TaskCostModel
from affordance.choice.reach import Reach
from affordance.control.timed_path import load_path
from affordance.exceptions import BadValueError, describe_choice

# Files of the tasks in a folder of models.
TASK_FILES = {"hammer": "nail.yaml", "reach": "paths/reach.yaml", "mash": "paths/mash.yaml"}


def list_tasks(models: Path) -> tuple[str, ...]:
    """Lists the names of the tasks whose files a folder of models has."""
    return tuple(name for name, file in TASK_FILES.items() if (models / file).is_file())


def load_task(models: Path, name: str) -> TaskCostModel:
    """Loads a task of a folder of models by its name.

    Raises:
        BadValueError: There is no such task, or its file is invalid; the message names it and the fault.
    """
    names = list_tasks(models)
    if name not in names:
        raise BadValueError(models, "task", describe_choice(name, names))
    path = models / TASK_FILES[name]
    return load_hammer(path) if name == "hammer" else Reach(load_path(path))
