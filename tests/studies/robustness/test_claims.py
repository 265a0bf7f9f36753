"""Claims that are judged in every setting, and settings in which one cannot be judged."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from affordance.reporting.claims import judge_claims
from studies.robustness.claims import EXPERIMENTS, judge, list_claims

EXAMPLES = yaml.safe_load((Path(__file__).parent / "counterexamples.yaml").read_text(encoding="utf-8"))
SECTIONS = Path(__file__).parents[2] / "experiments" / "counterexamples"
HEADLINES = EXAMPLES["counterexamples"]


def test_claims_are_those_of_all_sections_and_the_headlines():
    of_sections = {
        f"{name}.{key}"
        for name in EXPERIMENTS
        for key in yaml.safe_load((SECTIONS / f"{name}.yaml").read_text(encoding="utf-8"))["counterexamples"]
    }
    assert set(list_claims()) == of_sections | set(HEADLINES)
    assert of_sections.isdisjoint(HEADLINES)


@pytest.mark.parametrize("name", HEADLINES)
def test_headline_is_met_by_numbers_that_meet_it_and_by_no_counterexample(name):
    claim = list_claims()[name]
    assert judge_claims([claim], EXAMPLES["numbers"])[0].met
    assert len(HEADLINES[name]) >= len(claim.criteria)
    for change in HEADLINES[name]:
        assert not judge_claims([claim], {**EXAMPLES["numbers"], **change})[0].met


def test_claim_is_judged_by_the_numbers_of_its_experiment_alone():
    numbers = {
        "reach": EXAMPLES["numbers"] | {"correct_grip": "steel", "grip_of_densest": "steel", "energy_ratio_true": 1.1}
    }
    outcomes = judge(numbers)
    assert outcomes["reach.after_one"] == outcomes["reach.correct_grip"] == 1.0
    assert np.isnan([outcomes[name] for name in outcomes if not name.startswith("reach.")]).all()


def test_claim_about_a_number_that_was_not_measured_is_not_judged():
    outcomes = judge(
        {
            "hammer": EXAMPLES["numbers"]
            | {"force_ratios": None, "energy_ratio_true": 1.1, "correct_grip": "wood", "grip_of_densest_far": "steel"}
        }
    )
    assert np.isnan(outcomes["hammer.sufficient_force"])
    assert outcomes["hammer.correct_grip"] == 0.0
    assert outcomes["hammer.after_one"] == 1.0
