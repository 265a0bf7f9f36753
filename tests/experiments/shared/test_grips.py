"""Choices of a grip by observers with made-up beliefs, and the share of those of the cheaper grip."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from helpers.refusals import refuse
from helpers.shared import compute_once
from helpers.two_tools import HAMMER, REACH, STEEL, STICK, WOOD, believe

from affordance.choice.inner_simulation import plan_choice
from affordance.choice.listed_options import list_options
from affordance.choice.picking import NO_OPTION
from affordance.choice.ranking import rank_options
from affordance.experiments.shared.grips import (
    NUM_BAYES_SAMPLES,
    NUM_PRIOR_CHOICES,
    NUM_PROBABILITY_SAMPLES,
    caption_proportions,
    check_one_grip_is_cheaper,
    choose_before_experience,
    choose_by_expectation,
    choose_by_sample,
    compare_measures,
    compute_probabilities,
    estimate_correct,
    estimate_probability,
    find_cheaper_grip,
    find_grip_of_densest,
    measure_choices,
    remove_errors,
    tabulate_tools,
)
from affordance.extensions.pixels.pixel_eye import PIXELS
from affordance.files.model_folder import MODELS
from affordance.proprioception.faults import Faults
from affordance.runs.random_streams import Stream
from affordance.settings import DEFAULT_SETTINGS
from affordance.vision.features import VisionError

TOOLS = (STICK, HAMMER)
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
        lambda: [plan_choice(list_options(tool), REACH) for tool in TOOLS],
    )


def know(*densities):
    """Memories of an observer who knows two densities to 1 kg/m^3 at each moment."""
    return [believe(*each, sd=1.0) for each in densities]


@pytest.mark.parametrize("rule", [choose_by_sample, lambda *arguments: choose_by_expectation(*arguments)[0]])
def test_each_choice_is_by_what_is_believed_at_that_moment(choices, rule):
    stick, _ = choices
    memories = know(WOOD_IS_HEAVY, STEEL_IS_HEAVY, STEEL_IS_HEAVY, TOO_HEAVY, WOOD_IS_HEAVY)
    assert rule(stick, memories, (0, 0)).tolist() == [BY_WOOD, BY_STEEL, BY_STEEL, NO_OPTION, BY_WOOD]


def test_each_tool_is_chosen_about_by_itself(choices):
    memories = know(PLAIN_BY_WOOD, STEEL_IS_HEAVY, PLAIN_BY_WOOD)
    found = [choose_by_sample(choice, memories, (0, 0)).tolist() for choice in choices]
    assert found == [[BY_WOOD, BY_STEEL, BY_WOOD], [BY_STEEL, BY_STEEL, BY_STEEL]]


def test_choice_and_flips_are_those_of_a_ranking(choices):
    """Also where no option is usable and none is chosen."""
    memories = know(STEEL_IS_HEAVY, WOOD_IS_HEAVY, TOO_HEAVY, PLAIN_BY_WOOD)
    for choice in choices:
        chosen, flips = choose_by_expectation(choice, memories, (0, 0))
        for trial, memory in enumerate(memories):
            rng = np.random.default_rng([0, 0, trial, Stream.BAYES])
            ranking = rank_options(choice, memory, rng, NUM_BAYES_SAMPLES)
            usable = ranking.num_usable > 0
            assert chosen[trial] == (choice.options.index(ranking.best.option) if usable else NO_OPTION)
            assert flips[trial] == ranking.flips


def test_flips_are_choices_by_effort_that_differ(choices, monkeypatch):
    stick, _ = choices
    compute = stick.compute_costs

    def compute_with_swapped_efforts(choice, pi):
        costs = compute(pi)
        return costs._replace(effort=costs.effort[::-1])

    monkeypatch.setattr(type(stick), "compute_costs", compute_with_swapped_efforts)
    memories = know(STEEL_IS_HEAVY, WOOD_IS_HEAVY)
    assert choose_by_expectation(stick, memories, (0, 0))[1].tolist() == [True, True]


def test_choices_of_an_observer_are_those_of_seed_and_number(choices):
    """Choices between equal densities depend on seed and number of the observer, and go either way."""
    unsure = [believe(3000.0, 3000.0, sd=1000.0)] * 40
    first, again, other, seeded = (
        choose_by_sample(choices[0], unsure, seed).tolist() for seed in ((0, 0), (0, 0), (0, 1), (1, 0))
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
    np.testing.assert_array_equal(estimate_correct(chosen, 0).mean, [1.0, 0.5, 0.5])


def test_probability_is_the_share_of_many_draws(choices):
    """An option is the cheapest as often as the paper's rule draws it; where none is usable, all are guessed."""
    stick, _ = choices
    memories = [
        *know(STEEL_IS_HEAVY, TOO_HEAVY),
        believe(3000.0, 3000.0, sd=1000.0),
        believe(3500.0, 3000.0, sd=1000.0),
    ]
    found = compute_probabilities(stick, memories, (0, 0))
    assert found[:2].tolist() == [[0.0, 1.0], [0.5, 0.5]]
    for row, memory in zip(found[2:], memories[2:], strict=True):
        drawn = choose_by_sample(stick, [memory] * 400, (0, 0))
        error = np.sqrt(0.25 / 400 + 0.25 / NUM_PROBABILITY_SAMPLES)
        assert row[BY_STEEL] == pytest.approx((drawn == BY_STEEL).mean(), abs=4.0 * error)
    assert found[3, BY_WOOD] > found[2, BY_WOOD]


def test_choices_from_the_prior_stand_in_for_those_before_the_first_trial():
    right = np.column_stack([np.zeros(100), np.ones(100), np.tile([0.6, 0.8], 50)])
    before = np.repeat([0, 1], 5000)
    estimate = estimate_probability(right, before, 0)
    np.testing.assert_allclose(estimate.mean, [0.5, 1.0, 0.7])
    # By hand: Wilson's interval 0.5 -+ 1.96 sqrt(0.25 / 10000 + ...), and the mean -+ 1.984 times its standard error.
    assert estimate.low[0] == pytest.approx(0.4902, abs=1e-4)
    assert (estimate.low[1], estimate.high[1]) == (1.0, 1.0)
    assert estimate.low[2] == pytest.approx(0.7 - 1.98422 * 0.1 / np.sqrt(99), abs=1e-6)


def test_cheaper_grip_is_that_of_least_work():
    simulated = {"wood": SimpleNamespace(work=2.0), "steel": SimpleNamespace(work=1.5)}
    assert find_cheaper_grip(simulated) == "steel"


@pytest.mark.parametrize("works", [(8.0, 8.0), (8.0, 8.0 * (1.0 + 1e-10))])
def test_the_grips_of_a_tool_must_differ(works):
    path = MODELS / "tools" / "novel.yaml"
    said = "novel.yaml: tools: stick: costs 8 J in both grips, must have a cheaper one"
    assert said in refuse(check_one_grip_is_cheaper, path, STICK, works)
    check_one_grip_is_cheaper(path, STICK, (8.0, 8.001))


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
        eye=PIXELS,
        vision_error=VisionError(size=0.1),
        faults=Faults(arm_mass_factor=1.05),
    )
    assert remove_errors(mistaken) == DEFAULT_SETTINGS


def simulate(wood, steel):
    return {"wood": SimpleNamespace(work=wood), "steel": SimpleNamespace(work=steel)}


OF_STICK = np.array([[1, 0, 0], [1, 1, 0], [1, 0, -1], [1, 0, -1]])
OF_HAMMER = np.array([[0, 1, 1], [0, 1, 0], [0, 1, 0], [0, 1, -1]])


def divide(chosen):
    """Probabilities of two grips: .9 of the chosen one, or one half."""
    return np.where(chosen[..., None] < 0, 0.5, np.where(chosen[..., None] == [0, 1], 0.9, 0.1))


@pytest.fixture
def measured(choices):
    """Numbers of made-up choices of four observers; wood is right for the stick, and steel for the hammer.

    Before experience the choice with the stick is at chance level, and that with the hammer is not.
    """
    flips = [[True, False, True], [False, False, True], [False, False, True], [False, True, True]]
    data = xr.Dataset(
        {
            "paper": (("observer", "tool", "moment"), np.stack([OF_STICK, OF_HAMMER], axis=1)),
            "probability": (
                ("observer", "tool", "moment", "grip"),
                np.stack([divide(OF_STICK), divide(OF_HAMMER)], axis=1),
            ),
            "bayes": (("observer", "moment"), [[0, 1, 1], [0, 1, 1], [0, 0, 1], [1, 1, 1]]),
            "flips": (("observer", "moment"), flips),
        }
    )
    return measure_choices(
        data,
        TOOLS,
        dict(zip(("stick", "hammer"), choices, strict=True)),
        {"stick": simulate(8.0, 10.0), "hammer": simulate(9.0, 6.0)},
        {"stick": 0.01, "hammer": 0.02},
        colours=(WOOD, STEEL),
        seed=0,
    )


def test_numbers_of_made_up_choices_by_hand(measured):
    assert (measured["correct_grip"], measured["correct_grip_headed_tool"]) == ("wood", "steel")
    assert measured["p_correct"][0] == pytest.approx(0.5, abs=4 * 0.5 / np.sqrt(10_000))
    assert measured["p_correct_headed_tool"][0] > 0.8
    assert measured["p_correct"][1:] == pytest.approx([(3 * 0.9 + 0.1) / 4, (2 * 0.9 + 2 * 0.5) / 4])
    assert measured["p_correct_drawn"][1:].tolist() == [0.75, 0.75]
    assert measured["p_correct_bayes"].tolist() == [0.75, 0.25, 0.0]
    assert measured["p_correct_headed_tool"][1:] == pytest.approx([0.9, (0.9 + 2 * 0.1 + 0.5) / 4])
    for key in ("p_correct", "p_correct_bayes", "p_correct_headed_tool"):
        low, high = measured[f"{key}_ci95"].T
        assert (low <= measured[key]).all()
        assert (measured[key] <= high).all()
    for tool, key in (("stick", "p_correct"), ("hammer", "p_correct_headed_tool")):
        np.testing.assert_array_equal(measured["tools"][tool]["p_correct"], measured[key])
        assert measured["tools"][tool]["chance"] == measured[key][0]
    assert list(measured["tools"]) == ["stick", "hammer"]
    assert [name for name, tool in measured["tools"].items() if tool["chance_by_symmetry"]] == ["stick"]
    assert [each["energy_ratio_true"] for each in measured["tools"].values()] == [1.25, 1.5]
    assert measured["off_axis_2mm_change"] == 0.02
    assert measured["effort_flips"].tolist() == [0.25, 0.25, 1.0]
    assert measured["energy_ratio_true"] == 1.25
    assert measured["energy_true_headed_tool"] == {"wood": 9.0, "steel": 6.0}
    assert measured["density_true"] == {"beech": 720.0, "steel": 7850.0}


def test_words_and_rows_are_about_the_tools_that_there_are(measured):
    whole = caption_proportions(TOOLS, measured)
    assert "Both ends of the stick look alike, so chance is one half by symmetry; for the others" in whole
    alone = {**measured, "tools": {"hammer": measured["tools"]["hammer"]}}
    caption = caption_proportions((HAMMER,), alone)
    assert "Chance depends on the shapes." in caption
    assert "For the hammer, two rules" in caption
    assert not any(wrong in caption for wrong in ("both ends", "Both ends", "the others"))
    rows = tabulate_tools(measured)
    assert rows.index.tolist() == ["stick", "hammer"]
    assert rows["correct before"].str.contains("by symmetry").tolist() == [True, False]
    assert rows["absolute work by grip"].iloc[1] == "9.00 J (wood) and 6.00 J (steel)"
    assert rows["after one trial"].tolist() == ["70.0%", "90.0%"]


@pytest.mark.parametrize(
    ("effort", "word"), [({"wood": 1.0, "steel": 2.0}, "agrees"), ({"wood": 2.0, "steel": 1.0}, "does not agree")]
)
def test_other_measure_of_effort_agrees_or_not(measured, effort, word):
    said = compare_measures({**measured, "effort_true": effort}, STICK)
    assert f"measure of effort, {word} with the absolute work" in said
