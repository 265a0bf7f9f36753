from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import norm

from affordance.belief.density_belief import DensityBelief, Prior
from affordance.belief.kinds import KindPrior, Kinds, KnownObject, Membership
from affordance.belief.kinds_gate import (
    GateSettings,
    Hypothesis,
    compute_kind_probabilities,
    list_hypotheses,
    weigh,
)
from affordance.belief.likelihood import Likelihood
from affordance.objects.inertia import NUM_PARAMETERS
from affordance.proprioception.static_hold import StaticPercept
from affordance.proprioception.torque_noise import WeberNoise

PRIOR = Prior(mode=1000.0, sd=4000.0, deviation_sd=100.0)
SETTINGS = GateSettings(kappa=0.25)
FIRST = KindPrior(PRIOR.mode, PRIOR.sd)


def test_a_known_object_stays_by_how_long_it_has_been_of_its_kind():
    found = compute_kind_probabilities(np.array([4, 1]), SETTINGS, current=0, num_lifts=3)
    np.testing.assert_allclose(found, [(3 + 4 / 6) / 4, (1 / 6) / 4, (1 / 6) / 4])
    alone = compute_kind_probabilities(np.array([0, 4]), SETTINGS, current=0, num_lifts=2)
    np.testing.assert_allclose(alone, [2 / 3, (4 / 5) / 3, (1 / 5) / 3])


def test_probabilities_sum_to_one_for_any_settings(rng):
    for _ in range(50):
        counts = rng.integers(0, 6, size=rng.integers(1, 5))
        settings = GateSettings(0.25, *rng.uniform(0.1, 5.0, 2))
        found = compute_kind_probabilities(counts, settings, current=0, num_lifts=int(rng.integers(1, 9)))
        assert found.sum() == pytest.approx(1.0, abs=1e-14)
        assert compute_kind_probabilities(counts, settings).sum() == pytest.approx(1.0, abs=1e-14)
        assert (found >= 0.0).all()


def build_kinds(rng):
    """Two kinds of colour 0, one of colour 1, and one more of each that is new."""
    root = rng.normal(size=(3, 3))
    belief = DensityBelief.from_moments([5000.0, 900.0, 3000.0], 1e4 * (root @ root.T + np.eye(3)))
    kinds = Kinds((0, 0, 1), belief, (), (FIRST,) * 3)
    return kinds.add((0, 1), [KindPrior(5000.0, 10_000.0), KindPrior(3000.0, 6000.0)])


def test_hypotheses_are_all_combinations_of_kinds_and_new_ones(rng):
    kinds = build_kinds(rng)
    known = KnownObject((), (0, 1), (Membership(0, 0, 1.0), Membership(2, 0, 1.0)))
    others = tuple(KnownObject((), (0,), (Membership(kind, 1, 1.0),)) for kind in (0, 0, 1))
    others += (KnownObject((), (1,), (Membership(2, 1, 1.0),)),)
    kinds = replace(kinds, objects=others)
    hypotheses = list_hypotheses(kinds, known, None, SETTINGS)
    assert [hypothesis.kinds for hypothesis in hypotheses] == [(0, 2), (0, 4), (1, 2), (1, 4), (3, 2), (3, 4)]
    expected = np.outer([2 / 4, 1 / 4, 1 / 4], [1 / 2, 1 / 2]).ravel()
    np.testing.assert_allclose([hypothesis.probability for hypothesis in hypotheses], expected)
    assert [hypothesis.founded for hypothesis in hypotheses] == [(), (1,), (), (1,), (0,), (0, 1)]


def test_breadth_of_a_category_is_in_proportion_to_what_its_kind_weighs():
    kinds = Kinds((0, 0), DensityBelief.from_moments([4000.0, -20.0], np.diag([1e4, 1e4])))
    np.testing.assert_allclose(kinds.compute_category_sd(0.25), [1000.0, 2.5])  # no kind is lighter than foam


@pytest.mark.parametrize(("mean", "sd"), [(1000.0, 4000.0), (1500.0, 390.0), (2500.0, 60.0)])
def test_evidence_is_the_integral_of_likelihood_times_belief(mean, sd):
    belief = DensityBelief.from_moments([mean], [[sd**2]])
    r, y, s = np.array([2e-3, 1e-3]), np.array([3.2, 1.7]), 0.3
    likelihood = Likelihood(
        np.array([[r @ r]]) / s**2, np.array([r @ y]) / s**2, -0.5 * y @ y / s**2 - np.log(2.0 * np.pi * s**2)
    )
    (verdict,) = weigh([Hypothesis((0,), 1.0, belief)], lambda _: likelihood, SETTINGS)

    def integrand(rho):
        return norm.pdf(y[0], r[0] * rho, s) * norm.pdf(y[1], r[1] * rho, s) * norm.pdf(rho, mean, sd)

    exact, _ = quad(integrand, mean - 9 * sd, mean + 9 * sd, points=[1600.0], limit=500, epsrel=1e-11)
    assert verdict.log_evidence == pytest.approx(np.log(exact), abs=1e-8)
    assert verdict.probability == 1.0


@pytest.mark.parametrize("true", [1500.0, 2000.0, 2500.0, 700.0])
def test_errors_that_grow_with_torque_hardly_change_what_is_judged(true, hold):
    """Log odds with errors sized at each hypothesis's posterior mean agree to 0.1 with quadrature over densities."""
    noise = WeberNoise(0.07, 0.097)
    Phi = np.zeros((NUM_PARAMETERS, 1))
    Phi[0] = 600e-6  # the test object of Linear+
    regressor = (hold.Y @ Phi)[:, 0]
    member = DensityBelief.from_moments([1500.0], [[(0.25 * 1500.0) ** 2 + 30.0**2]])
    new = DensityBelief.from_moments([1000.0], [[4000.0**2]])
    for seed in range(4):
        rng = np.random.default_rng([seed, 5])
        tau = hold.tau_arm + regressor * true
        felt = tau + np.hypot(0.097, 0.07 * tau) * rng.standard_normal(7)
        percept = StaticPercept(hold.tau_arm, regressor[:, None], felt - hold.tau_arm, noise)
        verdicts = weigh(
            [Hypothesis((0,), 0.8, member), Hypothesis((1,), 0.2, new)], percept.find_likelihood, SETTINGS
        )
        rho = np.linspace(-3000.0, 8000.0, 22001)[:, None]
        predicted = hold.tau_arm + regressor * rho
        log_likelihood = norm.logpdf(felt, predicted, np.hypot(0.097, 0.07 * predicted)).sum(axis=1)
        weights = [
            prior * (np.exp(log_likelihood) * norm.pdf(rho[:, 0], *moments)).sum()
            for prior, moments in ((0.8, (1500.0, np.hypot(375.0, 30.0))), (0.2, (1000.0, 4000.0)))
        ]
        exact = weights[1] / sum(weights)
        odds = np.log(verdicts[1].probability / verdicts[0].probability) - np.log(exact / (1.0 - exact))
        assert abs(odds) < 0.1, (seed, odds)
