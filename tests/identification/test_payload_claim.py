from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.generated_runs import PAYLOAD, Truth, generate_run
from numpy.testing import assert_allclose

from affordance.exceptions import BadArgumentError
from affordance.identification.identify import Runs, identify
from affordance.identification.payload_claim import judge_claim
from affordance.identification.payload_formats import PayloadSetting
from affordance.identification.posterior.body_posterior import WeightedBodies

_CENTRE = PAYLOAD[1:4] / PAYLOAD[0]


@pytest.fixture(scope="module")
def belief(robot):
    rng = np.random.default_rng(4)
    truth = Truth(noise_sd=0.1)
    loaded = generate_run(robot, PAYLOAD, truth=truth, rng=rng, rate=50.0, source="loaded")
    empty = generate_run(robot, None, truth=truth, rng=rng, rate=50.0, source="empty")
    return identify(robot, Runs(loaded, (empty,)))


def test_the_payload_that_is_held_is_right_and_others_are_wrong(belief):
    assert judge_claim(belief, PayloadSetting(PAYLOAD[0], _CENTRE)).verdict == "right"
    camera = PayloadSetting(PAYLOAD[0] - 0.25, _CENTRE)
    for wrong in (
        camera,
        PayloadSetting(PAYLOAD[0], _CENTRE + np.array([0.0, 0.0, 0.06])),
        PayloadSetting(0.0, np.zeros(3)),
    ):
        assert judge_claim(belief, wrong).verdict == "wrong"
    assert judge_claim(belief, camera, tolerance=0.5).verdict == "right"


def test_errors_of_torque_are_those_of_the_difference(belief):
    setting = PayloadSetting(1.0, np.array([0.0, 0.0, 0.1]))
    Y = belief.fit.evidence.samples.Y
    expected = np.abs(np.einsum("nci,i->nc", Y, belief.parameters - setting.parameters)).max(axis=0)
    assert_allclose(judge_claim(belief, setting).torque_error, expected, rtol=1e-12)


def test_probability_is_the_weight_of_bodies_within_both_tolerances(belief):
    """Four bodies about the setting: right, too heavy, off centre, right."""
    setting = PayloadSetting(2.0, np.zeros(3))
    pi = np.tile(setting.parameters, (4, 1))
    pi[1, 0] += 0.11
    pi[2, 2] += 0.021
    pi[3, [0, 3]] += [0.09, 0.019]
    weights = np.array([0.1, 0.2, 0.3, 0.4])
    four = replace(belief, bodies=WeightedBodies(pi, weights, np.arange(4)))
    verdict = judge_claim(four, setting, tolerance=0.05)
    assert verdict.probability == pytest.approx(0.5)
    assert (verdict.mass_tolerance, verdict.moment_tolerance) == pytest.approx((0.1, 0.02))


def test_tolerances_out_of_bounds_are_refused(belief):
    with pytest.raises(BadArgumentError, match="tolerance: is 0"):
        judge_claim(SimpleNamespace(), PayloadSetting(1.0, np.zeros(3)), 0.0)
