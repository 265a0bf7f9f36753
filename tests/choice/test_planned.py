"""Motions are kept, and each is planned once in a process."""

import numpy as np
import pytest
from helpers.two_tools import STICK

from affordance.belief.material_memory import MaterialMemory
from affordance.choice.carry import Carry
from affordance.choice.options import Option
from affordance.choice.tool_options import list_drawn_options
from affordance.choice.weighing import weigh
from affordance.control.timed_path import TimedPath, load_path
from affordance.files.model_folder import MODELS
from affordance.objects.tool import list_densities
from affordance.settings import Settings

SETTINGS = Settings()
HELD = STICK.gripped_by(STICK.grips[0])
KNOWN = MaterialMemory.from_densities(list_densities([STICK]))
START = load_path(MODELS / "paths" / "reach.yaml").start
FAR = TimedPath(points=((0.5, 0.0, 0.3),), duration=1.0, tolerance=0.02, start=START)


def list_one() -> list[Option]:
    return list_drawn_options([STICK])[:1]


def test_motion_is_planned_once_in_a_process(monkeypatch: pytest.MonkeyPatch) -> None:
    planned = []
    plan = Carry.build_cost

    def count(task: Carry, *arguments: object) -> object:
        planned.append(task)
        return plan(task, *arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(Carry, "build_cost", count)
    task = Carry(TimedPath(points=((0.0, 0.01, 0.0),), duration=0.1, tolerance=0.02))
    for _ in range(2):  # options are made anew, with equal forms
        weigh(list_one(), task, KNOWN, SETTINGS, num_samples=20, rng=np.random.default_rng(0))
    assert planned == [task]
