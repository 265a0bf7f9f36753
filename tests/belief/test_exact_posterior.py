"""The belief is the posterior given all holds: against the reference, in any order, for any observer."""

import functools

import numpy as np
import pytest
from helpers.reference_holds import MODEL, PRIOR, colour, feel, hold_all, look, summarise
from scipy.integrate import quad
from scipy.stats import norm

from affordance.belief.density_belief import Prior
from affordance.belief.holds import Felt
from affordance.belief.learner import Seen
from affordance.belief.learners import DENSITY
from affordance.belief.likelihood import Likelihood
from affordance.belief.material_memory import MaterialMemory, start_memory
from studies import exact_reference as reference
from studies.exact_belief import compare_drawn

LENGTHS = {"rods": [[8000]] * 4, "lengths": [[0.1], [0.2], [0.3], [0.45]]}
CASES = {
    **{f"one colour, {n} x": reference.build_case([[8000]], n) for n in (1, 6, 30)},
    "light, 1 x": reference.build_case([[100]], 1),
    **{f"two colours, {n} x": reference.build_case([[8000, 700]], n) for n in (1, 6, 30)},
    **{f"three colours, {n} x": reference.build_case([[8000, 2700, 700]], n) for n in (1, 6)},
    "three colours lighter by 2 in the second of two": reference.build_case(
        [[8000, 700, 2700], [4000, 350, 1350]], 3
    ),
    "a colour that two objects of two colours share": (
        reference.build_case([[8000, 700], [4000, 2000]], 2)[0],
        [(0, 1), (1, 2)],
        reference.Model(),
    ),
    "three colours and two of them": reference.build_case([[8000, 700, 2700], [4000, 350]], 3),
    "light and heavy colour": reference.build_case([[100, 9000]], 1),
    **{f"four lengths, {n} x": reference.build_case(**LENGTHS, num_holds=n) for n in (1, 6)},
    "four lengths, errors of geometry": reference.build_case(**LENGTHS, num_holds=6, error=0.05, shared=True),
    "large errors of geometry": reference.build_case([[8000]] * 2, 3, error=0.15, shared=True),
    "one and two colours, 6 x": reference.build_case([[8000], [8000, 700], [7600, 760]], 6),
    **{
        f"one of {count} lighter by {factor}, {n} x": reference.build_case(
            [*[[8000]] * (count - 1), [8000 / factor]], n
        )
        for factor in (1.3, 2, 10)
        for count, n in ((2, 1), (2, 6), (5, 6))
    },
    **{
        f"two colours lighter by {factor} in the second of two": reference.build_case(
            [[8000, 700], [8000 / factor, 700 / factor]], 6
        )
        for factor in (1.3, 2)
    },
    "two colours that change places in the second": reference.build_case([[8000, 700], [700, 8000]], 6),
    "two colours lighter by 10 in the second of two": reference.build_case([[8000, 700], [800, 70]], 1),
    "first of two colours lighter by 2 in the second of three": reference.build_case(
        [[8000, 700], [4000, 700], [8000]], 6
    ),
}


@functools.cache
def compute_reference(name):
    return reference.compute_posterior(*CASES[name])


@pytest.mark.parametrize("name", CASES)
def test_belief_is_the_posterior_by_quadrature(name):
    """Of materials and of objects: mean to 2 %, SD to 5 %."""
    holds, owned, _ = CASES[name]
    exact = compute_reference(name)
    for expected, found in zip((exact.mu, exact.rho), summarise(hold_all(holds, owned), owned), strict=True):
        assert found.keys() == expected.keys()
        for key, density in found.items():
            assert density.mean == pytest.approx(expected[key].mean, rel=0.02), key
            assert density.sd == pytest.approx(expected[key].sd, rel=0.05), key


@pytest.mark.parametrize("name", ["one colour, 6 x", "one of 2 lighter by 10, 6 x", "one of 5 lighter by 2, 6 x"])
def test_mean_density_of_one_colour_is_nearly_exact(name):
    """Laplace's method for own densities and a spline over seven nodes remain: mean to 1e-4, SD to .5 %."""
    memory, expected = hold_all(*CASES[name][:2]), compute_reference(name).mu[0]
    found = memory.density(colour(0))
    assert found.mean == pytest.approx(expected.mean, rel=1e-4)
    assert found.sd == pytest.approx(expected.sd, rel=5e-3)


JOINT = [name for name, (_, owned, _) in CASES.items() if {*owned} in ({(0, 1)}, {(0, 1, 2)})]


@pytest.mark.parametrize("name", JOINT)
def test_belief_about_two_or_three_colours_is_nearly_exact(name):
    """A grid of all scores: mean and SD to .5 %. Laplace's method for deviations: objects' densities to 2 %."""
    holds, owned, _ = CASES[name]
    exact = compute_reference(name)
    (means, own), tolerances = summarise(hold_all(holds, owned), owned), (0.005, 0.02)
    for expected, found, rel in zip((exact.mu, exact.rho), (means, own), tolerances, strict=True):
        for key, density in found.items():
            assert density[:2] == pytest.approx(expected[key][:2], rel=rel), key


@pytest.mark.parametrize("number", range(10))
def test_belief_after_one_hold_of_two_unknown_materials_is_nearly_exact(number):
    """Of densities that are drawn from the prior, of which one hold leaves a direction open: to .5 %."""
    assert compare_drawn(number) == pytest.approx(np.zeros((2, 2)), abs=0.005)


PRECISE = {
    "the ends of the grid are far from the fit": (
        [
            reference.Hold(
                0,
                np.array([14.87, -1.80, -1.76]),
                np.array([11.44, -1.02, -0.41]),
                1e-3 * np.array([[1.402, 0.838], [-0.302, -0.198], [-0.481, -0.377]]),
            )
        ],
        reference.Model(prior_mean=2222.0, prior_sd=7348.0, scatter=0.089, s0=0.129, w=0.0576),
    ),
    "probability falls steeply to one side": (
        [
            hold._replace(y=np.array(y))
            for hold, y in zip(
                reference.build_case([[632, 671], [686, 728]], 1)[0],
                [
                    [0.045, -31.49, 1.538, 16.117, -0.443, 2.013, -0.021],
                    [0.016, -30.91, 1.614, 14.21, -0.433, 1.972, 0.011],
                ],
                strict=True,
            )
        ],
        reference.Model(prior_mean=2929.0, prior_sd=4390.0, scatter=0.0252, s0=0.039, w=0.0746),
    ),
}


@pytest.mark.parametrize("name", PRECISE)
def test_thirty_samples_of_a_hold_of_two_unknown_materials(name):
    """A grid that is wrong at its ends would give a belief that is sure and wrong: mean and SD to .5 %."""
    holds, model = PRECISE[name]
    holds, owned = [hold for hold in holds for _ in range(30)], [(0, 1)] * len(holds)
    prior, memory = Prior(mode=model.prior_mean, sd=model.prior_sd, deviation=model.scatter), MaterialMemory()
    for hold in holds:
        memory = memory.recall(look(hold.object, (0, 1)), prior).memory
        memory = memory.learn(feel(hold, model=model), prior.deviation).memory
    exact = reference.compute_posterior(holds, owned, model, nodes=600)
    for expected, found in zip((exact.mu, exact.rho), summarise(memory, owned), strict=True):
        for key, density in found.items():
            assert density[:2] == pytest.approx(expected[key][:2], rel=0.005), key


# Mean and SD of the worst density as fractions of the reference's, noted after the outcome was seen. After a
# contradiction by ten a density is less than its SD, or nearly: no normal distribution that is restricted to positive
# values has such moments.
OPEN = {
    "one of two by ten, 6 x": (reference.build_case([[8000, 700], [800, 70]], 6), 0.02, 0.15),
    "one of two of three colours by ten, 2 x": (
        reference.build_case([[8000, 2700, 700], [800, 270, 70]], 2),
        0.03,
        0.15,
    ),
}


@pytest.mark.parametrize("name", OPEN)
def test_belief_that_a_normal_distribution_represents_badly_is_off_by_what_is_stated(name):
    case, of_mean, of_sd = OPEN[name]
    exact = reference.compute_posterior(*case)
    for expected, found in zip((exact.mu, exact.rho), summarise(hold_all(*case[:2]), case[1]), strict=True):
        for key, density in found.items():
            assert density.mean == pytest.approx(expected[key].mean, rel=of_mean), key
            assert density.sd == pytest.approx(expected[key].sd, rel=of_sd), key


@pytest.mark.parametrize("mass", [1.0, 8.0])
def test_two_parts_of_which_the_mass_alone_is_known(mass):
    """Every division of the mass is nearly as probable: by a grid over both mean densities."""
    memory = MaterialMemory().recall(look(0, (0, 1)), PRIOR).memory
    P = np.full((2, 2), 1e-6) / 0.003**2
    felt = Felt.from_quadratic(Likelihood(P, P @ [mass * 1e3, 0.0], -0.5 * (mass / 0.003) ** 2, 0.0, 1))
    memory = memory.learn(felt, PRIOR.deviation).memory
    one, other = np.meshgrid(*2 * [(np.arange(2000) + 0.5) * mass * 0.75], indexing="ij")
    variance = 0.003**2 + 1e-6 * PRIOR.deviation**2 * (one**2 + other**2)
    log_p = norm.logpdf(one, PRIOR.mode, PRIOR.sd) + norm.logpdf(other, PRIOR.mode, PRIOR.sd)
    log_p += norm.logpdf(mass, 1e-3 * (one + other), np.sqrt(variance))
    p = np.exp(log_p - log_p.max()) / np.exp(log_p - log_p.max()).sum()
    mean = (p * one).sum()
    for density in (memory.density(colour(0)), memory.density(colour(1))):
        assert density.mean == pytest.approx(mean, rel=0.01)
        assert density.sd == pytest.approx(np.sqrt((p * (one - mean) ** 2).sum()), rel=0.01)


MIXED = reference.build_case([[8000], [8000, 700], [700, 4000], [3000]], 3)
MIXED_OWNED = [(0,), (0, 1), (1, 0), (0,)]


def test_order_of_holds_does_not_matter():
    rng, holds = np.random.default_rng(0), MIXED[0]
    start = MaterialMemory().add_colours([colour(0), colour(1)], PRIOR)
    one = hold_all(holds, MIXED_OWNED, memory=start)
    for order in (range(len(holds) - 1, -1, -1), rng.permutation(len(holds))):
        other = hold_all([holds[h] for h in order], MIXED_OWNED, memory=start)
        np.testing.assert_allclose(other.belief.untruncated_mean, one.belief.untruncated_mean, rtol=1e-9)
        np.testing.assert_allclose(other.belief.covariance, one.belief.covariance, rtol=1e-9)
        found, expected = (summarise(each, MIXED_OWNED)[1] for each in (other, one))
        for key, density in found.items():
            np.testing.assert_allclose(density, expected[key], rtol=1e-9)


def test_forgotten_object_leaves_no_trace():
    """Without an object's holds the belief is that of an observer who never held it."""
    memory = hold_all(MIXED[0], MIXED_OWNED)
    kept = [number for number, thing in enumerate(memory.things) if thing.appearance != tuple(look(1, (0, 1)))]
    left_out = [number for number in range(len(memory.things)) if number not in kept]
    state, _ = memory.learner.infer(memory.learner.leave_out(memory.state, left_out))
    never = hold_all([hold for hold in MIXED[0] if hold.object != 1], MIXED_OWNED)
    found, expected = memory.learner.believe(state), never.learner.believe(never.state)
    assert [memory.colours.index(each) for each in never.colours] == [0, 1]
    np.testing.assert_allclose(found.mean, expected.mean, rtol=1e-9)
    np.testing.assert_allclose(found.covariance, expected.covariance, rtol=1e-9)


def test_what_one_observer_felt_after_another_is_what_one_felt_of_all():
    """Memories merge: a memory that goes on with what another felt, in either order, knows what both know."""
    start = MaterialMemory().add_colours([colour(0), colour(1)], PRIOR)
    one, other = MIXED[0][::2], MIXED[0][1::2]
    first = hold_all(other, MIXED_OWNED, memory=hold_all(one, MIXED_OWNED, memory=start))
    second = hold_all(one, MIXED_OWNED, memory=hold_all(other, MIXED_OWNED, memory=start))
    np.testing.assert_allclose(first.belief.untruncated_mean, second.belief.untruncated_mean, rtol=1e-9)
    np.testing.assert_allclose(first.belief.covariance, second.belief.covariance, rtol=1e-9)


def test_many_observers_believe_what_each_would_alone():
    """Observers who held different objects different numbers of times."""
    holds, *_ = reference.build_case([[8000, 700], [4000, 2000]], 3)
    lifts = [(0, 3, 1, 1), (3, 3, 4, 0), (1, 2, 0, 5), (5, 4, 3, 2)]  # by trial, the hold of each observer

    def learn(observers):
        state = DENSITY.start(None, DENSITY.parameters, PRIOR, 2, len(observers))
        for chosen in lifts:
            mine = [holds[chosen[b]] for b in observers]
            seen = Seen((0, 1), np.array([hold.object for hold in mine]))
            lesson = DENSITY.learn(state, seen, feel(*mine), None)
            state = lesson.state
        return DENSITY.believe(state), lesson.densities

    together = learn(range(4))
    for b in range(4):
        for one, all_of_them in zip(learn([b]), together, strict=True):
            np.testing.assert_allclose(all_of_them.mean[b], one.mean[0], rtol=1e-9)
            np.testing.assert_allclose(all_of_them.covariance[b], one.covariance[0], rtol=1e-9)


def measure_alone(density, sd):
    """A measurement of the density of an object of one colour."""
    return Felt.from_quadratic(
        Likelihood(np.eye(1) / sd**2, np.array([density]) / sd**2, -0.5 * (density / sd) ** 2, 0.0, 1)
    )


@pytest.mark.parametrize("learner", ["density", "kinds_map", "kinds_drawn"])
def test_many_holds_of_one_object_tell_no_more_of_its_material_than_its_deviation_allows(learner):
    """Of an object of 850 kg/m^3, felt to .3 kg/m^3, by quadrature over its material's mean density."""
    memory = start_memory(learner)
    for _ in range(10):
        memory = memory.recall(look(0, (0,)), PRIOR).memory.learn(measure_alone(850.0, 1.0), PRIOR.deviation).memory

    def weigh(mu, power):
        return mu**power * norm.pdf(mu, 1000.0, 4000.0) * norm.pdf(850.0, mu, np.hypot(0.06 * mu, 10**-0.5))

    total, first, second = (quad(weigh, 400.0, 1500.0, args=(power,), epsabs=0.0)[0] for power in range(3))
    density = memory.density(colour(0))
    assert density.mean == pytest.approx(first / total, rel=1e-4)
    assert density.sd == pytest.approx(np.sqrt(second / total - (first / total) ** 2), rel=2e-3)


def test_evidence_of_constant_error_is_the_same_as_torques_or_as_a_quadratic():
    """White noise: the sum of all samples is a quadratic function, and one hold."""
    holds, owned, _ = reference.build_case([[8000, 700], [7000, 800]], 3)
    by_torques = by_sums = MaterialMemory()
    for hold in holds:
        seen = look(hold.object, owned[hold.object])
        torques = feel(hold, model=MODEL._replace(w=0.0))
        A, r = hold.A / MODEL.s0, (hold.y - hold.tau_arm) / MODEL.s0
        sums = Felt.from_quadratic(Likelihood(A.T @ A, A.T @ r, -0.5 * r @ r))
        by_torques = by_torques.recall(seen, PRIOR).memory.learn(torques, PRIOR.deviation).memory
        by_sums = by_sums.recall(seen, PRIOR).memory.learn(sums, PRIOR.deviation).memory
    np.testing.assert_allclose(by_sums.belief.untruncated_mean, by_torques.belief.untruncated_mean, rtol=1e-7)
    np.testing.assert_allclose(by_sums.belief.covariance, by_torques.belief.covariance, rtol=1e-7)


def test_equal_holds_are_one_entry_and_tell_as_much_as_all():
    """Holds in the same posture, which differ in the measured torques alone, are pooled."""
    base, owned, _ = reference.build_case([[8000, 700]], 1)
    rng = np.random.default_rng(4)
    holds = [base[0]._replace(y=base[0].y + 0.5 * rng.normal(size=7)) for _ in range(5)]
    pooled = hold_all(holds, owned)
    assert pooled.state["hold_count"].tolist() == [[5.0]]
    apart = [
        hold._replace(
            A=np.vstack([hold.A, np.zeros((1, 2))]),
            y=np.append(hold.y, 0.0),
            tau_arm=np.append(hold.tau_arm, h * 1e-9),
        )
        for h, hold in enumerate(holds)
    ]  # a joint that feels nothing makes them different
    separate = hold_all(apart, owned)
    assert separate.state["hold_count"].tolist() == [[1.0] * 5]
    np.testing.assert_allclose(separate.belief.untruncated_mean, pooled.belief.untruncated_mean, rtol=1e-9)
    np.testing.assert_allclose(separate.belief.covariance, pooled.belief.covariance, rtol=1e-9)


def test_densities_prior_and_volumes_may_be_scaled_together():
    """Objects of a fifth or five times the volume, with as much mass: densities are inversely scaled."""
    holds, owned, _ = reference.build_case([[8000], [4000]], 2)
    found = []
    for factor in (1.0, 0.2, 5.0):
        prior = Prior(mode=PRIOR.mode * factor, sd=PRIOR.sd * factor, deviation=PRIOR.deviation)
        memory = MaterialMemory()
        for hold in holds:
            felt = feel(hold._replace(A=hold.A / factor))
            memory = memory.recall(look(hold.object, owned[0]), prior).memory.learn(felt, prior.deviation).memory
        density = memory.density(colour(0))
        found.append([density.mean / factor, density.sd / factor])
    np.testing.assert_allclose(found[1:], [found[0]] * 2, rtol=1e-9)
