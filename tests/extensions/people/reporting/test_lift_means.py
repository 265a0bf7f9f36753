"""Means of lifts: each observer counts once, by hand."""

import numpy as np
import pandas as pd
import pytest

from affordance.extensions.people.reporting.lift_means import average, describe_means, list_numbers, tabulate_means


def build(**changes):
    """Two observers of a learner, and two people, in one group; the second observer has two lifts."""
    lifts = pd.DataFrame(
        {
            "learner": ["density"] * 3 + ["people"] * 2,
            "observer": [0, 1, 1, 0, 1],
            "group": "all",
            "phase": ["a"] * 5,
            "object": ["small"] * 5,
            "do": "lift",
            "measured": True,
            "weight": 3.0,
            "force": [2.0, 4.0, 6.0, 1.0, 4.0],
            "expected": [0.2, 0.4, 0.6, np.nan, np.nan],
            "felt": np.nan,
            "moved": np.nan,
            "chosen": "",
        }
    )
    return lifts.assign(**changes)


def test_each_observer_counts_once():
    density, people = average(build())
    assert density["force_N"] == pytest.approx(3.5)
    half = 12.7062 * np.std([2.0, 5.0], ddof=1) / np.sqrt(2.0)  # Student's, 1 degree of freedom
    np.testing.assert_allclose(density["force_N_ci95"], [3.5 - half, 3.5 + half], rtol=1e-5)
    assert (density["observers"], density["rows"], density["weight_N"]) == (2, 3, 3.0)
    assert (people["learner"], people["force_N"]) == ("people", pytest.approx(2.5))
    assert "expected_kg" not in people
    assert "felt_N" not in density


def test_rows_that_are_not_measured_do_not_count():
    (density, _) = average(build(measured=[True, True, False, True, True]))
    assert density["force_N"] == pytest.approx(3.0)


def test_choices_are_shares():
    found = average(build(do="choose", chosen=["head", "foot", "head", "", ""]))[0]
    assert found["chosen"] == {"head": pytest.approx(2 / 3), "foot": pytest.approx(1 / 3)}
    assert "head 67%, foot 33%" in describe_means([found])


def test_table_leaves_out_what_is_empty_or_the_same_everywhere():
    table = tabulate_means(average(build()))
    assert table.columns.tolist() == ["object", "observers", "weight (N)", "force (N)", "expected (kg)"]
    assert tabulate_means(average(build(phase=["a", "b", "b", "a", "a"]))).columns.tolist()[0] == "phase"
    assert describe_means(average(build())).splitlines()[2].split()[:4] == ["people", "small", "2", "3.00"]


def test_numbers_are_those_of_each_observer_and_spreads_those_of_people():
    values, spreads = list_numbers(build(), None)
    assert values["density"]["force_N, small"].tolist() == [2.0, 5.0]
    assert set(values) == {"density"}
    assert spreads["force_N, small"].sd == pytest.approx(np.std([1.0, 4.0], ddof=1))
    assert spreads["force_N, small"].source == "2 people of the table"
    assert list_numbers(build(), 1.9)[1]["force_N, small"] == (1.9, "as given")


def test_mean_of_one_observer_has_no_interval():
    found = average(build(observer=[0, 0, 0, 0, 0]))[0]
    assert found["force_N"] == pytest.approx(4.0)
    assert "force_N_ci95" not in found
    assert tabulate_means([found])["force (N)"].tolist() == ["4.000"]
