import numpy as np
from numpy.testing import assert_allclose
from pydrake.math import RotationMatrix
from pydrake.multibody.tree import SpatialInertia, UnitInertia

from affordance.identification.posterior.log_cholesky import theta_from_parameters
from affordance.identification.posterior.solid_prior import SolidPrior


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
    rng, num = np.random.default_rng(5), 2000
    draws = (draw_solid, draw_compact, draw_rod, draw_handled)
    theta = theta_from_parameters(np.array([draws[i % 4](rng) for i in range(num)]))
    prior = SolidPrior.for_hand()
    sd = theta.std(axis=0)
    assert_allclose(prior.mean, theta.mean(axis=0), atol=(5.0 * sd * np.sqrt(1.0 / num + 1.0 / 16000)).max())
    assert (np.abs(prior.mean - theta.mean(axis=0)) < 5.0 * sd * np.sqrt(1.0 / num + 1.0 / 16000)).all()
    assert_allclose(np.sqrt(np.diag(prior.covariance)), sd, rtol=0.15)
