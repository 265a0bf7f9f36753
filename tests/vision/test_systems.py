import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from affordance.belief.density_belief import DensityBelief, Prior
from affordance.belief.material_memory import MaterialMemory
from affordance.objects.inertia import Ellipsoid, build_inertia_map
from affordance.objects.tool_entries import build_pose
from affordance.vision.eye import measure_features
from affordance.vision.features import ComponentFeatures, VisionError
from affordance.vision.prediction import predict_object

PRIOR = Prior(mode=1000.0, sd=4000.0, deviation=0.06)
BRASS, WOOD = (0.8, 0.6, 0.1), (0.7, 0.5, 0.3)


@pytest.fixture
def features(rng):
    handle = ComponentFeatures(WOOD, Ellipsoid((0.1, 0.02, 0.02)), build_pose([0.1, 0.02, -0.01]), 0.03, 0.004, 0.05)
    X_TE = build_pose([0.2, 0.02, -0.01])
    X_TE[:3, :3] = Rotation.random(rng=rng).as_matrix()
    head = ComponentFeatures(BRASS, Ellipsoid((0.03, 0.05, 0.02)), X_TE, 0.02, 0.003, 0)
    return (handle, head)


def test_prior_of_an_unknown_object_is_broad_and_covers_all_its_looks(features):
    belief = predict_object(features, MaterialMemory(), PRIOR)
    assert belief.memory.colours == (WOOD, BRASS)
    np.testing.assert_allclose(belief.densities.untruncated_mean, [1000, 1000])
    np.testing.assert_allclose(np.diag(belief.densities.covariance), 4000.0**2 + 0.06**2 * (1000.0**2 + 4000.0**2))


def test_what_was_learned_carries_over_by_colour(features):
    memory = MaterialMemory.from_belief((BRASS,), DensityBelief(np.array([[1e-4]]), np.array([0.85])))
    belief = predict_object(features, memory, PRIOR)
    assert belief.memory.colours == (BRASS, WOOD)
    np.testing.assert_allclose(belief.densities.untruncated_mean, [1000, 8500], rtol=1e-12)
    np.testing.assert_allclose(belief.densities.covariance[1, 1], 1e4 + 0.06**2 * (8500.0**2 + 1e4), rtol=1e-12)


def test_materials_the_object_is_not_made_of_do_not_matter(features):
    memory = MaterialMemory().add_colours([(0.0, 0.0, 0.0), WOOD], PRIOR)
    belief = predict_object(features[:1], memory, PRIOR)
    assert belief.memory.colours == ((0.0, 0.0, 0.0), WOOD)
    assert belief.densities.size == 1
    assert belief.geometry.Phi.shape == (10, 1)


def test_geometry_is_the_inertia_map_of_what_is_seen(features):
    belief = predict_object(features, MaterialMemory(), PRIOR)
    expected = build_inertia_map([f.shape for f in features], [f.X_TE for f in features], [0, 1], 2)
    np.testing.assert_array_equal(belief.geometry.Phi, expected)


def test_uncertain_geometry_spreads_inertia_as_drawing_it_does(features, rng):
    """The first-order covariance agrees to 6 % in SD with features drawn anew 4000 times."""
    rho = np.array([700.0, 8500.0])
    geometry = predict_object(features, MaterialMemory(), PRIOR).geometry
    drawn = []
    for _ in range(4000):
        shapes, poses = [], []
        for part in features:
            shapes.append(part.shape.with_sizes(part.shape.sizes * (1 + part.size_sd * rng.standard_normal(3))))
            X_TE = part.X_TE.copy()
            X_TE[:3, 3] += part.position_sd * rng.standard_normal(3)
            turn = Rotation.from_rotvec(part.rotation_sd * rng.standard_normal(3))
            X_TE[:3, :3] = turn.as_matrix() @ X_TE[:3, :3]
            poses.append(X_TE)
        drawn.append(build_inertia_map(shapes, poses, [0, 1], 2) @ rho)
    expected, actual = np.cov(np.array(drawn).T), geometry.compute_covariance(rho)
    sds = np.sqrt(np.diag(expected))
    np.testing.assert_allclose(np.sqrt(np.diag(actual)), sds, rtol=0.06)
    np.testing.assert_allclose(actual / np.outer(sds, sds), expected / np.outer(sds, sds), atol=0.12)


def test_exact_features_leave_geometry_certain(weight, rng):
    features = measure_features(weight.tools[0], VisionError(), rng)
    geometry = predict_object(features, MaterialMemory(), PRIOR).geometry
    assert geometry.Phi_errors.shape == (0, 10, 1)
    np.testing.assert_allclose(geometry.Phi[:, 0] * 8500.0, weight.tools[0].parameters, rtol=1e-12, atol=1e-18)


def test_predictive_samples_have_the_predicted_mean_and_spread(features, rng):
    means = np.array([700.0, 8500.0])
    memory = MaterialMemory.from_belief((WOOD, BRASS), DensityBelief.from_moments(means, np.diag([50.0**2] * 2)))
    belief = predict_object(features, memory, PRIOR)
    samples = belief.draw_parameters(rng, 40_000)
    Phi = belief.geometry.Phi
    covariance = Phi @ belief.densities.covariance @ Phi.T + belief.geometry.compute_covariance(means)
    sds = np.sqrt(np.diag(covariance))
    mean = belief.compute_parameters(belief.densities.compute_mean())
    np.testing.assert_allclose(samples.mean(axis=0), mean, atol=0.03 * sds.max())
    np.testing.assert_allclose(samples.std(axis=0), sds, rtol=0.05)
    assert (samples[:, 0] > 0).all()


def test_measured_features_scatter_by_their_stated_error(weight, rng):
    error = VisionError(size=0.05, position=0.003, rotation=0.02)
    drawn = [measure_features(weight.tools[3], error, rng)[0] for _ in range(3000)]
    logs = np.log([part.shape.sizes for part in drawn])
    np.testing.assert_allclose(logs.std(axis=0), 0.05, rtol=0.06)
    np.testing.assert_allclose(np.std([part.X_TE[:3, 3] for part in drawn], axis=0), 0.003, rtol=0.06)
    angles = [Rotation.from_matrix(part.X_TE[:3, :3]).as_rotvec() for part in drawn]
    np.testing.assert_allclose(np.std(angles, axis=0), 0.02, rtol=0.06)
    assert (drawn[0].size_sd, drawn[0].position_sd, drawn[0].rotation_sd) == (0.05, 0.003, 0.02)
