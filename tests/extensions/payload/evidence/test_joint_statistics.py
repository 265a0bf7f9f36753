import numpy as np
from numpy.testing import assert_allclose

from affordance.extensions.payload.evidence.joint_statistics import compute_statistics

_BLOCK = 7


def test_sums_of_squares_are_those_of_the_residual(samples, rng):
    g, h, J, pi, c = 1.3, 0.2, 0.7, rng.standard_normal(10), rng.standard_normal(3)
    w = np.concatenate([-g * np.append(1.0, pi), -h * np.append(1.0, pi), -c, [-J, 1.0]])
    load = samples.tau_arm + samples.Y @ pi
    friction = c[0] * samples.direction + c[1] * samples.velocity + c[2] + J * samples.acceleration
    residual = (samples.signal - (g + h * samples.load_sign) * load - friction) * samples.used
    sums = compute_statistics(samples, _BLOCK)
    weights = np.tile(w, (3, 1))
    assert_allclose(sums.sum_squares(weights), (residual**2).sum(axis=0), rtol=1e-12)
    blocks = np.add.reduceat(residual, np.arange(0, len(residual), _BLOCK), axis=0)
    assert_allclose(sums.sum_block_squares(weights), (blocks**2).sum(axis=0), rtol=1e-12)
    whole = blocks[: len(residual) // _BLOCK]
    r = (whole[1:] * whole[:-1]).sum(axis=0) / (whole**2).sum(axis=0)
    assert_allclose(sums.correlate_blocks(weights), r, rtol=1e-9)
    assert_allclose(sums.counts, samples.used.sum(axis=0))
