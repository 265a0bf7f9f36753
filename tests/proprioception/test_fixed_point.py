from typing import NamedTuple

import numpy as np
import pytest
from scipy.optimize import brentq

from affordance.belief.density_belief import DensityBelief
from affordance.belief.likelihood import Likelihood
from affordance.belief.normals import Normals
from affordance.objects.inertia import NUM_PARAMETERS, Geometry
from affordance.proprioception.fixed_point import descend, find_fixed_point
from affordance.proprioception.static_hold import StaticPercept
from affordance.proprioception.torque_noise import WeberNoise

NOISE = WeberNoise(0.07, 0.097)


def lift(hold, volumes, true, noise=NOISE, rng=None):
    """Percept of point masses of some volumes at the grip; without errors unless there is a generator."""
    Phi = np.zeros((NUM_PARAMETERS, len(volumes)))
    Phi[0] = volumes
    regressor = hold.Y @ Phi
    tau = hold.tau_arm + regressor @ np.asarray(true, dtype=float)
    if rng is not None:
        tau = tau + noise.compute_sd(tau) * rng.standard_normal(len(tau))
    return Percept(StaticPercept(hold.tau_arm, regressor[None], (tau - hold.tau_arm)[None], noise))


class Percept(NamedTuple):
    """Percept of one observer."""

    several: StaticPercept

    def compute_likelihood(self, rho):
        return self.several.compute_likelihood(rho[None], np.zeros(1, dtype=np.intp)).take(0)

    def find_likelihood(self, belief):
        return self.several.find_likelihood(belief.normals).take(0)


def measure_error(percept, belief, likelihood):
    """Relative change of the believed densities if errors are sized at them again."""
    mean = belief.condition(likelihood).untruncated_mean
    again = belief.condition(percept.compute_likelihood(mean)).untruncated_mean
    return np.abs(again - mean).max() / np.abs(mean).max()


def test_object_much_lighter_than_its_well_known_colour_is_answered(hold):
    """Errors agree with the densities to 1e-9 where the plain iteration takes 104, 106 and 114 steps."""
    belief = DensityBelief.from_moments([7843.0], [[238.0**2]])
    for volume, true in ((600e-6, 400.0), (800e-6, 700.0), (800e-6, 600.0)):
        percept = lift(hold, [volume], [true])
        assert measure_error(percept, belief, percept.find_likelihood(belief)) < 1e-9


@pytest.mark.parametrize("num_densities", [1, 2, 3])
def test_any_surprise_is_answered(hold, num_densities):
    """Surprises up to a thousandfold are solved to 1e-7, also one in fifty that plain iteration does not settle."""
    rng = np.random.default_rng(num_densities)
    unsettled = 0
    for _ in range(100):
        mean, true = 10.0 ** rng.uniform(1.0, 4.3, (2, num_densities))
        sd = mean * 10.0 ** rng.uniform(-3.0, 0.0, num_densities)
        noise = WeberNoise(rng.choice([0.07, 0.3]), rng.choice([0.01, 0.097]))
        percept = lift(hold, rng.uniform(20e-6, 800e-6, num_densities), true, noise, rng)
        belief = DensityBelief.from_moments(mean, np.diag(sd**2))
        assert measure_error(percept, belief, descend(belief, percept.compute_likelihood)) < 1e-7
        rho = mean
        for _ in range(100):
            previous, rho = rho, belief.condition(percept.compute_likelihood(rho)).untruncated_mean
        unsettled += np.abs(rho - previous).max() > 1e-9 * np.abs(rho).max()
        assert measure_error(percept, belief, percept.find_likelihood(belief)) < 1e-7
    assert num_densities < 3 or unsettled > 0


def test_what_settles_is_what_descent_finds_and_what_a_bracket_finds(hold):
    belief = DensityBelief.from_moments([1500.0], [[390.0**2]])
    percept = lift(hold, [600e-6], [2500.0], rng=np.random.default_rng(3))
    mean = belief.condition(percept.find_likelihood(belief)).untruncated_mean[0]

    def change(rho):
        return belief.condition(percept.compute_likelihood(np.array([rho]))).untruncated_mean[0] - rho

    assert mean == pytest.approx(brentq(change, 0.0, 10_000.0, xtol=1e-12), rel=1e-10)
    found = belief.condition(descend(belief, percept.compute_likelihood)).untruncated_mean[0]
    assert mean == pytest.approx(found, rel=1e-9)


@pytest.mark.parametrize("num_densities", [1, 2])
def test_fixed_points_of_several_observers_are_those_of_each(hold, num_densities):
    """Surprises up to a hundredfold, of which some settle in a few steps and some by descent alone."""
    rng = np.random.default_rng(num_densities)
    beliefs, percepts, noise = [], [], WeberNoise(0.3, 0.01)
    for _ in range(60):
        mean, true = 10.0 ** rng.uniform(2.0, 4.0, (2, num_densities))
        sd = mean * 10.0 ** rng.uniform(-3.0, 0.0, num_densities)
        beliefs.append(DensityBelief.from_moments(mean, np.diag(sd**2)))
        percepts.append(
            lift(hold, rng.uniform(20e-6, 800e-6, num_densities), true, WeberNoise(0.3, 0.01), rng).several
        )
    together = StaticPercept(
        hold.tau_arm,
        np.concatenate([each.regressor for each in percepts]),
        np.concatenate([each.residual for each in percepts]),
        noise,
    )
    order = rng.permutation(60)
    normals = Normals(
        *(np.array([getattr(beliefs[i].normals, name)[0] for i in order]) for name in ("mean", "covariance"))
    )
    found = together.find_likelihood(normals, order)
    for row, i in enumerate(order):
        alone = find_fixed_point(beliefs[i], Percept(percepts[i]).compute_likelihood)
        for one, other in zip(alone, found.take(row), strict=True):
            np.testing.assert_allclose(other, one, rtol=1e-6)
        means = [beliefs[i].condition(each).untruncated_mean for each in (alone, found.take(row))]
        np.testing.assert_allclose(*means, rtol=1e-7)


def test_iteration_that_runs_in_a_circle_is_left():
    """An object thirty times as heavy as it looks is solved to 1e-9; plain iteration alternates for ever."""
    belief = DensityBelief.from_moments([300.0], [[250.0**2]])
    percept = lift(StaticHoldOfOneJoint(), [1.0], [9000.0], WeberNoise(0.3, 0.01))
    rho = belief.untruncated_mean
    for _ in range(5000):
        previous, rho = rho, belief.condition(percept.compute_likelihood(rho)).untruncated_mean
    assert abs(rho[0] - previous[0]) > 0.1 * abs(rho[0])
    likelihood = find_fixed_point(belief, percept.compute_likelihood)
    assert measure_error(percept, belief, likelihood) < 1e-9


class StaticHoldOfOneJoint:
    """An arm of one joint that weighs nothing."""

    tau_arm = np.zeros(1)
    Y = np.eye(1, NUM_PARAMETERS)


def test_uncertain_geometry_and_a_large_surprise_are_answered(hold):
    rng = np.random.default_rng(5)
    for _ in range(50):
        Phi = np.zeros((NUM_PARAMETERS, 2))
        Phi[0] = rng.uniform(20e-6, 800e-6, 2)
        geometry = Geometry(Phi, 0.3 * Phi * rng.standard_normal((4, *Phi.shape)))
        mean, true = 10.0 ** rng.uniform(1.0, 4.3, (2, 2))
        tau = hold.tau_arm + hold.Y @ Phi @ true
        features = NOISE.compute_features(tau, hold.tau_arm, hold.Y)
        belief = DensityBelief.from_moments(mean, np.diag((0.03 * mean) ** 2))

        def compute(rho, features=features, geometry=geometry):
            return NOISE.compute_likelihood(features, 1, 7, geometry, rho)

        mean = belief.condition(descend(belief, compute)).untruncated_mean
        again = belief.condition(compute(mean)).untruncated_mean
        np.testing.assert_allclose(again, mean, atol=1e-6 * np.abs(mean).max())


def test_an_ordinary_percept_costs_about_ten_likelihoods(hold):
    """Fewer than 20 likelihoods are computed, as plain iteration gains a digit a step and descent is not needed."""
    belief = DensityBelief.from_moments([5000.0, 1500.0], np.diag([500.0, 300.0]) ** 2)
    percept = lift(hold, [60e-6, 80e-6], [5200.0, 1400.0])
    asked = []
    find_fixed_point(belief, lambda rho: asked.append(rho) or percept.compute_likelihood(rho))
    assert 3 < len(asked) < 20


def test_descent_ends_where_no_step_descends():
    """Descent keeps the start if the percept says the opposite at any other density, so that no step descends."""
    belief = DensityBelief.from_moments([1000.0], [[100.0**2]])

    def compute_likelihood(rho):
        says = 2000.0 if rho[0] == 1000.0 else -1e6
        return Likelihood(np.array([[1e-4]]), np.array([1e-4 * says]), 0.0)

    assert descend(belief, compute_likelihood).information_vector[0] == pytest.approx(0.2)
