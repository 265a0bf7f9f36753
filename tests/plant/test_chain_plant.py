"""Chains that are read from plants and robots' files, their torques, and the plant that is built of a chain."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio
import pytest
from helpers.generated_runs import PAYLOAD, build_robot
from numpy.testing import assert_allclose
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import PrismaticJoint, RevoluteJoint, SpatialInertia, WeldJoint

from affordance.exceptions import ModelFileError
from affordance.plant.arm import Arm
from affordance.plant.arm_model import ArmModel, compute_payload_regressor
from affordance.plant.chain_plant import build_arm, build_chain, recognise_arm


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    return build_robot(tmp_path_factory.mktemp("robot"))


def test_arm_torques_agree_with_pinocchio(robot, rng):
    model = pinocchio.buildModelFromUrdf(robot.source)
    data = model.createData()
    q, v, vdot = rng.standard_normal((3, 10, robot.num_joints))
    ours = robot.compute_arm_torques(q, v, vdot)
    theirs = [pinocchio.rnea(model, data, *states) for states in zip(q, v, vdot, strict=True)]
    assert_allclose(ours, theirs, atol=1e-10)


def test_payload_adds_what_pinocchio_says(robot, rng):
    model = pinocchio.buildModelFromUrdf(robot.source)
    flange = model.getFrameId("flange")
    bare = model.copy()
    m, c = PAYLOAD[0], PAYLOAD[1:4] / PAYLOAD[0]
    xx, yy, zz, xy, xz, yz = PAYLOAD[4:]
    about_tip = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    about_cm = about_tip - m * (c @ c * np.eye(3) - np.outer(c, c))
    inertia = pinocchio.Inertia(m, c, about_cm)
    frame = model.frames[flange]
    model.appendBodyToJoint(frame.parentJoint, inertia, frame.placement)
    q, v, vdot = rng.standard_normal((3, 5, robot.num_joints))
    added = robot.compute_payload_regressors(q, v, vdot) @ PAYLOAD
    for k in range(len(q)):
        states = q[k], v[k], vdot[k]
        with_load = pinocchio.rnea(model, model.createData(), *states)
        assert_allclose(added[k], with_load - pinocchio.rnea(bare, bare.createData(), *states), atol=1e-10)


def test_gravity_of_the_base_turns_with_the_mounting(robot, rng):
    q, v, vdot = rng.standard_normal((3, 1, robot.num_joints))
    upright = robot.compute_arm_torques(q, 0.0 * v, 0.0 * vdot)
    hanging = robot.with_gravity((0.0, 0.0, 9.81)).compute_arm_torques(q, 0.0 * v, 0.0 * vdot)
    assert_allclose(hanging, -upright, atol=1e-12)


def test_wrench_of_a_still_payload_is_its_weight(robot):
    zero = np.zeros((1, robot.num_joints))
    wrench = robot.compute_wrench_regressors(zero, zero, zero)[0] @ PAYLOAD
    # The flange stands upright at zero: the sensor carries the weight, upwards.
    assert_allclose(wrench[3:], [0.0, 0.0, 9.81 * PAYLOAD[0]], atol=1e-12)
    assert_allclose(wrench[:3], np.cross(PAYLOAD[1:4], [0.0, 0.0, 9.81]), atol=1e-12)


def test_plant_of_the_chain_agrees_with_the_chain(robot, rng):
    model = ArmModel(build_arm(robot))
    x, vdot = rng.standard_normal(12), rng.standard_normal(6)
    Y = compute_payload_regressor(model, x, vdot)
    q, v = x[None, :6], x[None, 6:]
    assert_allclose(Y, robot.compute_payload_regressors(q, v, vdot[None])[0], atol=1e-10)
    assert_allclose(model.compute_inverse_dynamics(vdot), robot.compute_arm_torques(q, v, vdot[None])[0], atol=1e-10)


def test_a_link_without_mass_is_planted(robot, rng):
    light = robot.link_parameters * (np.arange(6) != 3)[:, None]
    x, vdot = rng.standard_normal(12), rng.standard_normal(6)
    model = ArmModel(build_arm(robot, light))
    model.set_state(x)
    expected = replace(robot, link_parameters=light).compute_arm_torques(x[None, :6], x[None, 6:], vdot[None])[0]
    assert_allclose(model.compute_inverse_dynamics(vdot), expected, atol=1e-10)


def test_an_arm_prints_its_joints(robot):
    assert repr(robot).endswith("to flange: joint_1, joint_2, joint_3, joint_4, joint_5, joint_6)")


def test_an_arm_is_recognised_wherever_its_stand_is_even_if_names_are_those_of_its_own_parts():
    def mount(stand=""):
        plant, inertia = MultibodyPlant(0.0), SpatialInertia.SolidSphereWithMass(1.0, 0.1)
        mount, own = plant.world_body(), plant.AddModelInstance("arm")
        if stand:
            mount = plant.AddRigidBody(stand, plant.AddModelInstance("stand"), inertia)
            X_WB = RigidTransform(RotationMatrix.MakeXRotation(0.3), [0.1, 0.2, 1.0])
            plant.AddJoint(WeldJoint("turn", plant.world_frame(), mount.body_frame(), X_WB))
        base, first, second = (plant.AddRigidBody(name, own, inertia) for name in ("base", "first", "second"))
        plant.WeldFrames(mount.body_frame(), base.body_frame(), RigidTransform())
        plant.AddJoint(RevoluteJoint("turn", base.body_frame(), first.body_frame(), [0, 0, 1]))
        plant.AddJoint(RevoluteJoint("bend", first.body_frame(), second.body_frame(), [0, 1, 0]))
        plant.Finalize()
        return Arm(Path("two.sdf"), plant, second.body_frame(), second, np.zeros(2), None)

    bare = build_chain(mount()).fingerprint
    assert [recognise_arm(mount(stand)) for stand in ("", "plate", "base", "first")] == [bare] * 4


def join_two_bodies(connect):
    """A plant of two bodies whose joints ``connect`` adds, with a tool on the second."""
    plant = MultibodyPlant(0.0)
    inertia = SpatialInertia.SolidSphereWithMass(1.0, 0.1)
    first, second = plant.AddRigidBody("first", inertia), plant.AddRigidBody("second", inertia)
    connect(plant, first, second)
    plant.Finalize()
    return Arm(Path("two.sdf"), plant, second.body_frame(), second, np.zeros(plant.num_positions()), None)


def test_sliding_joint_is_refused():
    def connect(plant, first, second):
        plant.AddJoint(RevoluteJoint("turn", plant.world_frame(), first.body_frame(), [0, 0, 1]))
        plant.AddJoint(PrismaticJoint("slide", first.body_frame(), second.body_frame(), [1, 0, 0]))

    with pytest.raises(ModelFileError, match=r"two.sdf: has joint slide, which is not revolute"):
        build_chain(join_two_bodies(connect))


def test_branching_joints_are_refused():
    def connect(plant, first, second):
        plant.AddJoint(RevoluteJoint("left", plant.world_frame(), first.body_frame(), [0, 0, 1]))
        plant.WeldFrames(plant.world_frame(), second.body_frame(), second.body_frame().GetFixedPoseInBodyFrame())
        third = plant.AddRigidBody("third", SpatialInertia.SolidSphereWithMass(1.0, 0.1))
        plant.AddJoint(RevoluteJoint("right", second.body_frame(), third.body_frame(), [0, 1, 0]))

    with pytest.raises(ModelFileError, match=r"two.sdf: has joints that are not in series"):
        build_chain(join_two_bodies(connect))
