"""A small version of the study of calibration, and proof that it detects wrong sizes of errors."""

import dataclasses

import numpy as np
import pytest
from helpers.refusals import refuse
from helpers.stacked import stack
from scipy.stats import binom, chi2, norm

from affordance.belief.material_memory import MaterialMemory
from affordance.proprioception.estimator import compute_posterior, condition_on_torques
from affordance.proprioception.torque_noise import WeberNoise, WhiteNoise
from affordance.settings import DEFAULT_SETTINGS
from affordance.vision.eye import measure_features
from affordance.vision.features import VisionError
from affordance.vision.prediction import predict_object
from studies.calibration import calibration
from studies.calibration.calibration import (
    COVERAGES,
    WHITE,
    assess,
    build_config,
    draw_truth,
    find_positions,
    run_draw,
)
from studies.calibration.cramer_rao import compute_bound, feel_at_rest

NUM_DRAWS = 400


def run_draws(config, draws=NUM_DRAWS):
    return stack([run_draw(config, number) for number in range(draws)])


@pytest.fixture(scope="module")
def at_rest():
    config = build_config(DEFAULT_SETTINGS.noise, moves=False)
    return config, run_draws(config)


def test_truths_lie_uniformly_in_posteriors_of_what_is_felt_at_rest(at_rest):
    _, arrays = at_rest
    found = assess(find_positions(arrays))
    assert found.p_value > 0.001
    for said, share in zip(COVERAGES, found.coverage, strict=True):
        # Ranks of the two densities of a draw go together: as if there were but one of them.
        low, high = binom.ppf([0.0005, 0.9995], NUM_DRAWS, said) / NUM_DRAWS
        assert low <= share <= high


@dataclasses.dataclass(frozen=True)
class Overconfident(WeberNoise):
    """Weber noise whose likelihood takes errors for half of their size."""

    def describe(self, *arguments):
        return WeberNoise(0.5 * self.weber_fraction, 0.5 * self.threshold).describe(*arguments)


@dataclasses.dataclass(frozen=True)
class OverconfidentWhite(WhiteNoise):
    """White noise whose likelihood takes errors for half of their size."""

    def describe(self, *arguments):
        return WhiteNoise(0.5 * self.sd).describe(*arguments)


def find_positions_of_what_was_felt(config, draws):
    """Positions of truths in their posteriors, (draws,), along the direction of which a trial says the most.

    Each density alone is nearly as uncertain as before, since it is their sum that loads the joints: errors of half
    the size would hardly be seen in it. Positions are uniform along any direction that follows from the posterior.
    """
    found = []
    for number in range(draws):
        mean, own = draw_truth(config, number)
        belief = calibration.learn(config, own, number).belief
        _, directions = np.linalg.eigh(belief.covariance)
        samples = belief.draw_samples(np.random.default_rng([number, 8]), 999)
        found.append(((samples - mean) @ directions[:, 0] < 0.0).mean())
    return (999 * np.array(found) + 0.5) / 1000


def is_calibrated(positions):
    """Judges positions, (N,), by their normal scores, whose squares have a sum that is distributed as chi-squared.

    A share of covered truths says little with few draws: half of the time it would let halved errors pass.
    """
    low, high = chi2.ppf([0.0005, 0.9995], len(positions))
    return bool(low <= (norm.ppf(positions) ** 2).sum() <= high)


@pytest.mark.parametrize(
    ("noise", "calibrated"),
    [
        pytest.param(DEFAULT_SETTINGS.noise, True, id="weber"),
        pytest.param(WHITE, True, id="white"),
        pytest.param(Overconfident(0.07, 0.097), False, id="weber with errors halved"),
        pytest.param(OverconfidentWhite(WHITE.sd), False, id="white with errors halved"),
    ],
)
def test_loop_in_drake_is_calibrated(noise, calibrated, monkeypatch):
    """The loop in Drake is calibrated, and an estimator that takes its errors for half of their size is not."""
    monkeypatch.setattr(calibration, "DURATION", 0.5)
    positions = find_positions_of_what_was_felt(build_config(noise, moves=True), 30)
    assert is_calibrated(positions) is calibrated


def test_overconfidence_is_noticed(at_rest):
    config, _ = at_rest
    noise = Overconfident(**dataclasses.asdict(config.settings.noise))
    sure = dataclasses.replace(config, settings=dataclasses.replace(config.settings, noise=noise))
    draws = NUM_DRAWS // 2
    found = assess(find_positions(run_draws(sure, draws)))
    assert found.p_value < 1e-4
    assert found.coverage[2] < binom.ppf(0.0005, draws, 0.9) / draws


def test_positivity_ignored_is_noticed(at_rest):
    _, arrays = at_rest
    assert assess(calibration.find_unrestricted_positions(arrays)).p_value < 1e-3


def test_exact_bayes_agrees_with_the_estimator(at_rest):
    config, arrays = at_rest
    exact = calibration.find_exact_positions(config, 30)
    difference = np.abs(exact - find_positions(arrays)[:30])
    # The grid is of the object's densities, ranks of its materials'; and the plug-in moves both.
    assert np.median(difference) < 0.03
    assert difference.max() < 0.3


def measure(config):
    """The stick at rest: its percept and its geometry."""
    hold = calibration.get_hold(config.settings.arm)
    features = measure_features(config.tool, VisionError(), np.random.default_rng(0))
    belief = predict_object(features, MaterialMemory(), config.settings.prior)
    return hold, belief


def without_scatter(config):
    """Objects as good as without a deviation, whose size a posterior knows only as well as what was felt."""
    prior = dataclasses.replace(config.settings.prior, deviation=1e-9)
    return dataclasses.replace(config, settings=dataclasses.replace(config.settings, prior=prior))


def test_bound_is_the_posteriors_variance_where_errors_do_not_depend_on_densities():
    arrays = run_draws(without_scatter(build_config(WeberNoise(0.0, 0.5), moves=False)), 3)
    np.testing.assert_allclose(arrays["bound"], arrays["variance"], rtol=1e-9)


@pytest.mark.parametrize("noise", [WeberNoise(0.0, 0.5), WhiteNoise(2.0)])
def test_bound_is_the_posteriors_variance_at_the_objects_most_probable_densities(noise):
    """To 2 %, a bound that was chosen after .6 % had been seen: the posterior is not quite normal."""
    config = build_config(noise, moves=False)
    prior, (hold, belief) = config.settings.prior, measure(config)
    statistics = hold.measure(belief, draw_truth(config, 0)[1], noise, (0,))
    posterior, _ = condition_on_torques(belief, statistics, 7, noise, prior.deviation)
    felt = feel_at_rest(hold.tau_arm, hold.Y, statistics.num_samples)
    bound = compute_bound(felt, belief.geometry.Phi, posterior.densities.untruncated_mean, noise, prior)
    np.testing.assert_allclose(bound, np.diag(posterior.memory.belief.covariance), rtol=0.02)


def test_bound_is_the_posteriors_variance_where_every_sample_has_its_own_error():
    config = without_scatter(build_config(WhiteNoise(2.0), moves=False))
    noise, prior = config.settings.noise, config.settings.prior
    hold, belief = measure(config)
    _, own = draw_truth(config, 0)
    statistics = hold.measure(belief, own, noise, (0,))._replace(num_samples=30)
    posterior = compute_posterior(belief, statistics, 7, noise, prior.deviation).posterior.memory.belief
    bound = compute_bound(feel_at_rest(hold.tau_arm, hold.Y, 30), belief.geometry.Phi, own, noise, prior)
    np.testing.assert_allclose(bound, np.diag(posterior.covariance), rtol=1e-9)


@pytest.mark.parametrize("noise", [WeberNoise(0.0, 0.5), WHITE])
def test_bound_follows_the_arm_as_it_moved(noise, monkeypatch):
    """The bound from the log alone, without the part from the size of errors, is the loop's variance to 1 %."""
    monkeypatch.setattr(calibration, "DURATION", 1.0)
    arrays = run_draws(without_scatter(build_config(noise, moves=True)), 4)
    np.testing.assert_allclose(arrays["bound"], arrays["variance"], rtol=1e-2)
    still = run_draws(without_scatter(build_config(noise, moves=False)), 4)
    assert np.abs(arrays["bound"] / still["bound"] - 1.0).max() > 0.02


def test_bound_counts_what_the_size_of_errors_tells():
    """The bound agrees to 2 % with the Fisher information by simulation, the variance of the score at the truth."""
    config = build_config(DEFAULT_SETTINGS.noise, moves=False)
    noise, prior = config.settings.noise, config.settings.prior
    hold, belief = measure(config)
    own, H = np.array([600.0, 900.0]), hold.Y @ belief.geometry.Phi
    tau = np.random.default_rng(1).normal(
        hold.tau_arm + H @ own, noise.compute_sd(hold.tau_arm + H @ own), (200_000, 7)
    )

    def compute_log_likelihood(rho):
        predicted = hold.tau_arm + H @ rho
        return norm.logpdf(tau, predicted, noise.compute_sd(predicted)).sum(axis=1)

    steps = 0.5 * np.eye(2)
    scores = np.array([compute_log_likelihood(own + step) - compute_log_likelihood(own - step) for step in steps])
    of_materials = np.linalg.inv(np.linalg.inv(np.cov(scores)) + np.diag(prior.deviation * own) ** 2)
    expected = np.diag(np.linalg.inv(of_materials + np.eye(2) / prior.sd**2))
    bound = compute_bound(feel_at_rest(hold.tau_arm, hold.Y, 1), belief.geometry.Phi, own, noise, prior)
    np.testing.assert_allclose(bound, expected, rtol=0.02)


def test_grid_is_for_weber_noise_only():
    config = build_config(WhiteNoise(1.0), moves=False)
    assert "must be a WeberNoise" in refuse(calibration.find_exact_positions, config, 1, error=ValueError)


def test_truths_are_of_the_prior_restricted_to_positive_densities():
    config = build_config(DEFAULT_SETTINGS.noise, moves=False)
    truths = np.array([draw_truth(config, number) for number in range(500)])
    assert (truths > 0.0).all()
    # A normal distribution of mode 1000 and SD 4000, cut off at zero: its mean by numerical integration.
    rho = np.linspace(0.0, 40_000.0, 200_001)
    weights = np.exp(-0.5 * ((rho - 1000.0) / 4000.0) ** 2)
    mean = (weights @ rho) / weights.sum()
    sd = np.sqrt(weights @ (rho - mean) ** 2 / weights.sum())
    assert truths[:, 0].mean() == pytest.approx(mean, abs=4.5 * sd / np.sqrt(1000))
    assert (truths[:, 1] / truths[:, 0] - 1.0).std() == pytest.approx(config.settings.prior.deviation, rel=0.1)
