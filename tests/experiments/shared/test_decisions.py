"""Share of choices of the cheaper grip, by observers with made-up beliefs."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.refusals import refuse
from helpers.shared import compute_once
from helpers.two_tools import HAMMER, REACH, STEEL, STICK, WOOD

from affordance.choice.inner_simulation import plan_choice
from affordance.choice.listed_options import list_options
from affordance.choice.picking import NO_OPTION
from affordance.choice.ranking import Ranking
from affordance.experiments.shared import decisions
from affordance.experiments.shared.decisions import (
    NUM_PRIOR_CHOICES,
    check_one_grip_is_cheaper,
    choose_before_experience,
    choose_by_expectation,
    choose_by_sample,
    count_correct,
    estimate_correct,
    find_cheaper_grip,
    find_grip_of_densest,
    label_choices,
    let_observer_choose,
    remove_errors,
)
from affordance.experiments.shared.experience import Experience
from affordance.files.model_folder import MODELS
from affordance.proprioception.faults import Faults
from affordance.settings import DEFAULT_SETTINGS
from affordance.vision.features import FeatureSource, VisionError

# Densities of wood and steel of which the answer is known: the heavier end belongs into the hand; the hammer's handle
# is the longer lever, so that it takes more than a heavier wood to hold it there; the last is too heavy for the arm.
WOOD_IS_HEAVY, STEEL_IS_HEAVY, PLAIN_BY_WOOD, TOO_HEAVY = (8e3, 7e2), (7e2, 8e3), (3e3, 2e3), (24e3, 24e3)
BY_WOOD, BY_STEEL = 0, 1


@pytest.fixture(scope="module")
def choices(tmp_path_factory):
    """A choice of a grip for reaching with the stick, and one with the hammer."""
    return compute_once(
        tmp_path_factory,
        "choices_for_reaching",
        lambda: [plan_choice(list_options(tool), REACH) for tool in (STICK, HAMMER)],
    )


def experience_by_hand(densities):
    """Observers who know two densities to 1 kg/m^3 at each moment, (repeats, K + 1, 2)."""
    rho = np.array(densities)
    order = np.zeros((len(rho), rho.shape[1] - 1), dtype=np.intp)
    return Experience((WOOD, STEEL), np.broadcast_to(np.eye(2), (*rho.shape, 2)), rho, order)


@pytest.mark.parametrize("rule", [choose_by_sample, lambda *arguments: choose_by_expectation(*arguments)[0]])
def test_each_choice_is_by_what_is_believed_at_that_moment(choices, rule):
    experience = experience_by_hand(
        [
            [WOOD_IS_HEAVY, STEEL_IS_HEAVY, STEEL_IS_HEAVY, TOO_HEAVY, WOOD_IS_HEAVY],
            [STEEL_IS_HEAVY, TOO_HEAVY, WOOD_IS_HEAVY, WOOD_IS_HEAVY, STEEL_IS_HEAVY],
        ],
    )
    stick, _ = choices
    assert rule(stick, experience, 0, 0).tolist() == [BY_WOOD, BY_STEEL, BY_STEEL, NO_OPTION, BY_WOOD]
    assert rule(stick, experience, 0, 1).tolist() == [BY_STEEL, NO_OPTION, BY_WOOD, BY_WOOD, BY_STEEL]


def test_flips_are_those_of_each_moment(monkeypatch):
    """Flips are those of each moment's belief also where no option is usable and none is chosen."""

    def rank_nothing(choice, memory, rng, num_samples):
        wood, steel = memory.belief.untruncated_mean
        return Ranking((), num_usable=0, min_feasibility=0.95, p_none=1.0, flips=bool(wood > steel))

    monkeypatch.setattr(decisions, "rank_options", rank_nothing)
    experience = experience_by_hand([[STEEL_IS_HEAVY, WOOD_IS_HEAVY, WOOD_IS_HEAVY]])
    chosen, flips = choose_by_expectation(None, experience, 0, 0)
    assert flips.tolist() == [False, True, True]
    assert chosen.tolist() == [NO_OPTION] * 3


def test_each_tool_is_chosen_about_by_itself(choices):
    experience = experience_by_hand([[PLAIN_BY_WOOD, STEEL_IS_HEAVY, PLAIN_BY_WOOD]])
    chosen = let_observer_choose(choices, experience, 0, 0)
    assert chosen["paper"].tolist() == [[BY_WOOD, BY_STEEL, BY_WOOD], [BY_STEEL, BY_STEEL, BY_STEEL]]
    assert chosen["bayes"].tolist() == [BY_WOOD, BY_STEEL, BY_WOOD]
    assert chosen["flips"].shape == (3,)


def test_choices_of_an_observer_are_those_of_seed_and_number(choices):
    """Choices between equal densities depend on seed and number of the observer, and go either way."""
    rho = np.full((2, 40, 2), 3000.0)
    unsure = Experience(
        (WOOD, STEEL), np.broadcast_to(1e-6 * np.eye(2), (2, 40, 2, 2)), 1e-6 * rho, np.zeros((2, 39))
    )
    stick, _ = choices
    first, again, other, seeded = (
        choose_by_sample(stick, unsure, seed, repeat).tolist() for seed, repeat in ((0, 0), (0, 0), (0, 1), (1, 0))
    )
    assert first == again
    assert first not in (other, seeded)
    assert 5 < sum(first) < 35


def test_choices_before_experience_are_drawn_from_the_prior(choices):
    stick, hammer = (choose_before_experience(choice, (WOOD, STEEL), 0) for choice in choices)
    assert len(stick) == NUM_PRIOR_CHOICES
    usable = stick[stick != NO_OPTION]
    assert (usable == BY_STEEL).mean() == pytest.approx(0.5, abs=4 * 0.5 / np.sqrt(len(usable)))
    assert (hammer == BY_STEEL).mean() > 0.7


def test_guesses_count_half():
    chosen = np.array([[0, 1, NO_OPTION], [0, 0, NO_OPTION]])
    np.testing.assert_array_equal(count_correct(chosen, 0), [2.0, 1.0, 1.0])


def test_choices_from_the_prior_stand_in_for_those_before_the_first_trial():
    chosen = np.zeros((100, 3), dtype=int)
    before = np.repeat([0, 1], 5000)
    estimate = estimate_correct(chosen, before, 0)
    np.testing.assert_allclose(estimate.mean, [0.5, 1.0, 1.0])
    # Wilson's interval by hand: 0.5 -+ 1.96 sqrt(0.25 / 10000 + ...) and n / (n + 1.96^2) to 1.
    assert estimate.low[0] == pytest.approx(0.4902, abs=1e-4)
    assert estimate.low[1] == pytest.approx(100 / (100 + 1.959964**2), rel=1e-6)
    assert estimate.high[1] == 1.0
    assert estimate_correct(chosen, None, 0).mean.tolist() == [1.0, 1.0, 1.0]


def test_choices_are_labelled_by_observer_tool_and_moment():
    arrays = {"paper": np.zeros((4, 2, 7), dtype=int), "bayes": np.zeros((4, 7), dtype=int)}
    for labelled, dimensions in zip(
        label_choices(arrays).values(), (("repeat", "tool", "moment"), ("repeat", "moment")), strict=True
    ):
        assert labelled.dimensions == dimensions
        assert labelled.values.ndim == len(dimensions)
        assert "index of the grip chosen, -1 if none can be used" in labelled.meaning


def test_cheaper_grip_is_that_of_least_work():
    simulated = {"wood": SimpleNamespace(work=2.0), "steel": SimpleNamespace(work=1.5)}
    assert find_cheaper_grip(simulated) == "steel"


@pytest.mark.parametrize(
    ("works", "grips"),
    [((8.0, 8.0), "both grips"), ((8.0, 8.0 * (1.0 + 1e-10)), "both grips"), ((8.0, 9.0, 8.0), "two of its 3 grips")],
)
def test_the_two_cheapest_grips_of_a_tool_must_differ(works, grips):
    path = MODELS / "tools" / "novel.yaml"
    said = f"novel.yaml: tools: stick: costs 8 J in {grips}, must have a cheaper one"
    assert said in refuse(check_one_grip_is_cheaper, path, STICK, works)
    for others in ((9.0, 8.0, 9.0), (8.0, 8.001)):
        check_one_grip_is_cheaper(path, STICK, others)


def test_heavy_end_is_found_by_its_material_not_by_its_name():
    assert find_grip_of_densest(STICK, at_hand=True) == "steel"
    assert find_grip_of_densest(STICK, at_hand=False) == "wood"
    swapped = [
        dataclasses.replace(grip, name=name) for grip, name in zip(STICK.grips, ("left", "right"), strict=True)
    ]
    assert find_grip_of_densest(dataclasses.replace(STICK, grips=tuple(swapped)), at_hand=True) == "right"


def test_nothing_is_mistaken_where_errors_are_removed():
    mistaken = dataclasses.replace(
        DEFAULT_SETTINGS,
        feature_source=FeatureSource.PIXELS,
        vision_error=VisionError(size=0.1),
        faults=Faults(arm_mass_factor=1.05),
    )
    assert remove_errors(mistaken) == DEFAULT_SETTINGS
