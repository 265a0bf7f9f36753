"""Texts beside the scene of ``affordance watch``, and its charts."""

import json
from dataclasses import replace

import numpy as np
import pytest

from affordance.belief.density_belief import Prior
from affordance.belief.material_memory import MaterialMemory
from affordance.extensions.watch.live_facts import (
    describe_grip,
    describe_masses,
    describe_motion,
    describe_surprise,
    draw_density_chart,
    draw_mass_chart,
    draw_masses,
    trace_densities,
)
from affordance.simulation.trial import TrialRunner


@pytest.fixture(scope="module")
def record(weight):
    settings = replace(weight.settings, posterior_log_period=0.1)
    return TrialRunner(settings).run_hold(weight.tools[0], MaterialMemory(), duration=0.5)


@pytest.fixture(scope="module")
def weight_beliefs(record):
    return record.posteriors[0].belief, record.posteriors[-1].belief


def find_middle(points):
    """The mean of a curve of a chart, as a share of its width."""
    x, y = np.array(points).T
    return np.trapezoid(x * y, x) / np.trapezoid(y, x)


def test_charts_show_what_was_expected_and_is_felt_beside_the_truth(weight, weight_beliefs):
    """Curves of masses have the means of their samples, to 1 %; so have those of densities but for a scale."""
    tool = weight.tools[0]
    expected, felt = weight_beliefs
    masses = draw_masses(expected), draw_masses(felt)
    charts = draw_mass_chart(tool, *masses), draw_density_chart(tool, expected, felt)
    for chart in charts:
        json.dumps(chart, allow_nan=False)
        assert [filled for _, _, filled in chart["curves"]] == [True, False]
        for points, _, _ in chart["curves"]:
            assert np.array(points).min() >= 0.0
            assert np.array(points).max() <= 1.0
    (points, _, _), ((truth, _),) = charts[0]["curves"][1], charts[0]["truths"]
    assert find_middle(points) / truth == pytest.approx(masses[1].mean() / tool.mass, rel=0.01)
    (points, _, _), ((truth, _),) = charts[1]["curves"][1], charts[1]["truths"]
    assert find_middle(points) / truth == pytest.approx(masses[1].mean() / tool.mass, rel=0.01)


def test_curves_are_the_marginal_densities():
    """The curve of a hardly truncated normal distribution is its density over the peak's, to 2 %."""
    memory = MaterialMemory.from_densities({"steel": 7850.0}).add_colours([], Prior())
    (curve,) = trace_densities(memory.belief)
    sd = float(np.sqrt(memory.belief.covariance[0, 0]))
    bell = np.exp(-0.5 * ((curve[:, 0] - 7850.0) / sd) ** 2)
    np.testing.assert_allclose(curve[:, 1], bell, atol=0.02)


def test_masses_are_given_with_their_interval():
    assert describe_masses(np.linspace(0.5, 0.7, 1001), 0.6) == "0.60 kg (0.51 to 0.69)"
    assert describe_masses(np.linspace(0.5, 0.7, 1001), 0.06) == "0.600 kg (0.510 to 0.690)"


@pytest.mark.parametrize(
    ("heights", "text"),
    [
        ([0.0, 0.031, 0.02], "3.1 cm up"),
        ([0.0, 0.02, -0.05], "5.0 cm down"),
    ],
)
def test_farthest_height_is_how_far_it_moved(record, heights, text):
    assert describe_motion(record._replace(height_centre=np.array(heights))) == text
    weak = record._replace(height_centre=np.array(heights), overloaded=("wrist",))
    assert describe_motion(weak) == f"{text}; wrist cannot hold it"


@pytest.mark.parametrize(
    ("p_value", "learns", "text"),
    [
        (0.5, True, "no (p = 0.50)"),
        (0.02, True, "somewhat (p = 0.020)"),
        (1e-8, True, "yes, beyond five sigma"),
        (1e-8, False, "yes, beyond five sigma: nothing is learned"),
    ],
)
def test_surprise_is_told_by_the_p_value(record, p_value, learns, text):
    assert describe_surprise(record._replace(p_value=p_value), learns_from_outliers=learns) == text


@pytest.mark.parametrize(
    ("costs", "text"),
    [
        ({"wood": 7.9, "steel": 13.7}, "right: by wood 7.9 J, by steel 13.7 J"),
        ({"wood": 17.9, "steel": 13.7}, "wrong: by wood 17.9 J, by steel 13.7 J"),
        ({"steel": np.inf, "wood": 7.9}, "right: by wood 7.9 J, by steel it cannot be done"),
        ({"steel": 7.9, "wood": np.inf}, "wrong: by wood it cannot be done, by steel 7.9 J"),
    ],
)
def test_a_grip_is_right_if_no_other_costs_less(costs, text):
    assert describe_grip(costs, "wood", "J") == text
