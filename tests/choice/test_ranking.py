"""Rules of choice, on options of the novel tools and on made-up costs."""

import dataclasses
import re
from collections.abc import Callable

import numpy as np
import pytest
from helpers.refusals import refuse
from helpers.two_tools import HAMMER, REACH, STEEL, STICK, WOOD, believe
from scipy.stats import norm

from affordance.belief.material_memory import MaterialMemory
from affordance.choice.demand import Demand
from affordance.choice.hammer import load_hammer
from affordance.choice.inner_simulation import Choice, plan_choice
from affordance.choice.listed_options import list_options
from affordance.choice.motion_cost import Costs
from affordance.choice.picking import MIN_FEASIBILITY, NO_OPTION, pick_cheapest
from affordance.choice.ranking import rank, rank_options
from affordance.exceptions import AffordanceError
from affordance.files.model_folder import MODELS
from affordance.objects.inertia import Ellipsoid
from affordance.settings import DEFAULT_SETTINGS


@pytest.fixture(scope="module")
def choice():
    return plan_choice(list_options(STICK), REACH)


def test_ranking_is_what_the_samples_say(choice):
    memory = believe(720.0, 1200.0, 300.0)
    ranking = rank_options(choice, memory, np.random.default_rng(4), 5_000)
    pi = choice.draw_parameters(memory, np.random.default_rng(4), 5_000)
    works = np.array(
        [cost_model.compute(parameters).work for cost_model, parameters in zip(choice.cost_models, pi, strict=True)]
    )
    assert ranking.best.option.grip == "steel"
    best, other = ranking.ranked
    assert best.work == pytest.approx(works[1].mean(), rel=1e-12)
    assert other.work == pytest.approx(works[0].mean(), rel=1e-12)
    assert best.p_best == pytest.approx((works[1] < works[0]).mean(), abs=1e-12)
    assert 0.55 < best.p_best < 0.95
    assert best.p_best + other.p_best + ranking.p_none == pytest.approx(1.0)
    np.testing.assert_array_equal(best.works, works[1])


def test_without_experience_the_plain_object_is_a_matter_of_chance_and_the_headed_one_is_not():
    plain = rank(list_options(STICK), REACH, MaterialMemory())
    p_wood = next(entry.p_best for entry in plain.ranked if entry.option.grip == "wood")
    assert p_wood == pytest.approx(0.5, abs=4 * 0.5 / np.sqrt(10_000))
    headed = rank(list_options(HAMMER), REACH, MaterialMemory())
    assert headed.best.option.name == "hammer by steel"
    assert headed.best.p_best > 0.7


def test_different_tools_can_be_options():
    options = [*list_options(STICK), *list_options(HAMMER)]
    ranking = rank(options, REACH, believe(720.0, 7850.0, 50.0), num_samples=1_000)
    assert {entry.option.object_name for entry in ranking.ranked} == {"stick", "hammer"}
    works = [entry.work for entry in ranking.ranked]
    assert works == sorted(works)
    assert sum(entry.p_best for entry in ranking.ranked) == pytest.approx(1.0)


def test_seed_decides_the_samples():
    first, again = (rank(list_options(STICK), REACH, MaterialMemory(), num_samples=200, seed=1) for _ in range(2))
    other = rank(list_options(STICK), REACH, MaterialMemory(), num_samples=200, seed=2)
    np.testing.assert_array_equal(first.best.works, again.best.works)
    assert not np.array_equal(np.sort(first.best.works), np.sort(other.best.works))


def test_option_that_breaks_a_limit_is_never_chosen(choice):
    """The grip by the light end loads the wrist beyond its limit; the grip by the heavy end does not."""
    ranking = rank_options(choice, believe(500.0, 33_000.0, 100.0), np.random.default_rng(0), 500)
    best, other = ranking.ranked
    assert best.option.grip == "steel"
    assert best.p_feasible > 0.9
    assert other.p_feasible < 0.1
    assert other.p_best < 0.1
    assert ranking.num_usable == 1


def test_if_all_options_break_limits_it_is_said(choice):
    ranking = rank_options(choice, believe(24_000.0, 24_000.0, 100.0), np.random.default_rng(0), 500)
    assert ranking.num_usable == 0
    assert ranking.p_none == 1.0
    said = r"no option can be used: stick by \w+ is feasible with a probability of 0, must be at least 0.95: "
    said += r"wrist_deviation must bear 1.4 times its torque limit; stick by \w+ is feasible"
    with pytest.raises(AffordanceError, match=said):
        _ = ranking.best


def test_option_that_is_not_usable_does_not_change_the_order_of_the_others():
    """An anvil feasible for less than half of the samples is ranked last and leaves the others' work the same."""
    part = dataclasses.replace(STICK.components[1], shape=Ellipsoid((0.075, 0.03, 0.03)))
    anvil = dataclasses.replace(STICK, name="anvil", grips=(), components=(STICK.components[0], part))
    memory = believe(6000.0, 10_000.0, 3000.0)
    without = rank(list_options(STICK), REACH, memory, num_samples=3000)
    among = rank([*list_options(STICK), *list_options(anvil)], REACH, memory, num_samples=3000)
    assert among.num_usable == 2
    assert among.ranked[2].option.name == "anvil"
    assert among.ranked[2].p_feasible < 0.5
    assert [entry.option.name for entry in among.ranked[:2]] == [entry.option.name for entry in without.ranked]
    for ours, alone in zip(among.ranked, without.ranked, strict=False):
        assert ours.work == pytest.approx(alone.work, rel=0.02)


def test_equal_options_are_ranked_by_lot(choice):
    """Either grip of an object of one density is chosen for more than 8 of 40 seeds."""
    uniform = dataclasses.replace(
        STICK, components=tuple(dataclasses.replace(part, looks_like=part.material) for part in STICK.components)
    ).with_densities(dict.fromkeys((WOOD, STEEL), 800.0))
    one_look = tuple(
        dataclasses.replace(part, looks_like=STICK.components[0].looks_like) for part in uniform.components
    )
    alike = plan_choice(list_options(dataclasses.replace(uniform, components=one_look)), REACH)
    best = [
        rank_options(alike, MaterialMemory(), np.random.default_rng(seed), 20).best.option.grip for seed in range(40)
    ]
    assert 8 < best.count("wood") < 32


@pytest.mark.parametrize(
    ("asked", "bound"),
    [
        *(({"num_samples": count}, "from 1 to 100000") for count in (0, -1)),
        *(({"num_samples": 10, "min_feasibility": least}, "from 0 to 1") for least in (-0.1, 1.1, np.nan)),
    ],
)
def test_bounds_of_samples_and_feasibility_are_checked(choice, asked, bound):
    name, value = list(asked.items())[-1]
    said = refuse(rank_options, choice, MaterialMemory(), np.random.default_rng(0), error=ValueError, **asked)
    assert said.startswith(f"{name}: is {value}, must be {bound}")


@dataclasses.dataclass(frozen=True)
class MadeUpCost:
    """Costs that depend on the tool's mass alone, or not even on that."""

    work: Callable
    effort: Callable
    feasible: Callable = lambda mass: mass > 0.0
    infeasible_reason: str = ""
    q_start: np.ndarray = dataclasses.field(default_factory=lambda: np.zeros(7))

    def compute(self, pi):
        mass = pi[:, 0]
        return Costs(self.work(mass), self.effort(mass), self.feasible(mass), self.work(mass))

    def compute_demand(self, pi):
        """Every joint must bear twice its torque limit."""
        return Demand(np.full((7, len(pi)), 2.0), np.zeros(len(pi)), np.zeros(len(pi)))


def constant(value):
    return lambda mass: np.full(len(mass), value)


# Mass of two parts of 8000 kg/m^3, and a bit more: lighter than that is 100 / sqrt(2 (300^2 + 100^2))
# standard deviations above the middle of the belief below.
MASS = STICK.components[0].shape.volume * 8000.0
LIGHT_MAX = STICK.components[0].shape.volume * 8100.0
P_LIGHT = norm.cdf(100.0 / np.sqrt(2 * (300.0**2 + 100.0**2)))


def rank_made_up(wood, steel, *, num_samples=2_000, min_feasibility=MIN_FEASIBILITY):
    """Ranks the stick's two grips, by wood and by steel, by made-up costs; returns them in this order too."""
    choice = Choice(list_options(STICK), (wood, steel), DEFAULT_SETTINGS)
    memory = believe(2000.0, 6000.0, 300.0)
    ranking = rank_options(choice, memory, np.random.default_rng(0), num_samples, min_feasibility)
    return ranking, *sorted(ranking.ranked, key=lambda entry: entry.option.grip == "steel")


def is_light(mass):
    return mass <= LIGHT_MAX


def test_work_is_expected_over_the_same_densities_for_all_options():
    """Works are means over the same densities for all options; steel, cheaper where wood is feasible, comes second.

    Steel is always feasible and costs 101 J if the object is heavy, else 1 J; wood costs 2 J and needs a light one.
    """
    ranking, wood, steel = rank_made_up(
        MadeUpCost(constant(2.0), constant(30.0), is_light),
        MadeUpCost(lambda mass: np.where(is_light(mass), 1.0, 101.0), lambda mass: np.where(is_light(mass), 20, 900)),
        min_feasibility=0.5,
    )
    share = (steel.works == 1.0).mean()
    assert (ranking.num_usable, ranking.min_feasibility, ranking.best.option.grip) == (2, 0.5, "wood")
    assert (wood.work, wood.effort) == (2.0, 30.0)
    assert steel.work == pytest.approx(101.0 - 100.0 * share, rel=1e-12)
    assert steel.effort == pytest.approx(900.0 - 880.0 * share, rel=1e-12)
    assert not ranking.flips
    assert (wood.p_best, steel.p_best, ranking.p_none) == (0.0, 1.0, 0.0)
    assert steel.p_feasible == 1.0
    assert wood.p_feasible == share == pytest.approx(P_LIGHT, abs=4 * 0.5 / np.sqrt(2_000))
    np.testing.assert_array_equal(wood.works, np.where(steel.works == 1.0, 2.0, np.inf))


@pytest.mark.parametrize(("offset", "usable"), [(-1e-9, True), (1e-9, False)])
def test_option_counts_from_the_stated_probability_on(offset, usable):
    made_up = MadeUpCost(constant(1.0), constant(1.0), is_light), MadeUpCost(constant(2.0), constant(2.0))
    _, wood, _ = rank_made_up(*made_up)
    assert 0.1 < wood.p_feasible < 0.9
    ranking, wood, steel = rank_made_up(*made_up, min_feasibility=wood.p_feasible + offset)
    assert (not wood.infeasible_reason) == usable
    assert ranking.best.option.grip == ("wood" if usable else "steel")
    assert wood.p_best == wood.p_feasible
    assert not steel.infeasible_reason


def test_novice_is_told_of_the_stick_before_the_hammer():
    """The option that is best most often precedes the other: the stick by its wood, the hammer by its steel."""
    blow = load_hammer(MODELS / "nail.yaml")
    options = [*list_options(STICK), *list_options(HAMMER)]
    ranking = rank(options, blow, MaterialMemory(), num_samples=2_000)
    names = [entry.option.name for entry in ranking.ranked]
    assert names.index("stick by wood") < names.index("hammer by steel")
    assert ranking.min_feasibility == 0.95
    p_best = {entry.option.name: entry.p_best for entry in ranking.ranked}
    assert p_best["stick by wood"] > p_best["hammer by steel"]


def test_risky_option_comes_after_a_dearer_one_that_is_safe():
    """A cheap option feasible with a probability of 0.94 comes after one that always is, unless 0.9 is enough."""

    def is_light_enough(mass):
        return mass <= np.quantile(mass, 0.94)

    made_up = MadeUpCost(constant(1.0), constant(1.0), is_light_enough), MadeUpCost(constant(2.0), constant(2.0))
    ranking, wood, _ = rank_made_up(*made_up)
    assert wood.p_feasible == pytest.approx(0.94, abs=1e-3)
    assert [entry.option.grip for entry in ranking.ranked] == ["steel", "wood"]
    reason = "is feasible with a probability of 0.94, must be at least 0.95: "
    assert wood.infeasible_reason.startswith(reason)
    assert wood.infeasible_reason.endswith(" must bear 2 times its torque limit")
    ranking, *_ = rank_made_up(*made_up, min_feasibility=0.9)
    assert [entry.option.grip for entry in ranking.ranked] == ["wood", "steel"]


@pytest.mark.parametrize(
    ("feasible", "infeasible_reason", "message"),
    [
        (
            lambda mass: mass < 0.9 * MASS,
            "",
            r"is feasible with a probability of 0\.\d+, must be at least 0\.95: \w+ must bear 2 .*",
        ),
        (lambda mass: mass < 0.0, "leaves the path", "leaves the path"),
    ],
)
def test_option_that_is_not_usable_takes_no_part_in_the_comparison(feasible, infeasible_reason, message):
    """An option that is not usable never comes first, however cheap; the other's work is a mean over all samples."""
    ranking, wood, steel = rank_made_up(
        MadeUpCost(constant(0.5), constant(0.5), feasible, infeasible_reason),
        MadeUpCost(lambda mass: np.where(is_light(mass), 1.0, 101.0), lambda mass: np.where(is_light(mass), 20, 900)),
    )
    assert [entry.option.grip for entry in ranking.ranked] == ["steel", "wood"]
    assert (ranking.num_usable, steel.infeasible_reason) == (1, "")
    assert re.fullmatch(message, wood.infeasible_reason)
    share = (steel.works == 1.0).mean()
    assert steel.work == pytest.approx(101.0 - 100.0 * share, rel=1e-12)
    assert steel.effort == pytest.approx(900.0 - 880.0 * share, rel=1e-12)
    assert not ranking.flips


@pytest.mark.parametrize(("efforts", "flips"), [((10.0, 20.0), False), ((20.0, 10.0), True)])
def test_choice_flips_where_the_least_work_is_not_the_least_effort(efforts, flips):
    for works, grip in (((1.0, 2.0), "wood"), ((2.0, 1.0), "steel")):
        ranking, wood, steel = rank_made_up(
            *(MadeUpCost(constant(work), constant(effort)) for work, effort in zip(works, efforts, strict=True)),
        )
        assert ranking.best.option.grip == grip
        assert (wood.work, steel.work) == works
        assert (wood.effort, steel.effort) == efforts
        assert ranking.flips == (flips if grip == "wood" else not flips)


def test_options_that_no_sample_lets_both_be_used_are_compared_all_the_same():
    """Wood is feasible for light objects only, steel for heavy ones; wood takes less work, and steel less effort."""
    ranking, wood, steel = rank_made_up(
        MadeUpCost(constant(1.0), constant(2.0), is_light),
        MadeUpCost(constant(2.0), constant(1.0), lambda mass: ~is_light(mass)),
        min_feasibility=0.3,
    )
    assert [entry.option.grip for entry in ranking.ranked] == ["wood", "steel"]
    assert ranking.num_usable == 2
    assert (wood.work, steel.work) == (1.0, 2.0)
    assert wood.p_feasible + steel.p_feasible == wood.p_best + steel.p_best == 1.0
    assert ranking.flips


def test_where_no_option_is_feasible_none_is_the_best():
    ranking, wood, steel = rank_made_up(
        MadeUpCost(constant(1.0), constant(1.0), is_light),
        MadeUpCost(constant(2.0), constant(2.0), is_light),
    )
    assert wood.p_best == wood.p_feasible == steel.p_feasible
    assert steel.p_best == 0.0
    assert wood.p_best + ranking.p_none == pytest.approx(1.0, abs=1e-12)
    assert ranking.p_none == pytest.approx(1.0 - P_LIGHT, abs=4 * 0.5 / np.sqrt(2_000))


def test_cheapest_feasible_option_is_picked():
    cost, feasible = np.array([[1.0, 5.0, 2.0, 9.0], [2.0, 3.0, 1.0, 1.0]]), np.array([[1, 1, 1, 0], [1, 1, 0, 0]])
    costs = Costs(-cost, -cost, feasible.astype(bool), cost)  # its work and effort would decide otherwise
    np.testing.assert_array_equal(pick_cheapest(costs, np.random.default_rng(0)), [0, 1, 0, NO_OPTION])


def test_ties_are_broken_by_a_fair_coin():
    work = np.full((2, 20_000), 3.0)
    work[1] *= 1.0 + 1e-14
    costs = Costs(work, work, np.ones(work.shape, dtype=bool), work)
    share = pick_cheapest(costs, np.random.default_rng(0)).mean()
    assert share == pytest.approx(0.5, abs=4 * 0.5 / np.sqrt(20_000))
