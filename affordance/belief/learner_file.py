"""Loads learners from users' Python files."""

import inspect
from collections.abc import Sequence
from pathlib import Path

from affordance.belief.learner import Learner
from affordance.exceptions import BadValueError, describe_choice, show_value
from affordance.runs.program_file import load_program

_OPTION = "--learner"


def load_learner(word: str, known: Sequence[str] = ()) -> Learner:
    """Runs a Python file, and returns a learner of one of its classes.

    Args:
        word: File and class, as ``FILE.py:CLASS``.
        known: Names of built-in learners, which are not allowed for the user's learner.

    Raises:
        BadValueError: The file or class does not exist, the file fails to run, the class is not a complete learner,
            or its name is not allowed.
    """
    file, _, name = word.rpartition(":")
    if not file.endswith(".py"):
        example = f"{word}:CLASS" if word.endswith(".py") else "FILE.py:CLASS"
        raise BadValueError(_OPTION, "", f"{describe_choice(word, known)}, or your own, as {example}")
    module = load_program(Path(file), _OPTION)
    own = [each for each, value in vars(module).items() if _is_own_learner(value, module.__name__)]
    found = getattr(module, name, None)
    if not (isinstance(found, type) and issubclass(found, Learner)):
        problem = describe_choice(name, own) if own else f"is {show_value(name)}, but the file has no learner"
        raise BadValueError(Path(file), "class", problem)
    if missing := sorted(getattr(found, "__abstractmethods__", ())):
        raise BadValueError(Path(file), name, f"has no method {missing[0]!r}, which a learner must have")
    learner = found()
    if learner.name in known:
        raise BadValueError(
            Path(file), name, f"is named {learner.name!r}, the name of a built-in learner; must be unique"
        )
    return learner


def _is_own_learner(value: object, module: str) -> bool:
    return (
        isinstance(value, type)
        and issubclass(value, Learner)
        and value.__module__ == module
        and not inspect.isabstract(value)
    )
