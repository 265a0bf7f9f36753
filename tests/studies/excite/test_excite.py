"""Study of how to move, small: predictions agree with the library's, rules choose, times to a floor are found."""

import json

import numpy as np
import pytest
from helpers.excite_runs import DATA, NUMBERS, SECONDS, move
from matplotlib.figure import Figure

from affordance.identification.evidence.joint_statistics import compute_statistics
from affordance.identification.evidence.payload_likelihood import PayloadLikelihood
from affordance.identification.excitation.expectation import fill_signal
from affordance.identification.posterior.log_cholesky import compute_jacobian, parameters_from_theta
from affordance.identification.posterior.solid_prior import SolidPrior
from studies.excite import posewise
from studies.excite.figure import draw_errors
from studies.excite.motions import SECONDS as SECONDS_DESIGNED
from studies.excite.motions import describe_motions, find_seconds, list_seconds
from studies.excite.study import weigh_in_postures

KEYS = {"found": "rmse_g", "said": "said_sd_g", "label": "time (s)"}


def test_a_pose_is_predicted_as_identification_states_it():
    """Predictions from sums of rows, friction and gains as columns, agree to 1e-6 with the library's likelihood."""
    task, _ = posewise.prepare_task(DATA, "red")
    rows = task.build_rows()[[3, 70, 500]]
    found = task.predict((rows[..., :, None] * rows[..., None, :]).sum(axis=0)[None])[0]
    kept = np.isin(np.arange(1000), [3, 70, 500])
    sums = compute_statistics(task.evidence.samples.select(kept), 1)
    pi = parameters_from_theta(task.theta)
    no_friction = task.prior.friction * 0.0
    prior = posewise.ChannelPrior(task.prior.gain, task.prior.gain_covariance, no_friction, task.prior.friction_sd)
    likelihood = PayloadLikelihood(fill_signal(sums, task.gains.mean, pi), prior, task.gains.least_variance)
    H = likelihood.linearise(pi).widen(task.prior.phantom_covariance).precision
    D = compute_jacobian(task.theta)
    stated = np.sqrt(np.linalg.inv(D.T @ H @ D + SolidPrior.for_hand().precision)[0, 0])
    assert found == pytest.approx(stated, rel=1e-6)


def test_rules_choose_each_pose_once_from_the_pool(rng):
    task, mass = posewise.prepare_task(DATA, "black")
    assert mass == pytest.approx(0.13892)  # by the scale
    pool = rng.choice(1000, 30, replace=False)
    for rule in posewise.RULES:
        chosen = posewise._choose(task, rule, pool, 6)
        assert len(set(chosen)) == 6
        assert set(chosen) <= set(pool)


def test_score_of_a_condition_number_is_least_for_even_columns(rng):
    even = np.eye(4)
    assert posewise.score_condition(even) == pytest.approx(0.0, abs=1e-12)
    assert posewise.score_condition(0.1 * even) == pytest.approx(np.log(10.0))  # the least singular value
    assert posewise.score_condition(rng.standard_normal((4, 4))) > -np.log(4.0)


def test_seconds_to_the_floor():
    seconds = (2.0, 4.0, 8.0)
    assert find_seconds(seconds, np.array([24.0, 6.0, 5.0]), 10.0) == pytest.approx(2.0 * 2.0**0.5)
    assert find_seconds(seconds, np.array([6.0, 24.0, 12.0]), 10.0) == pytest.approx(8.0)  # it must stay there
    assert find_seconds(seconds, np.array([3.0, 2.0, 1.0]), 10.0) == 2.0
    assert find_seconds(seconds, np.array([30.0, 20.0, 15.0]), 10.0) == 9.0


def test_random_motions_are_followed_further_and_the_floor_is_that_of_lengths_which_all_rules_have():
    def state(*said):
        flat = {name: np.zeros((1, len(said))) for name in ("inside", "excess")}
        sds = 1e-3 * np.array([said])
        return {"said": sds, "rmse": sds, "predicted": sds, **flat}

    assert list_seconds("random")[: len(SECONDS_DESIGNED)] == list_seconds("stated") == SECONDS_DESIGNED
    found = {"stated": state(24.0, 6.0), "random": state(48.0, 24.0, 3.0)}
    numbers = describe_motions(found, (2.0, 4.0, 8.0))
    assert numbers["floor_g"] == pytest.approx(6.0)
    assert numbers["seconds_to_floor"]["random"] == pytest.approx(4.0 * 2.0 ** (np.log(24.0 / 7.2) / np.log(8.0)))
    assert 2.0 < numbers["seconds_to_floor"]["stated"] < 4.0
    drawn = draw_errors((2, 4, 8), {"arm": numbers["rules"]}, **KEYS)
    assert [len(line.get_xdata()) for line in drawn.axes[0].lines] == [2, 2, 3, 3]
    assert [text.get_text() for text in drawn.axes[0].get_legend().get_texts()] == ["what will be stated", "random"]
    drawn.draw_without_rendering()
    assert [text.get_text() for text in drawn.axes[0].get_xticklabels()] == ["2", "4", "8"]
    arms = draw_errors((2, 4, 8), {"ur10e": numbers["rules"]}, **KEYS)
    assert arms.axes[0].get_title() == "UR10e"


def test_good_postures_weigh_better_than_home():
    found = weigh_in_postures(20)
    assert found["best_g"] < found["median_g"]
    assert found["over_home"] == pytest.approx(found["best_g"] / found["home_g"])


def test_numbers_are_those_of_the_section_and_are_drawn():
    numbers = move()
    rules = numbers["excite"]["poses"]["rules"]
    assert set(rules) == {"stated", "random"}
    assert rules["stated"]["said_sd_g"][0] < rules["random"]["said_sd_g"][0]
    assert np.all(np.diff(rules["stated"]["said_sd_g"]) < 0.0)
    arm = numbers["excite"]["generated"]
    assert arm["predicted_over_stated"] == pytest.approx(1.0, abs=0.3)
    assert numbers["largest_share_of_a_limit"] <= 1.0
    for places, found in ((NUMBERS, rules), (SECONDS, arm["rules"])):
        assert isinstance(draw_errors(places, {"objects": found}, **KEYS), Figure)
    json.dumps(numbers, default=lambda each: np.asarray(each).tolist())
