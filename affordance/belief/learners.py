"""Built-in learners, with their names in files and on the command line."""

from collections.abc import Mapping
from typing import Any

from affordance.belief.kinds_learner import Kinds, Pick
from affordance.belief.learner import Learner
from affordance.belief.one_density import OneDensity
from affordance.exceptions import BadArgumentError, describe_choice, show_value

DENSITY, KINDS_MAP, KINDS_DRAWN = OneDensity(), Kinds(Pick.MAP), Kinds(Pick.DRAWN)
LEARNERS: Mapping[str, Learner] = {each.name: each for each in (DENSITY, KINDS_MAP, KINDS_DRAWN)}
# Default learner of a robot arm. An object with an unusual density does not distort the belief about its material.
# Without such objects, this learner is equivalent to one density per colour (docs/decisions/0026-kinds.md).
ARM_LEARNER = KINDS_MAP


def check_learner(name: str, value: Any) -> Learner:
    """Returns the learner that an argument specifies.

    Args:
        name: Name of the argument in error messages.
        value: Learner, class of a learner, or name of a built-in learner.

    Raises:
        BadArgumentError: The value has another type, or there is no learner of this name.
    """
    if isinstance(value, Learner):
        return value
    if isinstance(value, type) and issubclass(value, Learner):
        return value()
    if not isinstance(value, str):
        raise BadArgumentError(name, "", f"is {show_value(value)}, must be a Learner or the name of one")
    if value not in LEARNERS:
        raise BadArgumentError(name, "", describe_choice(value, LEARNERS))
    return LEARNERS[value]


def list_learners(chosen: Learner) -> list[Learner]:
    """Lists the built-in learners and a chosen learner, which replaces the built-in learner of the same name."""
    return [*{**LEARNERS, chosen.name: chosen}.values()]
