"""Every claim of the study of robustness can fail: a small run with one thing changed does not meet it.

Changes are settings by name, objects, or a blow that is planned wrongly: no number is made up. Each claim is judged
as shipped too, with few observers.
"""

import numpy as np
import pytest
from helpers import robustness_runs
from helpers.study_runs import Numbers

from studies.robustness import report, study
from studies.robustness.claims import judge, list_claims


def evaluate_settings(count: int, error: float = 0.0) -> Numbers:
    """The study with a number of settings, in none of which an experiment can be run.

    Motions that are off by the largest error of interpolated ones, [m], are simulated in
    ``robustness/test_study.py::test_motions_that_are_wrong_are_found``.
    """
    study_of_few = study.load()
    with pytest.MonkeyPatch.context() as patch:
        nothing = study.Outcome(
            {},
            dict.fromkeys(study.list_claims(), float("nan")),
            dict.fromkeys((*study.EXPERIMENTS, study.TASKS), "no plan"),
            dict.fromkeys(study.PARTS, 0.0),
            {},
            error,
        )
        patch.setattr(study, "evaluate_setting", lambda setting, **more: nothing)
        one = study_of_few.run_setting(0)
    arrays = {name: np.stack([value] * (1 + count)) for name, value in one.items()}  # that of the simulations too
    return study_of_few.compute_metrics(arrays)


def test_every_claim_is_contradicted_by_a_run_and_judged_as_shipped() -> None:
    judged = {
        name: {claim.key: claim.met for claim in report.judge(numbers)}
        for name, numbers in {
            "shipped": evaluate_settings(300),
            "twelve settings": evaluate_settings(12),
            "wrong motions": evaluate_settings(300, error=1e-4),
        }.items()
    }
    assert judged == {
        "shipped": {"enough_settings": True, "interpolation": True},
        "twelve settings": {"enough_settings": False, "interpolation": True},
        "wrong motions": {"enough_settings": True, "interpolation": False},
    }


def test_every_claim_about_tasks_is_contradicted_in_a_setting_and_judged_as_shipped() -> None:
    shipped = robustness_runs.strike_and_choose()
    outcomes = judge(shipped)
    contradicted = [key for _, keys in robustness_runs.CONTRADICTED.values() for key in keys.split()]
    assert sorted(contradicted) == sorted(
        name for name in list_claims() if name.startswith(("reach", "hammer", "tasks"))
    )
    # 158 and 159 of 160 choices are right after two trials.
    assert {name for name, met in outcomes.items() if met == 0.0} <= {"reach.after_two", "hammer.after_two"}
    for run, keys in robustness_runs.CONTRADICTED.values():
        changed = {name: {**shipped[name], **of_one} for name, of_one in run().items()}
        outcomes = judge({**shipped, **changed})
        assert {key: outcomes[key] for key in keys.split()} == dict.fromkeys(keys.split(), 0.0)
