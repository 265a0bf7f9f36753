"""Search for a motion: better than at random, the same by the same seed, and within the limits with the load."""

import numpy as np
import pytest

from affordance.extensions.payload.excitation import motion_design
from affordance.extensions.payload.excitation.expectation import Aim
from affordance.extensions.payload.excitation.motion_design import NoMotionError, design_motion
from affordance.extensions.payload.excitation.planned_motion import FourierFamily, PostureFamily
from affordance.extensions.payload.posterior.log_cholesky import parameters_from_theta

FEW = {"num_draws": 12, "num_changes": 20}


def test_designed_motion_shows_more_than_random_ones(expectation, limits):
    family = FourierFamily(expectation.robot, limits, 4.0)
    design, spread = design_motion(expectation, family, Aim.MASS, **FEW)
    assert design.score < 0.8 * design.typical
    assert spread.mass == pytest.approx(design.score, rel=0.05)
    bodies = parameters_from_theta(expectation.bodies)
    assert limits.compute_excess(expectation.robot, design.motion, bodies) <= 1.0
    again, _ = design_motion(expectation, family, Aim.MASS, **FEW)
    np.testing.assert_array_equal(again.motion.q, design.motion.q)


def test_the_best_few_are_changed_and_the_best_of_these_is_kept(expectation, limits, monkeypatch):
    family = FourierFamily(expectation.robot, limits, 4.0)
    scores = []
    for starts in (1, 6):  # the first of six is changed as one alone
        monkeypatch.setattr(motion_design, "NUM_STARTS", starts)
        scores.append(design_motion(expectation, family, Aim.MASS, num_draws=8, num_changes=8)[0].score)
    assert scores[1] < scores[0]


def test_what_a_motion_is_for_is_what_it_shows(expectation, limits):
    family = FourierFamily(expectation.robot, limits, 4.0)
    spreads = {aim: design_motion(expectation, family, aim, **FEW)[1] for aim in (Aim.MASS, Aim.INERTIA)}
    assert spreads[Aim.MASS].mass < spreads[Aim.INERTIA].mass
    assert spreads[Aim.INERTIA].inertia < spreads[Aim.MASS].inertia


def test_no_motion_within_the_limits_is_said(expectation, limits):
    for family in (
        PostureFamily(expectation.robot, limits, 1.0, 8),
        FourierFamily(expectation.robot, limits._replace(tau_max=1e-3 * limits.tau_max), 4.0),
        FourierFamily(expectation.robot, limits._replace(height=4.0), 4.0),
    ):
        with pytest.raises(NoMotionError, match=r"none of 12 motions of \d s respects the limits"):
            design_motion(expectation, family, Aim.MASS, **FEW)
