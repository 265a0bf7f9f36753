"""Beliefs about materials by numerical integration: ``python studies/exact_reference.py``.

This program implements the documented model independently of the library, to validate the library:

    mu_i ~ N(1000, 4000^2), truncated at 0                     mean density of material i, [kg/m^3]
    rho_ki ~ N(mu_i, (.06 mu_i)^2), truncated at 0             density of material i in object k
    y ~ N(t, R), t = tau_arm + A rho_k                         mean torques of one hold of object k, [N m]
    R = diag(s0^2 + (w t)^2) + F F',  F = sum_i rho_ki G_i     F F' = Y Sigma(rho) Y', errors of geometry

R and its determinant depend on the density that is integrated over. The densities of an object are the same in all
its holds, and independent between its materials. Objects are independent given mu. The torques of object k therefore
enter through I_k(mu), the integral of its likelihood L_k(rho_k) times p(rho_k | mu), a product over its materials:

    p(mu | all holds) ~ p(mu) prod_k I_k(mu)
    p(rho_k | all holds) ~ L_k(rho_k) integral of p(rho_k | mu) p(mu) prod_{l != k} I_l(mu) dmu

All integrals are sums over tensor grids with at most three axes. Grids are equally spaced in a variable u for which
integrands are smooth and vanish at both ends, so that the error of the trapezoidal rule decreases faster than any
power of the step size.
"""

import argparse
import functools
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.special import logsumexp
from scipy.stats import norm, truncnorm

Array = NDArray[np.float64]
NODES = {1: 800, 2: 300, 3: 180}  # number of nodes per axis, by number of axes; a check doubles them
LEVELS = (0.025, 0.25, 0.5, 0.75, 0.975)
CHUNK = 16384  # number of densities per evaluation of the likelihood, so that arrays fit into the processor cache


class Model(NamedTuple):
    """Constants of the model."""

    prior_mean: float = 1000.0  # [kg/m^3]
    prior_sd: float = 4000.0  # [kg/m^3]
    scatter: float = 0.06  # coefficient of variation of object densities
    s0: float = 0.097  # torque threshold, [N m]
    w: float = 0.07  # Weber fraction
    shared_geometry: bool = False  # True if the geometry error of an object is the same in all its holds
    priors: tuple[tuple[float, float], ...] = ()  # mean and SD by material, instead of prior_mean and prior_sd


class Hold(NamedTuple):
    """Measurements in one hold."""

    object: int
    y: Array  # mean torques, (n,), [N m]
    tau_arm: Array  # torques of the arm alone, (n,), [N m]
    A: Array  # A = Y Phi, one column per material of the object, (n, m), [N m / (kg/m^3)]
    # Geometry errors: coefficients G, (m, n, q), with F = sum_i rho_i G_i; or a function that computes factors F,
    # (N, n, q), from densities, (N, m); or None.
    geometry: Array | Callable[[Array], Array] | None = None


class Marginal(NamedTuple):
    """Marginal posterior of a density, [kg/m^3]."""

    mean: float
    sd: float
    median: float
    quantiles: Array  # at ``LEVELS``
    grid: Array
    mass: Array  # probability of each grid point


class Posterior(NamedTuple):
    """Marginal posteriors of all densities, and the evidence."""

    mu: dict[int, Marginal]  # by material
    rho: dict[tuple[int, int], Marginal]  # by (object, material)
    log_evidence: float  # log probability density of all torques


class Axis(NamedTuple):
    """Grid of densities x = bend log(1 + e^u) with weights dx, [kg/m^3], equally spaced in u."""

    u: Array
    x: Array
    dx: Array


Axes = dict[Any, Axis]  # by material for mu, by (object, material) for rho


def build_axis(low: float, high: float, nodes: int) -> Axis:
    """Builds a grid that is logarithmic near zero, where kernels are narrow, and linear above."""
    bend = high / 6.0
    u_low, u_high = np.log(np.expm1(np.array([low, high]) / bend))
    u = np.linspace(u_low, u_high, nodes)
    return Axis(u, bend * np.logaddexp(0.0, u), bend / (1.0 + np.exp(-u)) * (u[1] - u[0]))


def compute_log_likelihood(rho: Array, holds: Sequence[Hold], model: Model) -> Array:
    """Computes log p(all torques of an object | rho), (N,), for densities rho, (N, m)."""
    result = np.zeros(len(rho))
    shared = []
    for hold in holds:
        t = hold.tau_arm + rho @ hold.A.T  # (N, n)
        residual, variance = hold.y - t, model.s0**2 + (model.w * t) ** 2
        result -= 0.5 * (residual**2 / variance + np.log(2.0 * np.pi * variance)).sum(axis=1)
        if hold.geometry is not None:
            F = hold.geometry(rho) if callable(hold.geometry) else np.einsum("Nm,mnq->Nnq", rho, hold.geometry)
            weighted = F / variance[:, :, None]  # D^-1 F, (N, n, q)
            terms = np.einsum("Nnq,Nnp->Nqp", weighted, F), np.einsum("Nnq,Nn->Nq", weighted, residual)
            if model.shared_geometry:
                shared.append(terms)
            else:
                result += _correct_for_geometry(*terms)
    if shared:
        result += _correct_for_geometry(sum(term for term, _ in shared), sum(term for _, term in shared))
    return result


def _correct_for_geometry(FtF: Array, Ftr: Array) -> Array:
    """Computes log N(r; 0, D + F F') - log N(r; 0, D), including determinants, from F' D^-1 F and F' D^-1 r."""
    M = np.eye(Ftr.shape[1]) + FtF
    quadratic = (Ftr[:, :, None] * np.linalg.solve(M, Ftr[:, :, None])).sum(axis=(1, 2))
    return np.asarray(0.5 * (quadratic - np.linalg.slogdet(M)[1]))


def compute_grid_log_likelihood(axes: Sequence[Axis], holds: Sequence[Hold], model: Model) -> Array:
    """Computes the log likelihood of an object on a tensor grid with one axis per material."""
    shape = tuple(len(axis.x) for axis in axes)
    flat = np.empty(int(np.prod(shape)))
    for start in range(0, flat.size, CHUNK):
        indices = np.unravel_index(np.arange(start, min(start + CHUNK, flat.size)), shape)
        rho = np.stack([axis.x[index] for axis, index in zip(axes, indices, strict=True)], axis=1)
        flat[start : start + CHUNK] = compute_log_likelihood(rho, holds, model)
    return flat.reshape(shape)


def compute_kernel(mu: Array, rho: Array, scatter: float) -> Array:
    """Computes p(rho | mu) for one material, (num mu, num rho), [m^3/kg]."""
    return np.asarray(norm.pdf(rho, mu[:, None], scatter * mu[:, None]) / norm.cdf(1.0 / scatter))


def contract(log_f: Array, kernels: Sequence[Array]) -> Array:
    """Computes log sum_b prod_i kernels[i][a_i, b_i] f[b], axis by axis."""
    for i, kernel in enumerate(kernels):
        top = np.maximum(np.max(log_f, axis=i, keepdims=True), -1e300)  # finite where all of f is zero
        scaled = np.moveaxis(np.exp(log_f - top), i, -1) @ kernel.T
        with np.errstate(divide="ignore"):
            log_f = np.moveaxis(np.log(scaled), -1, i) + top
    return log_f


def align(array: Array, positions: Sequence[int], ndim: int) -> Array:
    """Moves axis j of an array to positions[j] of ndim axes. The other axes have length one."""
    missing = tuple(axis for axis in range(ndim) if axis not in positions)
    return np.expand_dims(np.transpose(array, np.argsort(positions)), missing)


def compute_marginals(log_mass: Array, axes: Sequence[Axis]) -> list[Marginal]:
    """Computes the marginal of each axis from unnormalised log probabilities on a tensor grid."""
    mass = np.exp(log_mass - log_mass.max())
    marginals = []
    for i, axis in enumerate(axes):
        p = mass.sum(axis=tuple(j for j in range(mass.ndim) if j != i))
        p = p / p.sum()
        mean = float(p @ axis.x)
        fine = np.linspace(axis.u[0], axis.u[-1], 20 * len(axis.u))
        cumulative = CubicSpline(axis.u, p).antiderivative()(fine)
        levels = np.interp(LEVELS, np.maximum.accumulate(cumulative / cumulative[-1]), fine)
        quantiles = CubicSpline(axis.u, axis.x)(levels)
        sd = float(np.sqrt(p @ (axis.x - mean) ** 2))
        marginals.append(Marginal(mean, sd, float(quantiles[2]), quantiles, axis.x, p))
    return marginals


def integrate(objects: dict[int, list[Hold]], owned: dict[int, Sequence[int]], axes: Axes, model: Model) -> Posterior:
    """Computes the posterior on a common tensor grid of all materials of the objects, in ascending order."""
    names = sorted({i for k in objects for i in owned[k]})
    log_prior = np.zeros([1] * len(names))
    for position, i in enumerate(names):
        mean, sd = model.priors[i] if model.priors else (model.prior_mean, model.prior_sd)
        log_p = truncnorm.logpdf(axes[i].x, -mean / sd, np.inf, loc=mean, scale=sd)
        log_prior = log_prior + align(log_p + np.log(axes[i].dx), [position], len(names))
    likelihoods, kernels, log_integrals = {}, {}, {}
    positions = {k: [names.index(i) for i in owned[k]] for k in objects}
    for k, holds in objects.items():
        rho_axes = [axes[k, i] for i in owned[k]]
        likelihoods[k] = compute_grid_log_likelihood(rho_axes, holds, model)
        for j, axis in enumerate(rho_axes):
            likelihoods[k] += align(np.log(axis.dx), [j], len(rho_axes))
        kernels[k] = [compute_kernel(axes[i].x, axes[k, i].x, model.scatter) for i in owned[k]]
        log_integrals[k] = align(contract(likelihoods[k], kernels[k]), positions[k], len(names))
    total = functools.reduce(np.add, log_integrals.values(), log_prior)
    mu = dict(zip(names, compute_marginals(total, [axes[i] for i in names]), strict=True))
    rho = {}
    for k, log_likelihood in likelihoods.items():
        others = functools.reduce(np.add, (value for other, value in log_integrals.items() if other != k), log_prior)
        away = tuple(position for position in range(len(names)) if position not in positions[k])
        seen = logsumexp(others, axis=away) if away else others  # log p(mu of this object | other objects), sorted
        seen = np.transpose(seen, np.argsort(np.argsort(positions[k])))  # in the object's order of materials
        log_mass = log_likelihood + contract(seen, [kernel.T for kernel in kernels[k]])
        for i, marginal in zip(owned[k], compute_marginals(log_mass, [axes[k, i] for i in owned[k]]), strict=True):
            rho[k, i] = marginal
    return Posterior(mu, rho, float(logsumexp(total)))


def narrow(marginal: Marginal, nodes: int) -> Axis:
    """Builds a finer grid where a marginal is above 1e-7 of its maximum and the density above 1e-5 of its mean."""
    (kept,) = np.nonzero(marginal.mass > 1e-7 * marginal.mass.max())
    low, high = marginal.grid[max(kept[0] - 2, 0)], marginal.grid[min(kept[-1] + 2, len(marginal.grid) - 1)]
    return build_axis(max(low, 1e-5 * marginal.mean), high, nodes)


def compute_posterior(
    holds: Iterable[Hold], materials: Sequence[Sequence[int]], model: Model, nodes: int | None = None
) -> Posterior:
    """Computes the posterior of mean and object densities, given all holds.

    Materials are integrated separately unless objects connect them. Wide initial grids are narrowed three times to
    the region of the posterior.

    Args:
        holds: Holds in any order.
        materials: Materials of each object, as integers, in the order of the columns of A.
        model: Constants.
        nodes: Number of nodes per axis; None for ``NODES``. Steps must be smaller than the scatter.

    Raises:
        ValueError: Objects connect more than three materials.
        ArithmeticError: A grid does not cover the posterior.
    """
    by_object: dict[int, list[Hold]] = {}
    for hold in holds:
        by_object.setdefault(hold.object, []).append(hold)
    owned = {k: materials[k] for k in sorted(by_object)}
    groups: list[set[int]] = []
    for own in owned.values():
        apart = [group for group in groups if not group & set(own)]
        groups = [*apart, set(own).union(*(group for group in groups if group & set(own)))]
    result = Posterior({}, {}, 0.0)
    for group in groups:
        if len(group) > len(NODES):
            raise ValueError(f"objects join {len(group)} materials, at most {len(NODES)} can be integrated")
        objects = {k: by_object[k] for k in owned if set(owned[k]) <= group}
        count = nodes or NODES[len(group)]
        coarse = min(count, {1: 800, 2: 200, 3: 100}[len(group)])
        keys: list[Any] = [*group, *((k, i) for k in objects for i in owned[k])]
        axes = {key: build_axis(0.003, 1.4 * (model.prior_mean + 7.0 * model.prior_sd), coarse) for key in keys}
        for size in (coarse, coarse, count):
            found = integrate(objects, owned, axes, model)
            axes = {key: narrow((found.rho if isinstance(key, tuple) else found.mu)[key], size) for key in keys}
        found = integrate(objects, owned, axes, model)
        for p in (marginal.mass for marginal in [*found.mu.values(), *found.rho.values()]):
            if not max(p[0], p[-1]) <= 1e-3 * p.max():  # also true of nan
                raise ArithmeticError(f"a grid ends where density is {max(p[0], p[-1]) / p.max():.1e} of its maximum")
        result = Posterior(result.mu | found.mu, result.rho | found.rho, result.log_evidence + found.log_evidence)
    return result


# Test cases: an arm with 7 joints holds rods still in one of three postures. Constants are invented but plausible for
# a robot arm with a payload of 7 kg. Rods have a diameter of 2.5 cm and are gripped at one end; their parts are in a
# row. Lever arms of the grip about the joints, [m], and torques of the arm alone, [N m], by posture and joint.
LEVERS = np.array([[2, 62, 5, 38, -3, 12, 0], [4, 45, 11, 33, 5, 10, 1], [0, 71, -4, 44, 2, 15, -1]]) / 100.0
ARM = np.array([[0, -310, 15, 140, -4, 18, 0], [5, -240, 28, 120, 7, 16, 1], [0, -360, -10, 160, 2, 20, 0]]) / 10.0
COSINES = np.array([0.1, 0.95, 0.2, 0.9, 0.1, 0.95, 0.05])  # joint torques due to a unit moment about the grip
Case = tuple[list[Hold], list[tuple[int, ...]], Model]


def build_case(
    rods: Sequence[Sequence[float]], num_holds: int, *, lengths: Any = None, error: float = 0.0, shared: bool = False
) -> Case:
    """Draws holds of rods, with the same random joint errors in all cases.

    Args:
        rods: Densities of the parts of each rod.
        num_holds: Number of holds of each rod.
        lengths: Lengths of the parts of each rod, [m]; None for equal parts and a total of 30 cm.
        error: Assumed relative SD of the volume of a rod; the SD of its centre is 10 cm times this value.
        shared: True if the geometry error of a rod is the same in all its holds.
    """
    rng, holds = np.random.default_rng(1), []
    for k, rod in enumerate(rods):
        length = np.array(lengths[k] if lengths else [0.3 / len(rod)] * len(rod))
        weights = 9.81 * np.pi * 0.0125**2 * length  # per unit of density
        centres = np.cumsum(length) - length / 2.0  # from the grip, [m]
        for n in range(num_holds):
            A = weights * (LEVERS[n % 3][:, None] + COSINES[:, None] * centres)
            t = ARM[n % 3] + A @ np.array(rod)
            y = t + rng.normal(size=7) * np.sqrt(0.097**2 + (0.07 * t) ** 2)
            G = error * np.stack([A, 0.1 * weights * COSINES[:, None]], axis=2).transpose(1, 0, 2)  # (m, n, 2)
            holds.append(Hold(k, y, ARM[n % 3], A, G if error else None))
    return holds, [tuple(range(len(rod))) for rod in rods], Model(shared_geometry=shared)


def build_cases() -> dict[str, Case]:
    """Builds the test cases of the table."""
    colours = {"one colour": [8000], "two colours": [8000, 700], "three colours": [8000, 700, 2700]}
    cases = {f"{name}, {n} x": build_case([rod], n) for name, rod in colours.items() for n in (1, 6, 30)}
    rods: Any = {"rods": [[8000]] * 4, "lengths": [[0.1], [0.2], [0.3], [0.45]]}
    cases |= {f"four lengths, {n} x": build_case(**rods, num_holds=n) for n in (1, 6)}
    cases["four lengths, 6 x, 5 % errors of geometry a hold"] = build_case(**rods, num_holds=6, error=0.05)
    cases["four lengths, 6 x, 5 % an object"] = build_case(**rods, num_holds=6, error=0.05, shared=True)
    cases["rods of one and two colours, 6 x"] = build_case([[8000], [8000, 700], [7600, 760]], 6)
    for factor in (1.3, 2, 10):
        cases[f"one of two lighter by {factor}, 6 x"] = build_case([[8000], [8000 / factor]], 6)
        cases[f"one of five lighter by {factor}, 6 x"] = build_case([*[[8000]] * 4, [8000 / factor]], 6)
    cases["first colour lighter by 2 in the second of three, 6 x"] = build_case([[8000, 700], [4000, 700], [8000]], 6)
    return cases


def load_holds(path: Path) -> Case:
    """Loads H holds of K objects from a file.

    The file contains ``object``, (H,); ``y`` and ``tau_arm``, (H, n); ``A``, (H, n, m); and ``materials``, (K, m),
    with -1 at the end of a row for missing materials, whose columns are ignored. ``geometry``, (H, m, n, q), is
    optional, as are scalars with the names of fields of ``Model``.
    """
    with np.load(path) as file:
        data = {name: file[name] for name in file.files}
    owned = [tuple(int(i) for i in row if i >= 0) for row in data["materials"]]
    holds = []
    for h, k in enumerate(data["object"].tolist()):
        G = data["geometry"][h, : len(owned[k])] if "geometry" in data else None
        holds.append(Hold(k, data["y"][h], data["tau_arm"][h], data["A"][h][:, : len(owned[k])], G))
    return holds, owned, Model(**{name: data[name].item() for name in Model._fields if name in data})


def compare_doubled(case: Case, nodes: int | None = None) -> tuple[Posterior, float]:
    """Computes a posterior with twice as many nodes, and the largest relative change in a mean, SD or median."""
    holds, owned, model = case
    size = nodes or NODES[max(len(own) for own in owned)]
    base, doubled = (compute_posterior(holds, owned, model, n) for n in (size, 2 * size))
    pairs = zip([*base.mu.values(), *base.rho.values()], [*doubled.mu.values(), *doubled.rho.values()], strict=True)
    return doubled, max(abs(a / b - 1.0) for one, two in pairs for a, b in zip(one[:3], two[:3], strict=True))


def main() -> None:
    """Prints a table of the test cases, or of holds from a file."""
    parser = argparse.ArgumentParser(description="Computes what held objects teach about materials by quadrature.")
    parser.add_argument("--holds", type=Path, help="an .npz file of holds, as load_holds describes it")
    path = parser.parse_args().holds
    print("| case | density, [kg/m^3] | mean | SD | 2.5 % | 25 % | median | 75 % | 97.5 % | change by doubling |")
    print("| --- |" + " --- |" * 9)
    for name, case in ({path.stem: load_holds(path)} if path else build_cases()).items():
        posterior, change = compare_doubled(case)
        rows = {f"mu {i}": marginal for i, marginal in sorted(posterior.mu.items())}
        rows |= {f"rho {i} of object {k}": marginal for (k, i), marginal in sorted(posterior.rho.items())}
        for label, marginal in rows.items():
            numbers = " | ".join(f"{number:.1f}" for number in (marginal.mean, marginal.sd, *marginal.quantiles))
            print(f"| {name} | {label} | {numbers} | {change:.1e} |", flush=True)


if __name__ == "__main__":
    main()
