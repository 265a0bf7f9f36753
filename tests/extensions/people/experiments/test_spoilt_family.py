"""Spoilt family: objects, trials, and the numbers of one observer by hand."""

import numpy as np
import pandas as pd
import pytest

from affordance.experiments.shared.holds import compute_volume
from affordance.experiments.shared.observers import Setup
from affordance.extensions.people.experiments import spoilt_family

FAMILY = [*spoilt_family.FAMILY]


def test_odd_member_weighs_a_third_of_what_it_looks():
    *family, odd = spoilt_family.read(Setup())
    density = family[0].mass / compute_volume(family[0])
    assert odd.mass / (density * compute_volume(odd)) == pytest.approx(1 / 3, rel=1e-12)


def test_odd_member_comes_six_times_and_then_the_family_in_a_balanced_order():
    designs = [spoilt_family.design(observer, np.random.default_rng(observer)) for observer in range(4)]
    for trials in designs:
        objects = trials["object"].tolist()
        assert objects[40:46] == ["odd"] * 6
        assert all(sorted(objects[k : k + 4]) == sorted(FAMILY) for k in (*range(0, 40, 4), 46))
    assert {trials["object"].iloc[46] for trials in designs} == {*FAMILY}


def test_numbers_of_one_observer_by_hand():
    before = [(name, 8.0, 9.0) for name in FAMILY] * 10
    odd = [("odd", 3.0, force) for force in (9.0, 6.0, 5.0, 4.0, 3.0, 2.0)]
    after = [(name, 8.0, 6.0) for name in FAMILY]
    lifts = pd.DataFrame([*before, *odd, *after], columns=["object", "weight", "force"])
    assert spoilt_family.measure(lifts).to_dict() == {
        "odd_weight_N": 3.0,
        "odd_first_N": 9.0,
        "odd_last_N": 4.0,
        "family_before_N": 9.0,
        "family_after_N": 6.0,
        "family_weight_N": 8.0,
        "spoilt": 0.25,
    }


def test_one_density_spoils_the_family_more_than_kinds_do(shipped):
    spoilt = {learner: found["spoilt"] for learner, found in shipped.numbers["learners"].items()}
    assert spoilt["density"] > spoilt["kinds_map"]
    assert f"{spoilt['density']:.0%} (one density for each colour)" in shipped.finding
    assert len(shipped.lifts) == 2 * 3 * 50


def test_one_density_spoils_the_family_more_than_drawn_kinds_do_on_average():
    """Of two observers who draw both may take the odd object for a member, as one density does."""
    learners = spoilt_family.run(Setup(observers=16)).numbers["learners"]
    drawn = learners["kinds_drawn"]
    assert drawn["spoilt_ci95"][1] < learners["density"]["spoilt_ci95"][0]
