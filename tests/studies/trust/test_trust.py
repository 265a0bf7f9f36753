"""Small versions of the studies of studies/trust that no other test covers."""

import json

import numpy as np
import pytest
from helpers.answers import answer

from affordance.named_settings import change_settings
from affordance.proprioception.torque_noise import WhiteNoise
from affordance.settings import DEFAULT_SETTINGS
from studies.trust import calibration, command, parts, scaling, sensing, soak
from studies.trust.fault_costs import NO_FAULT
from studies.trust.report import describe


def test_soak_counts_its_trials_and_finds_no_growth(monkeypatch):
    monkeypatch.setattr(soak, "NUM_BLOCKS", 8)
    found, numbers = soak.measure(trials=40)
    assert found.memory.shape == found.seconds.shape == (soak.NUM_BLOCKS,)
    assert (found.seconds > 0.0).all()
    assert numbers["soak_trials"] == 40
    assert numbers["soak_memory_growth_MB"] < 1.6  # a leak of 50 kB a trial would show as 1.75 MB


@pytest.mark.parametrize(("num_components", "num_materials"), [(1, 1), (4, 2), (16, 16)])
def test_bar_is_as_long_and_heavy_whatever_it_is_made_of(num_components, num_materials):
    bar = scaling.build_bar(num_components, num_materials)
    assert len(bar.components) == num_components
    assert len({part.looks_like.colour for part in bar.components}) == num_materials
    assert bar.mass == pytest.approx(scaling.build_bar(1, 1).mass)
    np.testing.assert_allclose(bar.p_TTfree, [0.3, 0.0, 0.0], atol=1e-12)


@pytest.mark.parametrize(
    "text", ["", "{", "[1]", "null", "[" * 100_000, '{"soak_trials": 20, "soak_time_drift": 1.0}']
)
def test_file_that_no_study_wrote_is_set_aside(tmp_path, caplog, text):
    assert command.read_numbers(tmp_path, "soak") is None
    path = tmp_path / "soak.json"
    path.write_text(text, encoding="utf-8")
    assert command.read_numbers(tmp_path, "soak") is None
    assert "soak.json is not a result of a study" in caplog.text
    assert ("it has no soak_memory_growth_MB" in caplog.text) == ("drift" in text)
    assert not path.exists()
    assert (tmp_path / "soak.broken").exists()


@pytest.mark.parametrize("study", command.KEYS)
def test_what_a_study_found_is_read_unless_a_key_is_missing(tmp_path, caplog, study):
    found = dict.fromkeys((*command.KEYS[study], "program"), 1.0)
    path = tmp_path / f"{study}.json"
    for missing in (None, *command.KEYS[study]):
        path.write_text(json.dumps({key: value for key, value in found.items() if key != missing}), encoding="utf-8")
        assert command.read_numbers(tmp_path, study) == (found if missing is None else None)
        assert missing is None or f"(it has no {missing}); set aside as {study}.broken" in caplog.text


COST = {
    "density_error": 0.1,
    "p_correct": [0.5, 0.6, 1.0],
    "samples_rejected": 0.0,
    "trials_outlier": 0.0,
    "violation_rad": 0.0,
    "velocity_of_limit": 0.2,
    "torque_of_limit": 0.5,
    "beliefs_valid": True,
}
NUMBERS = {
    "sbc_draws": 1000,
    "sbc_p_value": 0.5,
    **{"coverage50": 0.5, "coverage80": 0.8, "coverage90": 0.9},
    "efficiency_vs_cramer_rao": 1.0,
    "efficiency": dict.fromkeys(calibration.LOOPS, 1.0),
    "calibration": {
        name: {"p_value": 0.5, "coverage": [0.5, 0.8, 0.9]} for name in (calibration.EXACT, calibration.IGNORING)
    },
    "faults": {NO_FAULT: COST, "bias": COST},
    **{"bad_inputs_tried": 500, "bad_inputs_refused": 500, "kills": 20, "kills_identical": 20},
    **{"cluster_identical": True, "soak_trials": 10_000, "soak_memory_growth_MB": 0.1, "soak_time_drift": 1.0},
    "parallel_efficiency_2": 0.95,
    "program": dict.fromkeys(command.KEYS, "abc"),
}


def change_fault(**changes):
    return {"faults": {NO_FAULT: COST, "bias": {**COST, **changes}}}


def test_section_meets_its_claims_where_all_is_well():
    section = describe(NUMBERS)
    assert len(section.claims) == 8
    assert all(claim.met for claim in section.claims)
    assert not section.remarks
    calibrated, _, faults = section.tables
    assert calibrated.rows[0] == [calibration.EXACT, "50.0 %", "80.0 %", "90.0 %", "0.50"]
    assert faults.rows[1] == ["bias", "10 %", "0.60", "1.00", "0 %", "0 %", "50 %", "20 %", "0.00", "yes"]
    assert all(len(row) == len(table.header) for table in section.tables for row in table.rows)


@pytest.mark.parametrize(
    ("change", "unmet"),
    [
        ({"sbc_p_value": 0.01}, "calibrated"),
        ({"efficiency_vs_cramer_rao": 0.94}, "efficient"),  # it wastes
        ({"efficiency_vs_cramer_rao": 1.06}, "efficient"),  # narrower than it may be
        (change_fault(violation_rad=1e-4), "faults"),
        (change_fault(velocity_of_limit=1.1), "faults"),
        (change_fault(torque_of_limit=1.1), "faults"),
        (change_fault(beliefs_valid=False), "faults"),
        ({"bad_inputs_refused": 499}, "bad_input"),
        ({"bad_inputs_tried": 3, "bad_inputs_refused": 3}, "bad_input"),
        ({"kills_identical": 19}, "kills"),
        ({"kills": 2, "kills_identical": 2}, "kills"),
        ({"cluster_identical": False}, "cluster"),
        ({"soak_memory_growth_MB": 11.0}, "soak"),
        ({"soak_time_drift": 1.2}, "soak"),
        ({"soak_trials": 100}, "soak"),
        ({"parallel_efficiency_2": 0.8}, "scaling"),
    ],
)
def test_section_does_not_meet_the_claim_that_fell_short(change, unmet):
    assert [claim.key for claim in describe({**NUMBERS, **change}).claims if not claim.met] == [unmet]


def test_section_says_if_studies_are_of_different_programs():
    section = describe({**NUMBERS, "program": {**NUMBERS["program"], "soak": "def"}})
    assert "from different states of the program: calibration of abc" in section.remarks[0]


def test_section_names_what_studies_must_have_found():
    """Every number that the section uses is one that a study must have found; not every one found is used."""
    found = {key for keys in command.KEYS.values() for key in keys}
    assert set(NUMBERS) - {"program"} <= found


def test_every_study_has_keys():
    assert command.KEYS.keys() == parts.PARTS.keys()


def test_unknown_study_is_refused():
    said = answer("study", "trust", "--only", "astrology", status=2).err
    assert "--only: is 'astrology', must be one of calibration, faults, sensing, bad_input" in said


def test_errors_of_measurement_are_those_that_the_study_names():
    settings = {name: change_settings(DEFAULT_SETTINGS, changes) for name, changes in sensing.CHANGES.items()}
    assert {name: round(3.0 / each.sample_period) for name, each in settings.items()} == {
        "independent_5": 5,
        "independent_30": 30,
        "white": 30,
        "weber_10": 30,
        "weber_13": 30,
    }
    independent = [getattr(each.noise, "independent_samples", None) for each in settings.values()]
    assert independent == [True, True, None, False, False]
    assert isinstance(settings["white"].noise, WhiteNoise)
