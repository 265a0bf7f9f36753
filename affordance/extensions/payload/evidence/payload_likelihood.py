"""Likelihood of the ten parameters, with all other unknowns integrated out.

Given the load, the signal is linear in all other unknowns (gain, load friction and friction of each channel), which
have normal priors. Their integral therefore has a closed form, however uncertain they are. It costs a few products of
small matrices for a thousand loads at once.

Gains change from run to run, so part of the arm's torque remains after subtraction. The change of each channel's gain
is treated like one more friction term. A change common to all channels is integrated out last.
"""

from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.belief.likelihood import SEEN, Quadratic
from affordance.extensions.payload.evidence.joint_statistics import (
    ARM,
    FRICTION,
    LOAD,
    NUM_COLUMNS,
    ROTOR,
    SIGNAL,
    JointStatistics,
)
from affordance.objects.inertia import NUM_PARAMETERS

_NUM_LOAD = 22  # number of columns of z that contain the load
_HALF = 11  # number of these columns without the factor s, and with it
_KEPT = np.r_[0:_NUM_LOAD, SIGNAL]
# Columns of friction, rotor inertia, and the arm's torque, which remains in a difference of two runs if gains change.
_NUISANCES = np.r_[FRICTION, ROTOR, ARM]


@dataclass(frozen=True)
class ChannelPrior:
    """Prior of all unknowns except the payload."""

    gain: Array  # means of g and h of each channel, shape (C, 2), [unit of the signal per N m]
    gain_covariance: Array  # covariance of g and h for each channel, shape (C, 2, 2)
    friction: Array  # means of c_C, c_v, c_0, shape (C, 3), in the signal's unit (c_v: per rad/s)
    friction_sd: Array  # standard deviations of friction, shape (C, 3)
    # Mean of the phantom payload, which is the apparent load of an empty hand, shape (10,).
    phantom: Array = field(default_factory=lambda: np.zeros(NUM_PARAMETERS))
    # Covariance of the phantom payload, shape (10, 10).
    phantom_covariance: Array = field(default_factory=lambda: np.zeros((NUM_PARAMETERS, NUM_PARAMETERS)))
    has_arm: bool = True  # True if the arm's torque is in the signal; False if it was subtracted
    # Standard deviations of gain changes between the subtracted and the loaded run, shape (C,), [unit of the signal
    # per N m]: of a change in proportion to all gains, and of each channel's own change.
    shared_change_sd: Array | float = 0.0
    own_change_sd: Array | float = 0.0
    # Standard deviation of rotor inertia times gain, shape (C,), [unit of the signal per rad/s^2].
    rotor_sd: Array | float = 0.0


class _AtLoad(NamedTuple):
    """Terms at one load that determine gains and gain changes, with A = d x / d (g, h)."""

    load: Array  # coefficients of the load, shape (11,)
    residual: Array  # A^T K (x - A g), shape (C, 2)
    c: Array  # L^T times the residual, shape (C, 2)
    inverse: Array  # inverse of I + L^T A^T K A L, shape (C, 2, 2)
    q: Array  # t^T K A, shape (C, 2)


class PayloadLikelihood:
    """Log likelihood log p(signals of a run | pi), up to a constant.

    A signal is x = A beta + u t + friction + error with beta = (g, h) ~ N(gain, gain_covariance) and A = (1, s) load.
    The load is tau_arm + Y pi, or Y pi if the arm was subtracted. u ~ N(0, 1) is the gain change common to all
    channels, and t is the arm's torque times the standard deviation of this change.
    """

    def __init__(self, statistics: JointStatistics, prior: ChannelPrior, long_run_variance: Array) -> None:
        """Integrates friction out of the sums over a run.

        The long-run variance, (C,), is the variance of an error times the number of samples that share it.
        """
        self.prior = prior
        # Number of errors from which each channel's variance was estimated.
        self.num_errors = statistics.counts / statistics.block_length
        # The signal is centred on the mean of friction: x - f^T c replaces x.
        shift = np.tile(np.eye(NUM_COLUMNS), (statistics.num_channels, 1, 1))
        shift[:, FRICTION, SIGNAL] = -prior.friction
        products = shift.transpose(0, 2, 1) @ statistics.products @ shift / long_run_variance[:, None, None]
        num = statistics.num_channels
        own, shared, rotor = (
            np.broadcast_to(each, num) for each in (prior.own_change_sd, prior.shared_change_sd, prior.rotor_sd)
        )
        F = np.column_stack([prior.friction_sd, rotor, own])[:, :, None] * np.eye(5)
        cross = F @ products[:, _NUISANCES[:, None], _KEPT]  # (C, 5, 23)
        inner = np.eye(5) + F @ products[:, _NUISANCES[:, None], _NUISANCES] @ F
        # F u is linear in the residual without friction; here u is the posterior mean of standardised friction.
        self._friction = F @ np.linalg.solve(inner, cross)
        self._log_friction = float(np.linalg.slogdet(inner)[1].sum())
        K = products[:, _KEPT[:, None], _KEPT] - cross.transpose(0, 2, 1) @ np.linalg.solve(inner, cross)
        # t^T K t, t^T K x, and t^T K times the columns of the load.
        self._shared_sd = shared
        self._has_shared = bool(shared.any())
        self._tt, self._tx = shared**2 * K[:, ARM, ARM], shared * K[:, ARM, _NUM_LOAD]
        self._t_load = shared[:, None] * K[:, ARM, :_NUM_LOAD]
        if not prior.has_arm:
            for index in (ARM, _HALF):
                K[:, index], K[:, :, index], self._t_load[:, index] = 0.0, 0.0, 0.0
        self._t_load = self._t_load.reshape(-1, 2, _HALF)
        self._K = K[:, :_NUM_LOAD, :_NUM_LOAD].reshape(-1, 2, _HALF, 2, _HALF)
        self._Kx = K[:, :_NUM_LOAD, _NUM_LOAD].reshape(-1, 2, _HALF)
        self._xx = K[:, _NUM_LOAD, _NUM_LOAD]
        # K and Kx as matrices that multiply products of two coefficients of the load, or single coefficients.
        self._K_of_pairs = self._K.transpose(2, 4, 0, 1, 3).reshape(_HALF**2, -1)
        self._Kx_of_load = self._Kx.transpose(2, 0, 1).reshape(_HALF, -1)
        self._L = factor(prior.gain_covariance)

    def compute_log_likelihood(self, pi: Array) -> Array:
        """Computes log L, (N,), of N loads, (N, 10), up to a common constant.

        A load is the body plus the deviation of the phantom payload from its mean.
        """
        load = self._extend(pi)
        values = (load[:, :, None] * load[:, None, :]).reshape(len(pi), -1) @ self._of_pairs
        a, b, d, c0, c1 = values[:, 1:].reshape(len(pi), 5, -1).swapaxes(0, 1)
        determinant = 1.0 + a + d + np.maximum(a * d - b**2, 0.0)
        explained = ((1.0 + d) * c0**2 - 2.0 * b * c0 * c1 + (1.0 + a) * c1**2) / determinant
        # Rounding destroys this sum of squares if a load is millions of times too heavy.
        squares = np.maximum(values[:, 0] - explained.sum(axis=1), 0.0)
        log_likelihood: Array = -0.5 * (squares + np.log(determinant).sum(axis=1))
        if self._has_shared:
            # With q = t^T K A and p = L^T q, u has the precision 1 + H and the information f.
            f, p0, p1 = (load @ self._of_shared).reshape(len(pi), 3, -1).swapaxes(0, 1)
            f = f - ((1.0 + d) * p0 * c0 - b * (p0 * c1 + p1 * c0) + (1.0 + a) * p1 * c1) / determinant
            H = ((1.0 + d) * p0**2 - 2.0 * b * p0 * p1 + (1.0 + a) * p1**2) / determinant
            precision = 1.0 + np.maximum(self._tt.sum() - H.sum(axis=1), 0.0)
            log_likelihood += 0.5 * (f.sum(axis=1) ** 2 / precision - np.log(precision))
        return log_likelihood

    def compute_log_evidence(self, covariance: Array, sizes: Array) -> Array:
        """Computes log p(signals), up to a constant, for loads ~ N(0, size^2 covariance) and exact gains.

        The result has one value per size. Unlike log likelihoods of a load, the values are comparable between priors
        of friction.
        """
        quadratic, root = self.linearise(np.zeros(NUM_PARAMETERS)), factor(covariance)
        values, vectors = np.linalg.eigh(root.T @ quadratic.precision @ root)
        f = vectors.T @ (root.T @ quadratic.information)
        widened = 1.0 + np.outer(sizes**2, np.maximum(values, 0.0))
        of_load = (np.outer(sizes**2, f**2) / widened - np.log(widened)).sum(axis=1)
        at_zero = float(self.compute_log_likelihood(np.zeros((1, NUM_PARAMETERS)))[0])
        log_evidence: Array = at_zero + 0.5 * (of_load - self._log_friction)
        return log_evidence

    def linearise(self, pi: Array) -> Quadratic:
        """Builds the Gauss-Newton approximation of log L near a load, (10,)."""
        H, b = self._linearise_channels(pi)
        H, b = H.sum(axis=0), b.sum(axis=0)
        if self._has_shared:  # the last unknown is u
            precision = 1.0 + H[-1, -1]
            H, b = H[:-1, :-1] - np.outer(H[:-1, -1], H[-1, :-1]) / precision, b[:-1] - H[:-1, -1] * b[-1] / precision
        else:
            H, b = H[:-1, :-1], b[:-1]
        return Quadratic(0.5 * (H + H.T), b + H @ pi)

    def count_errors(self, pi: Array, covariance: Array) -> float:
        """Computes the degrees of freedom of a load's distance from its expectation, given estimated variances.

        The distance is weighted with the inverse of the load's error covariance, H^-1 with H = sum H_c over channels
        c, plus a known covariance C, (10, 10). With M the inverse of this sum, channel c contributes k_c = tr(M H^-1
        H_c H^-1) to the k measured numbers. Its variance was estimated from n_c errors, so the distance varies as if
        there were k^2 / sum(k_c^2 / n_c) errors (Satterthwaite 1946). The effect of estimated variances on the
        relative weights of the channels is neglected. The likelihood is assumed quadratic near the load pi, (10,).
        """
        each, _ = self._linearise_channels(pi)
        each = each[:, :-1, :-1]
        H = each.sum(axis=0)
        H = 0.5 * (H + H.T)
        inverse = np.linalg.pinv(H, rcond=SEEN, hermitian=True)
        M = Quadratic(H, np.zeros(NUM_PARAMETERS)).widen(covariance).precision
        shares = np.einsum("ij,cji->c", inverse @ M @ inverse, each)
        num_values = float(np.linalg.matrix_rank(H, rtol=SEEN, hermitian=True))
        used = self.num_errors > 0.0
        return num_values**2 / max(float((shares[used] ** 2 / self.num_errors[used]).sum()), np.finfo(float).tiny)

    def _linearise_channels(self, pi: Array) -> tuple[Array, Array]:
        """Computes curvature, (C, 11, 11), and gradient, (C, 11), of each channel's log L at a load.

        The last unknown is u, the gain change common to all channels, which is zero at this point.
        """
        at = self._condition(pi)
        gain, _ = self._estimate_gains(at)
        g, L, load, inverse = self.prior.gain, self._L, at.load, at.inverse
        # T = g Y + h s Y, with the gains that fit this load.
        TK = np.einsum("ca,caibj->cibj", gain, self._K[:, :, 1:])
        TKA = TK @ load  # (C, 10, 2)
        TKT = np.einsum("cibj,cb->cij", TK[..., 1:], gain)
        TKx = np.einsum("ca,cai->ci", gain, self._Kx[:, :, 1:])
        # Rows of u below the rows of the load, with t in place of T.
        tT = np.einsum("ca,cai->ci", gain, self._t_load[:, :, 1:])
        TKT = np.concatenate([TKT, tT[:, None]], axis=1)
        TKT = np.concatenate([TKT, np.append(tT, self._tt[:, None], axis=1)[..., None]], axis=2)
        TKA = np.concatenate([TKA, at.q[:, None]], axis=1)
        TKx = np.append(TKx, self._tx[:, None], axis=1)
        D = TKA @ L
        H = TKT - D @ inverse @ D.transpose(0, 2, 1)
        return H, TKx - (TKA @ g[:, :, None] + D @ inverse @ at.c[..., None])[..., 0]

    def _estimate_change(self, at: _AtLoad) -> float:
        if not self._has_shared:
            return 0.0
        p = (at.q[:, None] @ self._L)[:, 0]
        along = (p[:, None] @ at.inverse)[:, 0]
        f = self._tx - (at.q * self.prior.gain).sum(axis=1) - (along * at.c).sum(axis=1)
        precision = 1.0 + float((self._tt - (along * p).sum(axis=1)).sum())
        return float(f.sum()) / precision

    def estimate_gains(self, pi: Array) -> tuple[Array, Array]:
        """Computes posterior means, (C, 2), and covariances, (C, 2, 2), of g and h given a load, (10,)."""
        return self._estimate_gains(self._condition(pi))

    def _estimate_gains(self, at: _AtLoad) -> tuple[Array, Array]:
        covariance = self._L @ at.inverse @ self._L.transpose(0, 2, 1)
        residual = at.residual
        if self._has_shared:
            residual = residual - self._estimate_change(at) * at.q
        return self.prior.gain + (covariance @ residual[..., None])[..., 0], covariance

    def build_residual_weights(self, pi: Array) -> Array:
        """Builds the weights w, (C, 27), of the residual w^T z at the most probable unknowns given a load, (10,)."""
        at = self._condition(pi)
        gain, _ = self._estimate_gains(at)
        load = at.load.copy()
        w = np.zeros((len(gain), NUM_COLUMNS))
        load[0] = float(self.prior.has_arm)
        w[:, LOAD] = -(gain[:, :, None] * load).reshape(len(gain), -1)
        w[:, ARM] -= self._estimate_change(at) * self._shared_sd
        w[:, SIGNAL] = 1.0
        nuisances = (self._friction @ w[:, _KEPT, None])[..., 0]
        w[:, FRICTION] = -self.prior.friction - nuisances[:, :3]
        w[:, ROTOR] = -nuisances[:, 3]
        w[:, ARM] -= nuisances[:, 4]
        return w

    def _extend(self, pi: Array) -> Array:
        """Returns the load coefficients [1, pi + phantom], shape (N, 11)."""
        return np.concatenate([np.ones((len(pi), 1)), pi + self.prior.phantom], axis=1)

    @cached_property
    def _of_pairs(self) -> Array:
        """Coefficients of products of two load coefficients in the log likelihood, shape (121, 1 + 5 C).

        The first load coefficient is one, so the products include the coefficients themselves. With M = L^T A^T K A L
        and c = L^T A^T K (x - A g), they yield (x - A g)^T K (x - A g), summed over channels, and then M_11, M_12,
        M_22, c_1 and c_2 of each channel.
        """
        g, L, K = self.prior.gain, self._L, self._K
        x = np.zeros((len(g), 2, _HALF, _HALF))
        x[:, :, 0] = self._Kx  # products of one and a coefficient
        M = np.einsum("cap,caibj,cbq->cpqij", L, K, L)
        c = np.einsum("cap,caij->cpij", L, x - np.einsum("caibj,cb->caij", K, g))
        rest = np.einsum("ca,caij->ij", g, np.einsum("caibj,cb->caij", K, g) - 2.0 * x)
        rest[0, 0] += self._xx.sum()
        each = np.stack([M[:, 0, 0], M[:, 0, 1], M[:, 1, 1], c[:, 0], c[:, 1]]).reshape(-1, _HALF, _HALF)
        return np.concatenate([rest[None], each]).reshape(-1, _HALF**2).T

    @cached_property
    def _of_shared(self) -> Array:
        """Coefficients of a load in t^T K (x - A g) and p = L^T A^T K t, shape (11, 3 C)."""
        g, t_load = self.prior.gain, self._t_load
        f = -np.einsum("ca,cai->ic", g, t_load)
        f[0] += self._tx
        p = np.einsum("cap,cai->ipc", self._L, t_load)
        return np.concatenate([f[:, None], p], axis=1).reshape(_HALF, -1)

    def _condition(self, pi: Array) -> _AtLoad:
        """Computes the terms that determine the unknowns at a load, (10,)."""
        load, channels = self._extend(pi[None]), len(self._xx)
        pairs = (load[:, :, None] * load[:, None, :]).reshape(1, -1)
        AKA = (pairs @ self._K_of_pairs).reshape(channels, 2, 2)
        residual = (load @ self._Kx_of_load).reshape(channels, 2) - (AKA @ self.prior.gain[:, :, None])[..., 0]
        inverse = _invert_with_identity(self._L.transpose(0, 2, 1) @ AKA @ self._L)
        return _AtLoad(load[0], residual, (residual[:, None] @ self._L)[:, 0], inverse, self._t_load @ load[0])


def factor(covariance: Array) -> Array:
    """Computes square roots L of possibly singular covariances L L^T."""
    values, vectors = np.linalg.eigh(covariance)
    root: Array = vectors * np.sqrt(np.maximum(values, 0.0))[..., None, :]
    return root


def _invert_with_identity(M: Array) -> Array:
    """Inverts many matrices I + M, several times faster than a general solver.

    M, of shape (..., 2, 2), is positive semidefinite, so the determinant of I + M is at least one for any M.
    """
    b, c = M[..., 0, 1], M[..., 1, 0]
    of_M = np.maximum(M[..., 0, 0] * M[..., 1, 1] - b * c, 0.0)
    determinant = 1.0 + M[..., 0, 0] + M[..., 1, 1] + of_M
    a, d = 1.0 + M[..., 0, 0], 1.0 + M[..., 1, 1]
    adjugate = np.empty(M.shape)
    adjugate[..., 0, 0], adjugate[..., 0, 1], adjugate[..., 1, 0], adjugate[..., 1, 1] = d, -b, -c, a
    inverse: Array = adjugate / determinant[..., None, None]
    return inverse


class BodyLikelihood:
    """Log likelihood log p(run | pi) of bodies, with the phantom payload integrated out.

    A phantom payload delta ~ N(0, C) represents errors of the arm's model, so that the load is the sum of the body pi
    and delta. Q is the quadratic approximation of log L near the most probable load, and Q_C is Q with delta
    integrated out:

        log p(signals | pi) = Q_C(pi) + log E[exp(log L(pi + delta) - Q(pi + delta))],  delta ~ N(0, C) exp Q(pi + .)

    The expectation is estimated from one draw. The estimate is unbiased, and exact without a phantom.
    """

    def __init__(self, likelihood: PayloadLikelihood, load: Array) -> None:
        """Prepares the quadratic approximations at a load with high likelihood, shape (10,)."""
        self._likelihood = likelihood
        self.of_load = likelihood.linearise(load)
        covariance = likelihood.prior.phantom_covariance
        self.of_body = self.of_load.widen(covariance)
        root = factor(covariance)
        self._has_phantom = bool(root.any())
        inner = np.linalg.inv(np.eye(NUM_PARAMETERS) + root.T @ self.of_load.precision @ root)
        self._share = root @ inner @ root.T
        self._spread = root @ np.linalg.cholesky(0.5 * (inner + inner.T))

    def draw_normals(self, rng: np.random.Generator, num_bodies: int) -> Array:
        """Draws standard normal numbers for the phantoms of N bodies, (N, 10); zeros without a phantom."""
        shape = num_bodies, NUM_PARAMETERS
        return rng.standard_normal(shape) if self._has_phantom else np.zeros(shape)

    def compute(self, pi: Array, normals: Array) -> Array:
        """Computes the log likelihood, (N,), of N bodies, (N, 10), up to a common constant.

        Each row of normal numbers, (N, 10), determines a body's phantom. The likelihood is unbiased if they are
        independent.
        """
        if not self._has_phantom:
            return self._likelihood.compute_log_likelihood(pi)
        delta = (self.of_load.information - pi @ self.of_load.precision) @ self._share
        load = pi + delta + normals @ self._spread.T
        rest = self._likelihood.compute_log_likelihood(load) - self.of_load.evaluate(load)
        return self.of_body.evaluate(pi) + rest
