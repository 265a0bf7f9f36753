"""Stores the measured torques of all holds, and computes their log likelihood for many observers.

A hold is one static measurement of an object. Holds that differ only in the measured torques share one entry, with
the mean and the sum of squares of the torques. A quadratic log likelihood of an object's densities is stored as a
hold with constant noise and one torque per parameter.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array, Mask
from affordance.belief.likelihood import SEEN, Likelihood
from affordance.belief.normals import Normals, invert
from affordance.belief.rows import Seen, State, pad

# Entries of a state for B observers: N holds with J joints, C densities of the held object, and Q geometry errors of
# the object. Unused entries are zero.
OF_HOLDS = (
    "hold_thing",  # number of the object
    "hold_count",  # number of measurements, 0 if there is no hold
    "hold_weight",  # number of averaged measurements, by which the variance is divided
    "hold_noise",  # threshold s0, [N m], and Weber fraction w, (B, N, 2)
    "hold_arm",  # torque of the arm alone, (B, N, J), [N m]
    "hold_tau",  # mean of the measured torques, (B, N, J), [N m]
    "hold_squares",  # sum of squared differences from this mean, (B, N, J), [(N m)^2]
    "hold_regressor",  # torque per density, Y Phi, (B, N, J, C), [N m / (kg/m^3)]
    "hold_errors",  # change of the regressor by one SD of each geometry error, (B, N, Q, J, C)
)


class Holds(NamedTuple):
    """Measurements of all holds; ``OF_HOLDS`` describes the arrays."""

    thing: NDArray[np.intp]
    counts: Array
    weight: Array
    noise: Array
    arm: Array
    tau: Array
    squares: Array
    regressor: Array
    errors: Array

    @classmethod
    def of(cls, state: State) -> "Holds":
        """Extracts the arrays of holds from a state."""
        return cls(*(state[name] for name in OF_HOLDS))

    def take(self, rows: NDArray[np.intp]) -> "Holds":
        """Selects observers."""
        return Holds._make(array[rows] for array in self)


class Slopes(NamedTuple):
    """Log likelihood of T objects at n sets of C densities, with derivatives by the densities."""

    value: Array  # (B, n, T)
    gradient: Array  # (B, n, T, C)
    hessian: Array  # (B, n, T, C, C)


def compute_log_likelihood(holds: Holds, rho: Array, *, is_expected: bool = False) -> Slopes:
    """Computes the log likelihood of the densities of T objects, and its derivatives.

    The variance of a torque depends on the torque, so the log likelihood includes the log variance. The geometry
    errors of an object are equal in all of its holds, and are integrated out.

    Args:
        holds: Measurements of B observers.
        rho: Densities at n points, (B, n, T, C), [kg/m^3].
        is_expected: If True, replaces the second derivatives with their expectations, which are negative
            semidefinite.
    """
    size, n, T, C = rho.shape
    J = holds.arm.shape[2]
    sums = np.zeros((size, n, T, 1 + C + C * C))
    for part in _cut(holds, size * n * J * C):
        A = part.regressor  # (B, N, J, C)
        AA = (A[..., :, None] * A[..., None, :]).reshape(*A.shape[:3], C * C)
        t = part.arm[:, None] + _multiply(_take_of_holds(part, rho), A.mT)
        value, first, second = _compare(part, t, is_expected)
        columns = [value[..., None], _multiply(first, A), _multiply(second, AA)]
        _add_by_thing(sums, part, np.concatenate(columns, axis=-1))
    slopes = Slopes(sums[..., 0], sums[..., 1 : 1 + C], sums[..., 1 + C :].reshape(size, n, T, C, C))
    return _correct_for_geometry(holds, rho, slopes, is_expected) if holds.errors.shape[2] else slopes


def fit_torques(holds: Holds, num_things: int) -> tuple[Array, Array]:
    """Fits densities to torques, as a starting point for the search of the mode.

    The noise is computed from the measured torques instead of the predicted torques, which makes the fit linear. The
    exact log likelihood can have several maxima, because noise is small at densities that make a joint torque small.

    Returns:
        Precision, (B, T, C, C), and information vector, (B, T, C), of each object's densities.
    """
    size, C = len(holds.thing), holds.regressor.shape[3]
    sums = np.zeros((size, 1, num_things, C * C + C))
    variance = holds.noise[..., :1] ** 2 + (holds.noise[..., 1:] * holds.tau) ** 2 + (holds.counts == 0)[..., None]
    weighted = holds.regressor.mT * (holds.weight[..., None] / variance)[..., None, :]  # (B, N, C, J)
    precision = (weighted @ holds.regressor).reshape(*holds.thing.shape, C * C)
    information = np.matvec(weighted, holds.tau - holds.arm)
    _add_by_thing(sums, holds, np.concatenate([precision, information], axis=-1)[:, None])
    return sums[:, 0, :, : C * C].reshape(size, num_things, C, C), sums[:, 0, :, C * C :]


# Largest number of entries of a temporary array; if more are needed, the holds are evaluated in parts.
_LARGEST = 2_000_000
_FEW = 32  # largest number of objects for which sums over holds are computed as matrix products


def _cut(holds: Holds, entries: int) -> Iterator[Holds]:
    """Splits the holds into parts, given the number of array entries per hold."""
    N, step = holds.arm.shape[1], max(1, _LARGEST // max(entries, 1))
    return (Holds._make(array[:, start : start + step] for array in holds) for start in range(0, N, step))


def _multiply(values: Array, matrices: Array) -> Array:
    """Multiplies the values of each hold, (B, n, N, K), by its matrix, (B, N, K, L)."""
    return np.asarray((values.swapaxes(1, 2) @ matrices).swapaxes(1, 2))


def _take_of_holds(holds: Holds, rho: Array) -> Array:
    """Returns the densities of the object in each hold, (B, n, N, C)."""
    # A third of the time of numpy.take_along_axis.
    return rho[np.arange(rho.shape[0])[:, None, None], np.arange(rho.shape[1])[:, None], holds.thing[:, None]]


def _add_by_thing(sums: Array, holds: Holds, values: Array) -> None:
    """Adds values of holds, (B, n, N, K), to the sums of their objects, (B, n, T, K)."""
    T = sums.shape[2]
    if len(sums) > 1 or T <= _FEW:
        owner = (holds.thing[:, None, :] == np.arange(T)[:, None]) & (holds.counts > 0)[:, None, :]
        sums += owner[:, None].astype(float) @ values
        return
    # For one observer with many objects and holds, the matrix above would be too large.
    thing, order = holds.thing[0], np.argsort(holds.thing[0], kind="stable")
    order = order[holds.counts[0, order] > 0]
    starts = np.flatnonzero(np.diff(thing[order], prepend=-1))
    sums[:, :, thing[order[starts]]] += np.add.reduceat(values[:, :, order], starts, axis=2)


def _compare(holds: Holds, t: Array, is_expected: bool) -> tuple[Array, Array, Array]:
    """Computes the log likelihood of predicted torques, (B, n, N, J).

    Returns:
        Log likelihood of each hold, (B, n, N), and its first and second derivatives by each torque, (B, n, N, J).
    """
    count, weight = holds.counts[:, None, :, None], holds.weight[:, None, :, None]
    threshold, fraction = (holds.noise[:, None, :, None, i] ** 2 for i in (0, 1))
    v = fraction * t**2 + (threshold + (count == 0))  # 1 where there is no hold
    precision = 1.0 / v
    r = holds.tau[:, None] - t
    pull, ratio = weight * r, 2.0 * fraction * t * precision  # ratio is d log v / dt
    misfit = pull * r
    if holds.squares.any():
        misfit += holds.squares[:, None]
    misfit *= precision
    # The logarithm of the product of variances is faster than the sum of logarithms.
    log_v = np.log(v.prod(axis=-1)) + v.shape[-1] * np.log(2.0 * np.pi)
    value = -0.5 * (misfit.sum(axis=-1) + count[..., 0] * log_v)
    first = pull * precision + 0.5 * (misfit - count) * ratio
    if is_expected:
        return value, first, -weight * precision - 0.5 * count * ratio**2
    second = ((misfit - count) * fraction - weight - 2.0 * pull * ratio) * precision
    second -= (misfit - 0.5 * count) * ratio**2
    return value, first, second


# Step of the central differences in ``_correct_for_geometry``, as a fraction of the densities.
_STEP = 1e-4


def _correct_for_geometry(holds: Holds, rho: Array, slopes: Slopes, is_expected: bool) -> Slopes:
    """Adds the effect of geometry errors e ~ N(0, I) to the log likelihood.

    The errors change the residual covariance of an object's holds from D to R = D + F F^T:

        log N(r; 0, R) = log N(r; 0, D) + b^T M^-1 b / 2 - log det M / 2,    M = I + F^T D^-1 F,    b = F^T D^-1 r

    M and b are sums over the object's holds. The second derivatives are central differences of the first derivatives.
    """

    def evaluate(rho: Array) -> tuple[Array, Array, Array]:
        M, b, K, dM, db = sum_geometry(holds, rho)
        inverse = invert(M)
        u = np.matvec(inverse, b)
        value = 0.5 * (np.vecdot(u, b) - np.linalg.slogdet(M)[1])
        square = inverse + u[..., :, None] * u[..., None, :]
        gradient = np.matvec(db, u) - 0.5 * (dM * square[..., None, :, :]).sum(axis=(-2, -1))
        return value, gradient, K @ inverse @ K.mT

    n, C = rho.shape[1], rho.shape[3]
    if is_expected:
        value, gradient, unknown = evaluate(rho)
        return Slopes(slopes.value + value, slopes.gradient + gradient, slopes.hessian + unknown)
    steps = (_STEP * np.maximum(np.abs(rho), 1.0))[..., None, :] * np.eye(C)  # (B, n, T, C, C)
    each = [steps[..., c, :] for c in range(C)]
    places = np.concatenate([rho, *(rho + step for step in each), *(rho - step for step in each)], axis=1)
    values, gradients, _ = evaluate(places)
    after, before = (
        gradients[:, first * n : (first + C) * n].reshape(len(rho), C, *rho.shape[1:]) for first in (1, 1 + C)
    )
    sizes = np.moveaxis(steps[..., range(C), range(C)], -1, 1)  # (B, C, n, T)
    hessian = np.moveaxis((after - before) / (2.0 * sizes[..., None]), 1, -1)
    return Slopes(
        slopes.value + values[:, :n],
        slopes.gradient + gradients[:, :n],
        slopes.hessian + 0.5 * (hessian + hessian.mT),
    )


# Smallest squared effect of a geometry error on torques, relative to the largest, that exceeds rounding errors.
_LEAST_SQUARES = 1e-14


def reduce_errors(holds: Holds, num_things: int) -> Holds:
    """Replaces the geometry errors of each object with fewer, equivalent errors.

    Errors e ~ N(0, I) can be rotated without changing the model. Combinations of errors that change no torque are
    removed. The remaining number is about the number of inertial parameters that affect the torques of a body at
    rest.
    """
    size, N, Q, J, C = holds.errors.shape
    errors, sums = holds.errors.reshape(size, N, Q, J * C), np.zeros((size, 1, num_things, Q * Q))
    _add_by_thing(sums, holds, (errors @ errors.mT).reshape(size, 1, N, Q * Q))
    squares, vectors = np.linalg.eigh(sums.reshape(size, num_things, Q, Q))
    kept = squares > _LEAST_SQUARES * squares[..., -1:]
    num_kept = int(kept.sum(axis=-1).max(initial=0))
    vectors = (vectors * kept[..., None, :])[..., Q - num_kept :]
    of_holds = vectors[np.arange(size)[:, None], holds.thing]
    return holds._replace(errors=(of_holds.mT @ errors).reshape(size, N, num_kept, J, C))


def sum_geometry(holds: Holds, rho: Array) -> tuple[Array, ...]:
    """Computes the information about geometry errors, summed over the holds of each object.

    Given densities, (B, n, T, C), the errors are normal with mean M^-1 b and covariance M^-1.

    Returns:
        M, (B, n, T, Q, Q), b, (B, n, T, Q), K = F^T D^-1 A, (B, n, T, C, Q), where A is the torque per density, and
        the derivatives of M and b by the densities, (B, n, T, C, Q, Q) and (B, n, T, C, Q).
    """
    size, n, T, C = rho.shape
    Q, J = holds.errors.shape[2:4]
    ends = np.cumsum([Q * Q, Q, C * Q, C * Q * Q])
    sums = np.zeros((size, n, T, ends[-1] + C * Q))
    for part in _cut(holds, size * n * Q * max(J, (1 + C) * Q)):
        of_hold = _take_of_holds(part, rho)
        t = part.arm[:, None] + _multiply(of_hold, part.regressor.mT)
        errors = part.errors.reshape(*part.errors.shape[:2], Q * J, C)
        F = _multiply(of_hold, errors.mT).reshape(*t.shape[:3], Q, J)
        threshold, fraction = part.noise[:, None, :, None, 0], part.noise[:, None, :, None, 1]
        v = threshold**2 + (fraction * t) ** 2 + (part.counts == 0)[:, None, :, None]
        W = part.weight[:, None, :, None] / v
        dW, r = -2.0 * fraction**2 * t / v * W, part.tau[:, None] - t  # derivative of W by the torque, and residual
        weighted = F * W[..., None, :]
        columns = [weighted @ F.mT, np.matvec(weighted, r), (weighted @ part.regressor[:, None]).mT]
        dM, db = [], []
        for c in range(C):
            A, G = part.regressor[:, None, ..., c], part.errors[:, None, ..., c]
            half = weighted @ G.mT
            dM.append(half + half.mT + (F * (dW * A)[..., None, :]) @ F.mT)
            db.append(np.matvec(G, W * r) + np.matvec(F, (dW * r - W) * A))
        columns += [np.stack(dM, axis=3), np.stack(db, axis=3)]
        _add_by_thing(sums, part, np.concatenate([each.reshape(*t.shape[:3], -1) for each in columns], axis=-1))
    each_M, b, K, each_dM, each_db = np.split(sums, ends, axis=-1)
    things = size, n, T
    M = np.eye(Q) + each_M.reshape(*things, Q, Q)
    return M, b, K.reshape(*things, C, Q), each_dM.reshape(*things, C, Q, Q), each_db.reshape(*things, C, Q)


class Felt(NamedTuple):
    """Measurements of one lift of an object with C densities, for B observers."""

    hold: Holds  # one hold per observer, (B, 1, ...)
    log_constant: Array  # constant that is added to the log likelihood, (B,)
    num_values: int  # number of measured values
    log_peak: Array | None = None  # log probability density of error-free data, (B,); computed if None

    @classmethod
    def from_torques(
        cls,
        tau: Array,
        tau_arm: Array,
        regressor: Array,
        noise: tuple[float, float],
        num_samples: int = 1,
        errors: Array | None = None,
    ) -> "Felt":
        """Builds the evidence from the mean torques of a hold.

        Args:
            tau: Measured torques, (B, J), [N m].
            tau_arm: Torques of the arm without the object, (J,) or (B, J), [N m].
            regressor: Torque per density, (B, J, C), [N m / (kg/m^3)].
            noise: Threshold s0, [N m], and Weber fraction w.
            num_samples: Number of independent measurements in the mean.
            errors: Change of the regressor by one SD of each of Q geometry errors, (B, Q, J, C).
        """
        B, J, C = regressor.shape
        ones = np.ones((B, 1))
        hold = Holds(
            np.zeros((B, 1), dtype=np.intp),
            ones,
            num_samples * ones,
            np.broadcast_to(np.array(noise, dtype=float), (B, 1, 2)),
            np.broadcast_to(tau_arm, tau.shape)[:, None],
            tau[:, None],
            np.zeros((B, 1, J)),
            regressor[:, None],
            np.zeros((B, 1, 0, J, C)) if errors is None else errors[:, None],
        )
        return cls(hold, np.zeros(B), J)

    @classmethod
    def from_quadratic(
        cls, likelihood: Likelihood, Phi: Array | None = None, Phi_errors: Array | None = None
    ) -> "Felt":
        """Builds the evidence of one observer from a quadratic log likelihood of K parameters.

        Args:
            likelihood: Log likelihood of the parameters with a positive semidefinite precision, (K, K).
            Phi: Parameters per density, (K, C); None if the parameters are the densities.
            Phi_errors: Change of Phi by one SD of each of Q geometry errors, (Q, K, C).
        """
        values, vectors = np.linalg.eigh(likelihood.precision)
        roots = np.sqrt(np.where(values > SEEN * max(values[-1], 0.0), values, 0.0))
        A = roots[:, None] * vectors.T  # P = A^T A
        y = np.divide(vectors.T @ likelihood.information_vector, roots, out=np.zeros_like(roots), where=roots > 0.0)
        errors = None if Phi_errors is None else (A @ Phi_errors)[None]
        found = cls.from_torques(
            y[None], np.zeros_like(y), (A if Phi is None else A @ Phi)[None], (1.0, 0.0), 1, errors
        )
        log_constant = np.asarray(likelihood.log_constant + 0.5 * (y @ y + len(y) * np.log(2.0 * np.pi)))
        return cls(
            found.hold, log_constant.reshape(1), likelihood.num_values, np.asarray(likelihood.log_peak).reshape(1)
        )

    def find_likelihood(self, normals: Normals, observers: NDArray[np.intp] | None = None) -> Likelihood:
        """Approximates the log likelihood of the densities by a quadratic function.

        Value, gradient and Hessian are exact at the posterior mode. A normal belief that is updated with this
        likelihood therefore has the evidence and posterior of Laplace's method. The mode may have negative
        densities.

        Args:
            normals: Beliefs before the lift about the C densities, (N, C).
            observers: Number of each belief's observer, (N,); None if belief b belongs to observer b.
        """
        rows = np.arange(len(normals)) if observers is None else observers
        hold = self.hold.take(rows)
        hold = reduce_errors(hold, 1) if hold.errors.shape[2] else hold
        Lambda, eta = normals.precision, normals.information_vector

        def evaluate(rho: Array, part: NDArray[np.intp]) -> tuple[Array, Array, Slopes]:
            slopes = compute_log_likelihood(hold.take(part), rho[:, None, None])
            product = np.matvec(Lambda[part], rho)
            log_p = slopes.value[:, 0, 0] + (rho * (eta[part] - 0.5 * product)).sum(axis=-1)
            return log_p, slopes.gradient[:, 0, 0] + eta[part] - product, slopes

        P, q = (array[:, 0] for array in fit_torques(hold, 1))
        fitted = np.linalg.solve(Lambda + P, (eta + q)[..., None])[..., 0]
        left = np.arange(len(rows))
        is_nearer = evaluate(fitted, left)[0] > evaluate(normals.mean, left)[0]
        rho = np.where(is_nearer[:, None], fitted, normals.mean)
        here = evaluate(rho, left)
        for _ in range(_MOST_STEPS):
            log_p, gradient, slopes = here
            curvature = Lambda[left] - slopes.hessian[:, 0, 0]
            is_bad = (
                np.linalg.eigvalsh(curvature)[:, 0] <= 0.0 if curvature.shape[-1] > 1 else curvature[:, 0, 0] <= 0.0
            )
            if is_bad.any():
                bad = left[is_bad]
                expected = compute_log_likelihood(hold.take(bad), rho[bad, None, None], is_expected=True)
                curvature[is_bad] = Lambda[bad] - expected.hessian[:, 0, 0]
            step = np.linalg.solve(curvature, gradient[..., None])[..., 0]
            going = (step * gradient).sum(axis=-1) > _SETTLED
            rho[left[~going]] += step[~going]  # Newton's method converges quadratically, so this step is the last
            left, step, log_p = left[going], step[going], log_p[going]
            if not len(left):
                break
            length = np.ones(len(left))
            for _ in range(_MOST_HALVINGS):
                tried = rho[left] + length[:, None] * step
                here = evaluate(tried, left)
                is_worse = ~(here[0] >= log_p - 1e-12 * np.abs(log_p))
                if not is_worse.any():
                    break
                length = np.where(is_worse, 0.5 * length, length)
            rho[left] = tried
        slopes = compute_log_likelihood(hold, rho[:, None, None])
        P, g = -slopes.hessian[:, 0, 0], slopes.gradient[:, 0, 0]
        product = np.matvec(P, rho)
        log_constant = slopes.value[:, 0, 0] - (rho * (g + 0.5 * product)).sum(axis=-1) + self.log_constant[rows]
        return Likelihood(P, g + product, log_constant, self._find_peak(hold, rho, rows), self.num_values)

    def _find_peak(self, hold: Holds, rho: Array, rows: NDArray[np.intp]) -> Array:
        """Computes the log probability density at the predicted torques, (N,)."""
        t = hold.arm[:, 0] + np.matvec(hold.regressor[:, 0], rho)
        variance = (hold.noise[:, 0, :1] ** 2 + (hold.noise[:, 0, 1:] * t) ** 2) / hold.weight[:, 0, None]
        peak = -0.5 * np.log(2.0 * np.pi * variance).sum(axis=-1) if self.log_peak is None else self.log_peak[rows]
        F = (hold.errors[:, 0] * rho[:, None, None]).sum(axis=-1)  # (N, Q, J)
        M = np.eye(F.shape[1]) + F / variance[:, None] @ F.mT
        return np.asarray(peak - 0.5 * np.linalg.slogdet(M)[1])


# Gain in log probability below which a step is the last; largest numbers of steps and step halvings.
_SETTLED, _MOST_STEPS, _MOST_HALVINGS = 1e-12, 200, 40


def start_holds(size: int) -> State:
    """Returns the entries of a state without holds, for B observers."""
    shapes = ((0,), (0,), (0,), (0, 2), (0, 0), (0, 0), (0, 0), (0, 0, 0), (0, 0, 0, 0))
    state: State = {name: np.zeros((size, *shape)) for name, shape in zip(OF_HOLDS, shapes, strict=True)}
    return {**state, "hold_thing": state["hold_thing"].astype(np.intp)}


def add_hold(state: State, seen: Seen, felt: Felt) -> State:
    """Adds a hold to the state. If it differs from an earlier hold only in the torques, both share one entry."""
    rows, N = np.arange(len(seen.things)), state["hold_count"].shape[1]
    new = {**dict(zip(OF_HOLDS, felt.hold, strict=True)), "hold_thing": seen.things[:, None]}
    shapes = {name: np.maximum(state[name].shape[2:], new[name].shape[2:]) for name in OF_HOLDS}
    old = {name: pad(state[name], (N, *shapes[name])) for name in OF_HOLDS}
    new = {name: pad(new[name], (1, *shapes[name])) for name in OF_HOLDS}
    # An averaged measurement keeps its own entry, because the scatter of its samples is unknown.
    same = (old["hold_count"] > 0) & (old["hold_weight"] == old["hold_count"]) & (new["hold_weight"] == 1.0)
    for name in ("hold_thing", "hold_noise", "hold_arm", "hold_regressor", "hold_errors"):
        same &= (old[name] == new[name]).all(axis=tuple(range(2, old[name].ndim)))
    joins, count = same.any(axis=1), (old["hold_count"] > 0).sum(axis=1)
    place = np.where(joins, same.argmax(axis=1) if N else 0, count)
    room = max(N, int(place.max(initial=-1)) + 1)
    merged = {name: pad(array, (room, *array.shape[2:])).copy() for name, array in old.items()}
    there = rows, place
    n, tau, squares = (merged[name][there] for name in ("hold_count", "hold_tau", "hold_squares"))
    for name in OF_HOLDS:
        merged[name][there] = new[name][:, 0]
    n = n[:, None]
    difference = new["hold_tau"][:, 0] - tau
    merged["hold_count"][there] += n[:, 0]
    merged["hold_weight"][there] += n[:, 0]
    merged["hold_tau"][there] = tau + difference / (n + 1.0)
    merged["hold_squares"][there] += squares + difference**2 * n / (n + 1.0)
    return {**state, **merged}


def add_holds(state: State, things: Sequence[int], felt: Sequence[Felt]) -> State:
    """Adds many holds to the state of a single observer (``add_hold``)."""
    number = np.array([*state["hold_thing"][0], *things], dtype=np.intp)
    merged: State = {"hold_thing": number[None]}
    for i, name in enumerate(OF_HOLDS[1:], 1):
        rows = [*state[name][0], *(each.hold[i][0, 0] for each in felt)]
        size = np.max([row.shape for row in rows], axis=0, initial=0).astype(np.intp)
        merged[name] = np.concatenate([pad(row[None], size) for row in rows])[None]
    same = ("hold_thing", "hold_noise", "hold_arm", "hold_regressor", "hold_errors")
    keys = np.concatenate([merged[name].reshape(len(number), -1) for name in same], axis=1)
    joins = merged["hold_weight"][0] == merged["hold_count"][0]
    known: dict[object, int] = {}
    place = np.array([known.setdefault(row.tobytes() if joins[i] else i, len(known)) for i, row in enumerate(keys)])
    first = np.unique(place, return_index=True)[1]
    count, tau = merged["hold_count"][0], merged["hold_tau"][0]

    def total(values: Array) -> Array:
        sums = np.zeros((len(first), *values.shape[1:]))
        np.add.at(sums, place, values)
        return sums

    n = total(count)
    mean = tau[first] + total(count[:, None] * (tau - tau[first][place])) / n[:, None]
    squares = total(merged["hold_squares"][0] + count[:, None] * (tau - mean[place]) ** 2)
    weight = np.where(joins[first], n, merged["hold_weight"][0, first])
    merged = {name: array[:, first] for name, array in merged.items()}
    found = {"hold_count": n, "hold_weight": weight, "hold_tau": mean, "hold_squares": squares}
    return {**state, **merged, **{name: array[None] for name, array in found.items()}}


def forget_things(state: State, things: Sequence[int]) -> State:
    """Keeps only the holds of given objects, which are renumbered in this order."""
    new = np.full(int(state["hold_thing"].max(initial=-1)) + 2, -1)
    kept = [thing for thing in things if thing < len(new)]
    new[kept] = [place for place, thing in enumerate(things) if thing < len(new)]
    is_kept = (state["hold_count"] > 0) & (new[state["hold_thing"]] >= 0)
    return keep_holds({**state, "hold_thing": np.where(is_kept, new[state["hold_thing"]], 0)}, is_kept)


def keep_holds(state: State, is_kept: Mask) -> State:
    """Removes all holds that are not selected by a mask, (B, N)."""
    order = np.argsort(~is_kept, axis=1, kind="stable")[:, : int(is_kept.sum(axis=1).max(initial=0))]
    left = np.take_along_axis(is_kept, order, axis=1)
    arrays = {name: state[name][np.arange(len(order))[:, None], order] for name in OF_HOLDS}
    for array in arrays.values():
        array[~left] = 0
    return {**state, **arrays}
