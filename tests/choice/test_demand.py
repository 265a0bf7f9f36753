"""Demands on the grip against the reaction of Drake's weld, and of motions and blows against each other."""

import numpy as np
from helpers.two_tools import STICK
from pydrake.multibody.tree import WeldJoint

from affordance.choice.demand import Criterion, compute_grip_peaks
from affordance.choice.hammer import load_hammer
from affordance.choice.motion_cost import MotionCost, PlannedMotion
from affordance.files.model_folder import MODELS
from affordance.plant.arm_model import ArmModel
from affordance.plant.chain_plant import build_chain
from affordance.settings import Settings


def find_weld_reaction(arm, q, v, vdot, pi):
    """Computes moment about the grip and force on the tool by Drake's weld joint, in a forward simulation's state."""
    plant, context = arm.plant, arm.plant.CreateDefaultContext()
    arm.set_payload(context, pi)
    plant.SetPositionsAndVelocities(context, np.concatenate([q, v]))
    model = ArmModel(arm)
    model.set_payload(pi)
    model.set_state(np.concatenate([q, v]))
    plant.get_actuation_input_port().FixValue(context, model.compute_inverse_dynamics(vdot))
    joints = [plant.get_joint(index) for index in plant.GetJointIndices()]
    (weld,) = [each for each in joints if isinstance(each, WeldJoint) and each.child_body() is arm.tool]
    reaction = plant.get_reaction_forces_output_port().Eval(context)[int(weld.index())]
    return reaction.rotational(), reaction.translational()


def test_wrench_at_the_grip_is_the_reaction_of_drakes_weld(arm, rng):
    """Peaks agree to 1e-9 with the weld's reaction on the tool, in the frame of the grip."""
    pi = STICK.gripped_by(STICK.grips[0]).parameters
    nodes = 6
    q = arm.home + 0.2 * rng.standard_normal((nodes, arm.num_joints))
    v, vdot = 2.0 * rng.standard_normal((2, nodes, arm.num_joints))
    reactions = [find_weld_reaction(arm, *row, pi) for row in zip(q, v, vdot, strict=True)]
    regressors = build_chain(arm).compute_wrench_regressors(q, v, vdot)
    force, moment = compute_grip_peaks(regressors, np.stack([pi, 2.0 * pi]))
    right_force = max(np.linalg.norm(each[1]) for each in reactions)
    right_moment = max(np.linalg.norm(each[0]) for each in reactions)
    np.testing.assert_allclose(force, [right_force, 2.0 * right_force], rtol=1e-9)
    np.testing.assert_allclose(moment, [right_moment, 2.0 * right_moment], rtol=1e-9)


def test_chunks_do_not_matter(arm, rng):
    q = arm.home + 0.1 * rng.standard_normal((4, arm.num_joints))
    motion = PlannedMotion(0.005, q, rng.standard_normal(q.shape), rng.standard_normal(q.shape))
    pi = STICK.gripped_by(STICK.grips[0]).parameters * rng.uniform(0.5, 2.0, (2003, 1))
    cost = MotionCost(ArmModel(arm), motion)
    whole, last = cost.compute_demand(pi), cost.compute_demand(pi[-3:])
    for one, other in zip(whole, last, strict=True):
        np.testing.assert_allclose(one[..., -3:], other, rtol=1e-12)
    np.testing.assert_allclose(whole.loads.max(axis=0), cost.compute_load(pi).load, rtol=1e-12)


def test_peaks_are_compared_by_their_quantile():
    assert [each.is_peak for each in Criterion] == [False, False, True, True]
    assert [each.unit for each in Criterion] == ["J", "N^2 m^2 s", "1", "N"]


def test_blow_demands_what_its_swing_does(arm):
    tool = STICK.gripped_by(STICK.grips[0])
    cost = load_hammer(MODELS / "nail.yaml").build_cost(ArmModel(arm), tool.components, Settings())
    pi = tool.parameters[None]
    near = int(np.searchsorted(cost.speeds, cost.compute_speed(pi)[0]))
    demand, low, high = (each.compute_demand(pi) for each in (cost, cost.motions[near - 1], cost.motions[near]))
    for found, below, above in zip(demand, low, high, strict=True):
        assert (np.minimum(below, above) <= found * (1.0 + 1e-9)).all()
        assert (found <= np.maximum(below, above) * (1.0 + 1e-9)).all()
