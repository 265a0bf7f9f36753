"""The page about robustness shows the numbers of the kept run."""

import json

import pytest

from affordance.reporting.statistics import estimate_proportion
from studies.robustness import page
from studies.robustness.assumptions import load_assumptions
from studies.robustness.claims import list_claims
from studies.robustness.study import DEFAULT_NUM_OBSERVERS, DEFAULT_NUM_SETTINGS, INTERPOLATION_BOUND

KEPT = json.loads(page.KEPT.read_text(encoding="utf-8"))


def test_tables_are_those_of_the_kept_run():
    assert page.read_tables() == page.describe(KEPT)


def test_the_run_is_a_whole_one_of_present_claims_and_assumptions():
    # The first 64 settings, a balanced part of the whole sequence; the page says so.
    assert (KEPT["settings"], KEPT["observers"]) == (64, DEFAULT_NUM_OBSERVERS)
    assert f"the default is {DEFAULT_NUM_SETTINGS}" in page.PAGE.read_text(encoding="utf-8")
    assert list(KEPT["claims"]) == list(list_claims())
    assert len(KEPT["commit"]) >= 7
    assert KEPT["interpolation_proven"] == (KEPT["interpolation_error_m"] <= INTERPOLATION_BOUND)
    names = {each.name for each in load_assumptions()}
    for claim in KEPT["claims"].values():
        assert claim["strongest_assumption"] in names | {"none above chance"}
        failed = len(claim["fails_in"])
        assert claim["holds"] == pytest.approx(1.0 - failed / claim["evaluated"])
        assert claim["ci95"] == pytest.approx(
            estimate_proportion(claim["evaluated"] - failed, claim["evaluated"]).ci95.tolist()
        )
