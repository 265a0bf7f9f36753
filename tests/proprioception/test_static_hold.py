from functools import partial

import numpy as np
import pytest
from helpers.seen_objects import TWO_MATERIALS, detect_parts

from affordance.belief.density_belief import DensityBelief, Prior
from affordance.proprioception.estimator import condition_on_torques
from affordance.proprioception.fixed_point import find_fixed_point
from affordance.proprioception.static_hold import StaticPercept
from affordance.proprioception.torque_noise import WeberNoise

PRIOR = Prior(mode=1000.0, sd=4000.0, deviation=0.06)


@pytest.mark.parametrize("noise", [WeberNoise(0.07, 0.097), WeberNoise(0.0, 0.3), WeberNoise(0.13, 0.01)])
@pytest.mark.parametrize("num_materials", [1, 2])
def test_likelihood_is_that_of_the_estimator(noise, num_materials, hold):
    belief = detect_parts(TWO_MATERIALS[:num_materials], PRIOR)
    narrow = DensityBelief.from_moments(np.full(num_materials, 3000.0), 500.0**2 * np.eye(num_materials))
    statistics = hold.measure(belief, np.array([5000.0, 700.0])[:num_materials], noise, (3, 1))
    residual = statistics.features[:7] - hold.tau_arm
    percept = StaticPercept(hold.tau_arm, (hold.Y @ belief.geometry.Phi)[None], residual[None], noise)
    for densities in (belief.densities, narrow):
        found = percept.find_likelihood(densities.normals).take(0)
        compute = partial(noise.compute_likelihood, statistics.features, 1, 7, belief.geometry)
        expected = find_fixed_point(densities, compute)
        for one, other in zip(found, expected, strict=True):
            np.testing.assert_allclose(one, other, rtol=1e-10)
    _, learned = condition_on_torques(belief, statistics, 7, noise, PRIOR.deviation)
    np.testing.assert_array_equal(learned.precision, find_fixed_point(belief.densities, compute).precision)
