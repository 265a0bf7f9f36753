import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import norm

from affordance.belief import kinds_gate
from affordance.belief.density_belief import Prior
from affordance.belief.holds import Felt
from affordance.belief.kinds import KindPrior, add_kinds, start_kinds
from affordance.belief.kinds_gate import Hypotheses, compute_kind_probabilities, list_hypotheses, weigh
from affordance.belief.learner import Seen, describe_start
from affordance.belief.learners import KINDS_MAP
from affordance.belief.likelihood import Likelihood
from affordance.belief.normals import Normals
from affordance.objects.inertia import NUM_PARAMETERS

PRIOR = Prior(mode=1000.0, sd=4000.0, deviation=0.06)
NEVER = np.zeros(1, dtype=np.intp)  # number of the only thing, of one observer


def find_probabilities(counts, concentration=1.0, switching=1.0, current=None, num_lifts=0):
    """Probabilities of the kinds of a colour for one observer, and last of a new one."""
    lifts = np.zeros((1, len(counts)))
    if current is not None:
        lifts[0, current] = num_lifts
    own = np.array([concentration]), np.array([switching])
    return compute_kind_probabilities(np.array([counts]), *own, lifts)[0]


def test_a_known_object_stays_by_how_long_it_has_been_of_its_kind():
    found = find_probabilities([4, 1], current=0, num_lifts=3)
    np.testing.assert_allclose(found, [(3 + 4 / 6) / 4, (1 / 6) / 4, (1 / 6) / 4])
    alone = find_probabilities([0, 4], current=0, num_lifts=2)
    np.testing.assert_allclose(alone, [2 / 3, (4 / 5) / 3, (1 / 5) / 3])


def test_probabilities_sum_to_one_for_any_settings(rng):
    for _ in range(50):
        counts = rng.integers(0, 6, size=rng.integers(1, 5))
        settings = rng.uniform(0.1, 5.0, 2)
        found = find_probabilities(counts, *settings, current=0, num_lifts=int(rng.integers(1, 9)))
        assert found.sum() == pytest.approx(1.0, abs=1e-14)
        assert find_probabilities(counts, *settings).sum() == pytest.approx(1.0, abs=1e-14)
        assert (found >= 0.0).all()


def build_state(colours, mean, covariance, things):
    """The state of one observer with kinds of colours, and things by the kinds of their colours; the first is new."""
    size = len(things[0])
    state = start_kinds(0, KindPrior(np.array([PRIOR.mode]), np.array([PRIOR.sd])))
    priors = [KindPrior(np.array([PRIOR.mode]), np.array([PRIOR.sd]))] * len(colours)
    state = add_kinds(state, colours, priors, np.ones((1, len(colours)), dtype=bool))
    kinds, lifts = np.zeros((2, 1, len(things), size), dtype=np.intp)
    for number, each in enumerate(things):
        kinds[0, number, : len(each)] = each
        lifts[0, number, : len(each)] = number > 0
    zeros = np.zeros(kinds.shape)
    room = np.zeros((*kinds.shape, size))
    return {
        **describe_start(KINDS_MAP.change(kappa=0.25).parameters, PRIOR, 1),
        **state,
        "mean": np.array([mean], dtype=float),
        "covariance": np.array([covariance], dtype=float),
        "thing_kind": kinds,
        "num_lifts": lifts,
        "probability": zeros,
        "is_own": zeros.astype(bool),
        "own_mean": zeros,
        "own_covariance": room,
    }


def test_hypotheses_are_all_combinations_of_kinds_and_new_ones(rng):
    root = rng.normal(size=(3, 3))
    covariance = 1e4 * (root @ root.T + np.eye(3))
    state = build_state((0, 0, 1), [5000.0, 900.0, 3000.0], covariance, [(0, 2), (0,), (0,), (1,), (2,)])
    state = add_kinds(state, (0, 1), kinds_gate.predict_new(state, (0, 1))[0], np.ones((1, 2), dtype=bool))
    hypotheses = list_hypotheses(state, Seen((0, 1), NEVER))
    assert hypotheses.kinds.tolist() == [[0, 2], [0, 4], [1, 2], [1, 4], [3, 2], [3, 4]]
    expected = np.outer([2 / 4, 1 / 4, 1 / 4], [1 / 2, 1 / 2]).ravel()
    np.testing.assert_allclose(hypotheses.probability, expected)
    assert [tuple(np.flatnonzero(each)) for each in hypotheses.founded] == [(), (1,), (), (1,), (0,), (0, 1)]


def test_breadth_of_a_category_is_in_proportion_to_what_its_kind_weighs():
    state = build_state((0, 0), [4000.0, -20.0], np.diag([1e4, 1e4]), [(0,), (0,), (1,)])
    state = add_kinds(state, (0,), kinds_gate.predict_new(state, (0,))[0], np.ones((1, 1), dtype=bool))
    found = list_hypotheses(state, Seen((0,), NEVER)).densities.covariance[:2, 0, 0]
    np.testing.assert_allclose(found, [1e4 + 1000.0**2, 1e4 + 2.5**2])  # no kind is lighter than foam


def weigh_hypotheses(monkeypatch, probability, moments, felt):
    """Verdicts on hypotheses of one observer, by their probabilities before, and moments of one density each."""
    N = len(moments)
    mean, sd = np.array(moments).T
    densities = Normals(mean[:, None], sd[:, None, None] ** 2)
    no = np.zeros((N, 1), dtype=bool)
    kinds = np.arange(N)[:, None]
    given = Hypotheses(np.zeros(N, dtype=np.intp), kinds, np.array(probability), densities, no)
    monkeypatch.setattr(kinds_gate, "list_hypotheses", lambda state, seen: given)
    state = build_state((0,), [1500.0], np.eye(1), [(0,)])
    return weigh(state, Seen((0,), NEVER), felt)


@pytest.mark.parametrize(("mean", "sd"), [(1000.0, 4000.0), (1500.0, 390.0), (2500.0, 60.0)])
def test_evidence_is_the_integral_of_likelihood_times_belief(mean, sd, monkeypatch):
    r, y, s = np.array([2e-3, 1e-3]), np.array([3.2, 1.7]), 0.3
    likelihood = Likelihood(
        np.array([[r @ r]]) / s**2, np.array([r @ y]) / s**2, -0.5 * y @ y / s**2 - np.log(2.0 * np.pi * s**2)
    )
    verdicts = weigh_hypotheses(monkeypatch, [1.0], [(mean, sd)], Felt.from_quadratic(likelihood))

    def integrand(rho):
        return norm.pdf(y[0], r[0] * rho, s) * norm.pdf(y[1], r[1] * rho, s) * norm.pdf(rho, mean, sd)

    exact, _ = quad(integrand, mean - 9 * sd, mean + 9 * sd, points=[1600.0], limit=500, epsrel=1e-11)
    assert verdicts.log_evidence == pytest.approx(np.log(exact), abs=1e-8)
    assert verdicts.probability == 1.0


@pytest.mark.parametrize("true", [1500.0, 2000.0, 2500.0, 700.0])
def test_errors_that_grow_with_torque_hardly_change_what_is_judged(true, hold, monkeypatch):
    """Log odds by Laplace's method under each hypothesis agree to 0.1 with quadrature over densities."""
    Phi = np.zeros((NUM_PARAMETERS, 1))
    Phi[0] = 600e-6  # the test object of Linear+
    regressor = (hold.Y @ Phi)[:, 0]
    moments = [(1500.0, np.hypot(375.0, 30.0)), (1000.0, 4000.0)]
    for seed in range(4):
        rng = np.random.default_rng([seed, 5])
        tau = hold.tau_arm + regressor * true
        felt = tau + np.hypot(0.097, 0.07 * tau) * rng.standard_normal(7)
        evidence = Felt.from_torques(felt[None], hold.tau_arm, regressor[None, :, None], (0.097, 0.07))
        verdicts = weigh_hypotheses(monkeypatch, [0.8, 0.2], moments, evidence)
        rho = np.linspace(-3000.0, 8000.0, 22001)[:, None]
        predicted = hold.tau_arm + regressor * rho
        log_likelihood = norm.logpdf(felt, predicted, np.hypot(0.097, 0.07 * predicted)).sum(axis=1)
        weights = [
            prior * (np.exp(log_likelihood) * norm.pdf(rho[:, 0], *each)).sum()
            for prior, each in zip((0.8, 0.2), moments, strict=True)
        ]
        exact = weights[1] / sum(weights)
        odds = np.log(verdicts.probability[1] / verdicts.probability[0]) - np.log(exact / (1.0 - exact))
        assert abs(odds) < 0.1, (seed, odds)
