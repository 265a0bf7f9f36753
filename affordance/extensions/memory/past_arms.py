"""Counts the trials that a robot made with a different arm from its present one."""

from collections.abc import Callable

from affordance.extensions.memory.ledger import has_memory, open_memory
from affordance.plant.arm import name_robot
from affordance.plant.serial_chain import ArmOwner


def count_past_arms(place: str, robot: str, recognise: Callable[[], str]) -> int:
    """Counts a robot's trials with a different arm from its present one; 0 without a memory.

    ``recognise`` computes the fingerprint of its present arm; it is called only if there are trials.
    """
    if not (place and has_memory(place)):
        return 0
    with open_memory(place, create=False) as ledger:
        return ledger.count_of_other_arms(robot, recognise()) if ledger.count_of_other_arms(robot) else 0


def count_of(robot: ArmOwner, place: str | None) -> int:
    """Counts the trials in a memory that a robot made with a different arm; 0 without a memory."""
    return count_past_arms(place or "", name_robot(robot.directives), lambda: robot.chain.fingerprint)


def describe_past_arms(robot: str, number: int) -> str:
    """Describes the number of trials with a different arm; empty if there are none."""
    return f"{robot} had another arm in {number} of its trials, which still count for materials" if number else ""
