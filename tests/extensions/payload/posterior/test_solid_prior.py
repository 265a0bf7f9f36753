import numpy as np
import pytest
from numpy.testing import assert_allclose
from pydrake.math import RotationMatrix
from pydrake.multibody.tree import SpatialInertia, UnitInertia
from scipy.stats import multivariate_normal

from affordance.extensions.payload.posterior.log_cholesky import parameters_from_theta, theta_from_parameters
from affordance.extensions.payload.posterior.solid_prior import Normals, SolidPrior


def _turn(rng):
    return RotationMatrix.ProjectToRotationMatrix(np.linalg.qr(rng.standard_normal((3, 3)))[0])


def _weigh(parts, rng):
    """The ten parameters of parts (mass, centre, unit inertia about it), scaled to a random mass; by Drake."""
    total = None
    for mass, place, unit in parts:
        part = SpatialInertia(mass, place, unit.ShiftFromCenterOfMass(place))
        total = part if total is None else total.__iadd__(part)
    moments, products = total.CalcRotationalInertia().get_moments(), total.CalcRotationalInertia().get_products()
    pi = np.array([total.get_mass(), *total.CalcComMoment(), *moments, *products])
    return pi / pi[0] * np.exp(rng.uniform(np.log(0.02), np.log(10.0)))


def _draw_between(rng, low, high, count=None):
    return np.exp(rng.uniform(np.log(low), np.log(high), count))


def draw_solid(rng):
    """One to three boxes of random edges, densities, places and orientations."""
    centre, parts = 0.15 * rng.standard_normal(3), []
    for _ in range(rng.integers(1, 4)):
        edges = _draw_between(rng, 0.01, 0.30, 3)
        mass = edges.prod() * _draw_between(rng, 100.0, 8000.0)
        parts.append(
            (mass, centre + 0.07 * rng.standard_normal(3), UnitInertia.SolidBox(*edges).ReExpress(_turn(rng)))
        )
    return _weigh(parts, rng)


def draw_compact(rng):
    unit = UnitInertia.SolidBox(*_draw_between(rng, 0.02, 0.20, 3)).ReExpress(_turn(rng))
    return _weigh([(1.0, 0.10 * rng.standard_normal(3), unit)], rng)


def draw_rod(rng):
    length, R = _draw_between(rng, 0.08, 0.80), _turn(rng)
    unit = UnitInertia.SolidCylinder(_draw_between(rng, 0.003, 0.025), length, [1.0, 0.0, 0.0]).ReExpress(R)
    place = R @ np.array([rng.uniform(-0.5, 0.5) * length, 0.0, 0.0]) + 0.04 * rng.standard_normal(3)
    return _weigh([(1.0, place, unit)], rng)


def draw_handled(rng):
    length, R, held = _draw_between(rng, 0.08, 0.50), _turn(rng), 0.04 * rng.standard_normal(3)
    handle = UnitInertia.SolidCylinder(_draw_between(rng, 0.005, 0.02), length, [1.0, 0.0, 0.0]).ReExpress(R)
    edges, grip, share = _draw_between(rng, 0.01, 0.30, 3), rng.uniform(0.0, 0.5) * length, rng.uniform()
    head = UnitInertia.SolidBox(*edges).ReExpress(R)
    along = (0.5 * length - grip, length - grip + 0.5 * edges[0])
    places = [R @ np.array([x, 0.0, 0.0]) + held for x in along]
    return _weigh([(1.0 - share, places[0], handle), (share, places[1], head)], rng)


def test_prior_is_that_of_solids_a_hand_could_hold():
    """Means and covariances of each of four kinds agree with those of solids that Drake assembles."""
    rng, num = np.random.default_rng(5), 700
    prior = SolidPrior.for_hand()
    assert_allclose(prior.shares, 0.25)
    for k, draw in enumerate((draw_solid, draw_compact, draw_rod, draw_handled)):
        theta = theta_from_parameters(np.array([draw(rng) for _ in range(num)]))
        mean, sd = theta.mean(axis=0), theta.std(axis=0)
        assert (np.abs(prior.kinds.means[k] - mean) < 5.0 * sd * np.sqrt(1.0 / num + 1.0 / 4000)).all()
        assert_allclose(np.sqrt(np.diag(prior.kinds.covariances[k])), sd, rtol=0.2)


def _build_two_kinds() -> SolidPrior:
    """Two kinds that differ in mass and size, of unequal shares."""
    solid = SolidPrior.for_hand()
    means, covariances = solid.kinds.means[1:3].copy(), solid.kinds.covariances[1:3]
    means[:, 0] = np.log([0.2, 3.0])
    return SolidPrior(Normals(means, 0.3 * covariances), np.array([0.3, 0.7]))


def test_density_and_moments_are_those_of_what_is_drawn(rng):
    solid = _build_two_kinds()
    theta = solid.draw_theta(rng, 40000)
    assert_allclose(theta.mean(axis=0), solid.mean, atol=5.0 * np.sqrt(solid.covariance.max() / 40000))
    assert_allclose(np.cov(theta.T), solid.covariance, atol=0.05 * solid.covariance.max())
    each = [multivariate_normal(*kind) for kind in zip(solid.kinds.means, solid.kinds.covariances, strict=True)]
    expected = np.log(0.3 * each[0].pdf(theta[:50]) + 0.7 * each[1].pdf(theta[:50]))
    assert_allclose(solid.compute_log_density(theta[:50]) - 5.0 * np.log(2.0 * np.pi), expected, rtol=1e-9)


def test_a_weighed_body_is_of_the_kind_that_weighs_as_much(rng):
    """Shares of the kinds agree to 0.03 with those of light and heavy draws whose mass is near the weighed one."""
    solid, mass = _build_two_kinds(), 2.0
    theta = solid.draw_theta(rng, 400000)
    near = theta[np.abs(theta[:, 0] - np.log(mass)) < 0.02]
    weighed = solid.with_mass(mass, 0.01)
    belongs = np.exp(solid.compute_log_densities(near))
    belongs /= belongs.sum(axis=1, keepdims=True)
    assert_allclose(weighed.shares, belongs.mean(axis=0), atol=0.03)
    expected = weighed.mean
    assert len(near) > 1000
    sd = near.std(axis=0) / np.sqrt(len(near))
    assert (np.abs(near.mean(axis=0) - expected)[1:] < 5.0 * sd[1:]).all()
    masses = weighed.draw_parameters(rng, 2000)[:, 0]
    assert_allclose(masses.mean(), mass, rtol=1e-3)
    assert_allclose(masses.std(), 0.01, rtol=0.15)


def test_a_common_factor_is_removed_as_bayes_rule_says_for_each_kind(rng):
    """Bodies of the prior with the common factor have the prior's moments when the factor is removed."""
    solid, sd = _build_two_kinds(), 0.4
    felt = solid.with_common_factor(sd).draw_theta(rng, 20000)
    assert solid.remove_common_factor(felt, 0.0, rng) is felt
    body = theta_from_parameters(solid.remove_common_factor(parameters_from_theta(felt), sd, rng))
    assert_allclose(body.mean(axis=0), solid.mean, atol=5.0 * np.sqrt(solid.covariance.max() / 20000))
    assert_allclose(body[:, 0].std(), np.sqrt(solid.covariance[0, 0]), rtol=0.02)
    assert np.mean(body[:, 0] < np.log(0.8)) == pytest.approx(
        np.mean(solid.draw_theta(rng, 20000)[:, 0] < np.log(0.8)), abs=0.02
    )


def test_squares_and_scales_are_those_of_the_densities(rng):
    roots = rng.standard_normal((3, 4, 4))
    normals = Normals(rng.standard_normal((3, 4)), roots @ roots.swapaxes(1, 2) + 0.1 * np.eye(4))
    points = rng.standard_normal((7, 4))
    ours = normals.log_scales - 0.5 * normals.measure_squares(points) - 2.0 * np.log(2.0 * np.pi)
    for k, (mean, covariance) in enumerate(zip(normals.means, normals.covariances, strict=True)):
        assert_allclose(ours[:, k], multivariate_normal(mean, covariance).logpdf(points), rtol=1e-9)
    assert_allclose(normals.precisions @ normals.covariances, np.tile(np.eye(4), (3, 1, 1)), atol=1e-8)
