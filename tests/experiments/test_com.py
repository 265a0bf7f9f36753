"""Simulation II: few observers."""

import dataclasses

import numpy as np
import pytest
from helpers.changed_files import change_file
from helpers.results_files import read_numbers, read_section, render
from helpers.short_holds import shorten

from affordance.experiments.protocol_runs import load_hold_experiment
from affordance.experiments.runner import run_experiment
from affordance.experiments.shared.experience import draw_order
from affordance.experiments.shared.gain_experience import collect_experience, gain_experience
from affordance.experiments.shared.recall import recall
from affordance.objects.tool import list_densities
from affordance.proprioception.faults import Faults


@pytest.fixture(scope="module")
def name():
    return "com"


def test_masses_are_equal_and_centres_of_mass_mirror_each_other(experiment):
    first, second, decoy = experiment.tools
    # Three spheroids of one volume: 720 + 720 + 7850 kg/m^3 times 4/3 pi 0.05 0.02^2.
    mass = (2 * 720 + 7850) * 4 / 3 * np.pi * 0.05 * 0.02**2
    for tool in experiment.tools:
        assert tool.mass == pytest.approx(mass, rel=1e-12)
    assert first.p_TTcm[0] == pytest.approx(720 * (0.05 + 0.15) / 9290 + 7850 * 0.25 / 9290, rel=1e-12)
    assert second.p_TTcm[0] == pytest.approx(0.30 - first.p_TTcm[0], rel=1e-12)
    np.testing.assert_allclose(decoy.parameters, second.parameters, rtol=1e-12)


def test_decoy_rises_and_the_honest_objects_stay(numbers):
    assert numbers["density_true"] == {"beech": 720.0, "steel": 7850.0}
    assert numbers["height_extreme_m"][2] > 2 * max(numbers["deviation_m"][:2])


def test_decoy_is_what_is_least_probable_in_the_test_pass(numbers):
    """The p-value of the decoy is below 0.001 and those of the others above 0.05; no sample is rejected."""
    assert numbers["p_value_test"][2] < 1e-3 < 0.05 < min(numbers["p_value_test"][:2])
    assert numbers["trials_outlier_test"][:2] == [0, 0]
    assert numbers["samples_rejected_test"] == [0, 0, 0]


def test_faults_are_counted_in_the_test_pass_and_named(experiment, tmp_path, caplog):
    faults = dataclasses.replace(experiment.settings, faults=Faults(drop_probability=1.0))
    faulty = dataclasses.replace(shorten(experiment, 0.3, repetitions=1), settings=faults)
    run_experiment(faulty, None, tmp_path / "com", repeats=1, jobs=1)
    numbers = read_numbers(tmp_path / "com")
    assert numbers["samples_rejected_test"] == [3, 3, 3]
    assert numbers["samples_rejected"] == 6
    assert "experience: 6 samples were rejected, and 0 of 2 trials are 5-sigma outliers" in caplog.text
    assert "com: 9 samples were rejected, and 0 trials with non-decoy objects are 5-sigma outliers" in caplog.text
    remarks = read_section(tmp_path / "com").remarks
    assert any(remark.startswith("Run with faults: drop_probability 1.0.") for remark in remarks)
    assert numbers["config"]["settings"]["faults"]["drop_probability"] == 1.0
    assert (numbers["seed"], numbers["repeats"]) == (0, 1)


def test_remarks_and_captions_say_what_is_seen(folder):
    section = read_section(folder)
    assert any("weigh the same (0.778 kg)" in remark for remark in section.remarks)
    assert any("The arm braces" in figure["caption"] for figure in section.figures)


def test_error_is_seen_on_its_side_of_the_bound(experiment, numbers):
    claims = {claim.key: claim for claim in render(experiment, None, numbers, inertia_error=0.1002).claims}
    assert not claims["inertia"].met
    assert claims["inertia"].criteria[0].value == "10.02 %"


def test_prediction_is_that_of_the_densities_learned(experiment, folder):
    """Predicted mass and first moment equal sums by hand over the most probable densities, to 1e-9."""
    experience = collect_experience(experiment.experience, folder.parent / "experience", repeats=2, jobs=1)
    arrays = experiment.run_observer(None, experience, 1)
    densities = dict(zip(experience.colours, recall(experience, 1, 6).belief.compute_mode(), strict=True))
    first = experiment.tools[0]
    masses = np.array(
        [
            densities[part.looks_like.colour] * 4 / 3 * np.pi * np.prod(part.shape.semi_axes)
            for part in first.components
        ]
    )
    pi = arrays["parameters_predicted"]
    assert pi[0, 0] == pytest.approx(masses.sum(), rel=1e-9)
    places = np.array([part.X_TE[0, 3] for part in first.components])
    assert pi[0, 1] == pytest.approx(masses @ places, rel=1e-9)
    # To the eye the decoy is the first object.
    np.testing.assert_array_equal(pi[0], pi[2])


def test_blocks_hold_every_object_once_in_random_order(experiment):
    orders = [draw_order(experiment.experience, repeat) for repeat in range(40)]
    for order in orders:
        assert [sorted(order[k : k + 2]) for k in (0, 2, 4)] == [[0, 1]] * 3
    assert len({tuple(order) for order in orders}) == 8  # all the orders there are
    assert orders[3] == draw_order(experiment.experience, 3)


def test_experience_narrows_the_belief_about_both_materials(experiment):
    short = dataclasses.replace(experiment.experience, duration=0.3)
    arrays = gain_experience(short, 0)
    assert arrays["precision"].shape == (7, 2, 2)
    determinants = np.linalg.det(arrays["precision"])
    assert (np.diff(determinants) > 0).all()


def test_numbers_are_those_of_made_up_arrays(experiment):
    """Medians of chosen errors of three observers lie halfway between the third and fourth of six."""
    mass = np.array([[0.01, -0.05, 9.0], [-0.02, 0.04, 9.0], [0.03, 0.60, 9.0]])
    com_m = 1e-3 * np.array([[11.0, 14.0, 900.0], [12.0, 15.0, 900.0], [13.0, 80.0, 900.0]])
    inertia = np.array([[-0.21, 0.24, 9.0], [0.22, -0.25, 9.0], [-0.23, 0.90, 9.0]])
    predicted = np.array([[tool.parameters for tool in experiment.tools]] * 3)
    places = predicted[..., 1:4] / predicted[..., :1] + com_m[..., None] * [0.6, 0.0, -0.8]
    predicted[..., 0] *= 1.0 + mass
    predicted[..., 1:4] = predicted[..., :1] * places
    predicted[..., 4:7] *= 1.0 + inertia[..., None]
    # Heights at four times, of which the third is the farthest.
    course = np.array([0.0, 0.5, 1.0, -0.25])
    peaks = np.array([[0.01, 0.02, 0.10], [-0.02, 0.02, 0.11], [0.04, -0.01, 0.12]])
    rho = np.array([[700, 7000], [900, 8000], [1700, 7900]])
    arrays = {
        "presented": np.array([[0, 1, 2]] * 3),
        "densities": np.repeat(rho[:, None], 3, axis=1),
        "parameters_predicted": predicted,
        "parameters_true": np.array([[tool.parameters for tool in experiment.tools]] * 3),
        "height_centre": peaks[..., None] * course,
        "height_grip": 2.0 * peaks[..., None] * course,
        "height_com": -3.0 * peaks[..., None] * course,
        "periods_limited": np.array([[1, 10, 100], [2, 20, 200], [3, 30, 300]]),
        "periods_failed": np.array([[0, 0, 1], [0, 1, 1], [0, 0, 0]]),
        "rejected": np.array([[0, 1, 2], [0, 2, 0], [0, 0, 4]]),
        "p_value": np.array([[0.9, 1e-9, 0.0], [0.5, 0.1, 1e-20], [0.2, 0.3, 1e-12]]),
    }
    numbers = experiment.compute_metrics(None, None, arrays)
    assert numbers["mass_error"] == pytest.approx(0.035, rel=1e-12)
    assert numbers["com_error_m"] == pytest.approx(13.5e-3, rel=1e-12)
    assert numbers["inertia_error"] == pytest.approx(0.235, rel=1e-12)
    extreme = np.array([0.01, 0.01, 0.11])
    np.testing.assert_allclose(numbers["height_extreme_m"], extreme, rtol=1e-12)
    np.testing.assert_allclose(numbers["height_extreme_grip_m"], 2.0 * extreme, rtol=1e-12)
    np.testing.assert_allclose(numbers["height_extreme_com_m"], -3.0 * extreme, rtol=1e-12)
    np.testing.assert_allclose(numbers["deviation_m"], [0.07 / 3, 0.05 / 3, 0.11], rtol=1e-12)
    # t(0.975, 2) = 4.302653 times the standard error; standard deviations are 0.03, sqrt(3) 0.01 and 0.01.
    half = 4.302653 / np.sqrt(3) * np.array([0.03, np.sqrt(3) * 0.01, 0.01])
    np.testing.assert_allclose(numbers["height_extreme_m_ci95"][:, 1] - extreme, half, rtol=1e-6)
    np.testing.assert_allclose(extreme - numbers["height_extreme_m_ci95"][:, 0], half, rtol=1e-6)
    assert numbers["periods_limited"].tolist() == [6, 60, 600]
    assert numbers["periods_failed"].tolist() == [0, 1, 2]
    assert numbers["samples_rejected_test"].tolist() == [0, 3, 6]
    assert numbers["trials_outlier_test"].tolist() == [0, 1, 3]
    np.testing.assert_allclose(numbers["p_value_test"], [0.5, 0.1, 1e-20])
    assert numbers["density_median"] == pytest.approx({"beech": 900.0, "steel": 7900.0}, rel=1e-9)


def test_densities_are_listed_by_colour_in_the_order_of_the_components(experiment):
    first, second, _ = experiment.tools
    beech, steel = (part.material for part in first.components[1:])
    assert list(list_densities([first]).items()) == [(beech.colour, 720.0), (steel.colour, 7850.0)]
    assert list(list_densities([second, first]).items()) == [(steel.colour, 7850.0), (beech.colour, 720.0)]
    lighter = first.with_densities({beech.colour: 500.0, steel.colour: 7850.0})
    assert list_densities([second, lighter])[beech.colour] == 500.0


@pytest.mark.parametrize("colour", ["#838a99", "#7d8499", "#7d8a9f"])
def test_looks_six_steps_apart_in_one_channel_are_told_apart(models, colour):
    change_file(models / "materials.yaml", "#c98f5a", colour)
    assert len(load_hold_experiment("com", models).tools) == 3
