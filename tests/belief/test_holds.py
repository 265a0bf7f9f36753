"""What was felt: exact log likelihoods against the reference, their derivatives, and their quadratic at the mode."""

import numpy as np
import pytest
from helpers.reference_holds import MODEL, feel

from affordance.belief.holds import Holds, add_hold, compute_log_likelihood, forget_things, reduce_errors, start_holds
from affordance.belief.learner import Seen
from affordance.belief.normals import Normals
from studies import exact_reference as reference

SHARED = MODEL._replace(shared_geometry=True)


def gather(holds, size=1):
    """The state of observers who felt the same holds, in this order."""
    state = start_holds(size)
    for hold in holds:
        seen = Seen(tuple(range(hold.A.shape[1])), np.full(size, hold.object))
        state = add_hold(state, seen, feel(*[hold] * size))
    return state


@pytest.mark.parametrize("error", [0.0, 0.1])
def test_log_likelihood_and_its_derivatives_are_those_of_the_reference(error, rng):
    """Two objects of two densities, three holds each, with and without errors of geometry that holds share."""
    holds, *_ = reference.build_case([[8000, 700], [4000, 2000]], 3, error=error)
    rho = rng.uniform(500.0, 9000.0, (1, 4, 2, 2))

    def compute(own, k):
        return reference.compute_log_likelihood(own[None], [hold for hold in holds if hold.object == k], SHARED)[0]

    found = compute_log_likelihood(Holds.of(gather(holds)), rho)
    expected = [[compute(rho[0, n, k], k) for k in range(2)] for n in range(4)]
    np.testing.assert_allclose(found.value[0], expected, rtol=1e-9)
    unit = 1.0 * np.eye(2)
    for n, k in np.ndindex(4, 2):
        own = rho[0, n, k]
        gradient = [(compute(own + e, k) - compute(own - e, k)) / 2.0 for e in unit]
        np.testing.assert_allclose(found.gradient[0, n, k], gradient, rtol=1e-5, atol=1e-8)
        steps = 10.0 * unit
        hessian = [
            [
                (
                    compute(own + a + b, k)
                    - compute(own + a - b, k)
                    - compute(own - a + b, k)
                    + compute(own - a - b, k)
                )
                / 400.0
                for b in steps
            ]
            for a in steps
        ]
        np.testing.assert_allclose(found.hessian[0, n, k], hessian, rtol=2e-3, atol=1e-9)


def evaluate(likelihood, rho):
    return likelihood.log_constant + rho @ likelihood.information_vector - 0.5 * rho @ likelihood.precision @ rho


@pytest.mark.parametrize("error", [0.0, 0.1])
def test_quadratic_touches_the_exact_likelihood_at_the_mode_of_the_posterior(error):
    (hold,), *_ = reference.build_case([[8000, 700]], 1, error=error)
    normals = Normals(np.array([[4000.0, 1000.0]]), np.array([[[2000.0**2, 0.0], [0.0, 800.0**2]]]))
    found = feel(hold).find_likelihood(normals)
    likelihood, mode = found.take(0), normals.condition(found).mean[0]

    def compute(rho):
        return reference.compute_log_likelihood(rho[None], [hold], SHARED)[0]

    assert evaluate(likelihood, mode) == pytest.approx(compute(mode), rel=1e-9)
    for step in 20.0 * np.eye(2):
        one, other = (
            [evaluate(likelihood, mode + t * step) for t in (-1, 1)],
            [compute(mode + t * step) for t in (-1, 1)],
        )
        assert one[1] - one[0] == pytest.approx(other[1] - other[0], rel=1e-3)
        assert sum(one) - 2.0 * evaluate(likelihood, mode) == pytest.approx(
            sum(other) - 2.0 * compute(mode), rel=1e-3
        )


def test_quadratic_of_a_constant_error_is_exact_everywhere():
    (hold,), *_ = reference.build_case([[8000, 700]], 1)
    model = MODEL._replace(w=0.0)
    normals = Normals(np.array([[1000.0, 1000.0]]), 4000.0**2 * np.eye(2)[None])
    likelihood = feel(hold, model=model).find_likelihood(normals).take(0)
    for rho in ([0.0, 0.0], [8000.0, 700.0], [-300.0, 5000.0]):
        expected = reference.compute_log_likelihood(np.array([rho]), [hold], model)[0]
        assert evaluate(likelihood, np.array(rho)) == pytest.approx(expected, rel=1e-9)


def test_beliefs_of_several_hypotheses_are_compared_with_what_their_observer_felt():
    holds, *_ = reference.build_case([[8000, 700]], 3)
    felt, observers = feel(*holds), np.array([2, 0, 2])
    mean = np.array([[4000.0, 1000.0], [6000.0, 500.0], [100.0, 100.0]])
    covariance = np.tile(1000.0**2 * np.eye(2), (3, 1, 1))
    together = felt.find_likelihood(Normals(mean, covariance), observers)
    for n, b in enumerate(observers):
        alone = feel(holds[b]).find_likelihood(Normals(mean[n : n + 1], covariance[n : n + 1]))
        for one, other in zip(alone[:4], together[:4], strict=True):
            np.testing.assert_allclose(np.asarray(other)[n], np.asarray(one)[0], rtol=1e-9)


def test_equal_holds_are_pooled_without_a_loss():
    """Twenty holds in one posture are one entry, and the likelihood is the product of twenty."""
    (hold,), *_ = reference.build_case([[8000, 700]], 1)
    rng = np.random.default_rng(2)
    holds = [hold._replace(y=hold.y + rng.normal(size=7)) for _ in range(20)]
    state = gather(holds)
    assert state["hold_count"].tolist() == [[20.0]]
    rho = np.array([7000.0, 900.0])
    expected = reference.compute_log_likelihood(rho[None], holds, MODEL)[0]
    found = compute_log_likelihood(Holds.of(state), rho[None, None, None]).value
    np.testing.assert_allclose(found, [[[expected]]], rtol=1e-9)


def test_forgotten_things_leave_the_holds_of_others_in_their_new_order():
    holds, *_ = reference.build_case([[8000], [4000], [2000]], 2)
    state = forget_things(gather(holds, size=2), [2, 0])
    expected = gather([h._replace(object=k) for k, j in enumerate([2, 0]) for h in holds if h.object == j], size=2)
    rho = np.array([[[[3000.0], [5000.0]]]] * 2)
    one, other = (compute_log_likelihood(Holds.of(each), rho) for each in (state, expected))
    for found, wanted in zip(one, other, strict=True):
        np.testing.assert_allclose(found, wanted, rtol=1e-9)
    assert state["hold_count"].sum() == 8.0


def test_errors_of_geometry_that_change_no_torque_are_left_out(rng):
    """Eight errors of each thing, of which three combinations change torques, leave three, and the likelihood."""
    holds, *_ = reference.build_case([[8000, 700], [4000, 2000]], 3, error=0.1)
    arrays = Holds.of(gather(holds))
    patterns = rng.standard_normal((3, *arrays.regressor.shape[1:])) * np.abs(arrays.regressor) * 0.1
    mixed = np.einsum("tqk,knjc->tnqjc", rng.standard_normal((2, 8, 3)), patterns)  # of each thing
    errors = mixed[arrays.thing[0], np.arange(arrays.thing.shape[1])][None]
    full = arrays._replace(errors=errors)
    fewer = reduce_errors(full, 2)
    assert fewer.errors.shape[2] == 3
    rho = rng.uniform(500.0, 9000.0, (1, 4, 2, 2))
    for one, other in zip(compute_log_likelihood(full, rho), compute_log_likelihood(fewer, rho), strict=True):
        np.testing.assert_allclose(other, one, rtol=1e-6, atol=1e-12)
    without = reduce_errors(full._replace(errors=np.zeros_like(errors)), 2)
    assert without.errors.shape[2] == 0
