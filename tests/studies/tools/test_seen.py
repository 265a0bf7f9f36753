"""Solids from two pictures or one, and ellipsoids in their place."""

import numpy as np
import pytest
from helpers.mallet import STAND, TOOL, weigh

from affordance.vision.pixels.seen_tool import detect_tool
from studies.tools.seen import ERRORS, find_equal_ellipsoid, measure_form


def test_one_view_is_worse_and_ellipsoids_are_worst_and_say_so(rng):
    photographs = STAND.take_pictures(TOOL, rng)
    errors = []
    for source, error in ERRORS.items():
        features = measure_form(photographs, STAND, source, np.eye(4))
        errors.append(abs(np.log(weigh(features)[0] * np.exp(error.bias) / TOOL.parameters[0])))
    assert errors == sorted(errors)
    sds = [error.log_volume_sd for error in ERRORS.values()]
    assert sds == sorted(sds)


def test_equal_ellipsoid_has_the_same_second_moments(rng):
    (part, *_) = detect_tool(STAND.take_pictures(TOOL, rng), STAND.rig, STAND.noise).compute_features(np.eye(4))
    ellipsoid, X_PE = find_equal_ellipsoid(part.shape, np.zeros(3))
    J, K = part.shape.unit_pseudo_inertia(), X_PE @ ellipsoid.unit_pseudo_inertia() @ X_PE.T
    np.testing.assert_allclose(K[:3, :3] / K[3, 3], J[:3, :3] / J[3, 3], rtol=1e-6, atol=1e-9)
    assert np.linalg.det(X_PE[:3, :3]) == pytest.approx(1.0)
