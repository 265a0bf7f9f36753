"""Simulated recordings and the table of coverage."""

import numpy as np
import pytest
from helpers.results_files import read_numbers
from helpers.study_runs import run_study
from numpy.testing import assert_allclose

from studies.payload.command import STUDY
from studies.payload.coverage import Cell, CoverageConfig, run_changes, run_load, tabulate
from studies.payload.errors import ARMS
from studies.payload.simulated import Motion, simulate


@pytest.mark.parametrize("arm", ["panda", "ur"])
def test_a_motion_starts_and_ends_at_rest_and_its_rates_are_its_own(arm):
    errors = ARMS[arm]
    robot = simulate(errors, "box", np.random.default_rng(1)).robot
    motion = Motion.draw(errors, robot, 12.0, 0.5, np.random.default_rng(2))
    times = np.arange(0.0, 13.0, 1e-3)
    q, v, vdot = motion.evaluate(times)
    assert not v[[0, -1]].any()
    assert_allclose(v[1:-1], (q[2:] - q[:-2]) / 2e-3, atol=1e-4)
    assert_allclose(vdot[1:-1], (v[2:] - v[:-2]) / 2e-3, atol=2e-2)
    low, high = robot.limits
    assert ((q > low) & (q < high)).all()


def test_a_load_that_is_heavier_by_the_truth_is_felt():
    """The mean is within five standard deviations of the truth, of a load that is drawn with all errors."""
    found = run_load(CoverageConfig("panda"), 4)
    assert abs(found["mean"][0] - found["truth"][0]) < 5.0 * found["sd"][0]
    assert 0.0 < found["place"][0] < 1.0


@pytest.mark.parametrize(("case", "num"), [("slow_wrist", 12), ("wrist_1", 12), ("held_joints", 8)])
def test_intervals_of_sensors_at_rest_hold_the_truth(case, num):
    """The 90 % intervals hold at least three quarters of the masses, and of the centres coordinate by coordinate."""
    places = np.array([run_load(CoverageConfig(case), repeat)["place"][:4] for repeat in range(num)])
    assert (np.abs(places - 0.5) <= 0.45).sum(axis=0).min() >= 0.75 * num


def test_a_gain_that_changed_in_the_loaded_run_alone_is_found():
    """Nothing is found in two pairs of runs without a change; a change of 5 % is found in one at least."""
    doubted = np.array([run_changes(CoverageConfig("panda"), repeat)["doubted"] for repeat in range(2)])
    assert not doubted[:, 0].any()
    assert doubted[:, -1].any()


def test_cases_are_run_by_their_names_and_printed(tmp_path, capsys):
    run_study(STUDY, "--only", "slow_wrist", "panda_changes", "--repeats", 1, "--jobs", 1, "--out", tmp_path)
    numbers, printed = read_numbers(tmp_path / "payload"), capsys.readouterr().out
    assert numbers["slow_wrist"]["loads"] == 1
    assert set(numbers["panda_changes"]) == {"1", "1.02", "1.03", "1.05"}
    assert "slow_wrist: 1 loads, 0 refused" in printed
    assert "| x 1.05 | " in printed


def test_coverage_is_counted_by_level_and_called_low_only_where_it_is():
    """Places drawn evenly are covered as they should be; those of intervals half as wide as they claim are not."""
    rng = np.random.default_rng(0)
    num = 400
    factors = np.column_stack(
        [
            np.arange(num) % 4,
            rng.random(num) < 0.5,
            *(np.exp(rng.uniform(np.log(low), np.log(high), num)) for low, high in ((0.2, 3), (8, 50), (0.15, 1))),
            rng.random(num) < 0.5,
        ]
    )
    zero = np.zeros((num, 10))
    fine = {
        "place": rng.random((num, 10)),
        "factors": factors,
        "trusted": np.ones(num),
        "seconds": np.ones(num),
        **dict.fromkeys(("truth", "mean", "sd"), zero),
    }
    table = tabulate(fine)
    assert table["low"] == []
    assert table["coverage"]["all"]["all"]["mass"][2]["share"] == pytest.approx(0.9, abs=0.05)
    narrow = {**fine, "place": np.where(rng.random((num, 10)) < 0.5, fine["place"], 0.001)}
    assert "all all, mass at 0.9" in tabulate(narrow)["low"]
    assert_allclose(Cell(45, 50).bound(0.05), (0.7864, 0.9565), atol=1e-3)
