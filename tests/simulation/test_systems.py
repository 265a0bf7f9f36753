"""Each system alone, with fixed ports."""

import dataclasses

import numpy as np
import pinocchio
import pytest
from helpers.peer_arms import build_pinocchio, read_grip
from helpers.seen_objects import BLUE, ONE_MATERIAL, RED, TWO_MATERIALS, detect_parts
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator
from scipy.stats import kstest, truncnorm

from affordance.belief.density_belief import PointEstimate
from affordance.belief.material_memory import MaterialMemory
from affordance.control.constrained_qp import AccelerationProgram
from affordance.control.mpc import MinimumAccelerationMpc
from affordance.control.problem import TerminalGoal
from affordance.control.systems import MpcController
from affordance.control.task import Hold
from affordance.proprioception.systems import DensityEstimator, Proprioception
from affordance.proprioception.torque_noise import WeberNoise, WhiteNoise, draw_acceleration_error
from affordance.settings import DEFAULT_SETTINGS
from affordance.vision.systems import MaterialMemorySystem

PRIOR, NOISE = DEFAULT_SETTINGS.prior, DEFAULT_SETTINGS.noise
NOTHING, NOWHERE = np.zeros(7), np.zeros(14)


def fix(system, context, **values):
    for name, value in values.items():
        port = system.GetInputPort(name)
        port.FixValue(context, value if isinstance(value, np.ndarray) else AbstractValue.Make(value))


def evaluate(system, context, port):
    return system.GetOutputPort(port).Eval(context)


def end(system, context):
    """Carries out the event at the end of a presentation."""
    system.ExecuteForcedEvents(context)


@pytest.fixture
def memory_system():
    """A memory with the posterior of a presentation at its ports."""
    system = MaterialMemorySystem(MaterialMemory(), least_p_value=1e-3)
    context = system.CreateDefaultContext()
    fix(system, context, posterior=detect_parts(TWO_MATERIALS, PRIOR), p_value=np.array([1e-3]))
    return system, context


def test_memory_learns_when_the_presentation_ends_and_not_before(memory_system):
    system, context = memory_system
    simulator = Simulator(system, context)
    simulator.AdvanceTo(5.0)
    assert evaluate(system, context, "materials").colours == ()
    end(system, context)
    assert evaluate(system, context, "materials").colours == (RED, BLUE)
    assert system.get_memory(context).belief.size == 2
    assert system.CreateDefaultContext().get_abstract_state(0).get_value().colours == ()


def test_memory_learns_nothing_from_what_is_too_improbable(memory_system):
    system, context = memory_system
    fix(system, context, p_value=np.array([0.99e-3]))
    end(system, context)
    assert system.get_memory(context).colours == ()


def test_memory_keeps_the_colours_that_are_to_be_remembered(memory_system):
    system, context = memory_system
    system.remembered.set(context, (BLUE,))
    end(system, context)
    memory = system.get_memory(context)
    assert memory.colours == (BLUE,)
    assert memory.belief.untruncated_mean[0] == pytest.approx(PRIOR.mode)


def feel(noise, tau=NOTHING, x=NOWHERE, vdot=NOTHING, **settings):
    """Joints that feel torques, angles, rates and accelerations, a sample every 50 ms."""
    system = Proprioception(7, noise, 0.05, **settings)
    context = system.CreateDefaultContext()
    fix(system, context, tau=tau, state=x, vdot=vdot)
    return system, context


def test_proprioception_errs_by_gain_and_offset_that_last_the_trial():
    tau, x, vdot = np.arange(7.0), np.arange(14.0), -np.arange(7.0)
    system, context = feel(WeberNoise(weber_fraction=0.07, threshold=0.1), tau, x, vdot)
    for name, value in (("tau", tau), ("state", x), ("vdot", vdot)):
        np.testing.assert_array_equal(evaluate(system, context, f"measured_{name}"), value)
    system.draw_errors(context, (1, 2))
    felt = evaluate(system, context, "measured_tau").copy()
    for name, value in (("state", x), ("vdot", vdot)):
        np.testing.assert_array_equal(evaluate(system, context, f"measured_{name}"), value)
    assert (felt != tau).all()
    context.SetTime(1.0)
    np.testing.assert_array_equal(evaluate(system, context, "measured_tau"), felt)
    system.draw_errors(context, (1, 3))
    assert (evaluate(system, context, "measured_tau") != felt).all()


def test_gain_error_multiplies_the_torque_and_offset_adds(rng):
    noise = WeberNoise(weber_fraction=0.07, threshold=0.1)
    system, context = feel(noise)
    system.draw_errors(context, (3,))

    def measure(tau):
        fix(system, context, tau=tau)
        return evaluate(system, context, "measured_tau").copy()

    gain, offset = noise.draw_trial_errors((3,), 7)
    np.testing.assert_array_equal(measure(np.zeros(7)), offset)
    for scale in (1.0, -2.0, 30.0):
        tau = scale * rng.normal(size=7)
        np.testing.assert_allclose(measure(tau) - offset, tau + gain * tau, rtol=0, atol=1e-13)


@pytest.mark.parametrize("noise", [WhiteNoise(sd=0.1), WeberNoise(0.07, 0.1, independent_samples=True)])
def test_error_of_a_sample_depends_on_trial_and_sample_and_not_on_how_often_it_is_asked_for(noise):
    tau = np.linspace(-30.0, 30.0, 7)
    system, context = feel(noise, tau)
    for seed, sample in ((1, 1), (1, 3), (1, 1), (2, 1)):
        system.draw_errors(context, (seed,))
        context.SetTime(0.05 * sample)
        error = evaluate(system, context, "measured_tau") - tau
        np.testing.assert_allclose(error, noise.draw_sample_error((seed, sample), tau), rtol=0, atol=1e-13)


def test_misfelt_acceleration_lasts_the_trial_and_touches_nothing_else():
    tau, x, vdot = np.arange(7.0), np.arange(14.0), -np.arange(7.0)
    system, context = feel(WeberNoise(weber_fraction=0.0, threshold=0.0), tau, x, vdot, acceleration_sd=0.2)
    system.draw_errors(context, (1, 2))
    np.testing.assert_array_equal(evaluate(system, context, "measured_tau"), tau)
    np.testing.assert_array_equal(evaluate(system, context, "measured_state"), x)
    felt = evaluate(system, context, "measured_vdot").copy()
    np.testing.assert_array_equal(felt, vdot + draw_acceleration_error(0.2, (1, 2), 7))
    assert (felt != vdot).all()
    context.SetTime(1.0)
    np.testing.assert_array_equal(evaluate(system, context, "measured_vdot"), felt)


@pytest.fixture
def estimator(arm, hold):
    system = DensityEstimator(arm, noise=NOISE, deviation=PRIOR.deviation, sample_period=0.05)
    context = system.CreateDefaultContext()
    belief = detect_parts(ONE_MATERIAL, PRIOR)
    tau = hold.tau_arm + hold.Y @ belief.compute_parameters(np.array([7850.0]))
    fix(system, context, prior=belief, tau=tau, state=np.concatenate([arm.home, np.zeros(7)]), vdot=np.zeros(7))
    return system, context, belief


def update(system, context):
    discrete_state = system.EvalUniquePeriodicDiscreteUpdate(context)
    context.SetDiscreteState(discrete_state)


def test_estimator_believes_the_prior_before_it_feels_and_the_truth_afterwards(estimator):
    system, context, belief = estimator
    posterior = evaluate(system, context, "posterior")
    np.testing.assert_array_equal(posterior.densities.untruncated_mean, belief.densities.untruncated_mean)
    for _ in range(3):
        update(system, context)
    posterior = evaluate(system, context, "posterior")
    # Felt without error, and the broad prior weighs next to nothing.
    assert posterior.densities.untruncated_mean[0] == pytest.approx(7850.0, rel=0.03)
    assert system.get_inference(context).log_evidence != 0.0


def test_estimator_starts_anew_when_the_presentation_ends(estimator):
    system, context, belief = estimator
    simulator = Simulator(system, context)
    simulator.AdvanceTo(0.99)
    inference = system.get_inference(context)
    assert evaluate(system, context, "p_value")[0] == inference.p_value != 1.0
    assert inference.log_evidence != 0.0
    assert system.get_counts(context).accepted == 19
    end(system, context)
    assert system.get_counts(context).accepted == 19
    posterior = evaluate(system, context, "posterior")
    np.testing.assert_array_equal(posterior.densities.untruncated_mean, belief.densities.untruncated_mean)
    assert system.get_inference(context)[1:] == (0.0, 1.0)
    assert evaluate(system, context, "p_value")[0] == 1.0


def test_equal_samples_say_no_more_than_one_with_one_percept_a_trial(estimator):
    system, context, _ = estimator
    update(system, context)
    once = evaluate(system, context, "posterior").densities.precision.copy()
    for _ in range(10):
        update(system, context)
    np.testing.assert_allclose(evaluate(system, context, "posterior").densities.precision, once, rtol=1e-12)


@pytest.fixture
def controller(arm, at_home):
    def build(point_estimate=PointEstimate.MODE):
        system = MpcController(
            arm,
            settings=DEFAULT_SETTINGS.mpc,
            control_period=DEFAULT_SETTINGS.control_period,
            point_estimate=point_estimate,
            angle_margin=0.0,
        )
        context = system.CreateDefaultContext()
        hold = Hold(arm.home)
        fix(system, context, belief=detect_parts(ONE_MATERIAL, PRIOR), goal=hold)
        fix(system, context, state=at_home)
        return system, context

    return build


def test_controller_holds_the_weight_it_believes_in(controller, hold):
    system, context = controller()
    assert not evaluate(system, context, "tau").any()
    update(system, context)
    expected = hold.tau_arm + hold.Y @ detect_parts(ONE_MATERIAL, PRIOR).compute_parameters(np.array([PRIOR.mode]))
    np.testing.assert_allclose(evaluate(system, context, "tau"), expected, atol=1e-9)
    assert system.get_counts(context) == (0, 0)


def test_two_contexts_of_one_controller_do_not_disturb_each_other(controller, arm, at_home):
    system, context = controller()
    update(system, context)
    alone = evaluate(system, context, "tau").copy()
    other = system.CreateDefaultContext()
    memory = detect_parts(ONE_MATERIAL, dataclasses.replace(PRIOR, mode=9000.0)).memory
    fix(system, other, belief=detect_parts(ONE_MATERIAL, PRIOR, memory), goal=Hold(arm.home))
    fix(system, other, state=at_home)
    update(system, other)
    assert np.abs(evaluate(system, other, "tau") - alone).max() > 1.0
    update(system, context)
    np.testing.assert_array_equal(evaluate(system, context, "tau"), alone)


def test_sampled_density_is_drawn_once_a_trial_from_its_seed(controller):
    system, context = controller(PointEstimate.SAMPLE)
    torques = []
    for seed in ((1,), (2,), (1,)):
        system.seed.set(context, seed)
        update(system, context)
        torques.append(evaluate(system, context, "tau").copy())
        update(system, context)
        np.testing.assert_array_equal(evaluate(system, context, "tau"), torques[-1])
    assert (torques[0] != torques[1]).any()
    np.testing.assert_array_equal(torques[0], torques[2])


def test_sampled_densities_are_distributed_as_believed(controller, hold):
    """Densities of the torques of 500 seeds pass Kolmogorov and Smirnov's test against the truncated prior."""
    system, context = controller(PointEstimate.SAMPLE)
    per_density = hold.Y @ detect_parts(ONE_MATERIAL, PRIOR).geometry.Phi[:, 0]
    drawn = []
    for seed in range(500):
        system.seed.set(context, (seed,))
        update(system, context)
        load = evaluate(system, context, "tau") - hold.tau_arm
        drawn.append(load @ per_density / (per_density @ per_density))
    sd = np.hypot(PRIOR.sd, PRIOR.deviation * np.hypot(PRIOR.mode, PRIOR.sd))
    believed = truncnorm(-PRIOR.mode / sd, np.inf, loc=PRIOR.mode, scale=sd)
    assert kstest(drawn, believed.cdf).pvalue > 1e-3


def test_limited_ticks_are_counted(controller, arm, at_home):
    system, context = controller()
    at_home[arm.joint_names.index("elbow_flexion")] = arm.limits.q_lower[3] - 0.05
    fix(system, context, state=at_home)
    update(system, context)
    assert system.get_counts(context) == (1, 0)


def compute_torques_with_pinocchio(density, x, vdot):
    """Torques of the arm holding ONE_MATERIAL, in a library that shares nothing with ours."""
    model = build_pinocchio()
    (part,) = ONE_MATERIAL
    mass = density * part.shape.volume
    payload = pinocchio.Inertia.FromEllipsoid(mass, *part.shape.semi_axes)
    place = pinocchio.SE3(np.eye(3), read_grip() + part.X_TE[:3, 3])
    model.appendBodyToJoint(model.njoints - 1, payload, place)
    q, v = np.split(x, 2)
    return pinocchio.rnea(model, model.createData(), q, v, vdot)


def test_failed_ticks_in_a_row_go_through_the_previous_plan_step_by_step_to_rest(
    controller, arm, rng, monkeypatch, at_home, caplog
):
    """Torques in mid-tick give the accelerations planned for the ticks' times, and zero after the plan's end."""
    system, context = controller()
    settings, control_period = DEFAULT_SETTINGS.mpc, DEFAULT_SETTINGS.control_period
    ticks_per_step = round(settings.horizon / settings.num_steps / control_period)
    mpc = MinimumAccelerationMpc(arm.limits, settings)
    home_at_rest = TerminalGoal(np.eye(7), arm.home, np.eye(7), np.zeros(7))
    time = 0.0

    def draw_state():
        return at_home + 0.02 * rng.normal(size=14)

    def compute_torque_of_middle(x, vdot):
        q, v = np.split(x, 2)
        half = 0.5 * control_period
        middle = np.concatenate([q + half * v + 0.5 * half**2 * vdot, v + half * vdot])
        return compute_torques_with_pinocchio(PRIOR.mode, middle, vdot)

    def advance(x):
        nonlocal time
        context.SetTime(time)
        fix(system, context, state=x)
        update(system, context)
        time += control_period
        return evaluate(system, context, "tau").copy()

    for num_failures in (6, 52):
        x = draw_state()
        plan = mpc.solve_free(x, home_at_rest)[: settings.num_steps]
        first = advance(x)
        np.testing.assert_allclose(first, compute_torque_of_middle(x, plan[0]), atol=1e-9)
        with monkeypatch.context() as broken:
            broken.setattr(AccelerationProgram, "solve", lambda *arguments, **named: None)
            broken.setattr(MinimumAccelerationMpc, "solve_free", lambda *arguments: np.full((36, 7), np.nan))
            for k in range(1, num_failures + 1):
                step = k // ticks_per_step
                vdot = plan[step] if step < settings.num_steps else np.zeros(7)
                x = draw_state()
                expected = compute_torque_of_middle(x, vdot)
                assert (np.abs(expected) < arm.limits.tau_max).all()
                np.testing.assert_allclose(advance(x), expected, atol=1e-9)
    assert system.get_counts(context) == (0, 6 + 52)
    assert "no new plan, because the solver failed" in caplog.text


def test_state_that_is_not_finite_keeps_the_last_torque(controller, at_home, caplog):
    system, context = controller()
    update(system, context)
    held = evaluate(system, context, "tau").copy()
    at_home[2] = np.nan
    fix(system, context, state=at_home)
    update(system, context)
    np.testing.assert_array_equal(evaluate(system, context, "tau"), held)
    assert system.get_counts(context) == (0, 1)
    assert "the state is not finite" in caplog.text


class Hurry(Hold):
    """A hold that plans ahead only half as far."""

    def choose_horizon(self, time, longest):
        return 0.5 * longest


def test_a_goal_in_half_the_time_takes_four_times_the_acceleration(controller, arm):
    """Acceleration from rest, -6 d / T^2 in continuous time, is four times as large for half the horizon, to 15 %."""
    system, context = controller()
    q = arm.home + 0.01 * np.ones(7)
    fix(system, context, state=np.concatenate([q, np.zeros(7)]))
    torques = []
    for task in (Hold(q), Hold(arm.home), Hurry(arm.home)):
        fix(system, context, goal=task)
        update(system, context)
        torques.append(evaluate(system, context, "tau").copy())
    at_rest, calm, hurried = torques
    np.testing.assert_allclose(hurried - at_rest, 4.0 * (calm - at_rest), rtol=0.15, atol=0.02)
