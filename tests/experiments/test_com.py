"""Simulation II: its objects, and its numbers against sums by hand."""

import dataclasses

import numpy as np
import pytest
import xarray as xr
from helpers.changed_files import change_file
from helpers.results_files import read_numbers, read_section

from affordance.experiments import com
from affordance.experiments.shared import experience
from affordance.experiments.shared.experience import gain_experience, recall
from affordance.experiments.shared.observers import Setup
from affordance.experiments.shared.suite import run_suite
from affordance.objects.tool import list_colours, list_densities
from affordance.proprioception.faults import Faults

TOOLS = com.read(Setup())
FIRST, SECOND, DECOY = TOOLS


@pytest.fixture
def short(monkeypatch):
    """Holds of 0.3 s, of each object once before the test."""
    monkeypatch.setattr(com, "DURATION", 0.3)
    monkeypatch.setattr(experience, "DURATION", 0.3)
    monkeypatch.setattr(experience, "REPETITIONS", 1)


def test_masses_are_equal_and_centres_of_mass_mirror_each_other():
    # Three spheroids of one volume: 720 + 720 + 7850 kg/m^3 times 4/3 pi 0.05 0.02^2.
    mass = (2 * 720 + 7850) * 4 / 3 * np.pi * 0.05 * 0.02**2
    for tool in TOOLS:
        assert tool.mass == pytest.approx(mass, rel=1e-12)
    assert FIRST.p_TTcm[0] == pytest.approx(720 * (0.05 + 0.15) / 9290 + 7850 * 0.25 / 9290, rel=1e-12)
    assert SECOND.p_TTcm[0] == pytest.approx(0.30 - FIRST.p_TTcm[0], rel=1e-12)
    np.testing.assert_allclose(DECOY.parameters, SECOND.parameters, rtol=1e-12)


def test_decoy_rises_and_is_what_is_least_probable_in_the_test_pass(shipped):
    """The p-value of the decoy is below 0.05 and those of the others above it; no sample is rejected."""
    numbers = shipped.numbers
    assert numbers["density_true"] == {"beech": 720.0, "steel": 7850.0}
    assert numbers["height_extreme_m"][2] > 2 * max(numbers["deviation_m"][:2])
    assert numbers["p_value_test"][2] < 0.05 < min(numbers["p_value_test"][:2])
    assert [*numbers["trials_outlier_test"][:2]] == [0, 0]
    assert [*numbers["samples_rejected_test"]] == [0, 0, 0]


@pytest.mark.usefixtures("short", "unrendered")
def test_faults_are_counted_in_the_test_pass_and_named(tmp_path, caplog):
    run_suite("com", Setup(observers=1, out=tmp_path).change(faults=Faults(drop_probability=1.0)))
    numbers = read_numbers(tmp_path / "com")
    assert numbers["samples_rejected_test"] == [3, 3, 3]
    assert numbers["samples_rejected"] == 6
    assert "experience: 6 samples were rejected, and 0 of 2 trials are 5-sigma outliers" in caplog.text
    assert "com: 9 samples were rejected, and 0 trials with non-decoy objects are 5-sigma outliers" in caplog.text
    assert read_section(tmp_path / "com").remarks[-1].startswith("Run with faults: drop_probability 1.0.")
    assert numbers["config"]["settings"]["faults"]["drop_probability"] == 1.0
    assert (numbers["seed"], numbers["repeats"]) == (0, 1)


def test_remarks_and_captions_say_what_is_seen(shipped):
    assert any("weigh the same (0.778 kg)" in remark for remark in shipped.remarks)
    first, decoy = (f"{100.0 * tool.p_TTcm[0]:.1f} cm" for tool in (FIRST, DECOY))
    said = f"braces for a centre of mass {first} from the grip and meets one at {decoy}"
    assert said in shipped.captions["figure6"]


def test_lifts_of_an_observer_are_those_of_both_passes(shipped):
    of_one = shipped.lifts[shipped.lifts["observer"] == 1]
    assert of_one["block"].tolist() == ["learning"] * 6 + ["test"] * 3
    assert of_one["lift"].tolist() == [*range(1, 10)]
    assert of_one["object"].tolist()[6:] == [tool.name for tool in TOOLS]


def test_error_is_seen_on_its_side_of_the_bound(shipped):
    claims = {claim.key: claim for claim in com.judge({**shipped.numbers, "inertia_error": 0.1002})}
    assert not claims["inertia"].met
    assert claims["inertia"].criteria[0].value == "10.02 %"


@pytest.mark.usefixtures("short")
def test_prediction_is_that_of_the_densities_learned(tmp_path):
    """Predicted mass and first moment equal sums by hand over the most probable densities, to 1e-9."""
    setup = Setup(observers=2, out=tmp_path)
    gained = gain_experience(setup, TOOLS[:2])
    found = com.observe(setup, TOOLS, gained, 1)
    memory = recall(setup, gained, 1, 2)
    densities = dict(zip(memory.colours, memory.belief.compute_mode(), strict=True))
    volumes = np.array([4 / 3 * np.pi * np.prod(part.shape.semi_axes) for part in FIRST.components])
    masses = volumes * [densities[part.looks_like.colour] for part in FIRST.components]
    pi = found.predicted.values
    assert pi[0, 0] == pytest.approx(masses.sum(), rel=1e-9)
    assert pi[0, 1] == pytest.approx(masses @ [part.X_TE[0, 3] for part in FIRST.components], rel=1e-9)
    # To the eye the decoy is the first object.
    np.testing.assert_array_equal(pi[0], pi[2])


@pytest.mark.usefixtures("short")
def test_seed_and_observer_decide_what_is_held_and_felt(tmp_path):
    gained = gain_experience(Setup(observers=2, out=tmp_path), TOOLS[:2])
    setups = Setup(), Setup(), Setup(seed=1)
    first, again, other = (com.hold(setup, TOOLS, gained, 0)[1] for setup in setups)
    np.testing.assert_array_equal(first[1].q, again[1].q)
    assert first[1].log_evidence == again[1].log_evidence != other[1].log_evidence
    # Nothing is learned in the test pass, so that each hold begins with the same belief.
    memory, records = com.hold(Setup(), TOOLS, gained, 1)
    again = com.hold(Setup(), (SECOND, SECOND, SECOND), gained, 1)[1]
    assert records[1].log_evidence == pytest.approx(again[1].log_evidence, rel=1e-9)
    assert memory.colours == list_colours(TOOLS)


def test_numbers_are_those_of_made_up_data():
    """Medians of chosen errors of three observers lie halfway between the third and fourth of six."""
    mass = np.array([[0.01, -0.05, 9.0], [-0.02, 0.04, 9.0], [0.03, 0.60, 9.0]])
    com_m = 1e-3 * np.array([[11.0, 14.0, 900.0], [12.0, 15.0, 900.0], [13.0, 80.0, 900.0]])
    inertia = np.array([[-0.21, 0.24, 9.0], [0.22, -0.25, 9.0], [-0.23, 0.90, 9.0]])
    predicted = np.array([[tool.parameters for tool in TOOLS]] * 3)
    places = predicted[..., 1:4] / predicted[..., :1] + com_m[..., None] * [0.6, 0.0, -0.8]
    predicted[..., 0] *= 1.0 + mass
    predicted[..., 1:4] = predicted[..., :1] * places
    predicted[..., 4:7] *= 1.0 + inertia[..., None]
    # Heights at four times, of which the third is the farthest.
    course = np.array([0.0, 0.5, 1.0, -0.25])
    peaks = np.array([[0.01, 0.02, 0.10], [-0.02, 0.02, 0.11], [0.04, -0.01, 0.12]])
    heights = peaks[..., None] * course
    of_trials = {
        "periods_limited": [[1, 10, 100], [2, 20, 200], [3, 30, 300]],
        "periods_failed": [[0, 0, 1], [0, 1, 1], [0, 0, 0]],
        "samples_rejected": [[0, 1, 2], [0, 2, 0], [0, 0, 4]],
        "p_value": [[0.9, 1e-9, 0.0], [0.5, 0.1, 1e-20], [0.2, 0.3, 1e-12]],
    }
    data = xr.Dataset(
        {
            "density_median": (("observer", "colour"), [[700.0, 7000.0], [900.0, 8000.0], [1700.0, 7900.0]]),
            "predicted": (("observer", "trial", "parameter"), predicted),
            "height_centre": (("observer", "trial", "time"), heights),
            "height_grip": (("observer", "trial", "time"), 2.0 * heights),
            "height_com": (("observer", "trial", "time"), -3.0 * heights),
            **{name: (("observer", "trial"), values) for name, values in of_trials.items()},
        }
    )
    numbers = com.summarise(com.measure(data, TOOLS), TOOLS)
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


def test_densities_are_listed_by_colour_in_the_order_of_the_components():
    beech, steel = (part.material for part in FIRST.components[1:])
    assert list(list_densities([FIRST]).items()) == [(beech.colour, 720.0), (steel.colour, 7850.0)]
    assert list(list_densities([SECOND, FIRST]).items()) == [(steel.colour, 7850.0), (beech.colour, 720.0)]
    lighter = FIRST.with_densities({beech.colour: 500.0, steel.colour: 7850.0})
    assert list_densities([SECOND, lighter])[beech.colour] == 500.0


@pytest.mark.parametrize("colour", ["#838a99", "#7d8499", "#7d8a9f"])
def test_looks_six_steps_apart_in_one_channel_are_distinguished(models, colour):
    change_file(models / "materials.yaml", "#c98f5a", colour)
    assert len(com.read(dataclasses.replace(Setup(), models=models))) == 3
