"""The simulated arm against independent mathematics: other libraries, and the conservation of energy."""

import numpy as np
import pinocchio
from helpers.peer_arms import build_pinocchio, build_toolbox_arm
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator
from pydrake.systems.framework import DiagramBuilder

from affordance.plant.load import add_arm
from affordance.settings import DEFAULT_SETTINGS, Integrator


def test_dynamics_agree_with_pinocchio(model, rng):
    other = build_pinocchio()
    data = other.createData()
    for _ in range(100):
        q, v, vdot = rng.normal(size=(3, 7))
        model.set_state(np.concatenate([q, v]))
        tau = model.compute_inverse_dynamics(vdot)
        np.testing.assert_allclose(tau, pinocchio.rnea(other, data, q, v, vdot), rtol=0, atol=1e-12)
        upper = np.triu(pinocchio.crba(other, data, q))
        M = upper + np.triu(upper, 1).T
        np.testing.assert_allclose(model.compute_mass_matrix(), M, rtol=0, atol=1e-13)


def test_inverse_dynamics_agree_with_the_robotics_toolbox(model, rng):
    other, signs = build_toolbox_arm()
    for _ in range(20):
        q, v, vdot = rng.normal(size=(3, 7))
        model.set_state(np.concatenate([q, v]))
        tau = signs * other.rne(signs * q, signs * v, signs * vdot)
        np.testing.assert_allclose(model.compute_inverse_dynamics(vdot), tau, rtol=0, atol=1e-12)


def swing_freely(weight, integrator=DEFAULT_SETTINGS.integrator):
    """Lets arm and tool fall for 0.4 s from home, unactuated; returns the relative drift of their energy."""
    builder = DiagramBuilder()
    arm = add_arm(builder, weight.settings.arm, weight.tools[3])
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = arm.plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    arm.plant.get_actuation_input_port().FixValue(context, np.zeros(arm.num_joints))
    ApplySimulatorConfig(integrator.free, simulator)
    start = arm.plant.CalcPotentialEnergy(context) + arm.plant.CalcKineticEnergy(context)
    simulator.AdvanceTo(0.4)
    kinetic = arm.plant.CalcKineticEnergy(context)
    drift = arm.plant.CalcPotentialEnergy(context) + kinetic - start
    assert kinetic > 5.0
    return abs(drift) / kinetic


def test_energy_of_the_passive_arm_is_conserved_at_the_chosen_accuracy(weight):
    assert swing_freely(weight) < 1e-5


def test_energy_is_conserved_better_as_accuracy_tightens(weight):
    drifts = [swing_freely(weight, Integrator(accuracy=accuracy)) for accuracy in (1e-2, 1e-4, 1e-6)]
    assert drifts[1] < drifts[0] / 20
    assert drifts[2] < drifts[1] / 20


def test_forward_dynamics_invert_inverse_dynamics(arm, model, rng):
    x = rng.normal(size=14)
    vdot = rng.normal(size=7)
    model.set_state(x)
    tau = model.compute_inverse_dynamics(vdot)
    context = arm.plant.CreateDefaultContext()
    arm.plant.SetPositionsAndVelocities(context, x)
    assert (np.abs(tau) <= arm.limits.tau_max).all()
    arm.plant.get_actuation_input_port().FixValue(context, tau)
    derivatives = arm.plant.EvalTimeDerivatives(context).CopyToVector()
    np.testing.assert_allclose(derivatives[7:], vdot, rtol=0, atol=1e-9)
