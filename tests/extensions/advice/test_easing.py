"""Advice on infeasible tasks: the reason, and less weight or an easier task that would make them feasible."""

import re
from dataclasses import replace

import numpy as np
import pytest
from helpers.one_option import FAR, KNOWN, SETTINGS, list_one

from affordance.choice.carry import Carry, Keep
from affordance.choice.demand import Criterion
from affordance.choice.pricing import GripBounds, plan_options
from affordance.choice.ranking import rank, rank_draws
from affordance.choice.reach import Reach
from affordance.extensions.advice.easing import explain_failure


def explain(task: Reach | Carry | Keep, bounds: GripBounds) -> str:
    choice, rng = plan_options(list_one(), task, SETTINGS), np.random.default_rng(0)
    ranking = rank_draws(choice, choice.draw(KNOWN, rng, 50), rng, bounds=bounds)
    assert ranking.num_usable == 0
    return explain_failure(ranking, task, KNOWN, SETTINGS, bounds, rng)


@pytest.mark.parametrize("task", [Reach(FAR), Carry(FAR)])
def test_path_beyond_reach_says_where_by_how_much_and_what_could_be_done(task: Reach | Carry) -> None:
    said = explain(task, GripBounds())
    assert "leaves the path by 0." in said
    assert " m, must stay within 0.02 m: near point " in said
    assert ", where " in said
    assert re.search(r"; the task would be feasible (0\.|mirrored|.* times slower)", said)


def test_task_of_which_nothing_is_easy_enough_says_what_was_tried() -> None:
    said = explain(Reach(replace(FAR, points=((1.9, 0.0, 1.9),), duration=0.3)), GripBounds())
    tried = "0.25 times as large, mirrored, 2 times slower"
    assert said.endswith(f"; the task would not be feasible even {tried}, the easiest variant tried")


def test_tool_that_is_too_heavy_could_be_lighter() -> None:
    best = rank(list_one(), Keep(1.0), KNOWN, SETTINGS, criterion=Criterion.GRIP, num_samples=50).best
    said = explain(Keep(1.0), GripBounds(force=0.5 * best.amounts.force.mean))
    assert re.search(r"; the task would be feasible with a tool of 0\.(49|48|47|46) times the weight$", said)
