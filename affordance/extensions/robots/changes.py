"""Result of adapting tasks to an arm: changes with their reasons."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from affordance.files.atomic import write_text
from affordance.files.bounded import read_yaml

# Key that stands for all lengths of the objects in a tools file; its values are factors.
SIZE_OF_TOOLS = "size"
_LENGTHS = ("tools.*.components.*.semi_axes", "tools.*.components.*.position", "tools.*.grips.*.position")


class Change(NamedTuple):
    """Change of a value in a task file, and its reason; a new value of None removes the key."""

    file: str
    key: str
    old: Any
    new: Any
    why: str

    def __str__(self) -> str:
        return f"{self.file}: {self.key}: {show(self.old)} -> {show(self.new)} ({self.why})"


def show(value: Any) -> str:
    """Formats a value; numbers get four significant digits."""
    if value is None:
        return "removed"
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(show(entry) for entry in value)}]"
    return str(value)


def apply_changes(models: Path, changes: Sequence[Change]) -> None:
    """Writes changes into the files of a model folder, each with a comment at the top of its file.

    Keys are paths such as ``blow.duration``, or SIZE_OF_TOOLS.
    """
    for file in dict.fromkeys(change.file for change in changes):
        of_file = [change for change in changes if change.file == file]
        path = models / file
        content = read_yaml(path)
        for change in of_file:
            if change.key == SIZE_OF_TOOLS:
                factor = change.new / change.old
                for key in _LENGTHS:
                    _edit(content, key.split("."), partial(_scale, factor))
            else:
                _edit(content, change.key.split("."), partial(lambda new, _: new, change.new))
        notes = "".join(f"# Changed by affordance import-arm: {change}\n" for change in of_file)
        write_text(path, notes + yaml.safe_dump(content, sort_keys=False, default_flow_style=None, width=110))


def _edit(content: Any, keys: Sequence[str], change: Callable[[Any], Any]) -> None:
    """Changes the value at a path of keys; ``*`` selects all values, and absent keys are ignored."""
    first, rest = keys[0], keys[1:]
    if first == "*":
        for entry in content.values() if isinstance(content, dict) else content:
            _edit(entry, rest, change)
    elif first in content:
        if rest:
            _edit(content[first], rest, change)
        else:
            content[first] = change(content[first])
            if content[first] is None:
                del content[first]


def _scale(factor: float, value: Any) -> Any:
    """Multiplies a number, or every number of a list, keeping six significant digits."""
    if isinstance(value, list):
        return [_scale(factor, entry) for entry in value]
    return float(f"{value * factor:.6g}")


class Fitted(NamedTuple):
    """Changes that adapt the tasks to an arm, and the reasons why tasks are infeasible, by name of the task."""

    changes: tuple[Change, ...]
    lacks: dict[str, str]
