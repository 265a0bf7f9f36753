"""The closed loop: whole trials in the Diagram that is really run."""

import dataclasses
import gc
import weakref

import numpy as np
import psutil
import pytest

from affordance.belief import DensityBelief
from affordance.diagram import build_trial_diagram
from affordance.memory import MaterialMemory
from affordance.noise import WhiteNoise
from affordance.trial import TrialRunner


def certain_of(config, density):
    return MaterialMemory((config.colour,), DensityBelief(np.array([[1e-2]]), np.array([1e-2 * density])))


def test_arm_that_knows_the_density_does_not_move(runner, weight_config):
    for tool in weight_config.tools[:-1]:
        record = runner.run_hold(tool, certain_of(weight_config, 8500.0), duration=3.0, seed=(0,))
        points = np.stack([record.height_centre, record.height_grip, record.height_com])
        assert np.abs(points).max() < 1e-6
        assert np.abs(record.q - record.q[0]).max() < 1e-6


def test_arm_sinks_if_it_believes_too_little_and_rises_if_too_much(runner, weight_config):
    tool = weight_config.tools[2]
    light, heavy = (
        runner.run_hold(tool, certain_of(weight_config, density), duration=1.0, seed=(0,))
        for density in (6000, 11000)
    )
    assert light.height_centre[-1] < -0.005
    assert heavy.height_centre[-1] > 0.005


@pytest.mark.parametrize("ratio", [2.0, 4.0, 8.0, 16.0])
def test_loop_is_stable_for_a_tool_lighter_than_believed_by(runner, weight_config, ratio):
    """The longest object, its inertia divided by the ratio, comes to rest and stays within its limits."""
    honest = weight_config.tools[3]
    (part,) = honest.components
    lighter = dataclasses.replace(part.material, density=part.material.density / ratio)
    tool = dataclasses.replace(
        honest, components=(dataclasses.replace(part, material=lighter, looks_like=part.material),)
    )
    record = runner.run_hold(tool, certain_of(weight_config, 8500.0), duration=3.0, seed=(0,))
    arm = runner.get_diagram(tool).arm
    assert np.abs(record.v[-50:]).max() < 0.02
    assert np.abs(record.q[-1] - record.q[-50]).max() < 1e-3
    assert (record.q >= arm.limits.q_lower).all()
    assert (record.q <= arm.limits.q_upper).all()
    assert (np.abs(record.tau) <= arm.limits.tau_max).all()
    assert record.counts.failed == 0


def test_logged_motion_is_consistent(runner, weight_config):
    record = runner.run_hold(weight_config.tools[0], MaterialMemory(), duration=1.0, seed=(0,))
    np.testing.assert_allclose(record.times, np.arange(101) * 0.01, atol=1e-12)
    assert record.height_centre[0] == record.height_grip[0] == record.height_com[0] == 0.0
    # Rates are the derivatives of angles, by central differences of second order.
    slopes = (record.q[2:] - record.q[:-2]) / 0.02
    np.testing.assert_allclose(slopes, record.v[1:-1], atol=0.02 * np.abs(record.v).max())


def test_trial_teaches_what_was_held(runner, weight_config):
    memory = MaterialMemory()
    record = runner.run_hold(weight_config.tools[3], memory, duration=1.0, seed=(3,))
    assert memory.looks == ()
    assert record.memory.looks == (weight_config.colour,)
    sd = np.sqrt(record.memory.belief.covariance[0, 0])
    assert abs(record.memory.belief.centre[0] - 8500.0) < 4 * sd
    assert sd < 2000.0


def test_what_was_felt_without_error_gives_the_density_exactly(weight_config):
    """Torques, rates and accelerations of the moving arm explain themselves by the true density."""
    settings = dataclasses.replace(weight_config.settings, noise=WhiteNoise(sd=1e-6))
    record = TrialRunner(settings).run_hold(weight_config.tools[0], MaterialMemory(), duration=1.0, seed=(0,))
    assert np.abs(record.height_centre).max() > 0.05
    # The object's own deviation from its material is all that remains uncertain.
    assert record.memory.belief.centre[0] == pytest.approx(8500.0, rel=1e-3)
    assert np.sqrt(record.memory.belief.covariance[0, 0]) == pytest.approx(100.0, rel=1e-3)


def test_controller_that_uses_the_posterior_corrects_itself_within_the_trial(weight_config):
    tool = weight_config.tools[3]
    believing = TrialRunner(weight_config.settings).run_hold(tool, MaterialMemory(), duration=3.0, seed=(1,))
    settings = dataclasses.replace(weight_config.settings, uses_posterior=True)
    learning = TrialRunner(settings).run_hold(tool, MaterialMemory(), duration=3.0, seed=(1,))
    assert believing.height_centre[-1] < -0.05
    assert abs(learning.height_centre[-1]) < 0.2 * abs(believing.height_centre[-1])


def test_same_seed_gives_the_same_trial_whatever_ran_before(runner, weight_config):
    tool, memory = weight_config.tools[1], MaterialMemory()
    first = runner.run_hold(tool, memory, duration=0.5, seed=(5, 6))
    runner.run_hold(weight_config.tools[0], memory, duration=0.2, seed=(1,))
    runner.run_hold(tool, certain_of(weight_config, 9000.0), duration=0.2, seed=(1,))
    again = runner.run_hold(tool, memory, duration=0.5, seed=(5, 6))
    fresh = TrialRunner(weight_config.settings).run_hold(tool, memory, duration=0.5, seed=(5, 6))
    for other in (again, fresh):
        np.testing.assert_array_equal(first.q, other.q)
        np.testing.assert_array_equal(first.tau, other.tau)
        np.testing.assert_array_equal(first.memory.belief.shift, other.memory.belief.shift)
    different = runner.run_hold(tool, memory, duration=0.5, seed=(5, 7))
    assert (different.memory.belief.shift != first.memory.belief.shift).all()


def test_tools_of_one_appearance_share_a_diagram(runner, weight_config):
    *_, last, decoy = weight_config.tools
    assert runner.get_diagram(last) is runner.get_diagram(decoy)
    assert runner.get_diagram(last) is not runner.get_diagram(weight_config.tools[0])


def test_memory_stays_flat_over_a_thousand_trials(runner, weight_config):
    process = psutil.Process()
    sizes = []
    for block in range(5):
        for number in range(200):
            tool = weight_config.tools[number % len(weight_config.tools)]
            runner.run_hold(tool, MaterialMemory(), duration=0.02, seed=(block, number))
        gc.collect()
        sizes.append(process.memory_info().rss)
    # The first block fills caches; a leak of 10 kB a trial would show as 8 MB.
    assert sizes[-1] - sizes[0] < 4e6


def test_diagrams_are_freed(weight_config):
    freed = weakref.WeakSet()
    for _ in range(5):
        trial = build_trial_diagram(weight_config.tools[0], weight_config.settings)
        freed.add(trial.diagram)
        del trial
    gc.collect()
    assert len(freed) == 0


def test_accuracy_chosen_is_that_of_a_far_tighter_reference(weight_config):
    """A small version of benchmarks/convergence.py: below a hundredth of a millimetre in the first, largest drop."""
    tool = weight_config.tools[0]
    tight = dataclasses.replace(weight_config.settings, integration_scheme="runge_kutta5", accuracy=1e-10)
    heights = [
        TrialRunner(settings).run_hold(tool, MaterialMemory(), duration=1.0, seed=(0,)).height_centre
        for settings in (weight_config.settings, tight)
    ]
    assert np.abs(heights[1]).max() > 0.1
    assert np.abs(heights[0] - heights[1]).max() < 1e-5


def test_steps_taken_stay_within_budget(runner, weight_config):
    """One step of the integrator a tick, but for a few: no stall."""
    from pydrake.systems.analysis import Simulator

    import affordance.trial

    taken = []

    class CountingSimulator(Simulator):
        def AdvanceTo(self, time):
            super().AdvanceTo(time)
            taken.append(self.get_num_steps_taken())

    original = affordance.trial.Simulator
    affordance.trial.Simulator = CountingSimulator
    try:
        runner.run_hold(weight_config.tools[0], MaterialMemory(), duration=1.0, seed=(0,))
    finally:
        affordance.trial.Simulator = original
    assert 200 <= taken[0] <= 400
