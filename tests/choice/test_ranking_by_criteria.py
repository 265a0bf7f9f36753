"""Ranking by each criterion: against the ranking by work, and by hand."""

import re
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.two_tools import HAMMER, REACH, STICK

from affordance.belief.material_memory import MaterialMemory
from affordance.choice.carry import Keep
from affordance.choice.demand import Criterion, Demand
from affordance.choice.inner_simulation import Choice, plan_choice
from affordance.choice.listed_options import list_drawn_options
from affordance.choice.motion_cost import Costs
from affordance.choice.pricing import GRIP_LEVER, GripBounds, plan_options
from affordance.choice.ranking import explain_choice, rank, rank_draws, rank_options
from affordance.exceptions import AffordanceError, name_gripped
from affordance.extensions.advice.easing import explain_failure
from affordance.settings import Settings

SETTINGS = Settings()
NOVICE = MaterialMemory()
SAMPLES = 400
CHOICE = plan_options(list_drawn_options([STICK]), REACH, SETTINGS)


def draw(choice):
    rng = np.random.default_rng(3)
    return choice.draw(NOVICE, rng, SAMPLES), rng


@pytest.fixture(scope="module")
def rankings():
    """The stick in both grips, ranked by each criterion under the same samples."""
    return {each: rank_draws(CHOICE, *draw(CHOICE), criterion=each, bounds=GripBounds()) for each in Criterion}


def test_demands_and_planning_once_do_not_change_the_ranking_by_work(rankings):
    choice = plan_choice(list_drawn_options([STICK]), REACH, SETTINGS)
    ranking = rank_options(choice, NOVICE, np.random.default_rng(3), SAMPLES)
    for one, other in zip(rankings[Criterion.WORK].ranked, ranking.ranked, strict=True):
        assert one.option.name == other.option.name
        assert one.amounts.work == pytest.approx(other.amounts.work)
        assert one.effort == pytest.approx(other.effort)
        assert one.amounts.work[1:] == pytest.approx(np.quantile(other.works, [0.05, 0.95]))
        assert (one.p_best, one.p_feasible) == (other.p_best, other.p_feasible)
        assert np.isnan(other.amounts.force).all()
        assert (one.amounts.joint != "", other.amounts.joint) == (True, "")


def test_public_ranking_takes_a_criterion_by_its_name():
    options, words = list_drawn_options([STICK]), {"num_samples": SAMPLES, "seed": 3}
    ranking = rank(options, REACH, NOVICE, SETTINGS, criterion="grip", **words)
    assert ranking.criterion is Criterion.GRIP
    assert ranking.best.cost == ranking.best.amounts.cost.p95
    none = rank(options, REACH, NOVICE, SETTINGS, bounds=GripBounds(force=1.0), **words)
    with pytest.raises(AffordanceError, match=r"must be at least 0\.95: the grip must hold .* N, --max-grip-force"):
        _ = none.best
    with pytest.raises(AffordanceError, match=r"bounds: is of type float, must be of type GripBounds"):
        rank(options, REACH, NOVICE, SETTINGS, bounds=1.0)


def test_each_criterion_orders_by_its_own_number(rankings):
    numbers = {
        Criterion.WORK: lambda each: each.work,
        Criterion.EFFORT: lambda each: each.effort,
        Criterion.MARGIN: lambda each: each.amounts.margin.p95,
    }
    for criterion, number in numbers.items():
        ranked = rankings[criterion].ranked
        assert [each.cost for each in ranked] == pytest.approx(sorted(number(each) for each in ranked))
        assert sum(each.p_best for each in ranked) == pytest.approx(1.0 - rankings[criterion].p_none)
        assert explain_choice(rankings[criterion], draw(CHOICE)[0], CHOICE.options).shares


def test_wrench_counts_as_a_force_at_the_lever_of_the_gripper(rankings):
    demand = CHOICE.compute_demands(CHOICE.draw_parameters(NOVICE, np.random.default_rng(3), SAMPLES))
    by_name = {each.option.name: each for each in rankings[Criterion.GRIP].ranked}
    for option, force, moment in zip(CHOICE.options, demand.force, demand.moment, strict=True):
        as_force = np.sqrt(force**2 + (moment / GRIP_LEVER) ** 2)
        assert by_name[option.name].cost == pytest.approx(np.quantile(as_force, 0.95))
    assert GripBounds(force=20.0, moment=1.0).lever == 0.05
    assert GripBounds(force=20.0).lever == GripBounds(moment=1.0).lever == GRIP_LEVER


def test_bounds_of_the_grip_take_part_in_feasibility():
    choice = plan_options(list_drawn_options([STICK]), Keep(1.0), SETTINGS)
    free = rank_draws(choice, *draw(choice), criterion=Criterion.GRIP)
    bounds = GripBounds(moment=0.5 * free.best.amounts.moment.p95)
    draws, rng = draw(choice)
    ranking = rank_draws(choice, draws, rng, criterion=Criterion.GRIP, bounds=bounds)
    assert ranking.num_usable == 0
    assert explain_choice(ranking, draws, choice.options) is None
    assert 0.0 < ranking.p_none < 1.0
    nearest, other = ranking.ranked
    assert nearest.p_feasible >= other.p_feasible
    said = explain_failure(ranking, Keep(1.0), NOVICE, SETTINGS, bounds, rng)
    assert said.startswith(f"no tool can do the task; nearest is {name_gripped(nearest.option.name)}: ")
    assert re.search(
        r"the grip must hold .* N m, --max-grip-moment allows .* N m; the task would be feasible with a tool of 0\.",
        said,
    )


def test_options_that_are_not_usable_are_ordered_by_nearness_and_then_by_cost():
    """Of two options that are never feasible and cheaper than the usable one, the cheaper comes first."""

    def make(cost, feasible):
        return SimpleNamespace(
            infeasible_reason="",
            q_start=np.zeros(7),
            compute_demand=lambda pi: Demand(np.full((7, len(pi)), 2.0), *np.zeros((2, len(pi)))),
            compute=lambda pi: Costs(
                *np.full((2, len(pi)), cost), np.full(len(pi), feasible), np.full(len(pi), cost)
            ),
        )

    options = list_drawn_options([STICK, HAMMER])
    choice = Choice(options, [make(2.0, False), make(1.0, False), make(3.0, True), make(4.0, True)], SETTINGS)
    ranked = rank_draws(choice, *draw(choice)).ranked
    assert [options.index(each.option) for each in ranked] == [2, 3, 1, 0]
