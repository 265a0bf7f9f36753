"""Motions are kept, and each is planned once in a process."""

import pytest
from helpers.one_option import SETTINGS, list_one

from affordance.choice.carry import Carry
from affordance.choice.pricing import plan_options
from affordance.control.timed_path import TimedPath


def test_motion_is_planned_once_in_a_process(monkeypatch: pytest.MonkeyPatch) -> None:
    planned = []
    plan = Carry.build_cost

    def count(task: Carry, *arguments: object) -> object:
        planned.append(task)
        return plan(task, *arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(Carry, "build_cost", count)
    task = Carry(TimedPath(points=((0.0, 0.01, 0.0),), duration=0.1, tolerance=0.02))
    for _ in range(2):  # options are made anew, with equal forms
        plan_options(list_one(), task, SETTINGS)
    assert planned == [task]
