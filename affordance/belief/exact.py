"""Computes the posterior of mean material densities from all holds, for many observers at once.

    mu_i ~ N(m_i, s_i^2) for mu_i > 0                  mean density of material i, [kg/m^3]
    rho_k = mu_i (1 + deviation delta_k)               density of object k, with delta_k ~ N(0, 1)
    y ~ N(t, s0^2 + (w t)^2),  t = tau_arm + A rho_k   mean torques of one hold of object k, [N m]

All measurements are stored (``holds``) instead of a running approximation. The posterior is therefore independent of
the order of objects. Objects can be forgotten, and memories can be merged.

Each mu_i is a function of a score z_i, which is N(0, 1) a priori. The marginal of a score is computed on a grid. At
each node, Laplace's method integrates over all other scores and all delta (Tierney and Kadane 1986, J. Am. Stat.
Assoc. 81:82; Rue, Martino and Chopin 2009, J. R. Stat. Soc. B 71:319). Means and SDs of mu_i and rho_k are sums over
the grid; correlations are computed at the mode. If two or three mean densities are coupled by common objects, a joint
grid of their scores gives the correlations as well. The result is a normal distribution, which has these moments
after restriction to positive densities.
"""

from collections.abc import Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import scipy  # imports its submodules on first use; interpolation takes a tenth of a second
from numpy.typing import NDArray
from scipy.special import log_ndtr, ndtri_exp

from affordance.arrays import Array, Mask
from affordance.belief.holds import Holds, compute_log_likelihood, fit_torques, reduce_errors
from affordance.belief.normals import Normals, invert
from affordance.belief.positive_normal import find_untruncated, find_untruncated_joint

# Ratio of mean to SD above which the bound at zero is ignored; absolute correlation below which densities count as
# independent.
_FREE, _RELATED = 6.0, 0.02
# Two densities form a ridge that both bounds cut if their means are below this number of SDs and their absolute
# correlation is above this value.
_CUT, _RIDGE = 2.1, 0.5
_LEAST_PRECISION = 1e-6  # smallest eigenvalue of a scaled precision
# Nodes of a score's grid, in SDs at the mode. A cubic spline interpolates the log marginal to the points, with linear
# extrapolation beyond the nodes.
_NODES, _POINTS = np.array([-4.0, -2.5, -1.2, 0.0, 1.2, 2.5, 4.0]), np.arange(-8.0, 6.6, 0.25)
# Numbers of scores with a joint grid, and largest number of observers for which grids of three scores are computed at
# once. A joint grid has more nodes along directions that the data do not determine, and half as many points per
# score.
_JOINT, _MOST_AT_ONCE = (2, 3), 8
_RIDGE_NODES = np.linspace(-4.0, 4.0, 13)
_LEAST_CURVATURE = 0.1  # smallest curvature of the log posterior by a deviation; the prior contributes 1
# Expected gain in log posterior below which Newton's method has converged, at the mode and at a node. If the gain is
# below the last value, one more step is enough, because convergence is quadratic and rounding hides smaller gains.
_SETTLED, _SETTLED_NODE, _LAST = 1e-20, 1e-10, 1e-10
_LARGE_GAIN = 30.0  # twice the gain in log posterior above which one Newton step is too inaccurate
_MOST_STEPS, _MOST_HALVINGS = 100, 40
_LEAST_SCORE = -8.0  # lower scores are equivalent to minus infinity in double precision


class Experience(NamedTuple):
    """Prior of M mean densities, and measurements of B observers for T objects with at most C densities."""

    prior: Normals  # prior of the mean densities
    holds: Holds
    kinds: NDArray[np.intp]  # index of the mean density of each object density, (B, T, C)
    is_used: Mask  # False for unused places of objects with fewer densities, (B, T, C)
    deviation: Array  # SD of an object's density as a fraction of the mean, (B,)
    # Objects whose own densities are computed: one per observer, (B,), or K objects of a single observer, (K,). None
    # computes mean densities only.
    things: NDArray[np.intp] | None = None

    def take(self, rows: NDArray[np.intp]) -> "Experience":
        """Selects observers."""
        of_things = None if self.things is None else self.things[rows]
        arrays = (self.kinds[rows], self.is_used[rows], self.deviation[rows])
        return Experience(self.prior.take(rows), self.holds.take(rows), *arrays, of_things)


class GivenMeans(NamedTuple):
    """Linear normal model of an object's C densities given M mean densities, for B observers."""

    offset: Array  # expected densities if all mean densities are zero, (B, C), [kg/m^3]
    slopes: Array  # derivative of the expected densities by the mean densities, (B, C, M)
    covariance: Array  # (B, C, C), [(kg/m^3)^2]


class Posterior(NamedTuple):
    """Posterior of mean densities and of one object's densities, [kg/m^3]."""

    means: Normals  # unrestricted normal distributions of M mean densities, (B, M)
    own: Normals | None  # unrestricted normal distributions of the object's C densities, (B, C)
    given_means: GivenMeans | None = None  # the object's densities given the mean densities
    log_evidence: float | Array = 0.0  # log probability density of all measurements (Laplace's method), (B,)


class _Point(NamedTuple):
    """Log posterior and its derivatives at given scores z, (B, n, M), and deviations d, (B, n, T, C)."""

    value: Array  # (B, n)
    of_things: Array  # term of each object in the value, (B, n, T)
    of_means: Array  # term of each mean density in the value, (B, n, M)
    gz: Array  # first derivatives by z, (B, n, M)
    gd: Array  # first derivatives by d, (B, n, T, C)
    A: Array  # negative second derivatives by z, (B, n, M, M)
    C: Array  # negative mixed derivatives by d and z, (B, n, T, C, M)
    D: Array  # negative second derivatives by d, (B, n, T, C, C)
    mu: Array  # mean densities, (B, n, M)
    slope: Array  # d mu / d z, (B, n, M)


class _Model:
    """Log posterior of scores and deviations for B observers."""

    def __init__(self, experience: Experience) -> None:
        prior, holds, kinds, is_used, deviation, _ = experience
        # Geometry errors that change no torque would only cost time.
        holds = reduce_errors(holds, kinds.shape[1]) if holds.errors.shape[2] else holds
        self.holds, self.deviation = holds, deviation[:, None, None, None]
        self.precision, self.information = prior.precision[:, None], prior.information_vector[:, None]
        self.size = prior.mean.shape[1]
        self.selection = (kinds[..., None] == np.arange(self.size)) & is_used[..., None]  # (B, T, C, M)
        self.sd = np.sqrt(np.diagonal(prior.covariance, axis1=1, axis2=2))[:, None]  # (B, 1, M)
        self.mode = prior.mean[:, None]
        self.log_share = log_ndtr(self.mode / self.sd)
        # Log of the prior's normalising constant; the probability of positive densities neglects correlations.
        quadratic = (self.mode * self.information).sum(axis=(1, 2))
        self.log_scale = 0.5 * (np.linalg.slogdet(prior.precision)[1] - quadratic) - self.log_share.sum(axis=(1, 2))

    def take(self, rows: NDArray[np.intp]) -> "_Model":
        """Selects observers."""
        other = object.__new__(_Model)
        for name, value in vars(self).items():
            setattr(other, name, value[rows] if isinstance(value, np.ndarray) else value)
        other.holds = self.holds.take(rows)
        return other

    def find_densities(self, z: Array) -> tuple[Array, Array, Array]:
        """Computes mean densities mu, (B, n, M), and their first two derivatives by the scores."""
        x = -ndtri_exp(self.log_share + log_ndtr(-z))
        slope = self.sd * np.exp(0.5 * (x - z) * (x + z) + self.log_share)
        # Far below the mode, x is a small difference of large numbers; the bound keeps mu positive.
        mu = np.maximum(self.mode + self.sd * x, 1e-12 * self.sd)
        return mu, slope, slope * (x * slope / self.sd - z)

    def evaluate(self, z: Array, d: Array, *, is_expected: bool = False) -> _Point:
        """Computes the log posterior and its derivatives.

        If ``is_expected``, A, C and D are expectations and form a positive definite matrix.
        """
        mu, slope, bend = self.find_densities(z)
        S, f = self.selection[:, None].astype(float), self.deviation
        own = (S @ mu[:, :, None, :, None])[..., 0]  # mu of each density, (B, n, T, C)
        e = 1.0 + f * d
        slopes = compute_log_likelihood(self.holds, own * e, is_expected=is_expected)
        g, H = slopes.gradient, slopes.hessian
        log_jacobian = np.log(slope)
        Lambda, eta = self.precision, self.information
        product = (Lambda @ mu[..., None])[..., 0]
        of_means = mu * (eta - 0.5 * product) + log_jacobian
        of_things = slopes.value - 0.5 * (d**2).sum(axis=-1)
        value = of_means.sum(axis=-1) + of_things.sum(axis=-1)
        # Derivatives by mean densities are sums over all objects of the kind.
        g_mu = eta - product + ((e * g)[..., None] * S).sum(axis=(-3, -2))
        eH, scale, unit = e[..., None] * H, f * own, np.eye(d.shape[-1])
        ES = S.transpose(0, 1, 2, 4, 3)  # (B, 1, T, M, C)
        H_mu = (ES @ (eH * e[..., None, :]) @ S).sum(axis=-3)
        # Derivatives by deviations, and mixed derivatives with rows for d and columns for mu.
        D = unit - scale[..., None] * H * scale[..., None, :]
        mixed = scale[..., None] * H * e[..., None, :]
        # Derivatives by scores; those of the log slope follow from log slope = (x^2 - z^2) / 2 + constant.
        x, ratio = (mu - self.mode) / self.sd, slope / self.sd
        gz = slope * g_mu + x * ratio - z
        if is_expected:
            A = np.eye(self.size) - slope[..., None] * H_mu * slope[..., None, :]
        else:
            mixed = mixed + (f * g)[..., None] * unit
            A = slope[..., None] * (Lambda - H_mu) * slope[..., None, :]
            A[..., range(self.size), range(self.size)] -= bend * g_mu + ratio**2 + x * bend / self.sd - 1.0
        C = -(mixed @ S) * slope[..., None, None, :]
        return _Point(value, of_things, of_means, gz, scale * g - d, A, C, D, mu, slope)


class _Curvature(NamedTuple):
    """Factors of the negative Hessian without fixed scores, and the Newton step."""

    DC: Array  # D^-1 C, (B, n, T, C, M)
    Dg: Array  # D^-1 g, (B, n, T, C)
    inverse: Array  # covariance of the scores, (A - C^T D^-1 C)^-1, zero for fixed scores, (B, n, M, M)
    log_det: Array  # log determinant of the negative Hessian, (B, n)
    dz: Array  # Newton step of the scores, (B, n, M)
    dd: Array  # Newton step of the deviations, (B, n, T, C)
    gain: Array  # twice the expected gain in log posterior by the step, (B, n)


def _solve(point: _Point, fixed: Array) -> tuple[_Curvature, Mask]:
    """Computes the Newton step. Also returns a mask of positive definite negative Hessians, (B, n)."""
    A, C, D = point.A, point.C, point.D
    if D.shape[-1] == 1:
        inverse_D, log_D, ok = 1.0 / D, np.log(np.maximum(D[..., 0, 0], 1e-300)), D[..., 0, 0] > 0.0
    else:
        inverse_D, (sign, log_D) = np.linalg.inv(D), np.linalg.slogdet(D)
        ok = (sign > 0.0) & (np.linalg.eigvalsh(D)[..., 0] > 0.0)
    DC, Dg = inverse_D @ C, (inverse_D @ point.gd[..., None])[..., 0]
    M = A.shape[-1]
    schur = A - (np.swapaxes(C, -1, -2) @ DC).sum(axis=-3)
    free = 1.0 - fixed
    schur = schur * free[..., None] * free[..., None, :] + np.eye(M) * fixed[..., None]
    g = (point.gz - (C * Dg[..., None]).sum(axis=(-3, -2))) * free
    if M == 1:
        inverse, log_schur, definite = (
            1.0 / schur,
            np.log(np.maximum(schur[..., 0, 0], 1e-300)),
            schur[..., 0, 0] > 0.0,
        )
    else:
        values = np.linalg.eigvalsh(schur)
        definite = values[..., 0] > 0.0
        inverse, log_schur = np.linalg.inv(schur), np.log(np.maximum(values, 1e-300)).sum(axis=-1)
    dz = (inverse @ g[..., None])[..., 0]
    dd = Dg - (DC @ dz[:, :, None, :, None])[..., 0]
    gain = (dz * g).sum(axis=-1) + (Dg * point.gd).sum(axis=(-2, -1))
    inverse = inverse * free[..., None] * free[..., None, :]
    return _Curvature(DC, Dg, inverse, log_D.sum(axis=-1) + log_schur, dz, dd, gain), definite & ok.all(axis=-1)


class _Mode(NamedTuple):
    """Mode of the log posterior over all scores that are not fixed, with its curvature."""

    z: Array
    d: Array
    point: _Point
    curvature: _Curvature


def _climb(model: _Model, z: Array, d: Array, fixed: Array, settled: float) -> _Mode:
    """Finds modes by Newton's method with step halving.

    If a Hessian is not negative definite, it is replaced by its expectation.

    Args:
        model: Log posterior of B observers.
        z: Initial scores, (B, n, M).
        d: Initial deviations, (B, n, T, C).
        fixed: 1 for scores that stay constant, otherwise 0, (B, n, M).
        settled: Expected gain below which a search has converged.
    """
    found = _Mode(z, d, *_look(model, z, d, fixed))
    left, part, here, ended = np.arange(len(z)), model, found, np.zeros(fixed.shape[:2], dtype=bool)
    for _ in range(_MOST_STEPS):
        moves = (here.curvature.gain > settled) & ~ended  # (b, n)
        going = np.flatnonzero(moves.any(axis=1))
        if not len(going):
            return found
        if len(going) < len(left):
            left, part, here, moves = left[going], part.take(going), _take(here, going), moves[going]
            ended = ended[going]
        length, free, is_last = moves.astype(float), fixed[left], here.curvature.gain <= _LAST
        for _ in range(_MOST_HALVINGS):
            z = np.maximum(here.z + length[..., None] * here.curvature.dz, _LEAST_SCORE)
            d = here.d + length[..., None, None] * here.curvature.dd
            point = part.evaluate(z, d)
            worse = ~(point.value >= here.point.value - 1e-12 * np.abs(here.point.value)) & ~is_last
            if not worse.any():
                break
            length = np.where(worse, 0.5 * length, length)
        ended |= is_last | worse  # if all step lengths are worse, the remaining gain is below rounding errors
        here = _Mode(z, d, *_look(part, z, d, free, point))
        found = here if len(left) == len(found.z) else _put(found, left, here)
    return found


def _look(model: _Model, z: Array, d: Array, fixed: Array, point: _Point | None = None) -> tuple[_Point, _Curvature]:
    """Computes the log posterior and the Newton step at a point."""
    point = model.evaluate(z, d) if point is None else point
    curvature, is_definite = _solve(point, fixed)
    if not is_definite.all():
        safe, _ = _solve(model.evaluate(z, d, is_expected=True), fixed)
        curvature = _Curvature(*(_choose(is_definite, one, two) for one, two in zip(curvature, safe, strict=True)))
    return point, curvature


def _start(model: _Model, prior: Normals, T: int, C: int) -> tuple[Array, Array]:
    """Computes two starting points for scores, (B, 2, M), and deviations, (B, 2, T, C).

    The first is a fit of the torques, the second is zero. Two are needed because the log posterior may have several
    maxima (``fit_torques``).
    """
    S, f = model.selection.astype(float), model.deviation[:, 0]
    P, q = fit_torques(model.holds, T)
    mode, sd = (
        (S @ np.broadcast_to(each, prior.mean.shape)[:, None, :, None])[..., 0]
        for each in (prior.mean, model.sd[:, 0])
    )
    sd = np.where(sd > 0.0, sd, 1.0)
    own = np.linalg.solve(P + np.eye(C) / sd[..., None] ** 2, (q + mode / sd**2)[..., None])[..., 0]
    own = np.maximum(own, 1e-3 * sd)
    spread = np.eye(C) + P * (f * own)[..., None, :] ** 2
    precision = prior.precision + (S.mT @ np.linalg.solve(spread, P) @ S).sum(axis=1)
    information = prior.information_vector + (S.mT @ np.linalg.solve(spread, q[..., None]))[..., 0].sum(axis=1)
    sds = model.sd[:, 0]
    mu = np.maximum(np.linalg.solve(precision, information[..., None])[..., 0], 1e-3 * sds)
    z = -ndtri_exp(log_ndtr(-(mu - prior.mean) / sds) - model.log_share[:, 0])
    d = np.where(
        model.selection.any(axis=-1) & (f > 0.0),
        own / np.maximum((S @ mu[:, None, :, None])[..., 0], 1e-300) - 1.0,
        0.0,
    )
    d = d / np.where(f > 0.0, f, 1.0)
    return np.stack([z, np.zeros_like(z)], axis=1), np.stack([d, np.zeros_like(d)], axis=1)


def _choose_best(found: _Mode) -> _Mode:
    """Selects the mode with the largest probability mass by Laplace's method."""
    z, d, point, curvature = found
    rows, best = np.arange(len(z)), (point.value - 0.5 * curvature.log_det).argmax(axis=1)

    def take(array: Array) -> Array:
        return np.asarray(array[rows, best][:, None])

    return _Mode(take(z), take(d), _Point(*map(take, point)), _Curvature(*map(take, curvature)))


def _choose(where: Mask, one: Array, other: Array) -> Array:
    return np.where(where.reshape(*where.shape, *[1] * (one.ndim - 2)), one, other)


def _take(mode: _Mode, rows: NDArray[np.intp]) -> _Mode:
    z, d, point, curvature = mode
    return _Mode(z[rows], d[rows], _Point(*(a[rows] for a in point)), _Curvature(*(a[rows] for a in curvature)))


def _put(mode: _Mode, rows: NDArray[np.intp], part: _Mode) -> _Mode:
    def put(one: Array, other: Array) -> Array:
        one = one.copy()
        one[rows] = other
        return one

    point = _Point(*(put(one, other) for one, other in zip(mode.point, part.point, strict=True)))
    curvature = _Curvature(*(put(one, other) for one, other in zip(mode.curvature, part.curvature, strict=True)))
    return _Mode(put(mode.z, part.z), put(mode.d, part.d), point, curvature)


def compute_posterior(experience: Experience) -> Posterior:
    """Computes the posterior of mean densities and of one object's densities."""
    prior, holds, kinds, is_used, deviation, things = experience
    B, M = prior.mean.shape
    owned = ((kinds[..., None] == np.arange(M)) & is_used[..., None]).any(axis=2)  # (B, T, M)
    joined = (prior.covariance != 0.0) | np.eye(M, dtype=bool) | (owned.mT @ owned)
    joined = np.linalg.matrix_power(joined, M)  # (B, M, M)
    patterns = np.concatenate([joined.reshape(B, -1), owned.any(axis=1)], axis=1)
    if (patterns != patterns[:1]).any():
        return _split(experience, patterns)
    joined = joined[0]
    if not (joined.all() and owned.any()):
        return _divide(experience, joined, owned)
    T, C = kinds.shape[1:]
    is_separate = not is_used[..., 1:].any() and not prior.covariance[:, ~np.eye(M, dtype=bool)].any()
    is_joint = M in _JOINT and not is_separate
    if is_joint and M > 2 and B > _MOST_AT_ONCE:
        return _split(experience, np.arange(B)[:, None] // _MOST_AT_ONCE)
    model = _Model(experience)
    z, d = _start(model, prior, T, C)
    if is_separate and not holds.errors.shape[2]:  # the fit of a single density is close to the mode
        z, d = z[:, :1], d[:, :1]
    mode = _choose_best(_climb(model, z, d, np.zeros((*z.shape[:2], M)), _SETTLED))
    grid = (_tabulate_separate if is_separate else _tabulate_joint if is_joint else _tabulate)(model, mode)
    mean = (grid.mass * grid.mu).sum(axis=-1)
    sd = np.sqrt((grid.mass * (grid.mu - mean[..., None]) ** 2).sum(axis=-1))
    expansion, covariance = _expand(model, mode), _find_covariance(mode)
    if is_joint:
        covariance = _correlate(grid.mass, grid.mu - mean[..., None])
    is_quadratic = ~((holds.noise[..., 1] > 0.0).any(axis=1) | (holds.errors != 0.0).any(axis=(1, 2, 3, 4)))
    points = None if grid.log_volumes is None else _Points(grid.mu, grid.log_volumes, np.ones(B, dtype=bool))
    means = _restrict(mean, sd, covariance, expansion, is_quadratic, points)
    log_evidence = model.log_scale + (mode.point.value - 0.5 * mode.curvature.log_det)[:, 0]
    if things is None:
        return Posterior(means, None, None, log_evidence)
    rows, point = np.broadcast_to(np.arange(B), things.shape), mode.point
    own_kinds, used = kinds[rows, things], is_used[rows, things]  # (B, C)
    at, f = (rows[:, None], own_kinds), deviation[:, None]
    cells = rows[:, None], own_kinds, slice(None), things[:, None], np.arange(C)
    mass, mu, d, variance = grid.mass[at], grid.mu[at], grid.d[cells], grid.variance[cells]  # (B, C, n)
    own = mu * (1.0 + f[..., None] * d)
    own_mean = (mass * own).sum(axis=-1)
    squares = (own - own_mean[..., None]) ** 2 + (f[..., None] * mu) ** 2 * variance
    own_sd = np.sqrt((mass * squares).sum(axis=-1))
    # Near the mode, rho = mu (1 + f d) changes by e dmu + f mu dd. If mu changes, d changes by -D^-1 C dmu.
    e, scale = 1.0 + f * mode.d[rows, 0, things], f * point.mu[:, 0][at]
    slopes = (own_kinds[..., None] == np.arange(M)) * e[..., None]
    slopes = (slopes - scale[..., None] * mode.curvature.DC[rows, 0, things] / point.slope[:, 0, None]) * used[
        ..., None
    ]
    alone = scale[..., None] * invert(point.D[rows, 0, things]) * scale[:, None, :]
    alone = np.where(used[..., None] & used[:, None], alone, np.eye(used.shape[1]))
    own_center = point.mu[:, 0][at] * e + np.matvec(slopes, expansion.mean - point.mu[:, 0])
    own_mean, own_sd = np.where(used, own_mean, 1.0), np.where(used, own_sd, 1.0)
    own_expansion = Normals(own_center, slopes @ expansion.covariance @ slopes.mT + alone)
    if is_joint:
        spread = alone + _correlate(mass, np.where(used[..., None], own - own_mean[..., None], 0.0))
    else:
        spread = alone + slopes @ covariance @ slopes.mT
    if points is not None:  # the points also integrate over the densities of an object with all three materials
        order = np.sort(np.where(used, own_kinds, -1), axis=1)
        has_all = (order == np.arange(M)).all(axis=1) if M == C else np.zeros(len(rows), dtype=bool)
        points = _Points(mu, points.log_volumes[rows], has_all)
    own_normals = _restrict(own_mean, own_sd, spread, own_expansion, is_quadratic[rows], points)
    given_means = GivenMeans(own_center - np.matvec(slopes, expansion.mean), slopes, alone)
    return Posterior(means, own_normals, given_means, log_evidence)


def _split(experience: Experience, patterns: NDArray[Any]) -> Posterior:
    """Computes posteriors in groups of observers with equal patterns, so that observers do not affect each other."""
    numbers = np.unique(patterns, axis=0, return_inverse=True)[1].ravel()
    parts = [np.flatnonzero(numbers == number) for number in range(numbers.max() + 1)]
    order = np.argsort(np.concatenate(parts))
    found = [compute_posterior(experience.take(rows)) for rows in parts]

    def join(*arrays: Array) -> Array:
        return np.concatenate(arrays)[order]

    def join_normals(*each: Normals) -> Normals:
        return Normals(join(*(one.mean for one in each)), join(*(one.covariance for one in each)))

    means, own, given_means, log_evidence = zip(*found, strict=True)
    return Posterior(
        join_normals(*means),
        None if experience.things is None else join_normals(*own),
        None if experience.things is None else GivenMeans(*map(join, *given_means)),
        join(*log_evidence),
    )


def _divide(experience: Experience, joined: Mask, owned: Mask) -> Posterior:
    """Computes posteriors of independent groups of mean densities, which share neither prior nor objects.

    A group without objects keeps its prior.

    Args:
        experience: Experience of B observers.
        joined: True for mean densities of the same group, (M, M).
        owned: True for the mean densities of each object's materials, (B, T, M).
    """
    prior, holds, kinds, is_used, deviation, things = experience
    B, M = prior.mean.shape
    mean, covariance = prior.mean.copy(), prior.covariance.copy()
    own, given_means, rows, log_evidence = None, None, np.arange(B), np.zeros(B)
    if things is not None:
        rows, C = np.broadcast_to(rows, things.shape), kinds.shape[2]
        unit = np.tile(np.eye(C), (len(things), 1, 1))
        own = Normals(np.ones((len(things), C)), unit)
        given_means = GivenMeans(np.ones((len(things), C)), np.zeros((len(things), C, M)), unit.copy())
    for chosen in map(np.flatnonzero, np.unique(joined, axis=0)):
        is_own = owned[..., chosen].any(axis=2)  # (B, T)
        kept = np.flatnonzero(is_own.any(axis=0))
        if not len(kept):
            continue
        is_felt = np.take_along_axis(is_own, holds.thing, axis=1) & (holds.counts > 0)
        of_group = Holds._make(array[:, is_felt.any(axis=0)] for array in holds)
        is_felt = is_felt[:, is_felt.any(axis=0)]
        numbers, places = np.zeros(M, dtype=np.intp), np.zeros(kinds.shape[1], dtype=np.intp)
        numbers[chosen], places[kept] = np.arange(len(chosen)), np.arange(len(kept))
        used = is_used[:, kept] & is_own[:, kept, None]
        of_group = of_group._replace(thing=places[of_group.thing], counts=np.where(is_felt, of_group.counts, 0.0))
        own_kinds = np.where(used, numbers[kinds[:, kept]], 0)
        wanted = None if things is None else places[things]
        found = compute_posterior(
            Experience(prior.select(chosen.tolist()), of_group, own_kinds, used, deviation, wanted)
        )
        mean[:, chosen], covariance[:, chosen[:, None], chosen] = found.means.mean, found.means.covariance
        log_evidence = log_evidence + found.log_evidence
        if things is not None and own is not None and given_means is not None:
            assert found.own is not None
            assert found.given_means is not None
            here = np.flatnonzero(is_own[rows, things])
            own.mean[here], own.covariance[here] = found.own.mean[here], found.own.covariance[here]
            offset, slopes, rest = found.given_means
            given_means[0][here], given_means[2][here] = offset[here], rest[here]
            given_means.slopes[here[:, None, None], np.arange(C)[:, None], chosen] = slopes[here]
    return Posterior(Normals(mean, covariance), own, given_means, log_evidence)


def _find_covariance(mode: _Mode) -> Array:
    """Computes the covariance of mean densities at the mode, (B, M, M)."""
    slope = mode.point.slope[:, 0]
    covariance: Array = slope[..., None] * mode.curvature.inverse[:, 0] * slope[:, None]
    return covariance


def _expand(model: _Model, mode: _Mode) -> Normals:
    """Expands the log posterior at the mode to second order in mean densities, instead of scores.

    After restriction to positive densities, this is nearly exact even if the data do not determine all densities.
    """
    point, M = mode.point, model.size
    slope = point.slope[:, 0]
    flat = _find_covariance(mode)
    if M == 1:
        return Normals(point.mu[:, 0], flat)
    x = (point.mu - model.mode) / model.sd
    ratio = point.slope / model.sd
    bend = point.slope * (x * ratio - mode.z)
    gradient = (point.gz - x * ratio + mode.z) / point.slope  # derivative by mean densities, (B, 1, M)
    of_slope = bend * gradient + ratio**2 + x * bend / model.sd - 1.0
    precision = invert(mode.curvature.inverse[:, 0]) + of_slope[:, 0, :, None] * np.eye(M)
    precision = precision / (slope[..., None] * slope[:, None])
    values, vectors = np.linalg.eigh(precision)
    # If the log posterior is not concave in densities, the expansion in scores is used.
    is_concave = values[:, 0] > 1e-12 * values[:, -1]
    inverse = (vectors / np.where(is_concave[:, None], values, 1.0)[:, None]) @ vectors.mT
    covariance = np.where(is_concave[:, None, None], inverse, flat)
    shift = np.where(is_concave[:, None], np.matvec(covariance, gradient[:, 0]), 0.0)
    return Normals(point.mu[:, 0] + shift, covariance)


class _Points(NamedTuple):
    """Quadrature points for three densities."""

    mu: Array  # (B, 3, n), [kg/m^3]
    log_volumes: Array  # log volume of each point, (B, n)
    is_valid: Mask  # False for observers to whom the points do not apply, (B,)


class _Grid(NamedTuple):
    """Marginals of M scores at n points."""

    mass: Array  # probabilities, (B, M, n)
    mu: Array  # densities, (B, M, n)
    d: Array  # deviations at the mode given the score, (B, M, n, T, C)
    variance: Array  # variances of the deviations given the score, (B, M, n, T, C)
    # Log volume of each point in the space of three densities, (B, n); None for other numbers of densities.
    log_volumes: Array | None = None


def _tabulate(model: _Model, mode: _Mode) -> _Grid:
    """Computes the marginal of each score on a grid about the mode."""
    B, M = mode.z.shape[0], model.size
    T, C = mode.d.shape[2:]
    n, inverse = len(_NODES), mode.curvature.inverse[:, 0]
    variances = np.diagonal(inverse, axis1=1, axis2=2)
    slopes = inverse / variances[..., None]  # change of all scores per change of one score
    dz = slopes[:, :, None, :] * (np.sqrt(variances)[:, :, None] * _NODES)[..., None]
    z = np.maximum(mode.z[:, :, None] + dz, _LEAST_SCORE).reshape(B, M * n, M)
    dd = -(mode.curvature.DC @ dz.reshape(B, M * n, 1, M, 1))[..., 0]
    fixed = np.broadcast_to(np.eye(M)[:, None], (B, M, n, M)).reshape(B, M * n, M)
    found = _climb(model, z, mode.d + dd, fixed, _SETTLED_NODE)
    log_p = (found.point.value - 0.5 * found.curvature.log_det).reshape(B, M, n)
    D, DC = np.diagonal(invert(found.point.D), axis1=-2, axis2=-1), found.curvature.DC
    variance = D + ((DC @ found.curvature.inverse[:, :, None]) * DC).sum(axis=-1)
    shape = (B, M, n, T, C)
    return _interpolate(model, mode, log_p, found.d.reshape(shape), variance.reshape(shape))


def _tabulate_joint(model: _Model, mode: _Mode) -> _Grid:
    """Computes the joint distribution of two or three scores on a grid.

    Scores are ordered by decreasing SD. The grid of the first score is centred at its mode; the grid of each further
    score is centred at its mode given the previous scores.
    """
    (B, _, M), (T, C) = mode.z.shape, mode.d.shape[2:]
    nodes = [_RIDGE_NODES] * (M - 1) + [_NODES]
    splines = [_build_spline(*each, step=2) for each in nodes]
    shape: tuple[int, ...] = (B,)
    here, fixed, centres, log_widths, units = mode, np.zeros((B, 1, M)), [], [], []
    for level, each in enumerate(nodes):
        inverse, n = here.curvature.inverse, here.z.shape[1]  # covariance given the previous scores
        widest = np.diagonal(inverse[:, n // 2], axis1=1, axis2=2).argmax(axis=1)  # at the middle node
        unit = np.eye(M)[widest][:, None]
        column = np.matvec(inverse, unit)
        width = np.sqrt((column * unit).sum(axis=-1, keepdims=True))
        centres.append((here.z * unit).sum(axis=-1).reshape(*shape, 1))
        log_widths.append(np.log(width).reshape(*shape, 1))
        units.append(unit)
        dz = ((column / width)[:, :, None] * each[:, None]).reshape(B, -1, M)
        z = np.maximum(np.repeat(here.z, len(each), axis=1) + dz, _LEAST_SCORE)
        DC = np.repeat(here.curvature.DC, len(each), axis=1)
        d = np.repeat(here.d, len(each), axis=1) - (DC @ dz[:, :, None, :, None])[..., 0]
        fixed, shape = fixed + unit, (*shape, len(each))
        if level < M - 1:
            here = _climb(model, z, d, np.broadcast_to(fixed, z.shape), _SETTLED_NODE)
    point, curvature = _look(model, z, d, np.ones(z.shape))  # one Newton step is enough for the deviations ...
    rows = np.flatnonzero((curvature.gain > _LARGE_GAIN).any(axis=1))
    if len(rows):  # ... unless it is long: its expected gain may then be far above the actual gain
        found = _climb(model.take(rows), z[rows], d[rows], np.ones((len(rows), *z.shape[1:])), _SETTLED_NODE)
        _, d, point, curvature = _put(_Mode(z, d, point, curvature), rows, found)
    log_p = point.value + 0.5 * (curvature.gain - curvature.log_det)
    log_p = _extend(log_p.reshape(*shape, 1), splines, is_log=True)[..., 0]
    scores, sum_of_widths = np.zeros((*log_p.shape, M)), np.zeros(log_p.shape)
    points = _POINTS[::2]
    for level, (centre, log_width, unit) in enumerate(zip(centres, log_widths, units, strict=True)):
        log_width = _apply(log_width, [closest for _, closest in splines[:level]])
        of_level = _extend(centre, splines[:level]) + np.exp(log_width) * points
        rest = (1,) * (M - 1 - level)
        sum_of_widths += log_width.reshape(*log_width.shape, *rest)
        scores += of_level.reshape(*of_level.shape, *rest, 1) * unit.reshape(B, *[1] * M, M)
    log_p = (log_p + sum_of_widths).reshape(B, 1, -1)
    mass = np.exp(log_p - log_p.max(axis=-1, keepdims=True))
    mass /= mass.sum(axis=-1, keepdims=True)
    mu, slope, _ = model.find_densities(np.maximum(scores, _LEAST_SCORE).reshape(B, -1, M))
    log_volumes = (sum_of_widths.reshape(B, -1) + np.log(slope).sum(axis=-1)) if M > 2 else None
    D = np.diagonal(invert(point.D), axis1=-2, axis2=-1)
    at_nodes, shape = (*shape, T * C), (B, M, mass.shape[-1], T, C)
    d, variance = (
        np.broadcast_to(_apply(each, [closest for _, closest in splines]).reshape(B, 1, -1, T, C), shape)
        for each in ((d + curvature.dd).reshape(*at_nodes), D.reshape(*at_nodes))
    )
    return _Grid(np.broadcast_to(mass, shape[:3]), mu.mT, d, variance, log_volumes)


def _apply(values: Array, matrices: Sequence[Array]) -> Array:
    """Multiplies axes 1, 2, ... of values by one matrix each: (B, n, ..., k) becomes (B, points, ..., k)."""
    for axis, matrix in enumerate(matrices, start=1):
        # Separate products for each observer have reproducible rounding errors, as in ``_interpolate``.
        values = np.moveaxis(matrix @ np.moveaxis(values, axis, -2), -2, axis)
    return values


def _extend(values: Array, splines: Sequence[tuple[Array, Array]], *, is_log: bool = False) -> Array:
    """Interpolates values along several axes, with a plane beyond the nodes.

    A product of linear extrapolations could increase again in corners. If ``is_log``, values are log probabilities.
    These do not increase beyond the nodes, but interpolated slopes of the plane may where the slopes change steeply.
    """
    closest = [each for _, each in splines]
    found = _apply(values, closest)
    for axis, (extended, inside) in enumerate(splines):
        beyond = _apply(values, [*closest[:axis], extended - inside, *closest[axis + 1 :]])
        found = found + (np.minimum(beyond, 0.0) if is_log else beyond)
    return found


def _correlate(mass: Array, offsets: Array) -> Array:
    """Computes covariances, (B, C, C), from probability masses and offsets to the means, (B, C, n)."""
    covariance: Array = (mass * offsets) @ offsets.mT
    return covariance


def _tabulate_separate(model: _Model, mode: _Mode) -> _Grid:
    """Computes the marginals of independent scores on a grid; each object must have one density.

    All scores move at once. The deviations are optimised by one Newton step, whose gain is added.
    """
    variances = np.diagonal(mode.curvature.inverse[:, 0], axis1=1, axis2=2)[:, None]
    dz = np.sqrt(variances) * _NODES[:, None]  # (B, n, M)
    dd = -(mode.curvature.DC @ dz[:, :, None, :, None])[..., 0]
    d = mode.d + dd
    point = model.evaluate(np.maximum(mode.z + dz, _LEAST_SCORE), d)
    D = np.maximum(np.diagonal(point.D, axis1=-2, axis2=-1), _LEAST_CURVATURE)  # (B, n, T, C)
    gain = 0.5 * point.gd**2 / D - 0.5 * np.log(D)
    of_kinds = (point.of_things[..., None] + gain)[..., None] * model.selection[:, None]
    log_p = np.swapaxes(point.of_means + of_kinds.sum(axis=(-3, -2)), 1, 2)  # (B, M, n)
    M = model.size
    each = (np.broadcast_to(a[:, None], (len(a), M, *a.shape[1:])) for a in (d + point.gd / D, 1.0 / D))
    return _interpolate(model, mode, log_p, *each)


def _interpolate(model: _Model, mode: _Mode, log_p: Array, d: Array, variance: Array) -> _Grid:
    """Interpolates log marginals, (B, M, n), and deviations and variances, (B, M, n, T, C), from nodes to points."""
    extended, closest = _build_spline(*_NODES)
    log_p = log_p @ extended.T
    mass = np.exp(log_p - log_p.max(axis=-1, keepdims=True))
    mass /= mass.sum(axis=-1, keepdims=True)
    sds = np.sqrt(np.diagonal(mode.curvature.inverse[:, 0], axis1=1, axis2=2))
    scores = np.maximum(mode.z + sds[:, None] * _POINTS[:, None], _LEAST_SCORE)
    mu = np.swapaxes(model.find_densities(scores)[0], 1, 2)
    # With separate products, rounding errors do not depend on the other observers; with tensordot they would.
    d, variance = (
        (closest @ each.reshape(*each.shape[:3], -1)).reshape(*each.shape[:2], len(closest), *each.shape[3:])
        for each in (d, variance)
    )
    return _Grid(mass, mu, d, variance)


@cache
def _build_spline(*nodes: float, step: int = 1) -> tuple[Array, Array]:
    """Builds matrices that interpolate values from nodes to every ``step``-th point, (points, nodes).

    Returns:
        Matrix with linear extrapolation beyond the nodes, and matrix with constant extrapolation.
    """
    spline = scipy.interpolate.CubicSpline(nodes, np.eye(len(nodes)))
    points = _POINTS[::step]
    inside = np.clip(points, nodes[0], nodes[-1])
    constant = spline(inside)
    return constant + spline(inside, 1) * (points - inside)[:, None], constant


def _restrict(
    mean: Array,
    sd: Array,
    covariance: Array,
    expansion: Normals,
    is_quadratic: Mask,
    points: _Points | None = None,
) -> Normals:
    """Builds unrestricted normal distributions that have given moments after restriction to positive densities.

    The moments are matched exactly for two or three densities. For more densities, each bound is approximated by a
    normal factor, as in expectation propagation (Minka 2001); this is exact for uncorrelated densities. The expansion
    is used instead if the log likelihood is quadratic, and for more than three densities if two bounds cut off both
    ends of an undetermined direction.

    Args:
        mean: Means after restriction, (B, M).
        sd: SDs after restriction, (B, M).
        covariance: Covariance with the correlations after restriction, (B, M, M).
        expansion: Second-order expansion of the log posterior.
        is_quadratic: True for observers with a quadratic log likelihood, (B,).
        points: Quadrature points, needed for three densities.
    """
    unit = np.eye(mean.shape[1])
    center, scale = find_untruncated(mean, sd)
    sds = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    correlation = covariance / (sds[..., None] * sds[:, None])
    # In units of the SDs after restriction.
    inverse, rest = invert(correlation), (sd / scale) ** 2
    precision = inverse + (rest - 1.0)[..., None] * unit
    information = np.matvec(inverse, mean / sd) - mean / sd + center * sd / scale**2
    related = np.abs(correlation - unit)
    is_cut = ((mean < _FREE * sd)[..., None] & (related > _RELATED)).any(axis=(1, 2))
    is_ridge = mean < _CUT * sd
    is_open = (is_quadratic & is_cut) | (np.linalg.eigvalsh(precision)[:, 0] < _LEAST_PRECISION)
    is_open |= (is_ridge[..., None] & is_ridge[:, None] & (related > _RIDGE)).any(axis=(1, 2))
    matched = invert(np.where(is_open[:, None, None], unit, precision))
    center = np.where(is_open[:, None], expansion.mean, sd * np.matvec(matched, information))
    matched = np.where(is_open[:, None, None], expansion.covariance, sd[..., None] * matched * sd[:, None])
    involved = (related > _RELATED).any(axis=2) & (is_cut & ~is_quadratic)[:, None]
    for pattern in np.unique(involved, axis=0):
        rows, columns = np.flatnonzero((involved == pattern).all(axis=1)), np.flatnonzero(pattern)
        there = None
        if len(columns) > 2:
            if points is None or len(columns) < mean.shape[1]:
                continue
            rows = rows[points.is_valid[rows]]
            there = points.mu[rows], points.log_volumes[rows]
        if len(rows) and len(columns):
            at, block = (rows[:, None], columns), (rows[:, None, None], columns[:, None], columns)
            found = find_untruncated_joint(mean[at], sd[at], correlation[block], center[at], matched[block], there)
            center[at], matched[block] = found
    return Normals(center, matched)
