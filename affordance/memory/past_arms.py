"""Trials of a memory that a robot made with another arm than it has now."""

from collections.abc import Callable

from affordance.memory.ledger import has_memory, open_memory


def count_past_arms(place: str, robot: str, recognise: Callable[[], str]) -> int:
    """Counts a robot's trials with another arm than it has now; none without a memory.

    The fingerprint of its arm is computed by ``recognise`` only if there are trials.
    """
    if not (place and has_memory(place)):
        return 0
    with open_memory(place, create=False) as ledger:
        return ledger.count_of_other_arms(robot, recognise()) if ledger.count_of_other_arms(robot) else 0


def describe_past_arms(robot: str, number: int) -> str:
    """Says of how many trials the arm was another; empty if of none."""
    return f"{robot} had another arm in {number} of its trials, which still count for materials" if number else ""
