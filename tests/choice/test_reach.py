"""The task of following a path, and the motion that is planned for it."""

import numpy as np
import pytest
from helpers.two_tools import REACH, STICK

from affordance.choice.motion_cost import MotionCost, plan_motion
from affordance.control.mpc import MinimumAccelerationMpc, MpcSolution, MpcStatus
from affordance.exceptions import NoPlanError
from affordance.objects.inertia import Ellipsoid, build_inertia_map
from affordance.settings import DEFAULT_SETTINGS

P_TF = np.array([0.3, 0.0, 0.0])


@pytest.fixture(scope="module")
def motion(own_model):
    return plan_motion(own_model, REACH.begin(own_model, P_TF), duration=REACH.duration, settings=DEFAULT_SETTINGS)


def place(model, q, v):
    model.set_state(np.concatenate([q, v]))
    return model.compute_point_position(P_TF)


def test_path_begins_where_the_start_posture_holds_the_free_end(model, arm):
    p_WF, v_WF = REACH.begin(model, P_TF).compute_reference(0.0)
    np.testing.assert_allclose(p_WF, place(model, arm.find_posture(dict(REACH.path.start)), np.zeros(7)), atol=1e-12)
    np.testing.assert_allclose(v_WF, 0.0, atol=1e-12)


def test_path_stands_still_before_and_after(model):
    following = REACH.begin(model, P_TF)
    for early, late in ((-1.0, 0.0), (REACH.duration, REACH.duration + 5.0)):
        np.testing.assert_array_equal(following.compute_reference(early), following.compute_reference(late))


def test_planned_motion_keeps_to_the_path_and_within_limits(model, motion, arm):
    following = REACH.begin(model, P_TF)
    for k in range(0, len(motion.q), 10):
        error = place(model, motion.q[k], motion.v[k]) - following.compute_reference(k * motion.control_period)[0]
        assert np.linalg.norm(error) < REACH.path.tolerance
    assert (motion.q >= arm.limits.q_lower - 1e-6).all()
    assert (motion.q <= arm.limits.q_upper + 1e-6).all()
    assert (np.abs(motion.v) <= arm.limits.v_max).all()
    assert np.abs(motion.v[-1]).max() < 0.05  # the arm does not drift when the path has ended


def test_planned_motion_is_a_double_integrator(motion):
    h = motion.control_period
    np.testing.assert_allclose(np.diff(motion.v, axis=0), h * motion.vdot[:-1], atol=1e-12)
    steps = h * motion.v[:-1] + 0.5 * h**2 * motion.vdot[:-1]
    np.testing.assert_allclose(np.diff(motion.q, axis=0), steps, atol=1e-12)


def test_costs_are_those_of_drakes_inverse_dynamics(model, motion):
    """Costs agree to 1e-9 with Drake's inverse dynamics at every tick, the tool being a body of the plant."""
    rng = np.random.default_rng(1)
    shapes = [Ellipsoid((0.075, 0.015, 0.02)), Ellipsoid((0.03, 0.05, 0.02))]
    poses = [np.eye(4), np.eye(4)]
    poses[0][:3, 3], poses[1][:3, 3] = [0.075, 0, 0], [0.2, 0.01, -0.02]
    Phi = build_inertia_map(shapes, poses, [0, 1], 2)
    rho = rng.uniform(500, 9000, (4, 2))
    costs = MotionCost(model, motion, num_nodes=len(motion.q)).compute(rho @ Phi.T)
    for k in range(4):
        model.set_payload(Phi @ rho[k])
        tau, rates = [], []
        for q, v, vdot in zip(motion.q, motion.v, motion.vdot, strict=True):
            middle_v = v + 0.5 * motion.control_period * vdot
            middle_q = q + 0.5 * motion.control_period * v + 0.125 * motion.control_period**2 * vdot
            model.set_state(np.concatenate([middle_q, middle_v]))
            tau.append(model.compute_inverse_dynamics(vdot))
            rates.append(middle_v)
        tau, rates = np.array(tau), np.array(rates)
        assert costs.work[k] == pytest.approx(motion.control_period * np.abs(tau * rates).sum(), rel=1e-9)
        assert costs.effort[k] == pytest.approx(motion.control_period * (tau**2).sum(), rel=1e-9)
        assert costs.feasible[k] == (np.abs(tau) <= model.arm.limits.tau_max).all()


def test_fifty_nodes_are_as_good_as_four_hundred(model, motion):
    rng = np.random.default_rng(2)
    pi = np.zeros((50, 10))
    pi[:, 0] = rng.uniform(0.1, 1.0, 50)
    pi[:, 1] = pi[:, 0] * rng.uniform(0.05, 0.25, 50)
    pi[:, 5:7] = (pi[:, 1] ** 2 / pi[:, 0] * 1.2)[:, None]
    few = MotionCost(model, motion).compute(pi)
    all_ticks = MotionCost(model, motion, num_nodes=len(motion.q)).compute(pi)
    np.testing.assert_allclose(few.work, all_ticks.work, rtol=1e-3)
    np.testing.assert_allclose(few.effort, all_ticks.effort, rtol=1e-3)


def test_chunks_do_not_change_the_costs(model, motion):
    cost_model = MotionCost(model, motion)
    pi = np.zeros((4_500, 10))
    pi[:, 0] = np.linspace(0.0, 5.0, 4_500)
    costs = cost_model.compute(pi)
    for k in (0, 1999, 2000, 4499):
        alone = cost_model.compute(pi[k : k + 1])
        assert costs.work[k] == pytest.approx(alone.work[0], rel=1e-12)
        assert costs.feasible[k] == alone.feasible[0]
    # Heavier point masses at the grip load the arm more, until a joint exceeds its torque limit.
    assert costs.feasible[0]
    assert not costs.feasible[-1]
    assert (np.diff(costs.feasible.astype(int)) <= 0).all()


def test_controller_without_a_plan_is_said(model, monkeypatch):
    failed = MpcSolution(np.full((12, 7), np.nan), np.full(7, np.nan), MpcStatus.FAILED)
    monkeypatch.setattr(MinimumAccelerationMpc, "solve", lambda *arguments: failed)
    with pytest.raises(NoPlanError, match=r"^no plan keeps the joints' position and velocity limits at t = 0.000 s$"):
        plan_motion(model, REACH.begin(model, P_TF), duration=0.1, settings=DEFAULT_SETTINGS)
    with pytest.raises(NoPlanError, match=r"at t = 0.000 s, near the start$"):
        REACH.build_cost(model, STICK.components, DEFAULT_SETTINGS)
