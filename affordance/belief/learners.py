"""Built-in learners, by their names in files and on the command line."""

from collections.abc import Mapping
from typing import Any

from affordance.belief.kinds_learner import Kinds, Pick
from affordance.belief.learner import Learner
from affordance.belief.one_density import OneDensity
from affordance.exceptions import BadArgumentError, describe_choice, show_value

DENSITY, KINDS_MAP, KINDS_DRAWN = OneDensity(), Kinds(Pick.MAP), Kinds(Pick.DRAWN)
LEARNERS: Mapping[str, Learner] = {each.name: each for each in (DENSITY, KINDS_MAP, KINDS_DRAWN)}
# The default for a working arm: an odd object does not spoil the belief about its material, and without odd objects
# it behaves as a learner with one density for each colour (docs/decisions/0026-kinds.md).
ARM_LEARNER = KINDS_MAP


def check_learner(name: str, value: Any) -> Learner:
    """Returns a learner, given as such or by its name. Any other value raises a BadArgumentError."""
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
    """Lists the built-in learners, and a chosen learner with its own parameters."""
    return [*{**LEARNERS, chosen.name: chosen}.values()]
