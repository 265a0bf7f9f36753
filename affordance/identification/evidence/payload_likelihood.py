"""Likelihood of the ten parameters, with all other unknowns integrated out.

Given the load, all other unknowns enter the signal linearly and have normal priors: the gain, the load friction and
the friction of each channel. Their integral is thus known in closed form, however large their uncertainty (nothing is
linearised), and costs a few products of small matrices, for a thousand loads at once.

Where the arm was subtracted, its torque is part of the signal still, as gains differ from run to run: by a factor of
each channel, which is one more term of friction, and by a factor that all channels share, which is integrated last.

Errors of the arm's model are a phantom payload delta, delta ~ N(0, C), and the load is the sum of body pi and delta.
With Q the quadratic approximation of log L near the most probable load, and Q_C that with delta integrated out,

    log p(signals | pi) = Q_C(pi) + log E[exp(log L(pi + delta) - Q(pi + delta))],    delta ~ N(0, C) exp Q(pi + .)

and the expectation is estimated by one draw: exact without a phantom, and unbiased with one.
"""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from affordance.arrays import Array
from affordance.belief.likelihood import SEEN, Quadratic
from affordance.identification.evidence.joint_statistics import (
    ARM,
    FRICTION,
    LOAD,
    NUM_COLUMNS,
    SIGNAL,
    JointStatistics,
)
from affordance.objects.inertia import NUM_PARAMETERS

_NUM_LOAD = 22  # columns of z that the load fills
_HALF = 11  # half of these columns, without or with the factor s
_KEPT = np.r_[0:_NUM_LOAD, SIGNAL]
# Columns of friction, and of the arm's torque in a difference of two runs whose gains differ.
_NUISANCES = np.r_[FRICTION, ARM]


@dataclass(frozen=True)
class ChannelPrior:
    """Prior of all unknowns but the payload."""

    gain: Array  # means of g and h of each channel, shape (C, 2), [unit of the signal per N m]
    gain_covariance: Array  # covariance of g and h, channel by channel, shape (C, 2, 2)
    friction: Array  # means of c_C, c_v, c_0, shape (C, 3), in the signal's unit (c_v: per rad/s)
    friction_sd: Array  # standard deviations of friction, shape (C, 3)
    # Mean of the phantom payload, which an empty hand appears to hold, shape (10,).
    phantom: Array = field(default_factory=lambda: np.zeros(NUM_PARAMETERS))
    # Covariance of the phantom payload, shape (10, 10).
    phantom_covariance: Array = field(default_factory=lambda: np.zeros((NUM_PARAMETERS, NUM_PARAMETERS)))
    has_arm: bool = True  # True if the arm's torque is in the signal; False if it was subtracted
    # Standard deviations of the change of gains between the run that was subtracted and the loaded one, shape (C,),
    # [unit of the signal per N m]: that which all channels share in proportion, and each channel's own.
    shared_change_sd: Array | float = 0.0
    own_change_sd: Array | float = 0.0


class PayloadLikelihood:
    """Log likelihood log p(signals of a run | pi) up to a constant.

    A signal is x = A beta + u t + friction + error with beta = (g, h) ~ N(gain, gain_covariance) and A = (1, s) load,
    where the load is tau_arm + Y pi, or Y pi if the arm was subtracted; u ~ N(0, 1) is the change of gains that all
    channels share, and t the arm's torque times its standard deviation.
    """

    def __init__(self, statistics: JointStatistics, prior: ChannelPrior, long_run_variance: Array) -> None:
        """Integrates friction out of the sums over a run.

        The long-run variance, (C,), is that of an error times the number of samples that share it.
        """
        self.prior = prior
        # Errors that each channel's variance was estimated from.
        self.num_errors = statistics.counts / statistics.block_length
        # Centred on the mean of friction: x - f^T c in place of x.
        shift = np.tile(np.eye(NUM_COLUMNS), (statistics.num_channels, 1, 1))
        shift[:, FRICTION, SIGNAL] = -prior.friction
        products = shift.transpose(0, 2, 1) @ statistics.products @ shift / long_run_variance[:, None, None]
        num = statistics.num_channels
        own, shared = (np.broadcast_to(each, num) for each in (prior.own_change_sd, prior.shared_change_sd))
        F = np.concatenate([prior.friction_sd, own[:, None]], axis=1)[:, :, None] * np.eye(4)
        cross = F @ products[:, _NUISANCES[:, None], _KEPT]  # (C, 4, 23)
        inner = np.eye(4) + F @ products[:, _NUISANCES[:, None], _NUISANCES] @ F
        # F u with u the posterior mean of standardised friction is linear in the residual without friction.
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
        # K and Kx as matrices that act on products of two coefficients of the load, or on one.
        self._K_of_pairs = self._K.transpose(2, 4, 0, 1, 3).reshape(_HALF**2, -1)
        self._Kx_of_load = self._Kx.transpose(2, 0, 1).reshape(_HALF, -1)
        self._L = factor(prior.gain_covariance)

    def compute_log_likelihood(self, pi: Array) -> Array:
        """Computes log L at N loads, pi of shape (N, 10), up to one constant for all; shape (N,).

        A load is the body plus the deviation of the phantom payload from its mean.
        """
        load = self._extend(pi)
        values = (load[:, :, None] * load[:, None, :]).reshape(len(pi), -1) @ self._of_pairs
        a, b, d, c0, c1 = values[:, 1:].reshape(len(pi), 5, -1).swapaxes(0, 1)
        determinant = 1.0 + a + d + np.maximum(a * d - b**2, 0.0)
        explained = ((1.0 + d) * c0**2 - 2.0 * b * c0 * c1 + (1.0 + a) * c1**2) / determinant
        # A sum of squares, of which rounding leaves nothing where a load is millions of times too heavy.
        squares = np.maximum(values[:, 0] - explained.sum(axis=1), 0.0)
        log_likelihood: Array = -0.5 * (squares + np.log(determinant).sum(axis=1))
        if self._has_shared:
            # q = t^T K A, and p = L^T q; then u has the precision 1 + H and the information f.
            f, p0, p1 = (load @ self._of_shared).reshape(len(pi), 3, -1).swapaxes(0, 1)
            f = f - ((1.0 + d) * p0 * c0 - b * (p0 * c1 + p1 * c0) + (1.0 + a) * p1 * c1) / determinant
            H = ((1.0 + d) * p0**2 - 2.0 * b * p0 * p1 + (1.0 + a) * p1**2) / determinant
            precision = 1.0 + np.maximum(self._tt.sum() - H.sum(axis=1), 0.0)
            log_likelihood += 0.5 * (f.sum(axis=1) ** 2 / precision - np.log(precision))
        return log_likelihood

    def compute_log_evidence(self, covariance: Array, sizes: Array) -> Array:
        """Computes log p(signals) up to a constant, with exact gains and loads ~ N(0, size^2 covariance), (sizes,).

        Unlike the log likelihood of a load, it compares priors of friction.
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
        """Builds the quadratic approximation of log L near a load, shape (10,), without products of two errors."""
        H, b = self._linearise_channels(pi)
        H, b = H.sum(axis=0), b.sum(axis=0)
        if self._has_shared:  # the last unknown is u
            precision = 1.0 + H[-1, -1]
            H, b = H[:-1, :-1] - np.outer(H[:-1, -1], H[-1, :-1]) / precision, b[:-1] - H[:-1, -1] * b[-1] / precision
        else:
            H, b = H[:-1, :-1], b[:-1]
        return Quadratic(0.5 * (H + H.T), b + H @ pi)

    def count_errors(self, pi: Array, covariance: Array) -> float:
        """Counts the degrees of freedom that estimated variances give the distance of a load from what is expected.

        The distance weighs the error of the load, H^-1 if H = sum H_c over channels c, along with errors of known
        covariance C, (10, 10). With M the inverse of both, channel c makes up k_c = tr(M H^-1 H_c H^-1) of the k
        measured numbers, and estimated its variance from n_c errors, so that the distance varies by these as if there
        were k^2 / sum(k_c^2 / n_c) of them (Satterthwaite 1946). That variances also weigh the channels among each
        other is left out. The likelihood is taken as quadratic near the load pi, (10,).
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
        """Computes curvature and gradient of log L at a load, channel by channel, shapes (C, 11, 11) and (C, 11).

        The last unknown is u, the change of gains that all channels share, about 0.
        """
        gain, _ = self.estimate_gains(pi)
        g, L = self.prior.gain, self._L
        load = self._extend(pi[None])[0]
        AKA, AKx = (each[0] for each in self._project(pi[None]))
        # T = g Y + h s Y at the gains that fit this load.
        TK = np.einsum("ca,caibj->cibj", gain, self._K[:, :, 1:])
        TKA = TK @ load  # (C, 10, 2)
        TKT = np.einsum("cibj,cb->cij", TK[..., 1:], gain)
        TKx = np.einsum("ca,cai->ci", gain, self._Kx[:, :, 1:])
        c = ((AKx - (AKA @ g[:, :, None])[..., 0])[:, None] @ L)[:, 0]
        inverse, _ = _invert_with_identity(L.transpose(0, 2, 1) @ AKA @ L)
        # Rows of u below those of the load: t in place of T.
        q = self._t_load @ load
        tT = np.einsum("ca,cai->ci", gain, self._t_load[:, :, 1:])
        TKT = np.concatenate([TKT, tT[:, None]], axis=1)
        TKT = np.concatenate([TKT, np.append(tT, self._tt[:, None], axis=1)[..., None]], axis=2)
        TKA = np.concatenate([TKA, q[:, None]], axis=1)
        TKx = np.append(TKx, self._tx[:, None], axis=1)
        D = TKA @ L
        H = TKT - D @ inverse @ D.transpose(0, 2, 1)
        return H, TKx - (TKA @ g[:, :, None] + D @ inverse @ c[..., None])[..., 0]

    def estimate_change(self, pi: Array) -> float:
        """Computes the most probable u given a load, shape (10,): the shared change of gains over its SD."""
        if not self._has_shared:
            return 0.0
        g, L = self.prior.gain, self._L
        AKA, AKx = (each[0] for each in self._project(pi[None]))
        inverse, _ = _invert_with_identity(L.transpose(0, 2, 1) @ AKA @ L)
        q = self._t_load @ self._extend(pi[None])[0]
        p = (q[:, None] @ L)[:, 0]
        c = ((AKx - (AKA @ g[:, :, None])[..., 0])[:, None] @ L)[:, 0]
        along = (p[:, None] @ inverse)[:, 0]
        f = self._tx - (q * g).sum(axis=1) - (along * c).sum(axis=1)
        precision = 1.0 + float((self._tt - (along * p).sum(axis=1)).sum())
        return float(f.sum()) / precision

    def estimate_changes(self, pi: Array) -> tuple[Array, Array]:
        """Computes the relative change of each channel's gain since the subtracted run, and its prior SD.

        The load, (10,), is given; both are of shape (C,), and zeros where no run was subtracted.
        """
        own, shared = (np.broadcast_to(each, self._tt.shape) for each in (self.prior.own_change_sd, self._shared_sd))
        gain = np.maximum(np.abs(self.prior.gain[:, 0]), np.finfo(float).tiny)
        w = self.build_residual_weights(pi)
        change = -w[:, ARM] if not self.prior.has_arm else np.zeros_like(gain)
        return change / gain * np.sign(self.prior.gain[:, 0]), np.hypot(own, shared) / gain

    def estimate_gains(self, pi: Array) -> tuple[Array, Array]:
        """Computes the posterior of g and h given a load, shape (10,): means, (C, 2), and covariances, (C, 2, 2)."""
        g, L = self.prior.gain, self._L
        AKA, AKx = (each[0] for each in self._project(pi[None]))
        inverse, _ = _invert_with_identity(L.transpose(0, 2, 1) @ AKA @ L)
        covariance = L @ inverse @ L.transpose(0, 2, 1)
        residual = AKx - (AKA @ g[:, :, None])[..., 0]
        if self._has_shared:
            residual -= self.estimate_change(pi) * (self._t_load @ self._extend(pi[None])[0])
        return g + (covariance @ residual[..., None])[..., 0], covariance

    def build_residual_weights(self, pi: Array) -> Array:
        """Builds w, (C, 26), with w^T z the residual at the most probable unknowns given a load, shape (10,)."""
        gain, _ = self.estimate_gains(pi)
        load = self._extend(pi[None])[0]
        w = np.zeros((len(gain), NUM_COLUMNS))
        load[0] = float(self.prior.has_arm)
        w[:, LOAD] = -(gain[:, :, None] * load).reshape(len(gain), -1)
        w[:, ARM] -= self.estimate_change(pi) * self._shared_sd
        w[:, SIGNAL] = 1.0
        nuisances = (self._friction @ w[:, _KEPT, None])[..., 0]
        w[:, FRICTION] = -self.prior.friction - nuisances[:, :3]
        w[:, ARM] -= nuisances[:, 3]
        return w

    def _extend(self, pi: Array) -> Array:
        """Returns the load's coefficients [1, pi + phantom], shape (N, 11)."""
        return np.concatenate([np.ones((len(pi), 1)), pi + self.prior.phantom], axis=1)

    @cached_property
    def _of_pairs(self) -> Array:
        """Factors by which products of two coefficients of a load enter the log likelihood.

        The first coefficient is one, so that these products hold the coefficients themselves. With M = L^T A^T K A L
        and c = L^T A^T K (x - A g) they give (x - A g)^T K (x - A g), summed over channels, and then, channel by
        channel, M_11, M_12, M_22, c_1 and c_2; shape (121, 1 + 5 C).
        """
        g, L, K = self.prior.gain, self._L, self._K
        x = np.zeros((len(g), 2, _HALF, _HALF))
        x[:, :, 0] = self._Kx  # one times a coefficient
        M = np.einsum("cap,caibj,cbq->cpqij", L, K, L)
        c = np.einsum("cap,caij->cpij", L, x - np.einsum("caibj,cb->caij", K, g))
        rest = np.einsum("ca,caij->ij", g, np.einsum("caibj,cb->caij", K, g) - 2.0 * x)
        rest[0, 0] += self._xx.sum()
        each = np.stack([M[:, 0, 0], M[:, 0, 1], M[:, 1, 1], c[:, 0], c[:, 1]]).reshape(-1, _HALF, _HALF)
        return np.concatenate([rest[None], each]).reshape(-1, _HALF**2).T

    @cached_property
    def _of_shared(self) -> Array:
        """Factors by which coefficients of a load enter t^T K (x - A g) and p = L^T A^T K t, shape (11, 3 C)."""
        g, t_load = self.prior.gain, self._t_load
        f = -np.einsum("ca,cai->ic", g, t_load)
        f[0] += self._tx
        p = np.einsum("cap,cai->ipc", self._L, t_load)
        return np.concatenate([f[:, None], p], axis=1).reshape(_HALF, -1)

    def _project(self, pi: Array) -> tuple[Array, Array]:
        """Computes A^T K A, shape (N, C, 2, 2), and A^T K x, shape (N, C, 2), with A = d x / d (g, h)."""
        load = self._extend(pi)
        num, channels = len(pi), len(self._xx)
        pairs = (load[:, :, None] * load[:, None, :]).reshape(num, -1)
        return (pairs @ self._K_of_pairs).reshape(num, channels, 2, 2), (load @ self._Kx_of_load).reshape(
            num, channels, 2
        )


class BodyLikelihood:
    """Log likelihood log p(run | pi) of bodies, with the phantom payload integrated out."""

    def __init__(self, likelihood: PayloadLikelihood, load: Array) -> None:
        """Prepares the quadratics about a load of high likelihood, shape (10,)."""
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
        """Draws the standard normal numbers from which phantoms of N bodies follow, (N, 10); zeros without one."""
        shape = num_bodies, NUM_PARAMETERS
        return rng.standard_normal(shape) if self._has_phantom else np.zeros(shape)

    def compute(self, pi: Array, normals: Array) -> Array:
        """Computes the log likelihood at N bodies, (N, 10), with a phantom by normal numbers, (N, 10); shape (N,).

        It is known up to one constant for all, and without bias if the normal numbers are independent.
        """
        if not self._has_phantom:
            return self._likelihood.compute_log_likelihood(pi)
        delta = (self.of_load.information - pi @ self.of_load.precision) @ self._share
        load = pi + delta + normals @ self._spread.T
        rest = self._likelihood.compute_log_likelihood(load) - self.of_load.evaluate(load)
        return self.of_body.evaluate(pi) + rest


def factor(covariance: Array) -> Array:
    """Computes square roots L of covariances L L^T that may be singular."""
    values, vectors = np.linalg.eigh(covariance)
    root: Array = vectors * np.sqrt(np.maximum(values, 0.0))[..., None, :]
    return root


def _invert_with_identity(M: Array) -> tuple[Array, Array]:
    """Computes inverses and determinants of many I + M, several times faster than a solver.

    M is positive semidefinite, shape (..., 2, 2), so that the determinant is at least one, however large M is.
    """
    b, c = M[..., 0, 1], M[..., 1, 0]
    of_M = np.maximum(M[..., 0, 0] * M[..., 1, 1] - b * c, 0.0)
    determinant = 1.0 + M[..., 0, 0] + M[..., 1, 1] + of_M
    a, d = 1.0 + M[..., 0, 0], 1.0 + M[..., 1, 1]
    inverse = (
        np.stack([np.stack([d, -b], axis=-1), np.stack([-c, a], axis=-1)], axis=-2) / determinant[..., None, None]
    )
    return inverse, determinant
