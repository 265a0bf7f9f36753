import numpy as np
import pytest
from helpers.generated_runs import Truth, generate_run
from numpy.testing import assert_allclose

from affordance.belief.likelihood import Quadratic
from affordance.exceptions import BadValueError
from affordance.extensions.payload.evidence.fitted_arm import CELL, ArmRegression
from affordance.extensions.payload.evidence.model_error import build_phantom_covariance, estimate_phantom_mass
from affordance.extensions.payload.recording.preparation import prepare
from affordance.extensions.payload.settings import DEFAULT_SETTINGS


def test_phantom_is_a_mass_of_unknown_sign_near_the_tip(rng):
    x, y, z = 0.15 * rng.standard_normal((3, 400_000))
    lumps = np.stack([np.ones_like(x), x, y, z, y * y + z * z, x * x + z * z, x * x + y * y, -x * y, -x * z, -y * z])
    drawn = np.cov(0.02 * lumps * rng.standard_normal(len(x)))
    scale = np.sqrt(np.outer(np.diag(drawn), np.diag(drawn)))
    assert_allclose(build_phantom_covariance(0.02) / scale, drawn / scale, atol=0.03)


@pytest.mark.parametrize("true", [0.005, 0.05])
def test_size_of_the_phantom_is_found_from_stretches(rng, true):
    H = np.diag([1e6, *[1e7] * 3, *[1e6] * 6])  # a gram, a third of a gram metre
    stretches = []
    for _ in range(30):
        delta = rng.multivariate_normal(np.zeros(10), build_phantom_covariance(true))
        measured = delta + np.diag(H) ** -0.5 * rng.standard_normal(10)
        stretches.append(Quadratic(H, H @ measured))
    assert estimate_phantom_mass(stretches) == pytest.approx(true, rel=0.2)


def test_fewer_stretches_give_no_smaller_a_phantom(rng):
    H = np.diag([1e6, *[0.0] * 9])  # one number each, the mass
    one = Quadratic(H, H @ np.array([0.02, *[0.0] * 9]))
    assert estimate_phantom_mass([one]) > 1.5 * estimate_phantom_mass([one] * 10)


def test_fitted_arm_predicts_what_its_file_does_not(robot, gains, rng):
    truth = Truth(friction=(0.5, 0.3, 0.1), noise_sd=0.02, file_error=0.2)
    run, other = (generate_run(robot, None, truth=truth, rng=rng, duration=40.0, motion_seed=seed) for seed in (0, 1))
    prepared, elsewhere = prepare(run, DEFAULT_SETTINGS), prepare(other, DEFAULT_SETTINGS)
    regression = ArmRegression(robot, [prepared], [prepared.signal], gains, DEFAULT_SETTINGS)
    fitted = regression.fit(np.ones(regression.num_cells, dtype=bool))
    moving = np.abs(elsewhere.v) > 0.1
    by_fit = np.abs(fitted.predict(elsewhere) - elsewhere.signal)[moving]
    by_file = np.abs(robot.compute_arm_torques(*elsewhere.motion) - elsewhere.signal)[moving]
    assert np.sqrt((by_fit**2).mean()) < 0.2 * np.sqrt((by_file**2).mean())


def test_fit_of_some_cells_is_the_fit_of_their_samples(robot, gains, rng):
    run = generate_run(robot, None, truth=Truth(noise_sd=0.02), rng=rng)
    prepared = prepare(run, DEFAULT_SETTINGS)
    rows = round(CELL * prepared.rate)
    whole = ArmRegression(robot, [prepared], [prepared.signal], gains, DEFAULT_SETTINGS)
    part = prepared.select(slice(0, 12 * rows))
    alone = ArmRegression(robot, [part], [part.signal], gains, DEFAULT_SETTINGS)
    ours = whole.fit(np.arange(whole.num_cells) < 12)
    theirs = alone.fit(np.ones(12, dtype=bool))
    assert_allclose(ours.link_change, theirs.link_change, rtol=1e-6, atol=1e-9)
    assert_allclose(ours.friction, theirs.friction, rtol=1e-6, atol=1e-9)


def test_a_joint_that_never_moves_cannot_be_fitted(robot, gains, rng):
    run = generate_run(robot, None, truth=Truth(), rng=rng)
    prepared = prepare(run, DEFAULT_SETTINGS)
    v = prepared.v.copy()
    v[:, 2] = 0.0
    with pytest.raises(BadValueError, match=r"has no sample in which joint_3 moves faster than 0.03 rad/s"):
        ArmRegression(robot, [prepared._replace(v=v)], [prepared.signal], gains, DEFAULT_SETTINGS)
