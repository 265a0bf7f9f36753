"""Small runs of the study of the loop: the paper's arm, the grips of one hammer, reaching; as shipped and changed."""

import functools
from typing import Any

import numpy as np
import pytest

from affordance.arrays import Array
from affordance.choice.listed_options import list_drawn_options
from affordance.choice.pricing import plan_options
from affordance.files.model_folder import MODELS
from affordance.memory.ledger import Ledger
from affordance.robots.robot import Robot
from affordance.settings import DEFAULT_SETTINGS
from helpers.stacked import stack
from helpers.study_runs import Numbers
from helpers.workshop import BLANKS, HAMMERS
from studies.loop import ledger_speed, lives, study
from studies.loop.recordings import TORQUE_SENSORS

TASKS = ("reach",)
CONFIG = study.LoopConfig(MODELS, has_torque_sensors=True)
# The paper's arm is light for its strength: errors that are shares of its torque limits would hide its own weight.
QUIET = TORQUE_SENSORS._replace(noise_sd=2e-4, friction=(2e-4, 2e-4, 2e-4))
_HAMMER = [HAMMERS["machinist hammer"]]
_PIECES = [BLANKS[name] for name in ("bar of oak", "rod of cast steel", "block of rubber")]


@functools.cache
def build_bench() -> study.Bench:
    """Builds a bench of one hammer, drawn, to reach with, and three pieces of stock."""
    robot = Robot()
    task = robot.load_task("reach")
    choice = plan_options(list_drawn_options(_HAMMER), task, DEFAULT_SETTINGS)
    return study.Bench(robot, DEFAULT_SETTINGS, _PIECES, _HAMMER, {"reach": task}, {"reach": choice})


def run_lives(*, repeats: int = 2, mixed_up: bool = False) -> dict[str, Any]:
    """Runs observers; if mixed up, a piece is as heavy as if it were made of what the next one is made of."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(study, "build_bench", lambda config: build_bench())
        patch.setattr(study, "TASKS", TASKS)
        patch.setattr(study, "_SAMPLES", 300)
        patch.setattr(study, "list_seen_options", lambda things, *_: list_drawn_options(things))
        patch.setattr(study, "TORQUE_SENSORS", QUIET)
        levels = {"before": 0, "after_1": 1, "after_2": 2, "after_5": len(_PIECES)}
        for module in (study, lives):
            patch.setattr(module, "LEVELS", levels)
        if mixed_up:
            draw = lives.draw_truth

            def draw_other(tool: Any, deviation: float, rng: np.random.Generator) -> Array:
                heavier = {"bar of oak": 12.0, "rod of cast steel": 0.08}.get(tool.name, 1.0)
                return heavier * draw(tool, deviation, rng)

            patch.setattr(lives, "draw_truth", draw_other)
        lived = [study.run_life(CONFIG, repeat) for repeat in range(repeats)]
    return stack(lived)


@functools.cache
def close_loop(*, mixed_up: bool = False) -> Numbers:
    """Returns the numbers of the study."""
    robots = {"ours": study.describe_robot(run_lives(repeats=1, mixed_up=mixed_up), TASKS)[0]}
    return {**study.summarise_robots(robots), **remember()}


@functools.cache
def remember(*, forgets_nothing: bool = False) -> Numbers:
    """Returns the numbers of a small ledger."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ledger_speed, "_kill_writer", lambda folder: (0, 0))  # tests/memory/test_ledger.py kills one
        patch.setattr(ledger_speed, "_SINGLE", 3)
        patch.setattr(ledger_speed, "_RECALLS", 5)
        if forgets_nothing:
            patch.setattr(Ledger, "forget", lambda ledger, selection: 0)
        numbers = ledger_speed.measure_ledger(60)
    return {name: numbers[name] for name in ("recall_s_1e5", "lost", "double", "forget_error")}
