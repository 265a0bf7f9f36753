"""Samples of materials and objects, against one normal distribution of all their densities, conditioned by hand."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.two_tools import STEEL, STICK, WOOD
from scipy.spatial.transform import Rotation
from scipy.stats import norm

from affordance.belief.density_belief import DensityBelief, Prior
from affordance.belief.felt_object import FeltObject
from affordance.belief.likelihood import Likelihood
from affordance.belief.material_memory import MaterialMemory
from affordance.choice.listed_options import list_options
from affordance.extensions.advice.hold_samples import ODD, HoldSamples, Suspicion
from affordance.settings import DEFAULT_SETTINGS
from affordance.vision.eye import measure_drawing
from affordance.vision.features import VisionError

DEVIATION = 0.05
SETTINGS = replace(DEFAULT_SETTINGS, prior=replace(DEFAULT_SETTINGS.prior, deviation=DEVIATION))
BRASS = (0.8, 0.6, 0.1)
PARTS = {"stick": measure_drawing(STICK)}  # of wood, then of steel
# Means of both materials before anything was felt, and what was felt of the stick's own densities: they err together.
MEAN, COVARIANCE = np.array([2000.0, 6000.0]), np.array([[400.0**2, 3e4], [3e4, 500.0**2]])
FELT, ERROR = np.array([2300.0, 5500.0]), np.array([[120.0**2, -1.2e4], [-1.2e4, 200.0**2]])


def condition():
    """Mean and covariance of the materials' means and the stick's own densities, (4,) and (4, 4), by Bayes' rule."""
    mean, joint = np.tile(MEAN, 2), np.tile(COVARIANCE, (2, 2))
    joint[2:, 2:] += np.diag(DEVIATION * feel((WOOD, STEEL)).own.estimate_densities()) ** 2
    gain = joint[:, 2:] @ np.linalg.inv(joint[2:, 2:] + ERROR)
    return mean + gain @ (FELT - MEAN), joint - gain @ joint[2:]


def feel(colours):
    """Evidence that was felt of an object of these colours, wood and steel among them."""
    precision = np.linalg.inv(ERROR)
    likelihood = Likelihood(precision, precision @ FELT, 0.0)
    order = [(WOOD, STEEL).index(colour) if colour in (WOOD, STEEL) else 0 for colour in colours]
    own = likelihood.select(order)
    return FeltObject(tuple(colours), own, own)


def sample(felt, monkeypatch, *, mean=None, covariance=None, parts=PARTS, count=40_000, settings=SETTINGS):
    """Samples without any doubt about odd objects."""
    monkeypatch.setattr(HoldSamples, "_suspect_objects", lambda _: [])
    known, spread = condition()
    belief = DensityBelief.from_moments(
        known[:2] if mean is None else np.array(mean), spread[:2, :2] if covariance is None else covariance
    )
    memory = MaterialMemory.from_belief((WOOD, STEEL), belief)
    return HoldSamples(memory, parts, felt, settings, np.random.default_rng(0)).draw(count)


@pytest.mark.parametrize("colours", [(WOOD, STEEL), (STEEL, WOOD)])
@pytest.mark.parametrize("step", [1, -1])
def test_own_densities_of_an_object_that_was_felt_scatter_as_bayes_rule_says(colours, step, monkeypatch):
    """To 3 % of standard deviations, together with the means of materials, in any order of parts."""
    samples = sample({"stick": feel(colours)}, monkeypatch, parts={"stick": PARTS["stick"][::step]})
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
    mean, covariance = condition()
    expected = np.diag(np.tile(DEVIATION**2 * (mean[:2] ** 2 + np.diag(covariance)[:2]), 3))
    expected[:2, :2] = covariance[:2, :2]
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
    unknown_sd = np.sqrt(condition()[1][0, 0] + (DEVIATION * condition()[0][0]) ** 2)
    assert bool(samples.draw_own("stick")[:, 0].std() < 0.8 * unknown_sd) == is_known
    suspicion = Suspicion("another", (0,), samples._belief, 0.0)
    assert samples.list_checks(suspicion) == ([] if is_known else ["stick"])


def test_densities_are_positive_and_the_same_at_every_call(monkeypatch):
    prior = replace(SETTINGS.prior, deviation=1.0)
    known = {"mean": [100.0, 6000.0], "covariance": np.diag([10.0**2, 500.0**2])}
    samples = sample({}, monkeypatch, **known, settings=replace(SETTINGS, prior=prior))
    own = samples.draw_own("stick")
    assert own.min() == 0.0
    assert (own[:, 0] == 0.0).mean() == pytest.approx(norm.cdf(-1.0), abs=0.01)  # P(1 + a < 0)
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


# Two planks of which each is felt to 1 kg/m^3, so far apart that one of them may be odd; a prior far from zero.
PLANKS, LIKELY = {"light": 6000.0, "dense": 13000.0}, Prior(mode=9000.0, sd=1000.0, deviation=0.15)


def believe(*densities):
    """Mean and variance of wood after exactly felt planks, from the prior: each errs by a fraction of its density."""
    weights = [(LIKELY.deviation * each) ** -2.0 for each in densities]
    precision = 1.0 / LIKELY.sd**2 + sum(weights)
    return (LIKELY.mode / LIKELY.sd**2 + np.dot(weights, densities)) / precision, 1.0 / precision


def suspect():
    """Samples of wood, of which both planks were felt."""
    felt = {}
    for name, density in PLANKS.items():
        own = Likelihood(np.eye(1), np.array([density]), 0.0)
        shared = np.eye(1) / (LIKELY.deviation * density) ** 2
        felt[name] = FeltObject((WOOD,), own, own._replace(precision=shared, information_vector=shared[0] * density))
    mean, variance = believe(*PLANKS.values())
    memory = MaterialMemory.from_belief((WOOD,), DensityBelief.from_moments(np.array([mean]), np.array([[variance]])))
    parts = dict.fromkeys(PLANKS, PARTS["stick"][:1])
    settings = replace(DEFAULT_SETTINGS, prior=LIKELY)
    return HoldSamples(memory, parts, felt, settings, np.random.default_rng(0))


def weigh():
    """Odds by Bayes' rule that one of the planks is odd: its density as of any material, or given the other plank."""
    odds = []
    for odd, other in (PLANKS.values(), reversed(PLANKS.values())):
        mean, variance = believe(other)
        scatter = LIKELY.deviation * odd
        strange = norm.pdf(odd, LIKELY.mode, np.hypot(LIKELY.sd, scatter))
        odds.append(ODD / (1.0 - ODD) * strange / norm.pdf(odd, mean, np.hypot(np.sqrt(variance), scatter)))
    return odds


def test_an_object_is_odd_by_the_evidence_of_its_own_densities():
    found = suspect().suspicions
    assert [each.weight for each in found] == pytest.approx(weigh(), rel=1e-3)
    for each, other in zip(found, reversed(PLANKS.values()), strict=True):
        mean, variance = believe(other)
        assert (each.belief.untruncated_mean[0], each.belief.covariance[0, 0]) == pytest.approx((mean, variance))


@pytest.mark.parametrize("left_out", [None, 0, 1])
def test_samples_are_of_all_hypotheses_by_their_probability(left_out):
    """None, the light or the dense plank is odd, and then tells nothing of wood; nor does one that is left out."""
    samples = suspect()
    samples.suspicions = [
        each._replace(weight=weight) for each, weight in zip(samples.suspicions, (0.5, 1.0), strict=True)
    ]
    light, dense = PLANKS.values()
    told = {None: ((light, dense), (dense,), (light,)), 0: ((dense,), (dense,), ()), 1: ((light,), (), (light,))}
    moments = [believe(*planks) for planks in told[left_out]]
    shares = np.array([1.0, 0.5, 1.0]) / 2.5
    mean = shares @ [mean for mean, _ in moments]
    variance = shares @ [variance + m**2 for m, variance in moments] - mean**2
    suspicion = None if left_out is None else samples.suspicions[left_out]
    mu = samples.draw(40_000, suspicion).mu[:, 0]
    assert mu.mean() == pytest.approx(mean, abs=0.03 * np.sqrt(variance))
    assert mu.var() == pytest.approx(variance, rel=0.03)
