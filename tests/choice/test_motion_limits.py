"""Words that name the joint at its limit where a motion fails."""

import numpy as np
import pytest

from affordance.choice.motion_cost import PlannedMotion, describe_limit


@pytest.fixture
def middle(arm):
    return 0.5 * (arm.limits.q_lower + arm.limits.q_upper)


def describe(arm, q, v):
    still = np.zeros((2, arm.num_joints))
    return describe_limit(arm, PlannedMotion(0.005, np.stack([still[0], q]), np.stack([still[0], v]), still), 1)


@pytest.mark.parametrize("side", ["q_lower", "q_upper"])
def test_angle_at_a_limit_is_named_first(arm, middle, side):
    q, v = middle.copy(), arm.limits.v_max.copy()
    q[3] = getattr(arm.limits, side)[3] + (0.01 if side == "q_lower" else -0.01)
    limit = getattr(arm.limits, side)[3]
    assert describe(arm, q, v) == f"where {arm.joint_names[3]} is at its limit of {limit:.3g} rad"


def test_rate_at_a_limit_is_named_next(arm, middle):
    v = 0.5 * arm.limits.v_max
    v[1] = -arm.limits.v_max[1]
    assert (
        describe(arm, middle, v) == f"where {arm.joint_names[1]} is at its limit of {arm.limits.v_max[1]:.3g} rad/s"
    )


def test_arm_at_no_limit_is_too_short_or_has_too_few_joints(arm, middle):
    expected = "where no joint is at a limit: the arm is too short, or its 7 joints are too few"
    assert describe(arm, middle, 0.5 * arm.limits.v_max) == expected
