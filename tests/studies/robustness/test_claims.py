"""Claims that are judged in every setting, and settings in which one cannot be judged."""

import numpy as np
import pytest

from affordance.experiments import com, hammer, reach, weight
from affordance.reporting.claims import check, claim
from studies.robustness.claims import judge, list_claims

# Numbers that meet all headlines, and the claims of reaching and hammering.
REACH = {
    "p_correct": [0.5, 0.65, 1.0, 1.0],
    "p_correct_ci95": [[0.48, 0.52], [0.58, 0.71], [0.98, 1.0], [0.98, 1.0]],
    "correct_grip": "steel",
    "grip_of_densest": "steel",
    "energy_ratio_true": 1.1,
}
HAMMER = {
    **REACH,
    "correct_grip": "wood",
    "grip_of_densest_far": "wood",
    "travel_of_other_grip_m": 0.0004,
    "force_ratios": [1.02, 1.05],
}
TASKS = {
    "correct_reach": "steel",
    "correct_hammer": "wood",
    "work_measures_agree": [True, True],
    "effort_differs": True,
}
NUMBERS = {"reach": REACH, "hammer": HAMMER, "tasks": TASKS}


def test_claims_are_those_of_the_simulations_and_the_headlines():
    names = list(list_claims())
    assert len(names) == len(set(names)) == 26
    assert [name for name, each in list_claims().items() if each.source == "README"] == [
        "reach.after_one",
        "reach.after_two",
        "hammer.learned",
        "hammer.light_taps",
        "tasks.opposite_grips",
        "tasks.work_measures_agree",
        "tasks.effort_differs",
    ]
    assert list_claims()["reach.learned"].text == "After 6 trials at least 95 of 100 choices are correct."
    assert not any(each.met for each in list_claims().values() if each.source != "README")


@pytest.mark.parametrize(("name", "module"), [("weight", weight), ("com", com), ("reach", reach), ("hammer", hammer)])
def test_claims_of_a_simulation_are_judged_by_the_simulation(name, module, monkeypatch):
    made_up = [claim("invented", "ours", "It is so.", check("number", 1, at_least=1))]
    monkeypatch.setattr(module, "judge", lambda *_: made_up)
    assert judge({**NUMBERS, name: {**HAMMER, "known": 1}})[f"{name}.invented"] == 1.0


def test_headlines_are_met_by_numbers_that_meet_them():
    outcomes = judge(NUMBERS)
    assert [name for name, met in outcomes.items() if met != 1.0 and not np.isnan(met)] == []
    assert {name for name, met in outcomes.items() if np.isnan(met)} == {
        name for name in outcomes if name.startswith(("weight", "com"))
    }


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("reach.after_one", {"p_correct_ci95": [[0.48, 0.52], [0.66, 0.79], [0.98, 1.0], [0.98, 1.0]]}),
        ("reach.after_one", {"p_correct_ci95": [[0.48, 0.52], [0.48, 0.62], [0.98, 1.0], [0.98, 1.0]]}),
        ("reach.after_two", {"p_correct_ci95": [[0.48, 0.52], [0.58, 0.71], [0.97, 0.999], [0.98, 1.0]]}),
        ("hammer.learned", {"p_correct": [0.5, 0.65, 1.0, 0.949]}),
        ("hammer.light_taps", {"travel_of_other_grip_m": 0.0033}),
        ("tasks.opposite_grips", {"correct_hammer": "steel"}),
        ("tasks.work_measures_agree", {"work_measures_agree": [True, False]}),
        ("tasks.work_measures_agree", {"work_measures_agree": [False, True]}),
        ("tasks.effort_differs", {"effort_differs": False}),
    ],
)
def test_headline_is_contradicted_by_other_numbers(name, change):
    experiment = name.split(".")[0]
    outcomes = judge({**NUMBERS, experiment: {**NUMBERS[experiment], **change}})
    unmet = [each for each, met in outcomes.items() if met == 0.0]
    assert name in unmet
    assert {each for each in unmet if list_claims()[each].source == "README"} == {name}


def test_claim_about_a_number_that_was_not_measured_is_not_judged():
    outcomes = judge({"hammer": {**HAMMER, "force_ratios": None, "grip_of_densest_far": "steel"}})
    assert np.isnan(outcomes["hammer.sufficient_force"])
    assert outcomes["hammer.correct_grip"] == 0.0
    assert outcomes["hammer.after_one"] == 1.0
    assert np.isnan([outcomes[name] for name in outcomes if not name.startswith("hammer.")]).all()
