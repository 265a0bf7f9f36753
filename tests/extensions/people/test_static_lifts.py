import dataclasses
import time

import numpy as np
import pytest

from affordance.belief.density_belief import PointEstimate
from affordance.belief.learners import DENSITY, KINDS_DRAWN, KINDS_MAP, LEARNERS
from affordance.belief.material_memory import start_memory
from affordance.extensions.people.experiments.lifts import cylinder
from affordance.extensions.people.static_lifts import NOTHING, StaticLifter
from affordance.files.model_folder import MODELS
from affordance.objects.appearance import is_same_object
from affordance.objects.load import load_tools
from affordance.objects.materials import load_materials
from affordance.proprioception.estimator import TorqueStatistics, compute_posterior
from affordance.proprioception.torque_noise import WhiteNoise
from affordance.settings import DEFAULT_SETTINGS
from affordance.vision.eye import measure_features
from affordance.vision.features import VisionError
from affordance.vision.prediction import predict_object


@pytest.fixture(scope="module")
def tools():
    """Two objects of two materials, a decoy that looks like the first, and a rod of one."""
    materials = load_materials(MODELS / "materials.yaml")
    return (
        *load_tools(MODELS / "tools" / "com.yaml", materials),
        load_tools(MODELS / "tools" / "weight.yaml", materials)[1],
    )


def lift(tools, learner, objects, seeds, settings=DEFAULT_SETTINGS, teaches=None):
    """Record of observers, each with a seed, who lift objects, (N, B)."""
    lifter = StaticLifter(tools, dataclasses.replace(settings, learner=learner))
    objects = np.array(objects)
    return lifter.run(objects, lifter.start(seeds), lifter.draw_errors(seeds, len(objects)), seeds, teaches)


def believe(learner, record, row=0):
    """Mean and covariance that an observer believes of the colours at the end."""
    state = {name: array[[row]] for name, array in record.after.state.items()}
    believed = learner.believe(state)
    return believed.mean[0], believed.covariance[0]


@pytest.mark.parametrize("learner", [DENSITY, KINDS_MAP.change(kappa=0.3), KINDS_DRAWN.change(kappa=0.3)])
def test_lifts_are_those_of_the_estimator_with_objects_held_at_rest(tools, learner, hold):
    """Forces agree to 1e-9 with the visual prior's, and beliefs to 1e-6 with the estimator's of the Diagram."""
    settings, seed = DEFAULT_SETTINGS, (3, 7)
    order = [0, 3, 1, 0, 2, 2, 1, 3, 0]
    record = lift(tools, learner, np.array(order)[:, None], [seed])
    memory = start_memory(learner, seed)
    for number, index in enumerate(order):
        tool = tools[index]
        features = measure_features(tool, VisionError(), np.random.default_rng(0))
        belief = predict_object(features, memory, settings.prior)
        mass = belief.compute_parameters(belief.densities.compute_mode())[0]
        assert record.expected[number, 0] == pytest.approx(mass, rel=1e-9)
        assert record.force[number, 0] == pytest.approx(9.81 * mass, rel=1e-9)
        colour = next(part.colour for part in features)
        met, place = memory.recognise(colour, 0.0, settings.prior)
        assert record.believed_density[number, 0] == pytest.approx(met.belief.compute_mode()[place], rel=1e-9)
        gain, offset = settings.noise.draw_trial_errors((*seed, number + 1), 7)
        tau = (hold.tau_arm + hold.Y @ tool.parameters) * (1.0 + gain) + offset
        statistics = TorqueStatistics(settings.noise.compute_features(tau, hold.tau_arm, hold.Y), 1)
        posterior = compute_posterior(belief, statistics, 7, settings.noise, settings.prior.deviation)
        memory = posterior.posterior.memory
        assert record.kind[number, 0] == memory.find_kind([part.appearance for part in features])
        assert record.p_value[number, 0] == pytest.approx(posterior.p_value, rel=1e-6)
    mean, covariance = believe(learner, record)
    np.testing.assert_allclose(mean, memory.belief.untruncated_mean, rtol=1e-8)
    np.testing.assert_allclose(covariance, memory.belief.covariance, rtol=1e-6, atol=1e-3)
    np.testing.assert_allclose(record.weight[:, 0], [9.81 * tools[index].mass for index in order])


@pytest.mark.parametrize("learner", LEARNERS.values(), ids=LEARNERS)
@pytest.mark.parametrize("point_estimate", [PointEstimate.MODE, PointEstimate.SAMPLE])
def test_an_observer_depends_on_no_other(tools, learner, point_estimate):
    """Seven observers of orders of their own, who rest and look on at times, are those who lift alone."""
    rng = np.random.default_rng(1)
    settings = dataclasses.replace(DEFAULT_SETTINGS, point_estimate=point_estimate)
    objects = rng.integers(-1, len(tools), (30, 7))
    assert (objects == NOTHING).any()
    teaches, seeds = rng.random(objects.shape) < 0.8, [(5, row) for row in range(7)]
    together = lift(tools, learner, objects, seeds, settings, teaches)
    for row, seed in enumerate(seeds):
        alone = lift(tools, learner, objects[:, [row]], [seed], settings, teaches[:, [row]])
        for name in ("force", "weight", "expected", "believed_density", "p_value"):
            one, other = getattr(alone, name)[:, 0], getattr(together, name)[:, row]
            np.testing.assert_allclose(one, other, rtol=1e-9, err_msg=name)
        np.testing.assert_array_equal(alone.kind[:, 0], together.kind[:, row])
        for one, other in zip(believe(learner, alone), believe(learner, together, row), strict=True):
            np.testing.assert_allclose(one, other, rtol=1e-9)
    assert np.isnan(together.force[objects == NOTHING]).all()
    assert np.isnan(together.p_value[~teaches]).all()


def test_parameters_by_observer_are_those_of_each(tools):
    """Observers with breadths of their own are those who share a breadth, one by one."""
    objects, seeds, kappa = (
        np.tile([[1], [1], [2], [1], [2], [2]], 3),
        [(0, row) for row in range(3)],
        (0.05, 0.22, 2.0),
    )
    together = lift(tools, KINDS_MAP.change(kappa=kappa), objects, seeds)
    for row in range(3):
        alone = lift(tools, KINDS_MAP.change(kappa=kappa[row]), objects[:, [row]], seeds[row : row + 1])
        np.testing.assert_allclose(together.force[:, row], alone.force[:, 0], rtol=1e-9)
    assert len(np.unique(together.force[-1].round(6))) == 3


def test_a_lift_that_does_not_teach_changes_nothing(tools):
    teaches = np.array([[True], [False], [True]])
    record = lift(tools, KINDS_MAP, [[0], [1], [1]], [(0,)], teaches=teaches)
    assert record.force[2] == record.force[1]
    once = lift(tools, KINDS_MAP, [[0], [NOTHING], [1]], [(0,)])
    for name, array in record.after.state.items():
        np.testing.assert_array_equal(array, once.after.state[name])


def test_closed_form_wants_exact_features_and_the_noise_it_is_of(tools):
    with pytest.raises(ValueError, match="noise: is WhiteNoise, must be WeberNoise"):
        StaticLifter(tools, dataclasses.replace(DEFAULT_SETTINGS, noise=WhiteNoise(0.1)))
    with pytest.raises(ValueError, match=r"vision_error: is VisionError\(size=0.01.*must be zero"):
        StaticLifter(tools, dataclasses.replace(DEFAULT_SETTINGS, vision_error=VisionError(size=0.01)))


def test_time_of_a_lift_does_not_grow_with_how_many_there_were(tools):
    """Later hundreds of lifts take less than twice the time of the second, as kinds and objects are as many."""
    lifter = StaticLifter(tools, dataclasses.replace(DEFAULT_SETTINGS, learner=KINDS_MAP))
    observers, times = lifter.start([(0,)]), []
    for hundred in range(6):
        errors = lifter.draw_errors([(hundred,)], 100)
        start = time.process_time()
        observers = lifter.run(np.full((100, 1), 3), observers, errors, [(hundred,)]).after
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
    objects, seeds = np.tile([[*range(4)] * 5 + [4] * 2], (8, 1)).T, [(seed, 2) for seed in range(8)]
    record = lift([*cylinders, build_cylinder("odd", odd, 0.1, volume)], KINDS_MAP, objects, seeds)
    errors = np.median(np.abs(record.force - record.weight)[-2:], axis=1)
    assert errors[0] > 7.0
    assert errors[1] < 1.2


def test_objects_are_compared_with_those_that_were_recognised_alone(monkeypatch):
    """Of 300 sizes, one person tells some dozens apart; objects that differ in mass alone are not compared at all."""
    compared = []

    def compare(one, other):
        compared.append((one, other))
        return is_same_object(one, other)

    monkeypatch.setattr("affordance.extensions.people.static_lifts.is_same_object", compare)
    heights = np.random.default_rng(0).permutation(np.geomspace(0.05, 0.1, 300))
    sizes = [cylinder(f"{h}", radius=0.03, height=h, mass=0.5) for h in heights]
    lifter, taught = StaticLifter(sizes, DEFAULT_SETTINGS), np.ones(300, dtype=bool)
    things, met = lifter.identify_all(np.arange(300), taught), list[int]()
    for i, thing in enumerate(things.tolist()):
        looks = [lifter._tools[each].appearance for each in (i, *met)]
        same = [each for each, look in zip(met, looks[1:], strict=True) if is_same_object(look, looks[0])]
        assert thing == (same[0] if same else i)
        met += [thing] if thing not in met else []
    assert len(compared) <= 300 * len(met) < 0.2 * 300**2
    compared.clear()
    masses = [cylinder(f"{m}", radius=0.03, height=0.06, mass=m) for m in np.linspace(0.3, 0.6, 300)]
    assert (StaticLifter(masses, DEFAULT_SETTINGS).identify_all(np.arange(300), taught) == 0).all()
    assert len(compared) == 1
