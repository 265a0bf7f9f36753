"""The reference by quadrature, against draws from the prior, against a closed form and against itself."""

import functools
import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import quad
from scipy.special import logsumexp
from scipy.stats import multivariate_normal, truncnorm

from studies import exact_reference as reference
from studies.exact_reference import Case, Hold, Model

Array = NDArray[np.float64]
CASES = reference.build_cases()


def sample_means(case: Case, draws: int, rng: np.random.Generator) -> dict[Any, tuple[float, float]]:
    """Estimates all posterior means and their standard errors by weighting draws from the prior: slow, but plain.

    All holds of an object are one vector with a full covariance.
    """
    holds, owned, model = case
    values: dict[Any, Array] = {}
    for i in {i for own in owned for i in own}:
        standard = truncnorm.rvs(-model.prior_mean / model.prior_sd, np.inf, size=draws, random_state=rng)
        values[i] = model.prior_mean + model.prior_sd * standard
    log_weights = np.zeros(draws)
    for k, own in enumerate(owned):
        rho = np.stack([values[i] * (1.0 + model.scatter * rng.normal(size=draws)) for i in own], axis=1)
        values |= {(k, i): rho[:, j] for j, i in enumerate(own)}
        mine = [hold for hold in holds if hold.object == k]
        t = np.concatenate([hold.tau_arm + rho @ hold.A.T for hold in mine], axis=1)
        R = (model.s0**2 + (model.w * t) ** 2)[:, :, None] * np.eye(t.shape[1])
        n = len(mine[0].y)
        for a, b in itertools.product(range(len(mine)), repeat=2):
            G, H = mine[a].geometry, mine[b].geometry
            if isinstance(G, np.ndarray) and isinstance(H, np.ndarray) and (a == b or model.shared_geometry):
                cross = np.einsum("Ni,inq,Nj,jmq->Nnm", rho, G, rho, H, optimize=True)
                R[:, a * n : (a + 1) * n, b * n : (b + 1) * n] += cross
        residual = (np.concatenate([hold.y for hold in mine]) - t)[:, :, None]
        quadratic = (residual * np.linalg.solve(R, residual)).sum(axis=(1, 2))
        log_weights += np.where((rho > 0.0).all(axis=1), -0.5 * (quadratic + np.linalg.slogdet(R)[1]), -np.inf)
    weights = np.exp(log_weights - logsumexp(log_weights))
    means = {key: float(weights @ value) for key, value in values.items()}
    return {
        key: (means[key], float(np.sqrt(weights**2 @ (value - means[key]) ** 2))) for key, value in values.items()
    }


def build_small_case(*, shared: bool) -> Case:
    """Two holds of a rod of two colours and one of a rod of one colour, errors of geometry, three joints of seven."""
    two, *_ = reference.build_case([[5000, 2000]], 2, error=0.1)
    one, *_ = reference.build_case([[3500]], 1, error=0.1)
    joints = [1, 3, 5]
    holds = []
    for hold in [*two, one[0]._replace(object=1)]:
        assert isinstance(hold.geometry, np.ndarray)
        y, arm = hold.y[joints], hold.tau_arm[joints]
        holds.append(Hold(hold.object, y, arm, hold.A[joints], hold.geometry[:, joints]))
    return holds, [(0, 1), (0,)], Model(shared_geometry=shared)


@pytest.mark.parametrize("shared", [False, True])
def test_means_agree_with_draws_from_the_prior(shared: bool) -> None:
    case = build_small_case(shared=shared)
    holds, owned, model = case
    exact = reference.compute_posterior(holds, owned, model)
    exact_means = {key: marginal.mean for key, marginal in [*exact.mu.items(), *exact.rho.items()]}
    sampled = sample_means(case, 150_000, np.random.default_rng(0))
    assert exact_means.keys() == sampled.keys()
    for key, (mean, se) in sampled.items():
        assert se < 0.015 * mean, key  # otherwise the comparison says little
        assert abs(exact_means[key] - mean) < 3.0 * se, key


@pytest.mark.parametrize("factor", [2.0, 10.0])
def test_contradiction_agrees_with_adaptive_quadrature(factor: float) -> None:
    case = reference.build_case([[8000.0], [8000.0 / factor]], 6)
    exact = reference.compute_posterior(*case)
    holds, _, model = case
    peak = exact.log_evidence / 2.0

    @functools.cache
    def integrate_object(k: int, mu: float) -> float:
        mine = [hold for hold in holds if hold.object == k]
        y, arm, A = (
            np.concatenate(parts) for parts in zip(*((h.y, h.tau_arm, h.A[:, 0]) for h in mine), strict=True)
        )

        def weigh(rho: float) -> float:
            t = arm + A * rho
            variance = model.s0**2 + (model.w * t) ** 2
            log_p = -0.5 * ((y - t) ** 2 / variance + np.log(2.0 * np.pi * variance)).sum()
            return float(np.exp(log_p - 0.5 * ((rho / mu - 1.0) / 0.06) ** 2 - peak) / (0.06 * mu))

        return float(sum(quad(weigh, low, low + 1000.0, epsrel=1e-6)[0] for low in range(0, 11000, 1000)))

    def weigh_mu(mu: float, power: int) -> float:
        prior = np.exp(-0.5 * ((mu - 1000.0) / 4000.0) ** 2)
        return float(mu**power * prior * integrate_object(0, mu) * integrate_object(1, mu))

    total, first, second = (quad(weigh_mu, 4500.0, 9500.0, args=(power,), epsrel=1e-6)[0] for power in range(3))
    np.testing.assert_allclose(exact.mu[0].mean, first / total, rtol=1e-5)
    np.testing.assert_allclose(exact.mu[0].sd, np.sqrt(second / total - (first / total) ** 2), rtol=1e-4)


def test_linear_gaussian_limit_has_its_closed_form() -> None:
    rng = np.random.default_rng(3)
    model = Model(scatter=2e-4, s0=0.1, w=0.0)
    A = rng.normal(size=(2, 5, 2)) * 1e-3
    arm = rng.normal(size=(2, 5))
    holds = [Hold(0, arm[h] + A[h] @ [5000.0, 4000.0] + 0.1 * rng.normal(size=5), arm[h], A[h]) for h in range(2)]
    stacked, residual = A.reshape(10, 2), np.concatenate([hold.y - hold.tau_arm for hold in holds])
    covariance = np.linalg.inv(np.eye(2) / 4000.0**2 + stacked.T @ stacked / 0.1**2)
    mean = covariance @ (np.full(2, 1000.0) / 4000.0**2 + stacked.T @ residual / 0.1**2)
    sd = np.sqrt(np.diag(covariance))
    axes = {i: reference.build_axis(mean[i] - 7.0 * sd[i], mean[i] + 7.0 * sd[i], 1200) for i in range(2)}
    found = reference.integrate({0: holds}, {0: (0, 1)}, {**axes, (0, 0): axes[0], (0, 1): axes[1]}, model)
    for i in range(2):
        for marginal in (found.mu[i], found.rho[0, i]):
            np.testing.assert_allclose(marginal.mean, mean[i], rtol=1e-5)
            np.testing.assert_allclose(marginal.sd, sd[i], rtol=1e-3)
            np.testing.assert_allclose(marginal.median, mean[i], rtol=1e-5)
            np.testing.assert_allclose(marginal.quantiles[0], mean[i] - 1.959964 * sd[i], rtol=1e-4)
    whole = multivariate_normal(stacked @ [1000.0, 1000.0], 0.1**2 * np.eye(10) + 4000.0**2 * stacked @ stacked.T)
    truncated = 2.0 * np.log(0.5987063256829237)  # Phi(1000 / 4000), for two materials
    np.testing.assert_allclose(found.log_evidence, whole.logpdf(residual) - truncated, atol=1e-3)


FAST = [name for name in CASES if "three colours" not in name and "30 x" not in name]


@pytest.mark.parametrize("name", FAST)
def test_doubling_nodes_changes_little(name: str) -> None:
    _, change = reference.compare_doubled(CASES[name])
    assert change < 1e-5


def test_doubling_nodes_of_three_materials_changes_means_by_less_than_a_thousandth() -> None:
    case = CASES["three colours, 1 x"]
    base, doubled = (reference.compute_posterior(*case, nodes) for nodes in (150, 300))
    for i in range(3):
        np.testing.assert_allclose(base.mu[i].mean, doubled.mu[i].mean, rtol=1e-3)
        np.testing.assert_allclose(base.rho[0, i].mean, doubled.rho[0, i].mean, rtol=1e-3)


def test_order_of_holds_and_of_materials_is_irrelevant() -> None:
    rng = np.random.default_rng(0)
    holds, _, model = reference.build_case([[8000, 700, 2700], [8000], [2700, 8000]], 2, error=0.05)
    owned = [(0, 1, 2), (0,), (2, 0)]
    turned = [(2, 0, 1), (0,), (0, 2)]
    orders = [[2, 0, 1], [0], [1, 0]]
    shuffled = []
    for hold in (holds[h] for h in rng.permutation(len(holds))):
        order = orders[hold.object]
        assert isinstance(hold.geometry, np.ndarray)
        shuffled.append(hold._replace(A=hold.A[:, order], geometry=hold.geometry[order]))
    one = reference.compute_posterior(holds, owned, model, 60)
    two = reference.compute_posterior(shuffled, turned, model, 60)
    np.testing.assert_allclose(one.log_evidence, two.log_evidence, rtol=1e-9)
    for i in one.mu:
        np.testing.assert_allclose(one.mu[i].quantiles, two.mu[i].quantiles, rtol=1e-9)
    assert one.rho.keys() == two.rho.keys()
    for key in one.rho:
        np.testing.assert_allclose(one.rho[key].mean, two.rho[key].mean, rtol=1e-9)


def test_materials_that_share_no_object_are_independent() -> None:
    first, *_ = reference.build_case([[8000], [6000]], 2)
    second, *_ = reference.build_case([[700]], 3)
    alone = reference.compute_posterior(first, [(0,), (0,)], Model())
    both = reference.compute_posterior(
        [*first, *(hold._replace(object=2) for hold in second)], [(0,), (0,), (4,)], Model()
    )
    assert both.mu.keys() == {0, 4}
    assert both.mu[0].mean == alone.mu[0].mean


def test_four_joined_materials_are_refused() -> None:
    case = reference.build_case([[1000, 2000, 3000, 4000]], 1)
    with pytest.raises(ValueError, match="objects join 4 materials, at most 3 can be integrated"):
        reference.compute_posterior(*case)


def test_geometry_may_be_a_function() -> None:
    holds, owned, model = build_small_case(shared=True)
    functions = [h._replace(geometry=lambda rho, G=h.geometry: np.einsum("Nm,mnq->Nnq", rho, G)) for h in holds]
    one, two = (reference.compute_posterior(some, owned, model, 100) for some in (holds, functions))
    np.testing.assert_allclose(one.mu[0].mean, two.mu[0].mean, rtol=1e-12)


def test_holds_are_loaded_from_a_file(tmp_path: Path) -> None:
    holds, owned, _ = build_small_case(shared=True)
    A, G = np.zeros((3, 3, 2)), np.zeros((3, 2, 3, 2))
    for h, hold in enumerate(holds):
        A[h, :, : hold.A.shape[1]] = hold.A
        assert isinstance(hold.geometry, np.ndarray)
        G[h, : hold.A.shape[1]] = hold.geometry
    y, arm = np.stack([hold.y for hold in holds]), np.stack([hold.tau_arm for hold in holds])
    table: dict[str, Any] = {"object": [0, 0, 1], "materials": [[0, 1], [0, -1]], "shared_geometry": True}
    np.savez(tmp_path / "holds.npz", **table, y=y, tau_arm=arm, A=A, geometry=G)
    loaded, owned_again, model = reference.load_holds(tmp_path / "holds.npz")
    assert owned_again == owned
    assert model == Model(shared_geometry=True)
    direct = reference.compute_posterior(holds, owned, model, 100)
    assert reference.compute_posterior(loaded, owned_again, model, 100).mu[1].mean == direct.mu[1].mean
