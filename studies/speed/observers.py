"""Lifts of 1,000 observers as arrays, compared with the same lifts observer by observer."""

import numpy as np

from affordance.belief.learner import Learner
from affordance.belief.learners import LEARNERS
from affordance.experiments import linear
from affordance.experiments.observers import Setup
from affordance.simulation.static_lifts import StaticLifter
from studies.speed.timing import time_by_turns

OBSERVERS = 1000
ONE_BY_ONE = 10  # observers that are timed one by one
FAMILIAR, TESTED = 4, 2  # lifts of each familiar object before the test object, and of the test object
HEADER = ["learner", "ms per lift of 1,000 observers", "the same one by one", "ratio"]


def measure() -> tuple[list[list[str]], dict[str, float]]:
    """Times lifts of the first objects of Linear++; errors are drawn beforehand."""
    rows, ratios = [], {}
    for learner in LEARNERS.values():
        at_once, one_by_one = time_lifts(learner)
        ratio = ratios[f"observers_at_once_{learner.name}"] = one_by_one / at_once
        rows.append([learner.name, f"{1e3 * at_once:.1f}", f"{1e3 * one_by_one:.0f}", f"{ratio:.0f}"])
    return rows, ratios


def time_lifts(learner: Learner) -> tuple[float, float]:
    """Times a lift of all observers as arrays, and observer by observer, [s]."""
    setup = Setup().change(learner=learner)
    tools = linear.read("linear_plus_plus", setup)
    lifter = StaticLifter(tools, setup.settings)
    order = np.array([*range(len(tools) - 1)] * FAMILIAR + [len(tools) - 1] * TESTED)
    seeds = [(0, number) for number in range(OBSERVERS)]
    errors = lifter.draw_errors(seeds, len(order))

    def lift(start: int, count: int) -> None:
        own = seeds[start : start + count]
        objects = np.repeat(order[:, None], count, axis=1)
        lifter.run(objects, lifter.start(own), errors[:, start : start + count], own)

    def lift_one_by_one() -> None:
        for number in range(ONE_BY_ONE):
            lift(number, 1)

    times = time_by_turns(
        {"at once": lambda: lift(0, OBSERVERS), "one by one": lift_one_by_one}, turns=5, calls_per_turn=1
    )
    return times["at once"] / len(order), times["one by one"] / len(order) * OBSERVERS / ONE_BY_ONE
