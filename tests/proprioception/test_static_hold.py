import numpy as np
import pytest
from helpers.seen_objects import TWO_MATERIALS, detect_parts

from affordance.belief.density_belief import Prior
from affordance.belief.holds import Felt
from affordance.belief.normals import Normals
from affordance.proprioception.torque_noise import WeberNoise

PRIOR = Prior(mode=1000.0, sd=4000.0, deviation=0.06)


@pytest.mark.parametrize("noise", [WeberNoise(0.07, 0.097), WeberNoise(0.0, 0.3), WeberNoise(0.13, 0.01)])
@pytest.mark.parametrize("num_materials", [1, 2])
def test_torques_at_rest_tell_what_the_estimator_learns_from(noise, num_materials, hold):
    """Many lifts are computed from torques at rest, without an estimator that averages samples."""
    belief = detect_parts(TWO_MATERIALS[:num_materials], PRIOR)
    narrow = Normals(np.full((1, num_materials), 3000.0), 500.0**2 * np.eye(num_materials)[None])
    statistics = hold.measure(belief, np.array([5000.0, 700.0])[:num_materials], noise, (3, 1))
    tau = statistics.features[:7]
    noise_of_lifts = noise.threshold, noise.weber_fraction
    lifted = Felt.from_torques(tau[None], hold.tau_arm, (hold.Y @ belief.geometry.Phi)[None], noise_of_lifts)
    held = noise.describe(statistics.features, 1, 7, belief.geometry)
    for normals in (belief.densities.normals, narrow):
        for one, other in zip(lifted.find_likelihood(normals), held.find_likelihood(normals), strict=True):
            np.testing.assert_allclose(one, other, rtol=1e-10)
