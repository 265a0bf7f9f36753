"""Worth of a hold against closed forms and quadratures, and holds without any worth."""

import numpy as np
import pytest
from scipy.stats import norm

from affordance.extensions.advice.hold_worth import (
    Decision,
    Outlook,
    PossibleHold,
    PricedDecisions,
    compute_information,
    compute_worth,
    feel,
)
from affordance.objects.inertia import Geometry
from affordance.plant.arm import ARM
from affordance.plant.load import load_arm
from affordance.proprioception.static_hold import StaticHold
from affordance.proprioception.torque_noise import WeberNoise

S = 8000


@pytest.fixture
def rng():
    return np.random.default_rng(2)


def decide(*costs, feasible=None):
    cost = np.array(costs)
    names = tuple(f"option {i}" for i in range(len(cost)))
    feasible = np.ones(cost.shape, dtype=bool) if feasible is None else feasible
    return Decision("task", names, cost, feasible, ((),) * len(names), ("",) * len(names))


def worth_of(percepts, decisions):
    return compute_worth(percepts, PricedDecisions(decisions))


@pytest.mark.parametrize(("mean", "noise"), [(0.0, 1.0), (0.7, 0.5), (-1.5, 0.3), (0.2, 5.0)])
def test_two_options_with_a_linear_difference_have_the_closed_form(rng, mean, noise):
    d = mean + rng.standard_normal(S)
    percept = d + noise * rng.standard_normal(S)
    s = 1.0 / np.sqrt(1.0 + noise**2)  # SD of the posterior mean of d
    expected = s * norm.pdf(mean / s) - abs(mean) * norm.cdf(-abs(mean) / s)
    worth = worth_of([percept[:, None]], [decide(d, np.zeros(S))])
    assert worth.worths[0] == pytest.approx(expected, abs=max(0.02, 3.0 * worth.se))


def test_cost_that_is_not_linear_is_priced_as_by_quadrature(rng):
    """The worth for a cost that is the square of the felt quantity agrees with quadrature of its normal posterior."""
    d = rng.standard_normal(S)
    percept = d + 0.5 * rng.standard_normal(S)
    worth = worth_of([percept[:, None]], [decide(d**2, np.full(S, 0.8))])
    share, variance = 1.0 / 1.25, 0.2
    y = np.sqrt(1.25) * np.linspace(-6.0, 6.0, 4001)
    density = norm.pdf(y, scale=np.sqrt(1.25))
    density /= density.sum()
    expected = 0.8 - float(density @ np.minimum((share * y) ** 2 + variance, 0.8))
    assert worth.worths[0] == pytest.approx(expected, abs=max(0.02, 3.0 * worth.se))


def test_what_tells_nothing_is_worth_nothing_even_at_ties(rng):
    cost = rng.standard_normal((6, S))
    worth = worth_of([rng.standard_normal((S, 2))], [decide(*(5.0 + cost))])
    assert worth.worths[0] <= 0.05 + 3.0 * worth.se
    assert worth_of([np.zeros((S, 0))], [decide(*cost)]).worths[0] == pytest.approx(0.0, abs=1e-9)


def test_worth_of_what_tells_nothing_is_never_negative(rng):
    decision = decide(*(5.0 + rng.standard_normal((3, 400))))
    found = [worth_of([rng.standard_normal((400, 1))], [decision]) for _ in range(10)]
    assert min(each.worths[0] for each in found) == 0.0


def test_worth_of_several_decisions_is_their_sum(rng):
    a, b = rng.standard_normal((2, S))
    decisions = [decide(2.0 * a, np.zeros(S)), decide(5.0 * b, np.zeros(S))]
    worth = worth_of([np.stack([a, b], axis=1)], decisions)
    # E max(0, a) of a standard normal variable
    assert worth.total == pytest.approx(7.0 / np.sqrt(2.0 * np.pi), rel=0.05)
    outlook = Outlook({"a": a[:, None], "b": b[:, None]}, PricedDecisions(decisions))
    assert outlook.find_best_pair(["a", "b"]) == (("a", "b"), worth.total)


@pytest.mark.parametrize("names", [["a"], ["a", "b"]])
def test_without_two_objects_that_tell_something_there_is_no_pair(rng, names):
    felt = {name: rng.standard_normal((S, 1)) for name in names}
    outlook = Outlook(felt, PricedDecisions([decide(np.ones(S), np.full(S, 2.0))]))
    assert outlook.find_best_pair(names) == (None, 0.0)


def test_options_that_cost_the_same_share_being_the_best():
    """Of three samples the first has one best option, the second two, and the third none that is feasible."""
    cost = np.array([[1.0, 2.0, 1.0], [2.0, 2.0 + 1e-12, 1.0], [3.0, 2.1, 1.0]])
    feasible = np.array([[True, True, False]] * 3)
    marked = decide(*cost, feasible=feasible).mark_best()
    assert marked.tolist() == [[1.0, 0.5, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 0.0]]


def test_a_pair_may_be_worth_what_neither_is_alone(rng):
    """Two percepts are worth over 0.15 together and under 0.05 each, if the cost is the product of their signs."""
    a, b = rng.standard_normal((2, S))
    decision = decide(np.sign(a) * np.sign(b), np.zeros(S))
    alone = [worth_of([each[:, None]], [decision]).worths[0] for each in (a, b)]
    together = worth_of([a[:, None], b[:, None]], [decision]).worths[0]
    assert max(alone) < 0.05
    assert together > 0.15


def test_what_is_felt_twice_alike_is_worth_what_is_felt_once(rng):
    """Two equal percepts have the worth of one percept and a constant, to 1e-9."""
    d = rng.standard_normal(S)
    percept = (d + 0.5 * rng.standard_normal(S))[:, None]
    decision = decide(d**2, np.full(S, 0.8), 0.5 + 0.3 * d)
    twice = worth_of([percept, percept], [decision])
    once = worth_of([percept, np.full((S, 1), 3.0)], [decision])
    assert twice.worths == pytest.approx(once.worths, rel=1e-9)
    assert twice.se == pytest.approx(once.se, rel=1e-9)
    assert twice.p_best_after == pytest.approx(once.p_best_after, rel=1e-9)


def test_of_a_percept_with_two_values_the_means_after_each_decide(rng):
    cost = rng.standard_normal((2, 400))
    heavy = rng.random(400) < 0.3
    cost[0] += np.where(heavy, 0.4, -0.2)
    falls = []
    for fold in range(4):
        inside = np.arange(400) % 4 == fold
        now = cost[:, ~inside].mean(axis=1).argmin()
        for value in (True, False):
            own, others = inside & (heavy == value), ~inside & (heavy == value)
            falls.extend(cost[now, own] - cost[cost[:, others].mean(axis=1).argmin(), own])
    worth = worth_of([np.where(heavy, 1.0, 0.0)[:, None]], [decide(*cost)])
    assert worth.worths[0] == pytest.approx(np.mean(falls), rel=1e-9)


def test_infeasible_samples_are_charged_and_information_is_never_of_negative_worth(rng):
    d = rng.standard_normal(S)
    feasible = np.stack([d < 1.0, np.ones(S, dtype=bool)])
    decision = decide(np.where(d < 1.0, 1.0, np.inf), np.full(S, 1.5), feasible=feasible)
    charged = decision.charge()
    assert np.isfinite(charged).all()
    assert charged[0][d >= 1.0].min() == pytest.approx(3.0)  # twice the dearest mean
    worth = worth_of([(d + 0.1 * rng.standard_normal(S))[:, None]], [decision])
    share = float((d < 1.0).mean())
    expected = min(share + 3.0 * (1.0 - share), 1.5) - (share + 1.5 * (1.0 - share))
    assert worth.worths[0] == pytest.approx(expected, abs=0.05)
    assert decision.mark_best().mean(axis=1) == pytest.approx([share, 1.0 - share])
    assert decision.find_best() == 0
    for option, mean in enumerate((share + 3.0 * (1.0 - share), 1.5)):
        assert decision.compute_regret(option) == pytest.approx(mean - (share + 1.5 * (1.0 - share)))


def test_nothing_feasible_is_worth_nothing():
    decision = decide(np.full(100, np.inf), np.full(100, np.inf), feasible=np.zeros((2, 100), dtype=bool))
    assert worth_of([np.random.default_rng(0).standard_normal((100, 1))], [decision]).worths[0] == 0.0


def test_probability_of_being_right_afterwards(rng):
    d = rng.standard_normal(S)
    worth = worth_of([(d + 0.5 * rng.standard_normal(S))[:, None]], [decide(d, np.zeros(S))])
    # P(sign of the posterior mean is that of d) = 1/2 + arcsin(correlation) / pi
    expected = 0.5 + np.arcsin(1.0 / np.sqrt(1.25)) / np.pi
    assert worth.p_best_after[0] == pytest.approx(expected, abs=0.02)


def test_percepts_are_those_of_a_hold_and_keep_its_information(rng):
    """Regression of a density on its percept leaves the variance of Bayes' rule to 5 %."""
    static, noise = StaticHold(load_arm(ARM)), WeberNoise(weber_fraction=0.0, threshold=0.1)
    Phi = np.zeros((10, 1))
    Phi[:4, 0] = 1e-4 * np.array([1.0, 0.2, 0.0, 0.0])
    geometry = Geometry(Phi, np.zeros((0, 10, 1)))
    mu = 3000.0 + 800.0 * rng.standard_normal((S, 1))
    own = mu + 100.0 * rng.standard_normal((S, 1))
    hold = PossibleHold("bar", geometry, own, np.zeros((S, 0)))
    percept = feel(hold, static, noise, mu.std(axis=0), rng)
    assert percept.shape == (S, 1)
    A = static.Y @ Phi
    precision = float((A.T @ A)[0, 0]) / 0.1**2
    gain = precision / (1.0 + 100.0**2 * precision)
    expected = 1.0 / (1.0 / 800.0**2 + gain)
    slope, at = np.polyfit(percept[:, 0], mu[:, 0], 1)
    left = (mu[:, 0] - slope * percept[:, 0] - at).var()
    assert left == pytest.approx(expected, rel=0.05)
    found = compute_information(hold, static, noise, np.cov(mu.T).reshape(1, 1))
    assert found == pytest.approx(0.5 * np.log(800.0**2 / expected), rel=0.05)


def test_arm_holds_what_no_joint_limit_forbids():
    """Of loads of half, twice and three times what the weakest joint can bear one is held."""
    arm = load_arm(ARM)
    static = StaticHold(arm)
    Phi = np.zeros((10, 1))
    Phi[:4, 0] = [1.0, 0.2, 0.0, 0.0]
    load = static.Y @ Phi[:, 0]
    most = ((arm.limits.tau_max - np.sign(load) * static.tau_arm) / np.maximum(np.abs(load), 1e-12)).min()
    own = most * np.array([0.5, 2.0, 3.0])[:, None]
    hold = PossibleHold("bar", Geometry(Phi, np.zeros((0, 10, 1))), own, np.zeros((3, 0)))
    assert hold.compute_probability(static, arm.limits) == pytest.approx(1.0 / 3.0)
