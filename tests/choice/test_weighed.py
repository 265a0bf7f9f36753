"""Weighings condition the densities of a tool's materials, by Bayes' rule."""

from dataclasses import replace

import numpy as np
import pytest

from affordance.belief.density_belief import DensityBelief, Prior
from affordance.belief.material_memory import MaterialMemory
from affordance.choice.listed_options import list_options
from affordance.choice.options import Option, add_weighings
from affordance.choice.weighed import WeighedObject, condition_on_weighings
from affordance.extensions.advice.known_materials import learn_weighings
from affordance.objects.inertia import Ellipsoid
from affordance.objects.materials import Material
from affordance.objects.tool import Component, Tool, Weighing
from affordance.vision.features import VisionError
from affordance.vision.prediction import measure_geometry
from studies import exact_reference as reference

STEEL = Material("steel", (0.5, 0.5, 0.6), 7850.0, 87.0)
OAK = Material("oak", (0.8, 0.6, 0.3), 700.0, 70.0)
PRIOR = Prior()
BELIEF = DensityBelief.from_moments(np.array([7800.0, 700.0]), np.diag([200.0**2, 150.0**2]))
MEMORY = MaterialMemory.from_belief((STEEL.colour, OAK.colour), BELIEF)


def make(name: str, *weighings: Weighing, size: float = 0.03) -> Tool:
    head, handle = Ellipsoid((size, size, size)), Ellipsoid((0.15, 0.02, 0.02))
    far = np.eye(4)
    far[0, 3] = 0.2
    return Tool(
        name, (Component(head, far, STEEL, STEEL), Component(handle, np.eye(4), OAK, OAK)), weighings=weighings
    )


def weigh(tool: Tool) -> WeighedObject:
    (option,) = add_weighings(list_options(tool), [tool])
    geometry = measure_geometry(option.features, [0, 1], 2)
    return WeighedObject(option.features, [0, 1], geometry, option.weighings)


@pytest.mark.parametrize(
    "weighings",
    [
        (Weighing((), 1.2, 0.02),),
        (Weighing((0,), 0.9, 0.01),),
        (Weighing((0,), 0.9, 0.02), Weighing((), 1.1, 0.03)),
    ],
)
def test_densities_are_those_of_samples_weighted_by_the_weighings(weighings: tuple[Weighing, ...]) -> None:
    """Importance sampling from the model of two tools, of which one is weighed, gives the same moments.

    Means agree to a twentieth of a standard deviation, a bound that was chosen after .03 had been seen.
    """
    objects = {"weighed": weigh(make("weighed", *weighings)), "other": weigh(make("other"))}
    joint, surprises = condition_on_weighings(BELIEF, objects, PRIOR)
    assert not surprises
    rng = np.random.default_rng(1)
    mu = rng.multivariate_normal(BELIEF.untruncated_mean, BELIEF.covariance, 400_000)
    samples = np.tile(mu, 2) * (1.0 + PRIOR.deviation * rng.standard_normal((len(mu), 4)))
    volumes = [part.shape.volume for part in make("weighed").components]
    log_weights = np.zeros(len(samples))
    for each in weighings:
        mass = sum(volumes[k] * samples[:, k] for k in each.parts or (0, 1))
        log_weights -= 0.5 * ((mass - each.mass) / each.sd) ** 2
    weights = np.exp(log_weights - log_weights.max())
    mean = np.average(samples, axis=0, weights=weights)
    sd = np.sqrt(np.average((samples - mean) ** 2, axis=0, weights=weights))
    np.testing.assert_allclose((joint.untruncated_mean - mean) / sd, 0.0, atol=0.05)
    np.testing.assert_allclose(np.sqrt(np.diag(joint.covariance)), sd, rtol=0.03)


def test_weighing_with_a_small_error_decides_the_mass() -> None:
    objects = {"weighed": weigh(make("weighed", Weighing((), 1.2, 1e-4)))}
    joint, _ = condition_on_weighings(BELIEF, objects, PRIOR)
    Phi = objects["weighed"].geometry.Phi
    assert (Phi @ joint.untruncated_mean)[0] == pytest.approx(1.2, abs=1e-4)


def test_weighing_that_contradicts_the_materials_counts_and_is_told() -> None:
    """A hammer of twice the mass that its materials allow is believed to weigh what the scale says."""
    heavy = Weighing((), 2.5, 0.025)
    objects = {"weighed": weigh(make("weighed", heavy)), "other": weigh(make("other"))}
    joint, (surprise,) = condition_on_weighings(BELIEF, objects, PRIOR)
    masses = [(objects["weighed"].geometry.Phi @ joint.untruncated_mean[k : k + 2])[0] for k in (0, 2)]
    assert masses[0] == pytest.approx(2.5, rel=0.01)
    assert masses[1] == pytest.approx(surprise.expected, rel=0.02)  # nothing is learned of the materials
    assert (surprise.name, surprise.mass) == ("weighed", 2.5)


def test_errors_of_sizes_widen_a_weighing() -> None:
    tool = make("weighed", Weighing((), 1.2, 1e-3))
    exact = weigh(tool)
    errors = VisionError(size=0.05)
    parts = tuple(replace(part, size_sd=errors.size) for part in exact.parts)
    seen = exact._replace(parts=parts, geometry=measure_geometry(parts, [0, 1], 2))
    sds = []
    for each in (exact, seen):
        joint, _ = condition_on_weighings(BELIEF, {"weighed": each}, PRIOR)
        sds.append(np.sqrt((each.geometry.Phi @ joint.covariance @ each.geometry.Phi.T)[0, 0]))
    assert sds[1] > 5.0 * sds[0]


def option_of(tool: Tool) -> Option:
    (option,) = add_weighings(list_options(tool), [tool])
    return option


def test_learning_from_weighings_gives_the_materials_of_the_joint_belief() -> None:
    """Marginals of a third tool's materials, conditioned on two weighings, are those that the memory has learned."""
    tools = [make("one", Weighing((), 1.2, 0.02)), make("two", Weighing((0,), 1.6, 0.02), size=0.036), make("three")]
    memory = learn_weighings(MEMORY, {tool.name: option_of(tool) for tool in tools}, PRIOR)
    joint, _ = condition_on_weighings(BELIEF, {tool.name: weigh(tool) for tool in tools}, PRIOR)
    third = memory.belief.add_object_variation(PRIOR.deviation)
    np.testing.assert_allclose(third.untruncated_mean, joint.untruncated_mean[4:], rtol=1e-6)
    np.testing.assert_allclose(third.covariance, joint.covariance[4:, 4:], rtol=1e-6)
    assert len(memory.things) == 2


def test_object_that_is_weighed_after_it_was_held_has_one_deviation() -> None:
    """Two weighings that come one after the other are those that come at once."""
    first, second = Weighing((), 1.2, 0.02), Weighing((0,), 0.9, 0.02)
    once = learn_weighings(MEMORY, {"a": option_of(make("a", first, second))}, PRIOR)
    memory = learn_weighings(MEMORY, {"a": option_of(make("a", first))}, PRIOR)
    twice = learn_weighings(memory, {"a": option_of(make("a", second))}, PRIOR)
    np.testing.assert_allclose(twice.belief.precision, once.belief.precision, rtol=1e-9)
    np.testing.assert_allclose(twice.belief.untruncated_mean, once.belief.untruncated_mean, rtol=1e-9)


def test_parts_that_a_picture_did_not_tell_apart_have_no_weighing() -> None:
    tool = make("a", Weighing((), 1.2, 0.02), Weighing((0,), 0.9, 0.02))
    (drawn,) = list_options(tool)
    merged = Option("a", "", drawn.features[:1], np.eye(4))
    (option,) = add_weighings([merged], [tool])
    assert option.weighings == (Weighing((), 1.2, 0.02),)


@pytest.mark.parametrize("size_sd", [0.0, 0.02])
@pytest.mark.parametrize("error", [0.01, 0.05])
def test_weighings_that_contradict_each_other_give_the_posterior_by_quadrature(size_sd: float, error: float) -> None:
    """One object weighs half of another of the same material and size: means to 2 %, standard deviations to 5 %."""
    broad = DensityBelief.from_moments(np.array([PRIOR.mode]), np.array([[PRIOR.sd**2]]))
    objects, holds = dict[str, WeighedObject](), list[reference.Hold]()
    for number, density in enumerate((8000.0, 4000.0)):
        ball = Component(Ellipsoid((0.03, 0.03, 0.03)), np.eye(4), STEEL, STEEL)
        mass = density * ball.shape.volume
        option = option_of(Tool(f"ball {number}", (ball,), weighings=(Weighing((), mass, error * mass),)))
        parts = tuple(replace(part, size_sd=size_sd) for part in option.features)
        geometry = measure_geometry(parts, [0], 1)
        objects[option.object_name] = WeighedObject(parts, [0], geometry, option.weighings)
        errors = geometry.Phi_errors[:, 0].T[:, None] / (error * mass)  # (1, 1, G)
        one, zero, A = np.array([1.0 / error]), np.zeros(1), np.array([[ball.shape.volume / (error * mass)]])
        holds.append(reference.Hold(number, one, zero, A, errors))
    joint, surprises = condition_on_weighings(broad, objects, PRIOR)
    assert not surprises
    model = reference.Model(PRIOR.mode, PRIOR.sd, PRIOR.deviation, s0=1.0, w=0.0)
    expected = reference.compute_posterior(holds, [(0,), (0,)], model).rho
    np.testing.assert_allclose(joint.untruncated_mean, [expected[k, 0].mean for k in (0, 1)], rtol=0.02)
    np.testing.assert_allclose(np.sqrt(np.diag(joint.covariance)), [expected[k, 0].sd for k in (0, 1)], rtol=0.05)
