import numpy as np
from numpy.testing import assert_allclose
from pydrake.math import RotationMatrix
from pydrake.multibody.tree import SpatialInertia, UnitInertia

from affordance.identification.posterior.log_cholesky import theta_from_parameters
from affordance.identification.posterior.solid_prior import SolidPrior


def draw_solid(rng):
    """One to three boxes of random edges, densities, places and orientations, scaled to a random mass; by Drake."""
    total, centre = None, 0.15 * rng.standard_normal(3)
    for _ in range(rng.integers(1, 4)):
        edges = np.exp(rng.uniform(np.log(0.01), np.log(0.30), 3))
        mass = edges.prod() * np.exp(rng.uniform(np.log(100.0), np.log(8000.0)))
        R = RotationMatrix.ProjectToRotationMatrix(np.linalg.qr(rng.standard_normal((3, 3)))[0])
        unit = UnitInertia.SolidBox(*edges).ReExpress(R)
        place = centre + 0.07 * rng.standard_normal(3)
        box = SpatialInertia(mass, place, unit.ShiftFromCenterOfMass(place))
        total = box if total is None else total.__iadd__(box)
    moments, products = total.CalcRotationalInertia().get_moments(), total.CalcRotationalInertia().get_products()
    pi = np.array([total.get_mass(), *total.CalcComMoment(), *moments, *products])
    return pi / pi[0] * np.exp(rng.uniform(np.log(0.02), np.log(10.0)))


def test_prior_is_that_of_boxes_a_hand_could_hold():
    rng, num = np.random.default_rng(5), 1500
    theta = theta_from_parameters(np.array([draw_solid(rng) for _ in range(num)]))
    prior = SolidPrior.for_hand()
    sd = theta.std(axis=0)
    assert_allclose(prior.mean, theta.mean(axis=0), atol=(5.0 * sd * np.sqrt(1.0 / num + 1.0 / 4000)).max())
    assert (np.abs(prior.mean - theta.mean(axis=0)) < 5.0 * sd * np.sqrt(1.0 / num + 1.0 / 4000)).all()
    assert_allclose(np.sqrt(np.diag(prior.covariance)), sd, rtol=0.15)
