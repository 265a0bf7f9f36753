from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.generated_runs import PAYLOAD, Truth, generate_pair
from numpy.testing import assert_allclose
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix

from affordance.exceptions import BadArgumentError
from affordance.extensions.payload.identify import Runs, identify
from affordance.extensions.payload.payload_claim import judge_claim
from affordance.extensions.payload.payload_setting import PayloadSetting
from affordance.extensions.payload.posterior.body_posterior import WeightedBodies
from affordance.objects.inertia import parameters_from_spatial_inertia, spatial_inertia_from_parameters

_CENTRE = PAYLOAD[1:4] / PAYLOAD[0]


@pytest.fixture(scope="module")
def belief(robot):
    empty, loaded = generate_pair(robot, np.random.default_rng(4), Truth(noise_sd=0.1), rate=50.0)
    return identify(robot, Runs(loaded, (empty,)))


def test_the_payload_that_is_held_is_right_and_others_are_wrong(belief):
    assert judge_claim(belief, PayloadSetting(PAYLOAD[0], _CENTRE)).verdict == "right"
    camera = PayloadSetting(PAYLOAD[0] - 0.25, _CENTRE)
    elsewhere = PayloadSetting(PAYLOAD[0], _CENTRE + np.array([0.0, 0.0, 0.06]))
    for wrong in (camera, elsewhere, PayloadSetting(0.0, np.zeros(3))):
        assert judge_claim(belief, wrong).verdict == "wrong"
    assert judge_claim(belief, camera, tolerance=0.5).verdict == "right"


def test_errors_of_torque_are_those_of_the_difference(belief):
    setting = PayloadSetting(1.0, np.array([0.0, 0.0, 0.1]))
    Y = belief.fit.evidence.samples.Y
    expected = np.abs(np.einsum("nci,i->nc", Y, belief.parameters - setting.parameters)).max(axis=0)
    assert_allclose(judge_claim(belief, setting).torque_error, expected, rtol=1e-12)


def test_probability_is_the_weight_of_bodies_within_both_tolerances(belief):
    """The two of four bodies within both tolerances of mass and first moment give the probability 0.5 by weight."""
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


@pytest.mark.parametrize("seed", range(6))
def test_plausibility_is_that_of_the_nearest_right_payload(belief, seed):
    """Plausibility agrees to 0.03 with the least distance of 400,000 payloads drawn within the tolerances."""
    rng = np.random.default_rng(seed)
    setting = PayloadSetting(2.0, np.zeros(3))
    root = rng.standard_normal((4, 4)) * 0.05 * np.array([[1.0], [0.2], [0.2], [0.2]])
    centre = np.array([0.1, 0.02, 0.02, 0.02]) * rng.uniform(-2.5, 2.5, 4)
    pi = np.tile(setting.parameters, (4000, 1))
    pi[:, :4] += centre + rng.standard_normal((4000, 4)) @ root.T
    equal = np.full(4000, 1.0 / 4000)
    verdict = judge_claim(replace(belief, bodies=WeightedBodies(pi, equal, np.arange(4000))), setting)
    within = rng.standard_normal((400000, 4))
    within[:, 0] = rng.uniform(-0.1, 0.1, len(within))
    within[:, 1:] *= 0.02 * (rng.random((len(within), 1)) ** 0.2) / np.linalg.norm(within[:, 1:], axis=1)[:, None]
    away = pi[:, :4] - setting.parameters[:4]
    precision = np.linalg.inv(np.cov(away.T, bias=True))
    distances = [np.einsum("ni,ij,nj->n", x, precision, x) for x in (within - away.mean(axis=0), away - away.mean(0))]
    assert verdict.plausibility == pytest.approx(np.mean(distances[1] >= distances[0].min()), abs=0.03)


def test_a_wide_belief_leaves_a_right_setting_open(belief):
    """A setting within 5 % of a mass known to 40 % stays open, and settings far off are wrong."""
    rng = np.random.default_rng(0)
    pi = np.tile(PAYLOAD, (8000, 1)) * np.exp(0.4 * rng.standard_normal((8000, 1)))
    pi[:, 1:4] += 0.1 * rng.standard_normal((8000, 3))
    wide = replace(belief, bodies=WeightedBodies(pi, np.full(8000, 1.0 / 8000), np.arange(8000)))
    right = judge_claim(wide, PayloadSetting(PAYLOAD[0], _CENTRE))
    assert right.probability < 0.05
    assert right.verdict == "open"
    assert judge_claim(wide, PayloadSetting(4.0 * PAYLOAD[0], _CENTRE)).verdict == "wrong"
    assert judge_claim(wide, PayloadSetting(PAYLOAD[0], _CENTRE + 0.5)).verdict == "wrong"


def test_tolerances_out_of_bounds_are_refused(belief):
    with pytest.raises(BadArgumentError, match="tolerance: is 0"):
        judge_claim(SimpleNamespace(), PayloadSetting(1.0, np.zeros(3)), 0.0)


def test_moments_that_make_larger_torques_than_a_right_mass_may_are_wrong(belief):
    """Moments of 1 kg m^2 for hundredths are found in a motion that hardly shows hundredths; right ones are right."""
    true = PAYLOAD[4:].copy()
    m, c = PAYLOAD[0], _CENTRE
    true[:3] -= m * np.array([c[1] ** 2 + c[2] ** 2, c[0] ** 2 + c[2] ** 2, c[0] ** 2 + c[1] ** 2])
    true[3:] += m * np.array([c[0] * c[1], c[0] * c[2], c[1] * c[2]])
    assert judge_claim(belief, PayloadSetting(m, c, true)).verdict == "right"
    assert judge_claim(belief, PayloadSetting(m, c, np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0]))).verdict == "wrong"


def test_moments_are_compared_only_where_the_run_can_check_them(belief):
    """Without moments set nothing is said; small ones cannot be seen, large ones can, and at rest none can."""
    small, large = np.array([[1e-4] * 3 + [0.0] * 3, [1.0] * 3 + [0.0] * 3])
    setting = PayloadSetting(PAYLOAD[0], _CENTRE)
    sure = replace(belief, bodies=WeightedBodies(PAYLOAD[None], np.ones(1), np.arange(1)))
    evidence = belief.fit.evidence
    Y = evidence.samples.Y.copy()
    Y[:, :, 4:] = 0.0
    at_rest = replace(evidence, samples=evidence.samples._replace(Y=Y))
    still = replace(sure, fit=belief.fit._replace(evidence=at_rest))
    found = [
        judge_claim(each, setting._replace(inertia=moments)).moments_compared
        for each in (sure, still)
        for moments in (None, small, large)
    ]
    assert found == [None, False, True, None, False, False]


def test_a_setting_is_compared_in_the_frame_of_the_flange(belief):
    """Of a payload that is set in a frame half a metre away, Drake's shifted inertias give mass and first moment."""
    X_FT = RigidTransform(RotationMatrix(RollPitchYaw(0.4, -1.0, 2.0)), [0.5, -0.2, 0.1])
    setting = PayloadSetting(PAYLOAD[0], _CENTRE)
    of_flange = setting.express(X_FT.GetAsMatrix4())
    verdict = judge_claim(belief, of_flange, 0.03, X_FT.GetAsMatrix4())
    pi = belief.bodies.pi[:300]
    few = replace(belief, bodies=WeightedBodies(pi, np.full(300, 1 / 300), np.arange(300)))
    shifted = np.array(
        [
            parameters_from_spatial_inertia(
                spatial_inertia_from_parameters(each).ReExpress(X_FT.rotation()).Shift(-X_FT.translation())
            )
            for each in pi
        ]
    )
    away = shifted - of_flange.parameters
    right = (abs(away[:, 0]) <= 0.03 * PAYLOAD[0]) & (np.linalg.norm(away[:, 1:4], axis=1) <= 0.006 * PAYLOAD[0])
    assert 0.0 < right.mean() < 1.0
    judged = judge_claim(few, of_flange, 0.03, X_FT.GetAsMatrix4())
    assert judged.probability == pytest.approx(right.mean())
    # Torques are the same in any frame; what is right in one frame is wrong if it is taken to be in the other.
    assert_allclose(verdict.torque_error, judge_claim(belief, setting).torque_error, rtol=1e-6, atol=1e-9)
    assert judge_claim(belief, of_flange, 0.1, X_FT.GetAsMatrix4()).verdict == "right"
    assert judge_claim(belief, of_flange).verdict == "wrong"
