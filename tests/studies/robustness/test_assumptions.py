"""Sample of the assumptions that the paper does not state, and models built from a setting."""

import dataclasses

import numpy as np
import pytest
from helpers.refusals import refuse

from affordance.belief.density_belief import Prior
from affordance.choice.hammer import load_hammer
from affordance.control.cost_measure import CostMeasure
from affordance.control.timed_path import load_path
from affordance.experiments import com, weight
from affordance.experiments.shared.observers import Setup
from affordance.files.model_folder import MODELS
from affordance.objects.load import load_tools
from affordance.objects.materials import load_materials
from affordance.proprioception.torque_noise import WhiteNoise
from affordance.settings import DEFAULT_SETTINGS
from studies.robustness.assumptions import (
    list_defaults,
    load_assumptions,
    sample_places,
    sample_settings,
)
from studies.robustness.build import build_world

ASSUMPTIONS = load_assumptions()
DEFAULTS = list_defaults(ASSUMPTIONS)


def build(**changes):
    return build_world({**DEFAULTS, **changes}, MODELS, DEFAULT_SETTINGS)


def parameters(tools):
    return np.array([tool.parameters for tool in tools])


def test_every_assumption_has_a_source_and_its_default_in_its_range():
    for each in ASSUMPTIONS:
        assert len(each.source) > 10
        assert each.label
        if each.choices:
            assert each.default in each.choices
        else:
            assert each.low <= each.default <= each.high


def test_default_without_range_is_refused(tmp_path):
    path = tmp_path / "assumptions.yaml"
    path.write_text("weber: {label: w, source: s, range: [0.1, 0.2], default: 0.3}\n", encoding="utf-8")
    assert "the default 0.3 is not from 0.1 to 0.2" in refuse(load_assumptions, path, error=ValueError)
    for entry in ("range: [0.1, 0.2], default: wood", "range: 0.1, default: 0.1", "default: 0.1"):
        path.write_text(f"weber: {{label: w, source: s, {entry}}}\n", encoding="utf-8")
        with pytest.raises(ValueError, match="weber: needs a range of two numbers and a default, or choices"):
            load_assumptions(path)
    path.write_text("rule: {label: r, source: s, choices: [a, b], default: c}\n", encoding="utf-8")
    assert "is not among the choices" in refuse(load_assumptions, path, error=ValueError)


def test_defaults_are_the_simulations_to_the_last_bit():
    world = build()
    assert world.settings == DEFAULT_SETTINGS
    materials = load_materials(MODELS / "materials.yaml")
    np.testing.assert_array_equal(parameters(world.rods), parameters(weight.read(Setup())))
    np.testing.assert_allclose(parameters(world.learning), parameters(com.read(Setup())), rtol=1e-14, atol=1e-18)
    stick = load_tools(MODELS / "tools" / "novel.yaml", materials)[0]
    for grip, held in stick.list_gripped().items():
        np.testing.assert_allclose(
            world.novel.list_gripped()[grip].parameters, held.parameters, rtol=1e-12, atol=1e-15
        )
    assert world.reach.path == load_path(MODELS / "paths" / "reach.yaml")
    hammer = load_hammer(MODELS / "nail.yaml")
    assert world.hammer.force == pytest.approx(hammer.force, rel=1e-3)
    assert dataclasses.replace(world.hammer, nail=hammer.nail, force=hammer.force) == hammer
    assert (world.rule, world.plans_least_work) == ("one sample", False)


def test_a_bent_novel_tool_is_the_crooked_stick():
    materials = load_materials(MODELS / "materials.yaml")
    crooked = next(
        tool for tool in load_tools(MODELS / "tools" / "novel.yaml", materials) if tool.name == "crooked stick"
    )
    novel = build(novel_bend=float(np.radians(30.0))).novel
    for grip, held in crooked.list_gripped().items():  # the file has five digits
        np.testing.assert_allclose(novel.list_gripped()[grip].parameters, held.parameters, rtol=1e-3, atol=1e-6)


def densities(tools):
    return [pytest.approx(part.material.density) for tool in tools for part in tool.components]


def get_samples(world):
    return world.settings.noise.independent_samples, world.num_samples


@pytest.mark.parametrize(
    ("change", "read", "value"),
    [
        ({"noise_structure": "30 independent samples"}, get_samples, (True, 30)),
        ({"noise_structure": "5 independent samples"}, get_samples, (True, 5)),
        ({"noise_structure": "white", "white_sd": 0.5}, lambda world: world.settings.noise, WhiteNoise(0.5)),
        ({"prior_sd": 2500.0}, lambda world: world.settings.prior, Prior(1000.0, 2500.0, 0.06)),
        ({"horizon": 0.3}, lambda world: world.settings.mpc.horizon, 0.3),
        ({"cost_measure": "effort"}, lambda world: world.settings.cost_measure, CostMeasure.EFFORT),
        ({"acceleration_sd": 0.05}, lambda world: world.settings.acceleration_sd, 0.05),
        ({"nail_force": 200.0}, lambda world: world.hammer.nail.force_demanded, pytest.approx(200.0)),
        ({"rod_density": 2700.0}, lambda world: densities(world.rods[:4]), [2700.0] * 4),
        ({"rod_density": 4250.0}, lambda world: densities(world.rods[4:]), [360.0]),
        ({"decoy_share": 0.1}, lambda world: densities(world.rods), [8500.0] * 4 + [850.0]),
        ({"dense_density": 2700.0}, lambda world: densities(world.learning[:1]), [720.0, 720.0, 2700.0]),
        ({"dense_density": 2700.0}, lambda world: densities([world.novel]), [720.0, 2700.0]),
        ({"wood_density": 450.0}, lambda world: densities([world.novel]), [450.0, 7850.0]),
        ({"nail_height": -0.3}, lambda world: world.hammer.offset[2], -0.3),
        ({"path_rise": 0.1}, lambda world: world.reach.path.points[-1][2], pytest.approx(0.0, abs=1e-12)),
        ({"path_duration": 3.0}, lambda world: world.reach.duration, 3.0),
        ({"start_elbow": 0.2}, lambda world: dict(world.hammer.start)["elbow_flexion"], pytest.approx(1.3376)),
        (
            {"novel_parts": "unequal", "novel_share": 0.3},
            lambda world: world.novel.components[0].shape.sizes[0],
            pytest.approx(0.045),
        ),
    ],
)
def test_each_assumption_reaches_what_it_is_about(change, read, value):
    assert read(build(**change)) == value
    assert read(build()) != value


def test_settings_fill_every_range_and_the_first_are_the_same_for_any_number():
    count = 320
    settings = sample_settings(ASSUMPTIONS, count, 0)
    assert settings[:7] == sample_settings(ASSUMPTIONS, 7, 0)
    assert settings != sample_settings(ASSUMPTIONS, count, 1)
    places = sample_places(len(ASSUMPTIONS), count, 0)
    fifths = np.array([np.bincount((5 * column).astype(int), minlength=5) for column in places.T])
    assert np.abs(fifths - count / 5).max() <= 4  # independent draws are off by 20
    shares = [sum(setting["planner"] == "least work" for setting in settings) / count]
    assert shares == pytest.approx([0.1], abs=0.01)
    for setting in settings:
        for each in ASSUMPTIONS:
            assert setting[each.name] in each.choices or each.low <= setting[each.name] <= each.high
