"""Weighing by each criterion: against the ranking by work, and by hand."""

import numpy as np
import pytest
from helpers.two_tools import STICK

from affordance.belief.material_memory import MaterialMemory
from affordance.choice.demand import Criterion
from affordance.choice.inner_simulation import plan_choice
from affordance.choice.keep import Keep
from affordance.choice.pricing import GRIP_LEVER, GripBounds
from affordance.choice.ranking import rank_options
from affordance.choice.reach import Reach
from affordance.choice.tool_options import list_drawn_options
from affordance.choice.weighing import weigh
from affordance.control.timed_path import load_path
from affordance.exceptions import AffordanceError
from affordance.files.model_folder import MODELS
from affordance.settings import Settings

SETTINGS = Settings()
REACH = Reach(load_path(MODELS / "paths" / "reach.yaml"))
NOVICE = MaterialMemory()
SAMPLES = 400


@pytest.fixture(scope="module")
def advices():
    """The stick in both grips, weighed by each criterion under the same samples."""
    return {
        each: weigh(
            list_drawn_options([STICK]),
            REACH,
            NOVICE,
            SETTINGS,
            criterion=each,
            num_samples=SAMPLES,
            rng=np.random.default_rng(3),
        )
        for each in Criterion
    }


def test_work_is_ranked_as_by_the_rule_of_bayes(advices):
    choice = plan_choice(list_drawn_options([STICK]), REACH, SETTINGS)
    ranking = rank_options(choice, NOVICE, np.random.default_rng(3), SAMPLES)
    for one, other in zip(advices[Criterion.WORK].ranked, ranking.ranked, strict=True):
        assert one.option.name == other.option.name
        assert one.work.mean == pytest.approx(other.work)
        assert one.effort.mean == pytest.approx(other.effort)
        assert (one.work.p05, one.work.p95) == pytest.approx(np.quantile(other.works, [0.05, 0.95]))
        assert (one.p_best, one.p_feasible) == (other.p_best, other.p_feasible)


def test_each_criterion_orders_by_its_own_number(advices):
    numbers = {
        Criterion.WORK: lambda each: each.work.mean,
        Criterion.EFFORT: lambda each: each.effort.mean,
        Criterion.MARGIN: lambda each: each.margin.p95,
    }
    for criterion, number in numbers.items():
        ranked = advices[criterion].ranked
        assert [each.value for each in ranked] == pytest.approx(sorted(number(each) for each in ranked))
        assert sum(each.p_best for each in ranked) == pytest.approx(1.0 - advices[criterion].p_none)
        assert advices[criterion].reasons.rival == 1


def test_wrench_counts_as_a_force_at_the_lever_of_the_gripper(advices):
    choice = plan_choice(list_drawn_options([STICK]), REACH, SETTINGS)
    demand = choice.compute_demands(choice.draw_parameters(NOVICE, np.random.default_rng(3), SAMPLES))
    by_name = {each.option.name: each for each in advices[Criterion.GRIP].ranked}
    for option, force, moment in zip(choice.options, demand.force, demand.moment, strict=True):
        as_force = np.sqrt(force**2 + (moment / GRIP_LEVER) ** 2)
        assert by_name[option.name].value == pytest.approx(np.quantile(as_force, 0.95))
    assert GripBounds(force=20.0, moment=1.0).lever == 0.05
    assert GripBounds(force=20.0).lever == GripBounds(moment=1.0).lever == GRIP_LEVER


def test_bounds_of_the_grip_take_part_in_feasibility():
    options = list_drawn_options([STICK])
    words = {"num_samples": SAMPLES, "criterion": Criterion.GRIP}
    free = weigh(options, Keep(1.0), NOVICE, SETTINGS, rng=np.random.default_rng(3), **words)
    bounds = GripBounds(moment=0.5 * free.best.moment.p95)
    advice = weigh(options, Keep(1.0), NOVICE, SETTINGS, bounds=bounds, rng=np.random.default_rng(3), **words)
    assert advice.num_usable == 0
    assert advice.reasons is None
    assert 0.0 < advice.p_none < 1.0
    with pytest.raises(
        AffordanceError, match=r"the grip must hold .* N m, --max-grip-moment allows .* N m; with 0\."
    ):
        _ = advice.best
