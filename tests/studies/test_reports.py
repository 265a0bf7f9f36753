"""Every bound of every claim of a study is needed: some numbers contradict it and nothing else.

That a run can give such numbers is tested in test_counter_examples.py and calibration/test_calibration.py.
"""

import pytest

from studies.calibration import report as calibration
from studies.robustness import report as robustness

# Numbers that meet every claim.
ROBUSTNESS = {"settings": 300, "interpolation_error_m": 4e-06, "interpolation_bound_m": 5e-05}
# Keys of claims, and changes that contradict one bound each.
ROBUSTNESS_CHANGES = [
    ("enough_settings", {"settings": 299}),
    ("interpolation", {"interpolation_error_m": 6e-05}),
    ("interpolation", {"interpolation_error_m": None}),
]
# Numbers that meet every claim.
CALIBRATION = {"sbc_p_value": 0.5, "efficiency_vs_cramer_rao": 1.0}
# Keys of claims, and changes that contradict one bound each.
CALIBRATION_CHANGES = [
    ("calibrated", {"sbc_p_value": 0.01}),
    ("efficient", {"efficiency_vs_cramer_rao": 0.94}),  # it wastes
    ("efficient", {"efficiency_vs_cramer_rao": 1.06}),  # narrower than it may be
]
STUDIES = {
    calibration: (CALIBRATION, CALIBRATION_CHANGES),
    robustness: (ROBUSTNESS, ROBUSTNESS_CHANGES),
}
CASES = [
    pytest.param(report, numbers, key, change, id=f"{report.__name__.split('.')[1]}-{change}")
    for report, (numbers, changes) in STUDIES.items()
    for key, change in changes
]


@pytest.mark.parametrize("report", STUDIES, ids=lambda report: report.__name__.split(".")[1])
def test_claims_are_met_by_numbers_that_meet_them_and_all_are_contradicted(report):
    numbers, changes = STUDIES[report]
    claims = report.judge(numbers)
    assert [claim.key for claim in claims if not claim.met] == []
    assert {claim.key for claim in claims} == {key for key, _ in changes}


@pytest.mark.parametrize(("report", "numbers", "key", "change"), CASES)
def test_number_contradicts_one_bound_of_one_claim(report, numbers, key, change):
    """The claim that a number contradicts marks the one criterion that is not met."""
    unmet = [claim for claim in report.judge({**numbers, **change}) if not claim.met]
    assert [claim.key for claim in unmet] == [key]
    assert sum(not criterion.met for criterion in unmet[0].criteria) == 1
