from dataclasses import replace

import numpy as np
import pytest
from helpers.generated_runs import PAYLOAD, Truth, generate_run
from numpy.testing import assert_allclose

from affordance.identification.evidence.paired_runs import pair_runs
from affordance.identification.posterior import payload_fit
from affordance.identification.posterior.payload_fit import build_channel_prior, fit_payload
from affordance.identification.posterior.solid_prior import SolidPrior
from affordance.identification.settings import DEFAULT_SETTINGS


def test_body_and_noise_settle_in_a_few_rounds_each_as_the_other_says(robot, gains, monkeypatch):
    rng = np.random.default_rng(4)
    runs = [generate_run(robot, pi, truth=Truth(noise_sd=0.1), rng=rng) for pi in (None, PAYLOAD)]
    evidence = pair_runs(robot, *runs, DEFAULT_SETTINGS)
    rounds, improve = [], payload_fit.improve_mode
    monkeypatch.setattr(payload_fit, "improve_mode", lambda *args: rounds.append(args) or improve(*args))
    fit = fit_payload(
        evidence, build_channel_prior(evidence, gains, DEFAULT_SETTINGS), SolidPrior.for_hand(), DEFAULT_SETTINGS
    )
    assert len(rounds) < 25
    errors = evidence.describe_errors(DEFAULT_SETTINGS)
    weights = fit.likelihood.build_residual_weights(fit.mode.load)
    assert_allclose(fit.long_run_variance, errors.estimate_variance(fit.statistics, weights), rtol=1e-3)
    # Two runs of white noise of 0.1 N m that agrees over 0.3 s, at 100 samples a second.
    assert fit.long_run_variance.mean() == pytest.approx(2.0 * 0.1**2 * 30.0, rel=0.4)


@pytest.mark.parametrize("count", [1, 4, 60])
def test_joint_that_hardly_moves_says_little_in_place_of_everything(robot, gains, rng, count):
    """Fewer samples than are fitted to them are explained exactly: an error of zero, which ended in no number."""
    runs = [generate_run(robot, pi, truth=Truth(noise_sd=0.1), rng=rng) for pi in (None, PAYLOAD)]
    evidence = pair_runs(robot, *runs, DEFAULT_SETTINGS)
    used = evidence.samples.used.copy()
    used[:, -1] = np.arange(len(used)) < count
    brief = replace(evidence, samples=evidence.samples._replace(used=used))
    prior = build_channel_prior(evidence, gains, DEFAULT_SETTINGS)
    fit = fit_payload(brief, prior, SolidPrior.for_hand(), DEFAULT_SETTINGS)
    assert fit.long_run_variance[-1] >= (evidence.samples.signal[:count, -1] ** 2).mean()
    assert fit.mode.pi[0] == pytest.approx(PAYLOAD[0], rel=0.05)
