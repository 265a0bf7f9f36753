import dataclasses

import numpy as np
import pinocchio
import pytest
from helpers.peer_arms import build_pinocchio, read_grip
from helpers.two_tools import STICK
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from affordance.choice.hammer import load_hammer
from affordance.control.swing import COASTING_TIME, find_target, plan_swing
from affordance.exceptions import AffordanceError
from affordance.files.model_folder import MODELS
from affordance.plant.arm_model import ArmModel
from studies.robustness.inverse_dynamics import InverseDynamics
from studies.robustness.optimal_swing import SwingSearch, measure_motion

HELD = STICK.gripped_by(STICK.grips[0])
PI = HELD.parameters
DOWN = np.array([0.0, 0.0, -1.0])
SPEED, DURATION = 3.0, 0.8
START = dict(load_hammer(MODELS / "nail.yaml").start)
ROUNDING = 0.1  # the lesser of the search, [W]


@pytest.fixture(scope="module")
def target(own_model):
    offset_W, q_start = np.array([-0.1, 0.0, -0.1]), own_model.arm.find_posture(START)
    return find_target(own_model, HELD.components, q_start=q_start, offset_W=offset_W, direction_W=DOWN)


@pytest.fixture(scope="module")
def swing(own_model, target):
    return plan_swing(own_model, target, speed=SPEED, duration=DURATION)


@pytest.fixture(scope="module")
def search(own_model, target, swing):
    return SwingSearch(own_model, target, swing, PI, num_pieces=2)


@pytest.fixture(scope="module")
def found(search):
    return search.find_least_work()


@pytest.fixture(scope="module")
def cubic(own_model, swing):
    """The given swing, of least acceleration."""
    times = np.linspace(0.0, swing.duration, 801)
    return measure_motion(InverseDynamics(own_model, PI), times, *swing.evaluate(times), converged=True)


@pytest.fixture(scope="module")
def peer():
    """The arm with the stick in Pinocchio, which shares nothing with ours."""
    model = build_pinocchio()
    for part in HELD.components:
        payload = pinocchio.Inertia.FromEllipsoid(part.material.density * part.shape.volume, *part.shape.semi_axes)
        place = pinocchio.SE3(part.X_TE[:3, :3], read_grip() + part.X_TE[:3, 3])
        model.appendBodyToJoint(model.njoints - 1, payload, place)
    return model


def test_slopes_of_the_torques_are_those_of_finite_differences(own_model, rng):
    dynamics = InverseDynamics(own_model, PI)
    motion = rng.normal(size=(3, 4, 7))
    gradients = dynamics.compute_gradients(*motion)
    np.testing.assert_allclose(gradients.tau, dynamics.compute(*motion), atol=1e-12)
    for which, slope in enumerate(gradients[1:]):
        for joint in range(7):
            step = np.zeros((3, 1, 7))
            step[which, 0, joint] = 1e-5
            difference = (dynamics.compute(*(motion + step)) - dynamics.compute(*(motion - step))) / 2e-5
            np.testing.assert_allclose(slope[:, :, joint], difference, atol=1e-7)


def test_gradient_of_the_cost_is_that_of_finite_differences(search, rng):
    points = search.start + 0.1 * rng.normal(size=search.start.shape)
    _, gradient = search.compute_cost(0.5, points)
    direction = rng.normal(size=points.shape)
    direction[:2] = 0.0
    ahead, behind = (search.compute_cost(0.5, points + shift * direction)[0] for shift in (1e-6, -1e-6))
    assert gradient @ direction[2:].ravel() == pytest.approx((ahead - behind) / 2e-6, rel=1e-6)


def test_search_begins_with_the_cubic(search, cubic):
    ours = search.measure(search.start)
    np.testing.assert_allclose(ours.q, cubic.q, atol=1e-12)
    np.testing.assert_allclose(ours.vdot, cubic.vdot, atol=1e-9)
    rounded = np.trapezoid(np.sum(np.hypot(cubic.tau * cubic.v, 10.0) - 10.0, axis=1), cubic.times)
    assert search.compute_cost(10.0, search.start)[0] == pytest.approx(rounded, rel=1e-3)


def test_swing_strikes_where_and_as_the_cubic_does(own_model, target, found):
    own_model.set_state(np.concatenate([found.q[-1], found.v[-1]]))
    np.testing.assert_allclose(own_model.compute_point_position(target.p_TS), target.p_WS, atol=1e-5)
    np.testing.assert_allclose(own_model.compute_point_jacobian(target.p_TS) @ found.v[-1], SPEED * DOWN, atol=1e-4)
    normal_W = own_model.compute_hand_pose().rotation().matrix() @ target.normal_T
    np.testing.assert_allclose(normal_W, DOWN, atol=1e-4)


def test_swing_begins_at_rest_where_it_is_to_and_keeps_the_limits(own_model, found):
    limits = own_model.arm.limits
    np.testing.assert_allclose(found.q[0], own_model.arm.find_posture(START), atol=1e-12)
    np.testing.assert_allclose(found.v[0], 0.0, atol=1e-12)
    assert (found.q >= limits.q_lower - 1e-6).all()
    assert (found.q <= limits.q_upper + 1e-6).all()
    assert (np.abs(found.v) <= limits.v_max + 1e-6).all()
    # Between the nodes of the quadrature torques may exceed their limit a little.
    assert (np.abs(found.tau) <= 1.03 * limits.tau_max).all()


def test_swing_of_least_work_takes_less_work_than_the_cubic(found, cubic):
    assert found.work < 0.7 * cubic.work


def test_no_swing_takes_less_work_than_the_energy_it_gains(own_model, found, cubic):
    plant = own_model.arm.plant
    context = plant.CreateDefaultContext()
    own_model.arm.set_payload(context, PI)

    def energy(q, v):
        plant.SetPositionsAndVelocities(context, np.concatenate([q, v]))
        return plant.CalcPotentialEnergy(context) + plant.CalcKineticEnergy(context)

    for motion in (cubic, found):
        gained = energy(motion.q[-1], motion.v[-1]) - energy(motion.q[0], motion.v[0])
        power = np.trapezoid(np.sum(motion.tau * motion.v, axis=1), motion.times)
        assert power == pytest.approx(gained, abs=1e-3)
        assert motion.work >= gained


def test_torques_of_the_swing_carry_it_out_in_another_library(peer, found):
    """Pinocchio's arm, driven open loop by nothing but the torques, follows the swing to 1e-5.

    Integration begins afresh each tenth of a second, in which errors grow tenfold with the arm's small inertias.
    """
    data = peer.createData()
    torque = CubicSpline(found.times, found.tau)
    states = np.hstack([found.q, found.v])

    def derive(time, x):
        return np.concatenate([x[7:], pinocchio.aba(peer, data, x[:7], x[7:], torque(time))])

    for i in range(0, 800, 100):
        between = (found.times[i], found.times[i + 100])
        end = solve_ivp(derive, between, states[i], method="DOP853", rtol=1e-9, atol=1e-9).y[:, -1]
        np.testing.assert_allclose(end, states[i + 100], atol=1e-5)


def test_no_nearby_motion_takes_less_work(own_model, target, swing):
    """Steps that keep strike and joint limits, restored by Newton's method, raise the work."""
    limits = own_model.arm.limits
    strong = dataclasses.replace(own_model.arm, limits=limits._replace(tau_max=np.full(7, 1e3)))
    search = SwingSearch(ArmModel(strong), target, swing, PI, num_pieces=2)
    motion = search.find_least_work()
    best = search.fit(motion.q)
    least, _ = search.compute_cost(ROUNDING, best)
    # Rates at the strike are linear in the last two control points.
    gain = motion.v[-1, 0] / (best[-1, 0] - best[-2, 0])

    def miss(z):
        end, before = z.reshape(2, 7)
        own_model.set_state(np.concatenate([end, np.zeros(7)]))
        place = own_model.compute_point_position(target.p_TS) - target.p_WS
        along = own_model.compute_point_jacobian(target.p_TS) @ (gain * (end - before)) - SPEED * DOWN
        normal = own_model.compute_hand_pose().rotation().matrix() @ target.normal_T
        return np.concatenate([place, along, normal[:2]])

    rng = np.random.default_rng(0)
    tried = 0
    for _ in range(60):
        points = best.copy()
        points[2:] = np.clip(best[2:] + 0.01 * rng.standard_normal(best[2:].shape), limits.q_lower, limits.q_upper)
        z = points[[-1, -2]].ravel()
        for _ in range(4):
            slopes = np.column_stack([(miss(z + h) - miss(z - h)) / 2e-6 for h in 1e-6 * np.eye(14)])
            z = z - np.linalg.pinv(slopes) @ miss(z)
        points[[-1, -2]] = z.reshape(2, 7)
        stopped = points[-1] + COASTING_TIME * gain * (points[-1] - points[-2])
        if all(((q >= limits.q_lower) & (q <= limits.q_upper)).all() for q in (*points, stopped)):
            tried += 1
            assert search.compute_cost(ROUNDING, points)[0] > least * (1.0 - 1e-6)
    assert tried >= 5


def test_arm_that_is_too_weak_is_refused(own_model, target, swing):
    limits = own_model.arm.limits
    weak = dataclasses.replace(own_model.arm, limits=limits._replace(tau_max=0.01 * limits.tau_max))
    with pytest.raises(
        AffordanceError, match=r"no swing of 0.8 s within position, velocity and torque limits was found$"
    ):
        SwingSearch(ArmModel(weak), target, swing, PI, num_pieces=2).find_least_work()
