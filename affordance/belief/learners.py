"""Learners that the program has, by their names in files and on the command line."""

from collections.abc import Mapping

from affordance.belief.kinds_learner import Kinds, Pick
from affordance.belief.learner import Learner
from affordance.belief.one_density import OneDensity
from affordance.belief.rivals import NothingRemembered, OwnAndShared, OwnMemory

DENSITY, KINDS_MAP, KINDS_DRAWN = OneDensity(), Kinds(Pick.MAP), Kinds(Pick.DRAWN)
LEARNERS: Mapping[str, Learner] = {each.name: each for each in (DENSITY, KINDS_MAP, KINDS_DRAWN)}
NOTHING_REMEMBERED, OWN_MEMORY, OWN_AND_SHARED = NothingRemembered(), OwnMemory(), OwnAndShared()
# Further ones that are compared with them on people's lifts, and are simulated only where they are named.
RIVALS: Mapping[str, Learner] = {each.name: each for each in (NOTHING_REMEMBERED, OWN_MEMORY, OWN_AND_SHARED)}
# The default for a working arm: an odd object does not spoil the belief about its material, and without odd objects
# it behaves as a learner with one density for each colour (docs/decisions/0026-kinds.md).
ARM_LEARNER = KINDS_MAP


def label_learner(name: str) -> str:
    """Returns the name in words of a learner's name in files."""
    known = {**LEARNERS, **RIVALS}
    return known[name].label if name in known else name


def list_learners(chosen: Learner) -> list[Learner]:
    """Lists the learners that are compared: those of the program, and one that was chosen, by its own parameters."""
    return [*{**LEARNERS, chosen.name: chosen}.values()]
