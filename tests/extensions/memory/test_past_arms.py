"""Trials that a robot made with another arm are counted by hand; an arm of which nothing is known is no other one."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest
from helpers.trials import WOOD, hold

from affordance.extensions.memory.ledger import open_memory
from affordance.extensions.memory.past_arms import count_past_arms, describe_past_arms


def write(folder: Path, *arms: str, robot: str = "mine") -> str:
    """Writes a memory of trials of a robot, and one of another robot, by the fingerprints of their arms."""
    path = folder / "memory.sqlite"
    trials = [hold("bar", (WOOD,), (600.0,), i, robot=robot) for i in range(len(arms) + 1)]
    known = [replace(trial, fingerprint=arm) for trial, arm in zip(trials, (*arms, "old"), strict=True)]
    with open_memory(path) as ledger:
        ledger.append([*known[:-1], replace(known[-1], robot="yours")])
    return str(path)


@pytest.mark.parametrize(
    ("arms", "count"),
    [
        ((), 0),
        (("",), 0),
        (("now",), 0),
        (("old",), 1),
        (("old", "old"), 2),
        (("old", "", "now", "older", "", "now"), 2),
    ],
)
def test_trials_of_another_known_arm_are_counted(tmp_path: Path, arms: Sequence[str], count: int) -> None:
    assert count_past_arms(write(tmp_path, *arms), "mine", lambda: "now") == count


@pytest.mark.parametrize("arms", [(), ("", "")])
def test_arm_is_recognised_only_where_it_can_be_another(tmp_path: Path, arms: Sequence[str]) -> None:
    assert count_past_arms(write(tmp_path, *arms), "mine", lambda: pytest.fail("was recognised")) == 0


def test_without_a_memory_nothing_is_counted_and_none_is_made(tmp_path: Path) -> None:
    for place in ("", str(tmp_path / "nowhere.sqlite")):
        assert count_past_arms(place, "mine", lambda: "now") == 0
    assert not list(tmp_path.iterdir())


def test_it_is_said_of_how_many_trials_the_arm_was_another() -> None:
    assert describe_past_arms("mine", 3) == "mine had another arm in 3 of its trials, which still count for materials"
    assert describe_past_arms("mine", 0) == ""
