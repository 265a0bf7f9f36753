import dataclasses
import time

import numpy as np
import pytest

from affordance.belief.kind_memory import start_memory
from affordance.belief.learner import Learner
from affordance.experiments.lifts import cylinder
from affordance.files.model_folder import MODELS
from affordance.objects.load import load_tools
from affordance.objects.materials import load_materials
from affordance.proprioception.estimator import TorqueStatistics, compute_posterior
from affordance.proprioception.torque_noise import WhiteNoise
from affordance.settings import DEFAULT_SETTINGS
from affordance.simulation.static_lifts import Lift, StaticLifter
from affordance.vision.eye import measure_features
from affordance.vision.features import VisionError
from affordance.vision.systems import predict_object


@pytest.fixture(scope="module")
def tools():
    """Two objects of two materials, a decoy that looks like the first, and a rod of one."""
    materials = load_materials(MODELS / "materials.yaml")
    return (
        *load_tools(MODELS / "tools" / "com.yaml", materials),
        load_tools(MODELS / "tools" / "weight.yaml", materials)[1],
    )


@pytest.mark.parametrize("learner", list(Learner))
def test_lifts_are_those_of_the_estimator_with_objects_held_at_rest(tools, learner, hold):
    """Forces agree to 1e-9 with the visual prior's, and memories to 1e-6 with the estimator's of the Diagram."""
    settings, seed = DEFAULT_SETTINGS, (3, 7)
    order = [0, 3, 1, 0, 2, 2, 1, 3, 0]
    record = StaticLifter(tools, settings).run([Lift(tool) for tool in order], start_memory(learner, (5,), 0.3), seed)
    memory = start_memory(learner, (5,), 0.3)
    for number, (index, force, remembered) in enumerate(
        zip(order, record.force, record.memories[1:], strict=True), start=1
    ):
        tool = tools[index]
        belief = predict_object(
            measure_features(tool, VisionError(), np.random.default_rng(0)), memory, settings.prior
        )
        assert force == pytest.approx(9.81 * belief.compute_parameters(belief.densities.compute_mode())[0], rel=1e-9)
        gain, offset = settings.noise.draw_trial_errors((*seed, number), 7)
        tau = (hold.tau_arm + hold.Y @ tool.parameters) * (1.0 + gain) + offset
        statistics = TorqueStatistics(settings.noise.compute_features(tau, hold.tau_arm, hold.Y), 1)
        memory = compute_posterior(belief, statistics, 7, settings.noise, 100.0).posterior.memory
        np.testing.assert_allclose(remembered.belief.untruncated_mean, memory.belief.untruncated_mean, rtol=1e-8)
        np.testing.assert_allclose(remembered.belief.covariance, memory.belief.covariance, rtol=1e-6, atol=1e-3)
    np.testing.assert_allclose(record.weight, [9.81 * tools[index].mass for index in order])


def test_a_lift_that_does_not_teach_changes_nothing(tools):
    lifter = StaticLifter(tools, DEFAULT_SETTINGS)
    memory = start_memory(Learner.KINDS_MAP, (0,))
    record = lifter.run([Lift(0), Lift(1, teaches=False), Lift(1)], memory, (0,))
    assert record.memories[0] is memory
    assert record.memories[2] is record.memories[1]
    assert record.force[2] == record.force[1]


def test_closed_form_wants_exact_features_and_the_noise_it_is_of(tools):
    with pytest.raises(ValueError, match="noise: is WhiteNoise, must be WeberNoise"):
        StaticLifter(tools, dataclasses.replace(DEFAULT_SETTINGS, noise=WhiteNoise(0.1)))
    with pytest.raises(ValueError, match=r"vision_error: is VisionError\(size=0.01.*must be zero"):
        StaticLifter(tools, dataclasses.replace(DEFAULT_SETTINGS, vision_error=VisionError(size=0.01)))


def test_time_of_a_lift_does_not_grow_with_how_many_there_were(tools):
    """Later hundreds of lifts take less than twice the time of the second, as kinds and objects are as many."""
    lifter = StaticLifter(tools, DEFAULT_SETTINGS)
    memory, times = start_memory(Learner.KINDS_MAP, (0,)), []
    for hundred in range(6):
        start = time.process_time()
        memory = lifter.run([Lift(3)] * 100, memory, (hundred,)).memories[-1]
        times.append(time.process_time() - start)
    assert min(times[3:]) < 2.0 * max(times[1:3])


def build_cylinder(name, density, height, volume):
    radius = (volume / (np.pi * height)) ** 0.5
    return cylinder(name, radius=radius, height=height, mass=density * volume)


@pytest.mark.parametrize(
    ("family", "odd", "volume"),
    [(30.0, 700.0, 1.1e-3), (700.0, 30.0, 1.6e-3), (8500.0, 720.0, 2e-4), (720.0, 8500.0, 2e-4)],
)
def test_large_surprise_is_lifted_right_the_second_time(family, odd, volume):
    """The median error of the first lift is more than 7 N, of the second less than 1.2 N, the error of feeling."""
    cylinders = [build_cylinder(f"family {k}", family, 0.05 + 0.01 * k, volume) for k in range(4)]
    lifter = StaticLifter([*cylinders, build_cylinder("odd", odd, 0.1, volume)], DEFAULT_SETTINGS)
    lifts = [Lift(k) for k in range(4)] * 5 + [Lift(4)] * 2
    records = [lifter.run(lifts, start_memory(Learner.KINDS_MAP, (seed,)), (seed, 2)) for seed in range(8)]
    errors = np.median([np.abs(record.force - record.weight)[-2:] for record in records], axis=0)
    assert errors[0] > 7.0
    assert errors[1] < 1.2
