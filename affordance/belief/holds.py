"""What was felt of things, kept hold by hold, and its log likelihood at given densities, for many observers at once.

The torques of N holds are kept with the thing that was held. Holds that differ in the measured torques alone are one
entry, with the mean and the sum of squares of these. Evidence that is a quadratic function of a thing's densities is
a hold, too: as many torques as densities, with constant errors.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.belief.likelihood import SEEN, Likelihood
from affordance.belief.normals import Normals
from affordance.belief.rows import Seen, State, pad

# Entries of a state, with an axis for B observers: N holds of J joints, (B, N, ...), with C columns for the densities
# of a thing and Q errors of its geometry. Entries without a hold are zero.
OF_HOLDS = (
    "hold_thing",  # number of the thing
    "hold_count",  # number of measurements, 0 if there is no hold
    "hold_weight",  # number of measurements that were averaged, which divides their variance
    "hold_noise",  # threshold s0, [N m], and Weber fraction w, (B, N, 2)
    "hold_arm",  # torque of the arm alone, (B, N, J), [N m]
    "hold_tau",  # mean of the measured torques, (B, N, J), [N m]
    "hold_squares",  # sum of squared differences from this mean, (B, N, J), [(N m)^2]
    "hold_regressor",  # torque per density, Y Phi, (B, N, J, C), [N m / (kg/m^3)]
    "hold_errors",  # its change by one SD of each error of geometry, (B, N, Q, J, C)
)


class Holds(NamedTuple):
    """Arrays of a state that hold what was felt; see ``OF_HOLDS``."""

    thing: NDArray[np.intp]
    count: Array
    weight: Array
    noise: Array
    arm: Array
    tau: Array
    squares: Array
    regressor: Array
    errors: Array

    @classmethod
    def of(cls, state: State) -> "Holds":
        """Takes the arrays from a state."""
        return cls(*(state[name] for name in OF_HOLDS))

    def take(self, rows: NDArray[np.intp]) -> "Holds":
        """Returns the arrays of some observers."""
        return Holds(*(array[rows] for array in self))


class Slopes(NamedTuple):
    """Log likelihood of T things at n sets of densities, (B, n, T, C), and its derivatives."""

    value: Array  # (B, n, T)
    gradient: Array  # (B, n, T, C)
    hessian: Array  # (B, n, T, C, C)


def compute_log_likelihood(holds: Holds, rho: Array, *, is_expected: bool = False) -> Slopes:
    """Computes the log likelihood of all that was felt at densities, (B, n, T, C), [kg/m^3].

    The variance of a torque grows with the torque itself, so its logarithm is a part of the likelihood. Errors of a
    thing's geometry are the same in all of its holds and are integrated over, with their determinant. If is_expected,
    the second derivatives are expectations, as if densities were true and geometry exact; they are never positive.
    """
    size, n, T, C = rho.shape
    N = holds.arm.shape[1]
    place = np.broadcast_to(holds.thing[:, None, :, None], (size, n, N, C))
    of_hold = np.take_along_axis(rho, place, axis=2)  # (B, n, N, C)
    A = holds.regressor[:, None]  # (B, 1, N, J, C)
    t = holds.arm[:, None] + (A * of_hold[..., None, :]).sum(axis=-1)  # (B, n, N, J)
    value, first, second = _compare(holds, t, is_expected)
    transposed = np.swapaxes(A, -1, -2)
    by_density = (transposed @ first[..., None])[..., 0]
    squares = (transposed @ (second[..., None] * A)).reshape(size, n, N, C * C)
    owner = (holds.thing[:, None, :] == np.arange(T)[:, None]) & (holds.count > 0)[:, None, :]
    columns = np.concatenate([value[..., None], by_density, squares], axis=-1)
    sums = owner[:, None].astype(float) @ columns  # (B, n, T, 1 + C + C^2)
    slopes = Slopes(sums[..., 0], sums[..., 1 : 1 + C], sums[..., 1 + C :].reshape(size, n, T, C, C))
    return _correct_for_geometry(holds, rho, owner, slopes) if holds.errors.shape[2] and not is_expected else slopes


def _compare(holds: Holds, t: Array, is_expected: bool) -> tuple[Array, Array, Array]:
    """Compares measured torques with predicted ones, (B, n, N, J).

    Returns: Log likelihood of a hold, (B, n, N), and its first and second derivative by each torque, (B, n, N, J).
    """
    count, weight = holds.count[:, None, :, None], holds.weight[:, None, :, None]
    threshold, fraction = (holds.noise[:, None, :, None, i] ** 2 for i in (0, 1))
    v = fraction * t**2 + (threshold + (count == 0))  # 1 where there is no hold
    precision = 1.0 / v
    r = holds.tau[:, None] - t
    pull, ratio = weight * r, 2.0 * fraction * t * precision  # ratio is d log v / dt
    misfit = pull * r
    if holds.squares.any():
        misfit += holds.squares[:, None]
    misfit *= precision
    # A product of variances takes one logarithm for all joints.
    log_v = np.log(v.prod(axis=-1)) + v.shape[-1] * np.log(2.0 * np.pi)
    value = -0.5 * (misfit.sum(axis=-1) + count[..., 0] * log_v)
    first = pull * precision + 0.5 * (misfit - count) * ratio
    if is_expected:
        return value, first, -weight * precision - 0.5 * count * ratio**2
    second = ((misfit - count) * fraction - weight - 2.0 * pull * ratio) * precision
    second -= (misfit - 0.5 * count) * ratio**2
    return value, first, second


# Step of the finite differences by which the effect of geometry is differentiated, as a fraction of the densities.
_STEP = 1e-4


def _correct_for_geometry(holds: Holds, rho: Array, owner: Array, slopes: Slopes) -> Slopes:
    """Adds what changes if errors e ~ N(0, I) of each thing's geometry are integrated over: R = D + F F^T.

    log N(r; 0, R) = log N(r; 0, D) + b^T M^-1 b / 2 - log det M / 2 with M = I + F^T D^-1 F and b = F^T D^-1 r, sums
    over the thing's holds. It is differentiated by central differences.
    """
    C = rho.shape[-1]
    steps = _STEP * np.maximum(np.abs(rho), 1.0)

    def evaluate(change: dict[int, float]) -> Array:
        moved = rho.copy()
        for c, times in change.items():
            moved[..., c] += times * steps[..., c]
        return _integrate_over_geometry(holds, moved, owner)

    here = evaluate({})
    gradient, hessian = np.zeros_like(rho), np.zeros((*rho.shape, C))
    for a in range(C):
        up, down = evaluate({a: 1.0}), evaluate({a: -1.0})
        gradient[..., a] = (up - down) / (2.0 * steps[..., a])
        hessian[..., a, a] = (up - 2.0 * here + down) / steps[..., a] ** 2
        for b in range(a):
            corners = [evaluate({a: i, b: j}) * i * j for i in (1.0, -1.0) for j in (1.0, -1.0)]
            hessian[..., a, b] = hessian[..., b, a] = sum(corners) / (4.0 * steps[..., a] * steps[..., b])
    return Slopes(slopes.value + here, slopes.gradient + gradient, slopes.hessian + hessian)


def _integrate_over_geometry(holds: Holds, rho: Array, owner: Array) -> Array:
    """Computes b^T M^-1 b / 2 - log det M / 2 of each thing, (B, n, T)."""
    size, n, T, C = rho.shape
    N, Q = holds.errors.shape[1:3]
    place = np.broadcast_to(holds.thing[:, None, :, None], (size, n, N, C))
    of_hold = np.take_along_axis(rho, place, axis=2)
    t = holds.arm[:, None] + (holds.regressor[:, None] * of_hold[..., None, :]).sum(axis=-1)
    F = (holds.errors[:, None] * of_hold[..., None, None, :]).sum(axis=-1)  # (B, n, N, Q, J)
    threshold, fraction = holds.noise[:, None, :, None, 0], holds.noise[:, None, :, None, 1]
    v = threshold**2 + (fraction * t) ** 2 + (holds.count == 0)[:, None, :, None]
    weighted = F * (holds.weight[:, None, :, None] / v)[..., None, :]
    M = (weighted @ np.swapaxes(F, -1, -2)).reshape(size, n, N, Q * Q)
    b = (weighted @ (holds.tau[:, None] - t)[..., None])[..., 0]
    sums = owner[:, None].astype(float) @ np.concatenate([M, b], axis=-1)
    M, b = np.eye(Q) + sums[..., : Q * Q].reshape(size, n, T, Q, Q), sums[..., Q * Q :]
    quadratic = (b * np.linalg.solve(M, b[..., None])[..., 0]).sum(axis=-1)
    return np.asarray(0.5 * (quadratic - np.linalg.slogdet(M)[1]))


class Felt(NamedTuple):
    """What B observers felt in one lift of a thing with C densities."""

    hold: Holds  # of one thing, (B, 1, ...)
    log_constant: Array  # added to the log likelihood, (B,)
    num_values: int  # number of measured values
    log_peak: Array | None = None  # log probability density of data without error; None for that of the torques

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
        """Builds the evidence from mean torques of a hold.

        Args:
            tau: Measured torques, (B, J), [N m].
            tau_arm: Torques of the arm alone, (J,) or (B, J), [N m].
            regressor: Torque per density, (B, J, C), [N m / (kg/m^3)].
            noise: Threshold s0, [N m], and Weber fraction w.
            num_samples: Number of independent measurements in the mean.
            errors: Change of the regressor by one SD of each of Q errors of geometry, (B, Q, J, C).
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
            likelihood: Log likelihood with a positive semidefinite precision, (K, K).
            Phi: Parameters per density, (K, C); None if the parameters are the densities.
            Phi_errors: Change of Phi by one SD of each of Q errors of geometry, (Q, K, C).
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
        """Finds the quadratic log likelihood that agrees with the exact one at the posterior mode.

        Value, gradient and Hessian agree there, so evidence and posterior of a normal belief are those of Laplace's
        method. The mode may be negative.

        Args:
            normals: Beliefs before the lift about the C densities, (N, C).
            observers: Number of the observer who holds each belief, (N,); None if belief b belongs to observer b.
        """
        rows = np.arange(len(normals)) if observers is None else observers
        hold = Holds(*(array[rows] for array in self.hold))
        Lambda, eta = normals.precision, normals.information_vector

        def evaluate(rho: Array, part: NDArray[np.intp]) -> tuple[Array, Array, Slopes]:
            slopes = compute_log_likelihood(hold.take(part), rho[:, None, None])
            product = np.matvec(Lambda[part], rho)
            log_p = slopes.value[:, 0, 0] + (rho * (eta[part] - 0.5 * product)).sum(axis=-1)
            return log_p, slopes.gradient[:, 0, 0] + eta[part] - product, slopes

        rho, left = normals.mean.copy(), np.arange(len(rows))
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
            rho[left[~going]] += step[~going]  # the last step squares what is left of the error
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
        """Computes the log probability density of torques that equal the predicted ones, (N,)."""
        if self.log_peak is not None:
            return self.log_peak[rows]
        t = hold.arm[:, 0] + np.matvec(hold.regressor[:, 0], rho)
        variance = (hold.noise[:, 0, :1] ** 2 + (hold.noise[:, 0, 1:] * t) ** 2) / hold.weight[:, 0, None]
        if not hold.errors.shape[2]:
            return np.asarray(-0.5 * np.log(2.0 * np.pi * variance).sum(axis=-1))
        F = (hold.errors[:, 0] * rho[:, None, None]).sum(axis=-1)
        covariance = variance[..., None] * np.eye(t.shape[-1]) + np.swapaxes(F, 1, 2) @ F
        return np.asarray(-0.5 * np.linalg.slogdet(2.0 * np.pi * covariance)[1])


# Gain in log probability by a step below which it is the last one; largest numbers of steps and of halvings.
_SETTLED, _MOST_STEPS, _MOST_HALVINGS = 1e-12, 200, 40


def start_holds(size: int) -> State:
    """Returns the entries of a state of B observers who have felt nothing yet."""
    shapes = ((0,), (0,), (0,), (0, 2), (0, 0), (0, 0), (0, 0), (0, 0, 0), (0, 0, 0, 0))
    state: State = {name: np.zeros((size, *shape)) for name, shape in zip(OF_HOLDS, shapes, strict=True)}
    return {**state, "hold_thing": state["hold_thing"].astype(np.intp)}


def add_hold(state: State, seen: Seen, felt: Felt) -> State:
    """Returns the state with one more hold of a thing; one that differs in its torques alone joins an earlier one."""
    rows, N = np.arange(len(seen.things)), state["hold_count"].shape[1]
    new = {**dict(zip(OF_HOLDS, felt.hold, strict=True)), "hold_thing": seen.things[:, None]}
    shapes = {name: np.maximum(state[name].shape[2:], new[name].shape[2:]) for name in OF_HOLDS}
    old = {name: pad(state[name], (N, *shapes[name])) for name in OF_HOLDS}
    new = {name: pad(new[name], (1, *shapes[name])) for name in OF_HOLDS}
    # A mean of independent measurements is not as informative as each of them.
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


def forget_things(state: State, things: Sequence[int]) -> State:
    """Returns the state with what was felt of these things alone, which are numbered anew in this order."""
    new = np.full(int(state["hold_thing"].max(initial=-1)) + 2, -1)
    kept = [thing for thing in things if thing < len(new)]
    new[kept] = [place for place, thing in enumerate(things) if thing < len(new)]
    is_kept = (state["hold_count"] > 0) & (new[state["hold_thing"]] >= 0)
    order = np.argsort(~is_kept, axis=1, kind="stable")[:, : int(is_kept.sum(axis=1).max(initial=0))]
    rows = np.arange(len(order))[:, None]
    left = np.take_along_axis(is_kept, order, axis=1)
    arrays = {name: state[name][rows, order] for name in OF_HOLDS}
    arrays["hold_thing"] = new[arrays["hold_thing"]]
    for array in arrays.values():
        array[~left] = 0
    return {**state, **arrays}
