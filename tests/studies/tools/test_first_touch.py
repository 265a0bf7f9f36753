"""Predictions before first touch, and their scores."""

import dataclasses

import numpy as np
import pytest
from helpers.workshop import BLANKS, HAMMERS, MATERIALS

from affordance.belief.material_memory import MaterialMemory
from affordance.objects.tool import list_colours
from affordance.settings import Settings
from affordance.vision.eye import CAD_VOLUME_SD, measure_drawing
from studies.tools.first_touch import (
    Prediction,
    Truth,
    compute_shares,
    list_recurring,
    predict,
    predict_unfelt,
    predict_without_experience,
    score,
    take_first,
)
from studies.tools.holds import learn, simulate_holds

SETTINGS = Settings()


def test_measures_are_those_of_their_definition():
    predictions = [Prediction(np.array([0.5, 1.0, 3.0]), np.zeros((3, 3)))] * 2
    com = np.zeros((3, 3))
    com[0], com[2] = -0.01, 0.01
    predictions[1] = Prediction(np.array([0.9, 1.0, 1.1]), com)
    truths = [Truth(2.0, np.array([0, 0, 0.1])), Truth(0.8, np.array([0.0, 0.005, 0.02]))]
    found = score(predictions, truths)
    assert found.ade_g == pytest.approx(600.0)
    assert found.alde == pytest.approx(0.5 * (np.log(2.0) + np.log(1.25)))
    assert found.ape == pytest.approx(0.375)
    assert found.mnre == pytest.approx((0.5 + 0.8) / 2.0)  # not the root of their product, 0.63
    assert found.coverage_mass == 0.5
    assert found.coverage_com == pytest.approx(4 / 6)


def test_who_knows_densities_and_drawings_is_right_and_says_how_surely(rng):
    tool = HAMMERS["mallet"]
    memory = MaterialMemory.from_densities({each.colour: each.density for each in MATERIALS.values()})
    settings = Settings(prior=dataclasses.replace(SETTINGS.prior, deviation=1e-3))
    found = predict(measure_drawing(tool), memory, settings, rng)
    assert found.mass[1] == pytest.approx(tool.mass, rel=1e-3)
    # The parts' volumes err independently.
    masses = [part.material.density * part.shape.volume for part in tool.components]
    width = 2 * 1.645 * CAD_VOLUME_SD * np.hypot(*masses)
    assert found.mass[2] - found.mass[0] == pytest.approx(width, rel=0.1)


def test_floors_weigh_everything_alike():
    tool = HAMMERS["mallet"]
    volume = sum(part.shape.volume for part in tool.components)
    assert predict_without_experience(measure_drawing(tool), 7850.0).mass[1] == pytest.approx(
        7850.0 * volume, rel=1e-3
    )


def test_what_recurs_in_others_is_judged():
    tools = {**BLANKS, **HAMMERS}
    found = list_recurring(tools)
    assert "pin of brass" not in found  # nothing else is of brass
    assert "mallet" in found
    assert sum(compute_shares(tools["mallet"]).values()) == pytest.approx(1.0)


@pytest.fixture(scope="module")
def felt():
    return simulate_holds(list(BLANKS.values()), SETTINGS, rounds=2, seed=(3, 1))


def test_holding_teaches_what_materials_weigh_and_more_holds_teach_more(felt):
    drawings = {name: measure_drawing(tool) for name, tool in BLANKS.items()}
    colours = list_colours(list(BLANKS.values()))
    once, twice = (learn(take_first(felt, count), drawings, colours, SETTINGS).belief for count in (1, 2))
    true = np.array([MATERIALS[part.material.name].density for tool in BLANKS.values() for part in tool.components])
    sd = np.sqrt(np.diag(twice.covariance))
    assert (np.abs(twice.compute_mean() - true) < 4.0 * sd).all()
    assert (sd < np.sqrt(np.diag(once.covariance))).all()
    assert (np.abs(twice.compute_mean() / true - 1.0) < 0.6).all()
    # Same seed, same holds.
    again = simulate_holds([BLANKS["pin of brass"]], SETTINGS, rounds=1, seed=(3, 1))
    more = simulate_holds([BLANKS["pin of brass"]], SETTINGS, rounds=1, seed=(3, 1))
    np.testing.assert_array_equal(again["pin of brass"][0].features, more["pin of brass"][0].features)


def test_tool_that_is_left_out_teaches_nothing_about_itself(felt):
    drawings = {name: measure_drawing(tool) for name, tool in BLANKS.items()}
    colours = list_colours(list(BLANKS.values()))
    (found,) = predict_unfelt(["pin of brass"], felt, drawings, colours, SETTINGS, seed=0).values()
    # Only the prior is left: its interval spans more than a factor of three.
    assert found.mass[2] > 3.0 * found.mass[0]
