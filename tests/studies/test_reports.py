"""Every bound of every claim of a study is needed: some numbers contradict it and nothing else.

That a run can give such numbers is tested in test_counter_examples.py; claims of `make trust` in trust/test_trust.py.
"""

import pytest

from studies.active import report as active
from studies.loop import report as loop
from studies.recorded import report as recorded
from studies.robustness import report as robustness

# Numbers that meet every claim.
ACTIVE = {
    "has_motions": True,
    "value_holds": 3,
    "value_over_random": 0.33,
    "value_over_information": 0.33,
    "value_less_best_other": -1,
    "regret_after_3": 0.03,
    "paper_holds": 2,
    "paper_holds_most": 2,
    "worths_within": 1.0,
    "worth_cases": 24,
    "irrelevant_J": 0.004,
    "drawn_right": 0.988,
    "drawn_stopped": 0.99,
    "decoy_right": 0.99,
    "repeat_z_least": 0.97,
    "repeat_z_largest": 1.02,
    "kinds_worst": 0.01,
    "ms_per_candidate": 6.0,
    "poses_as_8_random": 5,
    "worse_with_more": 0.05,
    "inside_90": 0.92,
    "seconds_over_random": 0.4,
    "largest_share_of_a_limit": 0.97,
}
# Keys of claims, and changes that contradict one bound each.
ACTIVE_CHANGES = [
    ("few_holds", {"value_holds": 5}),
    ("few_holds", {"value_over_random": 0.6}),
    ("few_holds", {"value_over_information": 0.6}),
    ("few_holds", {"value_less_best_other": 0}),
    ("few_holds", {"regret_after_3": 0.11}),
    ("paper_world", {"paper_holds": 3}),
    ("paper_world", {"paper_holds_most": 3}),
    ("worth", {"worths_within": 0.95}),
    ("worth", {"worth_cases": 19}),
    ("worth", {"irrelevant_J": 0.011}),
    ("stopping", {"drawn_right": 0.95}),
    ("stopping", {"drawn_stopped": 0.79}),
    ("odd_object", {"decoy_right": 0.94}),
    ("repeats", {"repeat_z_least": 0.89}),
    ("repeats", {"repeat_z_largest": 1.11}),
    ("kinds", {"kinds_worst": 0.06}),
    ("fast", {"ms_per_candidate": 11.0}),
    ("few_postures", {"poses_as_8_random": 6}),
    ("few_postures", {"worse_with_more": 0.21}),
    ("honest", {"inside_90": 0.79}),
    ("honest", {"inside_90": 0.99}),
    ("fast_to_the_floor", {"seconds_over_random": 0.51}),
    ("within_limits", {"largest_share_of_a_limit": 1.001}),
]
# Numbers that meet every claim.
LOOP = {
    "settled": 1.0,
    "largest_rise": 0.0,
    "least_coverage": 0.88,
    "largest_coverage": 0.94,
    "recall_s_1e5": 2.0,
    "lost": 0,
    "double": 0,
    "forget_error": 1e-13,
}
# Keys of claims, and changes that contradict one bound each.
LOOP_CHANGES = [
    ("right", {"settled": 0.66}),
    ("regret", {"largest_rise": 0.001}),
    ("coverage", {"least_coverage": 0.82}),
    ("coverage", {"largest_coverage": 0.98}),
    ("memory", {"recall_s_1e5": 11.0}),
    ("memory", {"lost": 1}),
    ("memory", {"double": 1}),
    ("memory", {"forget_error": 1e-08}),
]
# Numbers that meet every claim.
RECORDED = {
    "ur10e": {
        "half_error": [0.003, -0.004],
        "half_inside": [1, 1],
        "half_sd_kg": [0.028, 0.027],
        "load_friction": [0.099, 0.104],
        "empty_as_load_kg": 0.004,
        "empty_as_load_sd_kg": 0.018,
    },
    "panda": {
        "coverage_mass": {"2": 0.9, "5": 0.9, "10": 0.9},
        "rmse_mass_g_5s": 22.0,
        "white_coverage_mass_5s": 0.1,
    },
    "lbipe": {"inside": 3, "rmse_g": 7.0},
    "prior_coverage": {"mass": 0.9, "com": 0.9, "inertia": 0.9},
    "hidden_part_com_coverage": 0.9,
    "mistakes": {"tried": 160, "wrong_silent": 3},
    "false_alarms": 0.005,
    "seed_shift_over_sd": 0.08,
    "class_coverage": {"mass": [0.9, 0.9, 0.9, 0.9], "com": [0.9, 0.9, 0.9, 0.9], "inertia": [0.9, 0.9, 0.9, 0.9]},
    "size_seen_wrongly": {"0": 0.97, "10": 0.9, "20": 0.85, "up_to_20": 0.85},
    "claimed": {"right_accepted": 0.97, "wrong_found": 0.99},
    "ms_per_sample": 0.06,
    "ms_per_posterior": 7.0,
    "s_per_run": 0.5,
}
# Keys of claims, and changes that contradict one bound each.
RECORDED_CHANGES = [
    ("ur10e_halves", {"ur10e": {"half_error": [0.003, -0.021]}}),
    ("ur10e_halves", {"ur10e": {"half_inside": [1, 0]}}),
    ("ur10e_halves", {"ur10e": {"half_sd_kg": [0.006, 0.027]}}),
    ("ur10e_halves", {"ur10e": {"half_sd_kg": [0.028, 0.061]}}),
    ("ur10e_load_friction", {"ur10e": {"load_friction": [0.069, 0.104]}}),
    ("ur10e_load_friction", {"ur10e": {"load_friction": [0.099, 0.131]}}),
    ("ur10e_empty", {"ur10e": {"empty_as_load_kg": -0.05}}),
    ("ur10e_empty", {"ur10e": {"empty_as_load_sd_kg": 0.031}}),
    ("panda_coverage", {"panda": {"coverage_mass": {"2": 0.74}}}),
    ("panda_coverage", {"panda": {"coverage_mass": {"5": 0.84}}}),
    ("panda_coverage", {"panda": {"coverage_mass": {"10": 0.84}}}),
    ("panda_error", {"panda": {"rmse_mass_g_5s": 35.5}}),
    ("panda_control", {"panda": {"white_coverage_mass_5s": 0.15}}),
    ("lbipe", {"lbipe": {"inside": 2}}),
    ("lbipe", {"lbipe": {"rmse_g": 9.1}}),
    ("own_prior", {"prior_coverage": {"mass": 0.85}}),
    ("own_prior", {"prior_coverage": {"mass": 0.96}}),
    ("own_prior", {"prior_coverage": {"com": 0.85}}),
    ("own_prior", {"prior_coverage": {"com": 0.96}}),
    ("own_prior", {"prior_coverage": {"inertia": 0.82}}),
    ("hidden_part", {"hidden_part_com_coverage": 0.84}),
    ("mistakes", {"mistakes": {"wrong_silent": 4}}),
    ("mistakes", {"mistakes": {"tried": 59}}),
    ("false_alarms", {"false_alarms": 0.02}),
    ("seeds", {"seed_shift_over_sd": 0.1}),
    ("classes", {"class_coverage": {"mass": [0.9, 0.82, 0.9, 0.9]}}),
    ("classes", {"class_coverage": {"mass": [0.9, 0.9, 0.98, 0.9]}}),
    ("classes", {"class_coverage": {"com": [0.9, 0.9, 0.9, 0.8]}}),
    ("classes", {"class_coverage": {"com": [0.98, 0.9, 0.9, 0.9]}}),
    ("classes", {"class_coverage": {"inertia": [0.9, 0.9, 0.9, 0.77]}}),
    ("classes", {"class_coverage": {"inertia": [0.99, 0.9, 0.9, 0.9]}}),
    ("sizes", {"size_seen_wrongly": {"0": 0.8}}),
    ("sizes", {"size_seen_wrongly": {"10": 0.82}}),
    ("sizes", {"size_seen_wrongly": {"up_to_20": 0.8}}),
    ("sizes_fifth_off", {"size_seen_wrongly": {"20": 0.67}}),
    ("claimed", {"claimed": {"right_accepted": 0.68}}),
    ("claimed", {"claimed": {"wrong_found": 0.8}}),
    ("speed", {"ms_per_sample": 0.11}),
    ("speed", {"ms_per_posterior": 15.0}),
    ("speed", {"s_per_run": 1.1}),
]
# Numbers that meet every claim.
ROBUSTNESS = {"settings": 300, "interpolation_error_m": 4e-06, "interpolation_bound_m": 5e-05}
# Keys of claims, and changes that contradict one bound each.
ROBUSTNESS_CHANGES = [
    ("enough_settings", {"settings": 299}),
    ("interpolation", {"interpolation_error_m": 6e-05}),
    ("interpolation", {"interpolation_error_m": None}),
]
STUDIES = {
    active: (ACTIVE, ACTIVE_CHANGES),
    loop: (LOOP, LOOP_CHANGES),
    recorded: (RECORDED, RECORDED_CHANGES),
    robustness: (ROBUSTNESS, ROBUSTNESS_CHANGES),
}
CASES = [
    pytest.param(report, numbers, key, change, id=f"{report.__name__.split('.')[1]}-{change}")
    for report, (numbers, changes) in STUDIES.items()
    for key, change in changes
]


def update(numbers, change):
    """Numbers with some changed, at any depth."""
    changed = {
        name: update(numbers[name], value) if isinstance(value, dict) else value for name, value in change.items()
    }
    return {**numbers, **changed}


@pytest.mark.parametrize("report", STUDIES, ids=lambda report: report.__name__.split(".")[1])
def test_claims_are_met_by_numbers_that_meet_them_and_all_are_contradicted(report):
    numbers, changes = STUDIES[report]
    claims = report.judge(numbers)
    assert [claim.key for claim in claims if not claim.met] == []
    assert {claim.key for claim in claims} == {key for key, _ in changes}


@pytest.mark.parametrize(("report", "numbers", "key", "change"), CASES)
def test_number_contradicts_one_bound_of_one_claim(report, numbers, key, change):
    """The claim that a number contradicts marks the one criterion that is not met."""
    unmet = [claim for claim in report.judge(update(numbers, change)) if not claim.met]
    assert [claim.key for claim in unmet] == [key]
    assert sum(not criterion.met for criterion in unmet[0].criteria) == 1


def test_motions_are_judged_and_shown_only_if_recordings_were_given():
    keys = [claim.key for claim in active.judge({**ACTIVE, "has_motions": False})]
    assert keys == [claim.key for claim in active.judge(ACTIVE)][: len(keys)]
    assert not {"few_postures", "honest", "fast_to_the_floor", "within_limits"} & set(keys)
