import numpy as np
import pinocchio
import pytest
from helpers.peer_arms import build_pinocchio

from affordance.objects.inertia import parameters_from_pseudo_inertia
from affordance.plant.arm_model import ArmModel, compute_payload_regressor

# Where Pinocchio keeps our parameters: its order is m, m c, Ixx, Ixy, Iyy, Ixz, Iyz, Izz.
FROM_PINOCCHIO = [0, 1, 2, 3, 4, 6, 9, 5, 7, 8]


@pytest.fixture
def trajectory(rng):
    """Random angles, rates and accelerations of 60 samples."""
    return rng.normal(size=(3, 60, 7)) * np.array([1.0, 2.0, 10.0])[:, None, None]


def draw_parameters(rng):
    root = 0.1 * rng.normal(size=(4, 4))
    return parameters_from_pseudo_inertia(root @ root.T)


def test_regressor_gives_the_torque_a_tool_adds_in_drake(arm, chain, trajectory, rng):
    q, v, vdot = trajectory
    Y = chain.compute_payload_regressors(q, v, vdot)
    without, with_tool = ArmModel(arm), ArmModel(arm)
    for k in range(len(q)):
        pi = draw_parameters(rng)
        with_tool.set_payload(pi)
        torques = []
        for model in (with_tool, without):
            model.set_state(np.concatenate([q[k], v[k]]))
            torques.append(model.compute_inverse_dynamics(vdot[k]))
        added = torques[0] - torques[1]
        scale = np.abs(torques[0]).max()
        np.testing.assert_allclose(Y[k] @ pi, added, rtol=0, atol=1e-12 * scale)


def test_regressor_of_one_sample_is_that_of_the_trajectory(chain, model, trajectory):
    q, v, vdot = trajectory
    Y = chain.compute_payload_regressors(q, v, vdot)
    for k in range(len(q)):
        one = compute_payload_regressor(model, np.concatenate([q[k], v[k]]), vdot[k])
        np.testing.assert_allclose(one, Y[k], rtol=0, atol=1e-11)


def test_regressor_agrees_with_pinocchio(chain, trajectory):
    q, v, vdot = trajectory
    Y = chain.compute_payload_regressors(q, v, vdot)
    model = build_pinocchio()
    # A last joint's frame at the grip makes the tool's parameters those of a body of its own.
    grip = model.frames[model.getFrameId("grip")].placement
    data = model.createData()
    for k in range(len(q)):
        whole = pinocchio.computeJointTorqueRegressor(model, data, q[k], v[k], vdot[k])[:, -10:]
        # Parameters about the last joint's origin, as a function of those about the grip.
        expected = np.empty((7, 10))
        for column in range(10):
            unit = np.zeros(10)
            unit[column] = 1.0
            expected[:, column] = whole @ shift_parameters(unit, grip.translation)
        expected = expected[:, FROM_PINOCCHIO]
        np.testing.assert_allclose(Y[k], expected, rtol=0, atol=1e-9)


def shift_parameters(parameters, offset):
    """Pinocchio's ten parameters about a point, given those about a point at ``offset`` from it; linear in them."""
    mass, first_moment = parameters[0], parameters[1:4]
    Ixx, Ixy, Iyy, Ixz, Iyz, Izz = parameters[4:]
    inertia = np.array([[Ixx, Ixy, Ixz], [Ixy, Iyy, Iyz], [Ixz, Iyz, Izz]])
    d, h = offset, first_moment
    shifted = inertia + (2 * d @ h) * np.eye(3) - np.outer(d, h) - np.outer(h, d)
    shifted += mass * (d @ d * np.eye(3) - np.outer(d, d))
    return np.array(
        [
            mass,
            *(h + mass * d),
            shifted[0, 0],
            shifted[0, 1],
            shifted[1, 1],
            shifted[0, 2],
            shifted[1, 2],
            shifted[2, 2],
        ]
    )


def test_weightless_tool_at_rest_needs_no_torque_and_a_mass_needs_its_weight(arm, chain):
    q = arm.home[None]
    Y = chain.compute_payload_regressors(q, 0 * q, 0 * q)[0]
    assert not (Y @ np.zeros(10)).any()
    elevation = arm.joint_names.index("shoulder_elevation")
    reach = 0.3274 + 0.2570 + 0.19
    assert Y[elevation, 0] == pytest.approx(9.81 * reach, rel=1e-12)
    # A centre of mass further out by 1 m for 1 kg adds 9.81 N m; second moments cannot be felt at rest.
    assert Y[elevation, 1] == pytest.approx(9.81, rel=1e-12)
    np.testing.assert_allclose(Y[:, 4:], 0.0, atol=1e-15)
