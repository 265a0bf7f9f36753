"""Motions that keep limits whatever their parameters, rest at both ends, and have the stated derivatives."""

import numpy as np
import pytest
from helpers.generated_runs import PAYLOAD

from affordance.extensions.payload.excitation.planned_motion import (
    FourierFamily,
    PostureFamily,
    compute_tip_speed,
    list_times,
)


@pytest.fixture(params=["fourier", "postures"])
def family(request, robot, limits):
    return FourierFamily(robot, limits, 8.0) if request.param == "fourier" else PostureFamily(robot, limits, 8.0, 3)


def draw(family, num, rng):
    drawn = (3.0 * family.draw(rng) for _ in range(10 * num))  # beyond what is drawn, too
    built = (family.build(numbers, list_times(family.duration, 200.0)) for numbers in drawn)
    return [motion for motion in built if motion is not None][:num]


def test_limits_hold_and_the_arm_rests_at_both_ends(family, limits, rng):
    motions = draw(family, 5, rng)
    assert motions
    for motion in motions:
        assert np.all((motion.q >= limits.q_lower) & (motion.q <= limits.q_upper))
        assert np.all(np.abs(motion.v) <= limits.v_max)
        assert np.all(np.abs(motion.vdot) <= limits.vdot_max)
        assert compute_tip_speed(family.robot, motion) <= limits.tip_speed
        for end in (0, -1):
            np.testing.assert_allclose(motion.v[end], 0.0, atol=1e-9)
            np.testing.assert_allclose(motion.vdot[end], 0.0, atol=1e-9)


def test_rates_are_derivatives(family, rng):
    motion = draw(family, 1, rng)[0]
    step = motion.times[1]
    np.testing.assert_allclose(np.gradient(motion.q, step, axis=0)[1:-1], motion.v[1:-1], atol=2e-3)
    np.testing.assert_allclose(np.gradient(motion.v, step, axis=0)[2:-2], motion.vdot[2:-2], atol=0.15)


def test_each_posture_is_swept_through_both_ways(robot, limits):
    family = PostureFamily(robot, limits, 8.0, 2)
    motion = family.build(np.concatenate([np.full(6, 0.4), np.full(6, 0.5)]), list_times(8.0, 100.0))
    slow = np.abs(motion.v).max(axis=1) < 0.25
    for j in range(6):
        assert (motion.v[slow, j] > 0.03).sum() > 50
        assert (motion.v[slow, j] < -0.03).sum() > 50


def test_postures_too_far_apart_are_no_motion(robot, limits):
    far = np.concatenate([np.zeros(6), np.ones(6)])
    assert PostureFamily(robot, limits, 1.0, 2).build(far, list_times(1.0)) is None


def test_excess_names_what_is_broken(robot, limits, rng):
    motion = draw(FourierFamily(robot, limits, 8.0), 1, rng)[0]
    bodies = PAYLOAD[None]
    assert limits.compute_excess(robot, motion, bodies) <= 1.0
    for broken in (
        limits._replace(q_upper=motion.q.max(axis=0) - 0.01),
        limits._replace(v_max=0.9 * np.abs(motion.v).max(axis=0)),
        limits._replace(vdot_max=0.9 * np.abs(motion.vdot).max(axis=0)),
        limits._replace(tip_speed=0.9 * compute_tip_speed(robot, motion)),
        limits._replace(height=100.0),
    ):
        assert broken.compute_excess(robot, motion, bodies) > 1.0
    torque = robot.compute_arm_torques(*motion.motion)
    weak = limits._replace(tau_max=np.abs(torque).max(axis=0) + 1e-3)
    assert weak.compute_excess(robot, motion, np.zeros((1, 10))) <= 1.0
    assert weak.compute_excess(robot, motion, 3.0 * bodies) > 1.0


def test_the_least_height_of_the_tip_is_approached_by_what_is_left_of_a_metre(robot, limits, rng):
    motion = draw(FourierFamily(robot, limits, 8.0), 1, rng)[0]
    lowest = robot.compute_motion(*motion.motion).p_WT[:, 2].min()
    for left in (0.005, -0.005):
        limited = limits._replace(height=lowest - left)
        assert limited.compute_excess(robot, motion, PAYLOAD[None]) == pytest.approx(1.0 - left)
