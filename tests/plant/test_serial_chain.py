from dataclasses import replace

import numpy as np
from pydrake.multibody.tree import JacobianWrtVariable

from affordance.plant.arm_model import ArmModel


def test_dynamics_are_motion_torques_and_regressors_to_the_last_bit(chain, rng):
    q, v, vdot = rng.normal(size=(3, 25, 7))
    found = chain.compute_dynamics(q, v, vdot)
    for one, other in zip(found.motion, chain.compute_motion(q, v, vdot), strict=True):
        np.testing.assert_array_equal(one, other)
    np.testing.assert_array_equal(found.arm_torques, chain.compute_arm_torques(q, v, vdot))
    np.testing.assert_array_equal(found.Y, chain.compute_payload_regressors(q, v, vdot))


def test_motion_of_the_tool_agrees_with_drake(arm, chain, rng):
    q, v, vdot = rng.normal(size=(3, 25, 7))
    motion = chain.compute_motion(q, v, vdot)
    plant, world, T = arm.plant, arm.plant.world_frame(), arm.tool.body_frame()
    context = plant.CreateDefaultContext()
    for k in range(len(q)):
        plant.SetPositions(context, q[k])
        plant.SetVelocities(context, v[k])
        X_WT = T.CalcPoseInWorld(context)
        J = plant.CalcJacobianSpatialVelocity(context, JacobianWrtVariable.kV, T, np.zeros(3), world, world)
        bias = plant.CalcBiasSpatialAcceleration(context, JacobianWrtVariable.kV, T, np.zeros(3), world, world)
        A_WT = J @ vdot[k] + bias.get_coeffs()
        np.testing.assert_allclose(motion.R_WT[k], X_WT.rotation().matrix(), atol=1e-13)
        np.testing.assert_allclose(motion.p_WT[k], X_WT.translation(), atol=1e-13)
        np.testing.assert_allclose(motion.Jv_V_WT[k], J, atol=1e-13)
        np.testing.assert_allclose(motion.w_WT[k], (J @ v[k])[:3], atol=1e-13)
        np.testing.assert_allclose(motion.alpha_WT[k], A_WT[:3], atol=1e-11)
        np.testing.assert_allclose(motion.a_WT[k], A_WT[3:], atol=1e-11)


def test_a_point_of_a_turned_tool_moves_with_its_frame(chain, rng):
    q, p_TQ = rng.normal(size=(5, 7)), np.array([0.1, -0.2, 0.3])
    turned = replace(chain, R_MT=np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]), p_MT=p_TQ)
    motion = turned.compute_motion(q, np.zeros_like(q), np.zeros_like(q))
    np.testing.assert_allclose(turned.compute_positions(q, p_TQ), motion.p_WT + motion.R_WT @ p_TQ, atol=1e-13)


def test_torques_of_the_links_agree_with_drake_whatever_the_tool(arm, chain, rng):
    q, v, vdot = rng.normal(size=(3, 5, 7))
    model = ArmModel(arm)
    for k, torque in enumerate(chain.compute_arm_torques(q, v, vdot)):
        model.set_state(np.concatenate([q[k], v[k]]))
        damping = np.array([joint.default_damping() for joint in map(arm.plant.GetJointByName, chain.joint_names)])
        np.testing.assert_allclose(torque + damping * v[k], model.compute_inverse_dynamics(vdot[k]), atol=1e-11)
