"""Samples of materials and objects, against one normal distribution of all their densities, conditioned by hand."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.two_tools import STEEL, STICK, WOOD
from scipy.spatial.transform import Rotation
from scipy.stats import norm

from affordance.belief.density_belief import DensityBelief, Prior
from affordance.belief.holds import Felt
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
BELIEF = DensityBelief.from_moments(MEAN, COVARIANCE)


def draw_model(count=400_000):
    """Draws both materials' means and the stick's own densities, (S, 4), before anything was felt."""
    rng = np.random.default_rng(0)
    mu = rng.multivariate_normal(MEAN, COVARIANCE, count)
    return np.hstack([mu, mu * (1.0 + DEVIATION * rng.standard_normal(mu.shape))])


def condition():
    """Mean and covariance of the materials' means and the stick's own densities, (4,) and (4, 4), by Bayes' rule."""
    drawn = draw_model()
    miss = drawn[:, 2:] - FELT
    weights = np.exp(-0.5 * (miss * np.linalg.solve(ERROR, miss.T).T).sum(axis=1))
    mean = np.average(drawn, axis=0, weights=weights)
    return mean, np.cov(drawn.T, aweights=weights)


def feel(memory, parts, densities, error, prior=SETTINGS.prior):
    """The memory that has felt an object of these parts: its densities in their order, with normal errors."""
    precision = np.linalg.inv(np.atleast_2d(error))
    likelihood = Likelihood(precision, precision @ np.atleast_1d(densities), 0.0)
    recollection = memory.recall([part.appearance for part in parts], prior)
    return recollection.memory.learn(Felt.from_quadratic(likelihood), prior.deviation).memory


def scale(parts, factor):
    """Parts of another size."""
    return [replace(part, shape=part.shape.with_sizes(factor * part.shape.sizes)) for part in parts]


def sample(memory, monkeypatch, *, parts=PARTS, count=40_000, settings=SETTINGS):
    """Samples without any doubt about odd objects."""
    monkeypatch.setattr(HoldSamples, "_suspect_objects", lambda *_: [])
    return HoldSamples(memory, parts, settings, np.random.default_rng(0)).draw(count)


@pytest.mark.parametrize("felt_step", [1, -1])
@pytest.mark.parametrize("step", [1, -1])
def test_own_densities_of_an_object_that_was_felt_scatter_as_bayes_rule_says(felt_step, step, monkeypatch):
    """To 3 % of standard deviations, together with the means of materials, in any order of parts."""
    memory = MaterialMemory.from_belief((WOOD, STEEL), BELIEF)
    memory = feel(memory, PARTS["stick"][::felt_step], FELT[::felt_step], ERROR[::felt_step, ::felt_step])
    samples = sample(memory, monkeypatch, parts={"stick": PARTS["stick"][::step]})
    found = np.hstack([samples.mu, samples.draw_own("stick")])
    mean, covariance = condition()
    sds = np.sqrt(np.diag(covariance))
    np.testing.assert_allclose((found.mean(axis=0) - mean) / sds, 0.0, atol=0.03)
    np.testing.assert_allclose((np.cov(found.T) - covariance) / np.outer(sds, sds), 0.0, atol=0.03)


def test_own_densities_of_an_object_that_was_never_felt_scatter_about_its_materials(monkeypatch):
    """By the deviation of objects, independently of the means, of each other and of other objects."""
    parts = {"stick": PARTS["stick"], "other": PARTS["stick"]}
    samples = sample(MaterialMemory.from_belief((WOOD, STEEL), BELIEF), monkeypatch, parts=parts)
    deviations = [samples.draw_own(name) - samples.mu for name in ("stick", "other")]
    found = np.cov(np.hstack([samples.mu, *deviations]).T)
    expected = np.diag(np.tile(DEVIATION**2 * (MEAN**2 + np.diag(COVARIANCE)), 3))
    expected[:2, :2] = COVARIANCE
    sds = np.sqrt(np.diag(expected))
    np.testing.assert_allclose((found - expected) / np.outer(sds, sds), 0.0, atol=0.03)


@pytest.mark.parametrize(
    ("places", "factor", "is_known"), [((0, 1), 1.0, True), ((0, 1), 1.2, False), ((0,), 1.0, False)]
)
def test_object_that_looks_different_is_another(places, factor, is_known, monkeypatch):
    memory = feel(MaterialMemory.from_belief((WOOD, STEEL), BELIEF), PARTS["stick"], FELT, ERROR)
    parts = {"stick": scale([PARTS["stick"][i] for i in places], factor)}
    samples = sample(memory, monkeypatch, parts=parts, count=2000)
    unknown_sd = np.sqrt(memory.belief.covariance[0, 0] + (DEVIATION * memory.belief.untruncated_mean[0]) ** 2)
    assert bool(samples.draw_own("stick")[:, 0].std() < 0.8 * unknown_sd) == is_known
    suspicion = Suspicion("another", (0,), samples._belief, 0.0, 0)
    assert samples.list_checks(suspicion) == ([] if is_known else ["stick"])


def test_densities_are_positive_and_the_same_at_every_call(monkeypatch):
    prior = replace(SETTINGS.prior, deviation=1.0)
    known = DensityBelief.from_moments(np.array([100.0, 6000.0]), np.diag([10.0**2, 500.0**2]))
    memory = MaterialMemory.from_belief((WOOD, STEEL), known)
    samples = sample(memory, monkeypatch, settings=replace(SETTINGS, prior=prior))
    own = samples.draw_own("stick")
    assert own.min() == 0.0
    assert (own[:, 0] == 0.0).mean() == pytest.approx(norm.cdf(-1.0), abs=0.01)  # P(1 + a < 0)
    assert samples.draw_own("stick") is own
    assert samples.draw_errors("stick") is samples.draw_errors("stick")
    assert not np.array_equal(samples.draw(len(own)).draw_own("stick"), own)


def test_objects_of_a_suspicious_ones_materials_are_concerned_and_unheld_ones_check_it(monkeypatch):
    wood, steel = ([part] for part in PARTS["stick"])
    parts = {"stick": PARTS["stick"], "plank": wood, "rod": steel, "nail": scale(steel, 0.5)}
    memory = feel(MaterialMemory.from_belief((WOOD, STEEL), BELIEF), PARTS["stick"], FELT, ERROR)
    samples = sample(feel(memory, parts["nail"], 6000.0, 200.0**2), monkeypatch, parts=parts, count=10)
    for columns, checks in (((0,), ["plank"]), ((1,), ["rod"]), ((0, 1), ["plank", "rod"])):
        suspicion = Suspicion("stick", columns, samples._belief, 0.0, 0)
        assert samples.list_checks(suspicion) == checks
        assert [samples.concerns(suspicion, [name]) for name in ("plank", "rod")] == [0 in columns, 1 in columns]
        assert samples.concerns(suspicion, ["plank", "rod"])
        assert not samples.concerns(suspicion, [])


def test_geometry_in_a_grip_is_that_of_the_body_moved_there(monkeypatch):
    """First moments are m R^T (p - p_TG), of the body and of the errors of its look."""
    (option, *_) = list_options(STICK, VisionError(size=0.05, position=0.01), seed=3)
    memory = MaterialMemory.from_belief((WOOD, STEEL), BELIEF)
    samples = sample(memory, monkeypatch, parts={"stick": option.features}, count=10)
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


MU = np.linspace(10.0, 25_000.0, 20_000)


def integrate(*densities):
    """Unnormalised probability of wood's mean on a grid after exactly felt planks: each errs by a fraction of it."""
    p = norm.pdf(MU, LIKELY.mode, LIKELY.sd)
    for each in densities:
        p *= norm.pdf(each, MU, LIKELY.deviation * MU)
    return p * (MU[1] - MU[0])


def believe(*densities):
    """Mean and variance of wood after exactly felt planks."""
    p = integrate(*densities) / integrate(*densities).sum()
    mean = p @ MU
    return mean, p @ (MU - mean) ** 2


def suspect():
    """Samples of wood, of which both planks were felt."""
    settings, memory = replace(DEFAULT_SETTINGS, prior=LIKELY), MaterialMemory()
    parts = {name: scale(PARTS["stick"][:1], 1.0 + 0.3 * n) for n, name in enumerate(PLANKS)}
    for name, density in PLANKS.items():
        memory = feel(memory, parts[name], density, 1.0, LIKELY)
    return HoldSamples(memory, parts, settings, np.random.default_rng(0))


def weigh():
    """Odds by Bayes' rule that one of the planks is odd: it and the other apart, against both of one material."""
    alone = [integrate(each).sum() for each in PLANKS.values()]
    return ODD / (1.0 - ODD) * np.prod(alone) / integrate(*PLANKS.values()).sum()


def test_an_object_is_odd_by_the_evidence_of_its_own_densities():
    """Which of two objects that differ is odd cannot be told; Laplace's method gives the odds to 2 %."""
    found = suspect().suspicions
    assert [each.weight for each in found] == pytest.approx([weigh()] * 2, rel=0.02)
    for each, other in zip(found, reversed(PLANKS.values()), strict=True):
        mean, variance = believe(other)
        sd = np.sqrt(each.belief.covariance[0, 0])
        assert (each.belief.untruncated_mean[0], sd) == pytest.approx((mean, np.sqrt(variance)), rel=0.02)


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
