"""The study as its users run it, with few draws."""

from pathlib import Path

import pytest
from helpers.results_files import OF_STUDY, find_documented_keys, read_numbers, read_section
from helpers.study_runs import run_study

from affordance.named_settings import change_settings
from affordance.proprioception.torque_noise import WhiteNoise
from affordance.settings import DEFAULT_SETTINGS
from studies.calibration import calibration, sensing
from studies.calibration.command import STUDY


def test_few_draws_have_all_numbers_and_tables(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(calibration, "DURATION", 0.3)
    monkeypatch.setattr(sensing, "CHANGES", {"white": sensing.CHANGES["white"]})
    run_study(STUDY, "--repeats", 2, "--jobs", 1, "--out", tmp_path)
    numbers, section = read_numbers(tmp_path / "calibration"), read_section(tmp_path / "calibration")
    assert set(numbers) - OF_STUDY == find_documented_keys("Calibration")
    assert (numbers["repeats"], numbers["sensing_observers"]) == (2, 1)
    assert set(section.claims) == {"calibrated", "efficient"}
    intervals, bounds, choices = section.tables
    assert [row[0] for row in intervals["rows"]] == list(numbers["calibration"])
    assert [row[0] for row in bounds["rows"]] == list(numbers["efficiency"])
    assert choices["rows"][0][0] == "white"
    assert (tmp_path / "calibration" / "ranks.png").is_file()


def test_errors_of_measurement_are_those_that_the_study_names() -> None:
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
