"""Samples of materials and objects, against one normal distribution of all their densities, conditioned by hand."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.two_tools import STEEL, STICK, WOOD
from scipy.spatial.transform import Rotation

from affordance.belief.density_belief import DensityBelief
from affordance.belief.likelihood import Likelihood
from affordance.belief.material_memory import MaterialMemory
from affordance.belief.object_belief import FeltObject
from affordance.choice.hold_samples import HoldSamples, Suspicion
from affordance.choice.listed_options import list_options
from affordance.settings import DEFAULT_SETTINGS
from affordance.vision.eye import measure_drawing
from affordance.vision.features import VisionError

SD = 150.0
SETTINGS = replace(DEFAULT_SETTINGS, prior=replace(DEFAULT_SETTINGS.prior, deviation_sd=SD))
BRASS = (0.8, 0.6, 0.1)
PARTS = {"stick": measure_drawing(STICK)}  # of wood, then of steel
# Means of both materials before anything was felt, and what was felt of the stick's own densities: they err together.
MEAN, COVARIANCE = np.array([2000.0, 6000.0]), np.array([[400.0**2, 3e4], [3e4, 500.0**2]])
FELT, ERROR = np.array([2300.0, 5500.0]), np.array([[120.0**2, -1.2e4], [-1.2e4, 200.0**2]])


def condition():
    """Mean and covariance of the materials' means and the stick's own densities, (4,) and (4, 4), by Bayes' rule."""
    mean, joint = np.tile(MEAN, 2), np.tile(COVARIANCE, (2, 2))
    joint[2:, 2:] += SD**2 * np.eye(2)
    gain = joint[:, 2:] @ np.linalg.inv(joint[2:, 2:] + ERROR)
    return mean + gain @ (FELT - MEAN), joint - gain @ joint[2:]


def feel(colours):
    """What was felt of an object of these colours, wood and steel among them."""
    precision = np.linalg.inv(ERROR)
    likelihood = Likelihood(precision, precision @ FELT, 0.0)
    order = [(WOOD, STEEL).index(colour) if colour in (WOOD, STEEL) else 0 for colour in colours]
    own = likelihood.select(order)
    return FeltObject(tuple(colours), own, own)


def sample(felt, monkeypatch, *, mean=None, covariance=None, parts=PARTS, count=40_000):
    """Samples without any doubt about odd objects."""
    monkeypatch.setattr(HoldSamples, "_suspect_objects", lambda _: [])
    known, spread = condition()
    belief = DensityBelief.from_moments(
        known[:2] if mean is None else np.array(mean), spread[:2, :2] if covariance is None else covariance
    )
    memory = MaterialMemory((WOOD, STEEL), belief)
    return HoldSamples(memory, parts, felt, SETTINGS, np.random.default_rng(0)).draw(count)


@pytest.mark.parametrize("colours", [(WOOD, STEEL), (STEEL, WOOD)])
def test_own_densities_of_an_object_that_was_felt_scatter_as_bayes_rule_says(colours, monkeypatch):
    """To 3 % of standard deviations, together with the materials' means, in whatever order they were felt."""
    samples = sample({"stick": feel(colours)}, monkeypatch)
    found = np.hstack([samples.mu, samples.draw_own("stick")])
    mean, covariance = condition()
    sds = np.sqrt(np.diag(covariance))
    np.testing.assert_allclose((found.mean(axis=0) - mean) / sds, 0.0, atol=0.03)
    np.testing.assert_allclose((np.cov(found.T) - covariance) / np.outer(sds, sds), 0.0, atol=0.03)


def test_own_densities_of_an_object_that_was_never_felt_scatter_about_its_materials(monkeypatch):
    """By the deviation of objects, independently of the means, of each other and of other objects."""
    samples = sample({}, monkeypatch, parts={"stick": PARTS["stick"], "other": PARTS["stick"]})
    deviations = [samples.draw_own(name) - samples.mu for name in ("stick", "other")]
    found = np.cov(np.hstack([samples.mu, *deviations]).T)
    expected = SD**2 * np.eye(6)
    expected[:2, :2] = condition()[1][:2, :2]
    sds = np.sqrt(np.diag(expected))
    np.testing.assert_allclose((found - expected) / np.outer(sds, sds), 0.0, atol=0.03)


@pytest.mark.parametrize(
    ("colours", "parts", "is_known"),
    [
        ((WOOD, STEEL), (0, 1), True),
        ((WOOD, BRASS), (0, 1), False),
        ((WOOD,), (0, 1), False),
        ((WOOD, STEEL), (0,), False),
        ((WOOD,), (0,), True),
    ],
)
def test_object_of_the_same_name_with_other_colours_is_another(colours, parts, is_known, monkeypatch):
    parts = {"stick": [PARTS["stick"][i] for i in parts]}
    samples = sample({"stick": feel(colours)}, monkeypatch, parts=parts, count=2000)
    assert bool(samples.draw_own("stick")[:, 0].std() < SD) == is_known  # about 120 kg/m^3, or SD and more
    suspicion = Suspicion("another", (0,), samples._belief, 0.0)
    assert samples.list_checks(suspicion) == ([] if is_known else ["stick"])


def test_densities_are_positive_and_the_same_at_every_call(monkeypatch):
    samples = sample({}, monkeypatch, mean=[100.0, 6000.0], covariance=np.diag([10.0**2, 500.0**2]))
    own = samples.draw_own("stick")
    assert own.min() == 0.0
    # P(100 + 10 a + 150 b < 0)
    assert (own[:, 0] == 0.0).mean() == pytest.approx(0.253, abs=0.01)
    assert samples.draw_own("stick") is own
    assert samples.draw_errors("stick") is samples.draw_errors("stick")
    assert not np.array_equal(samples.draw(len(own)).draw_own("stick"), own)


def test_objects_of_a_suspicious_ones_materials_are_concerned_and_unheld_ones_check_it(monkeypatch):
    wood, steel = ([part] for part in PARTS["stick"])
    parts = {"stick": PARTS["stick"], "plank": wood, "rod": steel, "nail": steel}
    samples = sample({"stick": feel((WOOD, STEEL)), "nail": feel((STEEL,))}, monkeypatch, parts=parts, count=10)
    for columns, checks in (((0,), ["plank"]), ((1,), ["rod"]), ((0, 1), ["plank", "rod"])):
        suspicion = Suspicion("stick", columns, samples._belief, 0.0)
        assert samples.list_checks(suspicion) == checks
        assert [samples.concerns(suspicion, [name]) for name in ("plank", "rod")] == [0 in columns, 1 in columns]
        assert samples.concerns(suspicion, ["plank", "rod"])
        assert not samples.concerns(suspicion, [])


def test_geometry_in_a_grip_is_that_of_the_body_moved_there(monkeypatch):
    """First moments are m R^T (p - p_TG), of the body and of the errors of its look."""
    (option, *_) = list_options(STICK, VisionError(size=0.05, position=0.01), seed=3)
    samples = sample({}, monkeypatch, parts={"stick": option.features}, count=10)
    X_TG = np.eye(4)
    X_TG[:3, :3], X_TG[:3, 3] = Rotation.from_rotvec([0.3, -0.5, 0.7]).as_matrix(), [0.1, -0.2, 0.3]
    own, moved = samples.build_geometry("stick"), samples.build_geometry("stick", X_TG)
    assert len(own.Phi_errors) > 1
    for one, other in ((own.Phi, moved.Phi), *zip(own.Phi_errors, moved.Phi_errors, strict=True)):
        np.testing.assert_allclose(other[0], one[0], rtol=1e-12)
        expected = X_TG[:3, :3].T @ (one[1:4] - np.outer(X_TG[:3, 3], one[0]))
        np.testing.assert_allclose(other[1:4], expected, rtol=1e-9, atol=1e-18)
