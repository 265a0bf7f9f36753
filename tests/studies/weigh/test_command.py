"""The study of weighing: coverage in simulated tables, and least squares beside it."""

import numpy as np
from helpers.results_files import read_numbers
from helpers.study_runs import run_study
from numpy.testing import assert_allclose

from affordance.extensions.payload.weighing.poses import FORMS
from studies.weigh.command import STUDY, WeighConfig, run_table, solve_least_squares
from studies.weigh.simulated import NOISES, simulate_poses


def test_repeats_go_through_forms_and_noises():
    made = [simulate_poses(0, repeat) for repeat in range(18)]
    assert {(each.form, each.noise) for each in made} == {(form, noise) for form in FORMS for noise in NOISES}


def test_intervals_hold_the_truth_where_those_of_least_squares_do_not():
    """Of 36 tables with the smallest noise, whose errors are those of gains."""
    repeats = [18 * k + j for k in range(6) for j in range(6)]
    found = [run_table(WeighConfig(1), repeat) for repeat in repeats]
    held = np.mean([each["held"][1] for each in found], axis=0)
    plain = np.mean([each["plain_held"][1] for each in found], axis=0)
    assert held.min() > 0.8
    assert plain[0] < 0.65
    assert np.mean([each["read_right"] for each in found]) > 0.95
    assert np.mean([each["doubted"] for each in found]) < 0.06


def test_least_squares_finds_the_truth_without_errors():
    simulated = simulate_poses(0, 36)
    weight = simulated.mass * simulated.rotations.inv().apply([0.0, 0.0, -9.81])
    wrench = np.column_stack([weight, np.cross(simulated.centre, weight)]) + np.arange(6.0)
    down = simulated.rotations.inv().apply([0.0, 0.0, -1.0])
    found, sd, _ = solve_least_squares(simulated._replace(axes="sensor"), wrench, down)
    assert_allclose(found, [simulated.mass, *simulated.centre], atol=1e-9)
    assert sd.max() < 1e-9


def test_the_study_prints_and_writes_its_table(tmp_path, capsys):
    run_study(STUDY, "--repeats", 6, "--jobs", 1, "--out", tmp_path)
    numbers, printed = read_numbers(tmp_path / "weigh"), capsys.readouterr().out
    assert numbers["tables"] == 6
    assert numbers["coverage"]["all"]["tables"] == 6
    assert 0.0 <= numbers["read_right"] <= 1.0
    assert "| all | 6 |" in printed
