"""Computes what held objects teach about materials by quadrature alone: ``python studies/exact_reference.py``.

It follows the written model and uses nothing of the library, so that the library can be compared with it:

    mu_i ~ N(1000, 4000^2), truncated at 0                     mean density of material i, [kg/m^3]
    rho_ki ~ N(mu_i, (.06 mu_i)^2), truncated at 0             density of material i in object k
    y ~ N(t, R), t = tau_arm + A rho_k                         mean torques of one hold of object k, [N m]
    R = diag(s0^2 + (w t)^2) + F F',  F = sum_i rho_ki G_i     F F' = Y Sigma(rho) Y', errors of geometry

R and its determinant are evaluated at the density that is integrated over. An object's densities are the same in all
its holds and independent between its materials, and given mu objects are independent. So the torques of object k enter
through I_k(mu) = integral of its likelihood times p(rho_k | mu), which is a product of kernels, one for each material:

    p(mu | all holds)    ~ p(mu) prod_k I_k(mu)
    p(rho_k | all holds) ~ L_k(rho_k) integral of p(rho_k | mu) p(mu) prod_{l != k} I_l(mu) dmu

All integrals are sums over tensor grids with at most three axes. Grids are equally spaced in a variable u, in which
densities are smooth and vanish at both ends; there the trapezoidal rule converges faster than any power of the step.
"""

import argparse
import functools
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.special import log_ndtr, logsumexp

Array = NDArray[np.float64]
Geometry = Array | Callable[[Array], Array] | None
NODES = {1: 800, 2: 300, 3: 140}  # nodes of an axis, by the number of axes; a check doubles them
LEVELS = (0.025, 0.25, 0.5, 0.75, 0.975)
CHUNK = 16384  # densities whose likelihood is computed at once, so that arrays stay in the processor's cache


class Model(NamedTuple):
    """Constants of the model. ``shared_geometry``: an object's error of geometry is the same in all of its holds."""

    prior_mean: float = 1000.0  # [kg/m^3]
    prior_sd: float = 4000.0  # [kg/m^3]
    scatter: float = 0.06  # standard deviation of an object's density, as a fraction of mu
    s0: float = 0.097  # [N m]
    w: float = 0.07
    shared_geometry: bool = False


class Hold(NamedTuple):
    """One hold: mean torques y and arm torques tau_arm, shape (n,), [N m], and A, shape (n, m), [N m / (kg/m^3)].

    Column i of A, which is Y Phi, belongs to the i-th material of the object. ``geometry`` is None; or coefficients G,
    shape (m, n, q), with F = sum_i rho_i G_i; or a function from densities (N, m) to factors F, shape (N, n, q).
    """

    object: int
    y: Array
    tau_arm: Array
    A: Array
    geometry: Geometry = None


class Marginal(NamedTuple):
    """One density's posterior, [kg/m^3]: summary, quantiles at ``LEVELS``, and the grid with its weights' sum of 1."""

    mean: float
    sd: float
    median: float
    quantiles: Array
    grid: Array
    mass: Array


class Posterior(NamedTuple):
    """Marginals of mu by material and of rho by (object, material), and the log probability of all torques."""

    mu: dict[int, Marginal]
    rho: dict[tuple[int, int], Marginal]
    log_evidence: float


class Axis(NamedTuple):
    """A grid of densities x = bend log(1 + e^u), equally spaced in u, and its weights dx, [kg/m^3]."""

    u: Array
    x: Array
    dx: Array


def build_axis(low: float, high: float, nodes: int) -> Axis:
    """Builds a grid from low to high that is logarithmic near zero, where kernels are narrow, and linear above."""
    bend = high / 6.0
    u_low, u_high = np.log(np.expm1(np.array([low, high]) / bend))
    u = np.linspace(u_low, u_high, nodes)
    return Axis(u, bend * np.logaddexp(0.0, u), bend / (1.0 + np.exp(-u)) * (u[1] - u[0]))


def compute_log_likelihood(rho: Array, holds: Sequence[Hold], model: Model) -> Array:
    """Computes log p(torques of all holds of one object | rho), shape (N,), for densities of shape (N, m)."""
    result = np.zeros(len(rho))
    inner: Any = 0.0  # F' D^-1 F and F' D^-1 r, summed over holds that share one error of geometry
    inner_r: Any = 0.0
    for hold in holds:
        t = hold.tau_arm + rho @ hold.A.T  # (N, n)
        residual, variance = hold.y - t, model.s0**2 + (model.w * t) ** 2
        result -= 0.5 * (residual**2 / variance + np.log(2.0 * np.pi * variance)).sum(axis=1)
        if hold.geometry is None:
            continue
        G = hold.geometry
        F = G(rho) if callable(G) else np.einsum("Nm,mnq->Nnq", rho, G)
        weighted = F / variance[:, :, None]  # D^-1 F, (N, n, q)
        FtF, Ftr = np.einsum("Nnq,Nnp->Nqp", weighted, F), np.einsum("Nnq,Nn->Nq", weighted, residual)
        if model.shared_geometry:
            inner, inner_r = inner + FtF, inner_r + Ftr
        else:
            result += _correct_for_geometry(FtF, Ftr)
    return result if np.ndim(inner) == 0 else result + _correct_for_geometry(inner, inner_r)


def _correct_for_geometry(FtF: Array, Ftr: Array) -> Array:
    """Turns the log density under D = diag(variance) into that under D + F F' (Woodbury, determinant lemma)."""
    M = np.eye(Ftr.shape[1]) + FtF
    solved = np.linalg.solve(M, Ftr[:, :, None])[:, :, 0]
    return 0.5 * ((Ftr * solved).sum(axis=1) - np.linalg.slogdet(M)[1])


def compute_grid_log_likelihood(axes: Sequence[Axis], holds: Sequence[Hold], model: Model) -> Array:
    """Computes an object's log likelihood on a tensor grid, one axis for each of its materials."""
    shape = tuple(len(axis.x) for axis in axes)
    flat = np.empty(int(np.prod(shape)))
    for start in range(0, flat.size, CHUNK):
        stop = min(start + CHUNK, flat.size)
        indices = np.unravel_index(np.arange(start, stop), shape)
        rho = np.stack([axis.x[index] for axis, index in zip(axes, indices, strict=True)], axis=1)
        flat[start:stop] = compute_log_likelihood(rho, holds, model)
    return flat.reshape(shape)


def compute_kernel(mu: Array, rho: Array, scatter: float) -> Array:
    """Computes p(rho | mu) of one material, shape (num mu, num rho), [m^3/kg]."""
    sd = scatter * mu[:, None]
    log_normal = -0.5 * ((rho - mu[:, None]) / sd) ** 2 - np.log(sd * np.sqrt(2.0 * np.pi))
    return np.exp(log_normal - log_ndtr(1.0 / scatter))


def contract(log_f: Array, kernels: Sequence[Array]) -> Array:
    """Computes the log of the sum over all axes b of prod_i kernels[i][a_i, b_i] f[b], axis by axis."""
    for i, kernel in enumerate(kernels):
        top = np.max(log_f, axis=i, keepdims=True)
        top = np.where(np.isfinite(top), top, 0.0)
        scaled = np.moveaxis(np.exp(log_f - top), i, -1) @ kernel.T
        with np.errstate(divide="ignore"):
            log_f = np.moveaxis(np.log(scaled), -1, i) + top
    return log_f


def spread(array: Array, positions: Sequence[int], ndim: int) -> Array:
    """Inserts axes of length one, so that axis j of the array becomes axis positions[j] of ndim axes."""
    shape = [1] * ndim
    for size, position in zip(array.shape, positions, strict=True):
        shape[position] = size
    return array.reshape(shape)


def compute_marginals(log_mass: Array, axes: Sequence[Axis]) -> list[Marginal]:
    """Computes the marginal of each axis from unnormalised log masses on a tensor grid."""
    top = log_mass.max()
    if not np.isfinite(top):
        raise ArithmeticError(f"no probability on the grid: largest log mass {top}")
    mass = np.exp(log_mass - top)
    marginals = []
    for i, axis in enumerate(axes):
        p = mass.sum(axis=tuple(j for j in range(mass.ndim) if j != i))
        p = p / p.sum()
        mean = float(p @ axis.x)
        cumulative = CubicSpline(axis.u, p / (axis.u[1] - axis.u[0])).antiderivative()
        fine = np.linspace(axis.u[0], axis.u[-1], 20 * len(axis.u))
        cdf = np.maximum.accumulate(cumulative(fine) / cumulative(fine[-1]))
        bend = axis.x[-1] / np.logaddexp(0.0, axis.u[-1])
        quantiles = bend * np.logaddexp(0.0, np.interp(LEVELS, cdf, fine))
        sd = float(np.sqrt(p @ (axis.x - mean) ** 2))
        marginals.append(Marginal(mean, sd, float(quantiles[2]), quantiles, axis.x, p))
    return marginals


Axes = dict[Any, Axis]  # by material for mu, by (object, material) for rho


def integrate(
    by_object: dict[int, list[Hold]], materials: dict[int, tuple[int, ...]], axes: Axes, model: Model
) -> Posterior:
    """Integrates over the given grids; the materials of these objects have one joint grid."""
    names = sorted({i for k in by_object for i in materials[k]})
    ndim = len(names)
    log_prior: Any = 0.0
    for position, i in enumerate(names):
        x = axes[i].x
        normal = -0.5 * ((x - model.prior_mean) / model.prior_sd) ** 2 - np.log(model.prior_sd * np.sqrt(2 * np.pi))
        log_p = normal - log_ndtr(model.prior_mean / model.prior_sd) + np.log(axes[i].dx)
        log_prior = log_prior + spread(log_p, [position], ndim)
    log_likelihoods, log_integrals = {}, {}
    for k, holds in by_object.items():
        rho_axes = [axes[k, i] for i in materials[k]]
        log_l = compute_grid_log_likelihood(rho_axes, holds, model)
        for j, axis in enumerate(rho_axes):
            log_l += spread(np.log(axis.dx), [j], len(rho_axes))
        kernels = [compute_kernel(axes[i].x, axes[k, i].x, model.scatter) for i in materials[k]]
        positions = [names.index(i) for i in materials[k]]
        # Axes of a contracted array are in the object's order of materials; the joint grid's are sorted.
        order = np.argsort(positions)
        log_i = np.transpose(contract(log_l, kernels), order)
        log_likelihoods[k], log_integrals[k] = log_l, spread(log_i, sorted(positions), ndim)
    total = functools.reduce(np.add, log_integrals.values(), log_prior)
    mu = dict(zip(names, compute_marginals(total, [axes[i] for i in names]), strict=True))
    rho = {}
    for k, log_l in log_likelihoods.items():
        others = functools.reduce(np.add, (v for other, v in log_integrals.items() if other != k), log_prior)
        positions = [names.index(i) for i in materials[k]]
        away = tuple(position for position in range(ndim) if position not in positions)
        seen = logsumexp(others, axis=away) if away else others
        seen = np.transpose(seen, np.argsort(np.argsort(positions)))  # back to the object's order
        back = [compute_kernel(axes[i].x, axes[k, i].x, model.scatter).T for i in materials[k]]
        marginals = compute_marginals(log_l + contract(seen, back), [axes[k, i] for i in materials[k]])
        rho.update({(k, i): marginal for i, marginal in zip(materials[k], marginals, strict=True)})
    return Posterior(mu, rho, float(logsumexp(total)))


def narrow(marginal: Marginal, nodes: int) -> Axis:
    """Builds a finer grid where a marginal is above 1e-7 of its maximum, and above 1e-4 of its mean."""
    (kept,) = np.nonzero(marginal.mass > 1e-7 * marginal.mass.max())
    low = marginal.grid[max(kept[0] - 2, 0)]
    high = marginal.grid[min(kept[-1] + 2, len(marginal.grid) - 1)]
    return build_axis(max(low, 1e-4 * marginal.mean), high, nodes)


def compute_posterior(
    holds: Iterable[Hold],
    materials: Sequence[Sequence[int]] | dict[int, tuple[int, ...]],
    *,
    model: Model = Model(),  # noqa: B008 - a frozen tuple
    nodes: int | None = None,
) -> Posterior:
    """Computes the posterior of all mean densities and of all objects' densities, given all holds.

    Materials that share no object, directly or through others, are integrated apart from each other.

    Args:
        holds: Holds in any order.
        materials: Materials of each object, as whole numbers; column i of A belongs to the i-th.
        model: Constants.
        nodes: Nodes of each axis, or None for ``NODES``.
    Raises: ValueError: more than three materials are joined by objects.
    """
    by_object: dict[int, list[Hold]] = {}
    for hold in holds:
        by_object.setdefault(hold.object, []).append(hold)
    owned = {k: tuple(materials[k]) for k in sorted(by_object)}
    components: list[set[int]] = []
    for own in owned.values():
        joined = [group for group in components if group & set(own)]
        components = [group for group in components if not group & set(own)] + [set(own).union(*joined)]
    mu: dict[int, Marginal] = {}
    rho: dict[tuple[int, int], Marginal] = {}
    log_evidence = 0.0
    for group in components:
        if len(group) > len(NODES):
            raise ValueError(f"objects join {len(group)} materials, at most {len(NODES)} can be integrated")
        own_holds = {k: by_object[k] for k in owned if set(owned[k]) <= group}
        count = nodes or NODES[len(group)]
        keys: list[Any] = [*group, *((k, i) for k in own_holds for i in owned[k])]
        highest = model.prior_mean + 7.0 * model.prior_sd
        axes = {key: build_axis(0.1, highest * 1.4, min(count, 800)) for key in keys}
        for size in (*[min(count, {1: 800, 2: 200, 3: 80}[len(group)])] * 3, count):
            found = integrate(own_holds, owned, axes, model)
            axes = {key: narrow(found.rho[key] if isinstance(key, tuple) else found.mu[key], size) for key in keys}
        found = integrate(own_holds, owned, axes, model)
        mu, rho, log_evidence = mu | found.mu, rho | found.rho, log_evidence + found.log_evidence
    for key, marginal in [*mu.items(), *rho.items()]:
        edge = max(marginal.mass[0], marginal.mass[-1]) / marginal.mass.max()
        if edge > 1e-3:
            raise ArithmeticError(
                f"the grid of {key} cuts probability off: density at an edge {edge:.1e} of its maximum"
            )
    return Posterior(mu, rho, log_evidence)


# Cases: an arm holds rods still, with 7 joints in one of three postures. Lever arms and arm torques are made up, but
# plausible for a robot arm of 7 kg payload. A rod of 2.5 cm is gripped at one end; its parts follow each other.
LEVERS = np.array([[0.02, 0.62, 0.05, 0.38, -0.03, 0.12, 0.0], [0.04, 0.45, 0.11, 0.33, 0.05, 0.10, 0.01]])
LEVERS = np.vstack([LEVERS, [0.0, 0.71, -0.04, 0.44, 0.02, 0.15, -0.01]])  # of the grip, [m], (postures, joints)
COSINES = np.array([0.1, 0.95, 0.2, 0.9, 0.1, 0.95, 0.05])  # joint torque of a unit moment about the grip
ARM_TORQUES = np.array(
    [[0, -31, 1.5, 14, -0.4, 1.8, 0], [0.5, -24, 2.8, 12, 0.7, 1.6, 0.1], [0, -36, -1, 16, 0.2, 2, 0]]
)


def hold_rod(
    rng: np.random.Generator,
    k: int,
    densities: Sequence[float],
    lengths: Sequence[float],
    *,
    number: int,
    error: float = 0,
) -> list[Hold]:
    """Draws holds of one rod. ``error`` is the relative SD of its volume and, times 10 cm, the SD of its centre."""
    volumes = np.pi * 0.0125**2 * np.array(lengths)  # [m^3]
    centres = np.cumsum(lengths) - np.array(lengths) / 2.0  # from the grip, [m]
    holds = []
    for n in range(number):
        A = 9.81 * volumes * (LEVERS[n % 3][:, None] + COSINES[:, None] * centres)
        shift = 0.1 * 9.81 * volumes * COSINES[:, None]
        G = error * np.stack([A, shift], axis=2).transpose(1, 0, 2) if error else None  # (m, n, 2)
        t = ARM_TORQUES[n % 3] + A @ np.array(densities)
        y = t + rng.normal(size=7) * np.sqrt(0.097**2 + (0.07 * t) ** 2)
        holds.append(Hold(k, y, ARM_TORQUES[n % 3], A, G))
    return holds


Case = tuple[list[Hold], list[tuple[int, ...]], Model]


def build_cases() -> dict[str, Case]:
    """Builds the cases of the table, each with random errors of its own."""
    cases: dict[str, Case] = {}

    def add(name: str, objects: Sequence[Sequence[float]], number: int, **options: Any) -> None:
        rng = np.random.default_rng(len(cases))
        lengths = options.get("lengths", [[0.3 / len(densities)] * len(densities) for densities in objects])
        holds: list[Hold] = []
        for k, densities in enumerate(objects):
            holds += hold_rod(rng, k, densities, lengths[k], number=number, error=options.get("error", 0.0))
        owned = [tuple(range(len(densities))) for densities in objects]
        cases[name] = holds, owned, Model(shared_geometry=options.get("shared", False))

    for number in (1, 6, 30):
        add(f"one colour, held {number} x", [[8000]], number)
    for number in (1, 6, 30):
        add(f"two colours, held {number} x", [[8000, 700]], number)
    for number in (1, 6):
        add(f"three colours, held {number} x", [[8000, 700, 2700]], number)
    rods = [[0.1], [0.2], [0.3], [0.45]]
    add("four rods of 10 to 45 cm, held 1 x", [[8000]] * 4, 1, lengths=rods)
    add("the same, 5 % errors of geometry in each hold", [[8000]] * 4, 6, lengths=rods, error=0.05)
    add("the same, an object's errors the same in all", [[8000]] * 4, 6, lengths=rods, error=0.05, shared=True)
    add("rods of one and two colours, held 6 x", [[8000], [8000, 700], [7600, 760]], 6)
    for factor in (1.3, 2, 10):
        add(f"one of two rods lighter by {factor}, held 6 x", [[8000], [8000 / factor]], 6)
    for factor in (1.3, 2, 10):
        add(f"one of five rods lighter by {factor}, held 6 x", [[8000]] * 4 + [[8000 / factor]], 6)
    add("two colours, first lighter by 2 in one, held 6 x", [[8000, 700], [4000, 700], [8000]], 6)
    return cases


def load_holds(path: Path) -> Case:
    """Loads holds: ``object`` (H,), ``y`` and ``tau_arm`` (H, n), ``A`` (H, n, m) and ``materials`` (K, m) by object.

    Missing materials are -1 at the end of a row, and their columns are ignored. ``geometry``, shape (H, m, n, q), may be
    missing. Scalars named like a field of ``Model`` replace its default.
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
    """Computes a posterior with doubled nodes, and the largest relative change of a mean, SD or median by doubling."""
    holds, owned, model = case
    size = nodes or NODES[max(len(own) for own in owned)]
    base, doubled = (compute_posterior(holds, owned, model=model, nodes=n) for n in (size, 2 * size))
    pairs = [(base.mu[i], doubled.mu[i]) for i in base.mu] + [(base.rho[i], doubled.rho[i]) for i in base.rho]
    return doubled, max(abs(a / b - 1.0) for one, two in pairs for a, b in zip(one[:3], two[:3], strict=True))


def main() -> None:
    """Prints a table of the cases, or of one file of holds."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--holds", type=Path, help="an .npz file of holds, as load_holds describes it")
    path = parser.parse_args().holds
    print("| case | density, [kg/m^3] | mean | SD | 2.5 % | 25 % | median | 75 % | 97.5 % | change by doubling |")
    print("| --- |" + " --- |" * 9)
    for name, case in ({path.stem: load_holds(path)} if path else build_cases()).items():
        posterior, change = compare_doubled(case)
        rows = [(f"mu of material {i}", m) for i, m in sorted(posterior.mu.items())]
        rows += [(f"rho of object {k}, material {i}", m) for (k, i), m in sorted(posterior.rho.items())]
        for label, m in rows:
            numbers = " | ".join(f"{number:.1f}" for number in (m.mean, m.sd, *m.quantiles))
            print(f"| {name} | {label} | {numbers} | {change:.1e} |", flush=True)


if __name__ == "__main__":
    main()
