"""The likelihood of ten parameters, with everything else that is unknown integrated out.

Given the parameters, all the rest enters the signal linearly and has a normal prior: the gain and the load friction
of a channel, its friction, and a phantom payload that stands for what the arm's model gets wrong. So their integral is known in closed form, however large their uncertainty (nothing is linearised), and
costs a few products of small matrices, for a thousand bodies at once.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.identification.joint_statistics import FRICTION, LOAD, NUM_COLUMNS, SIGNAL, JointStatistics
from affordance.objects.inertia import NUM_PARAMETERS

_NUM_LOAD = 22  # columns of z that the load fills
_HALF = 11  # of these, without and with s
_KEPT = np.r_[0:_NUM_LOAD, SIGNAL]


@dataclass(frozen=True)
class ChannelPrior:
    """What is known before a run of all but the payload.

    Attributes:
        gain: Means of g and h of each channel, shape (C, 2), [unit of the signal per N m].
        gain_covariance: Their covariance, channel by channel, shape (C, 2, 2).
        friction_sd: Standard deviations of c_C, c_v, c_0, shape (C, 3), in the signal's unit (c_v: per rad/s).
        phantom: Mean of the phantom payload: what an empty hand seems to hold, shape (10,).
        phantom_covariance: Its covariance, shape (10, 10).
    """

    gain: Array
    gain_covariance: Array
    friction_sd: Array
    phantom: Array
    phantom_covariance: Array


@dataclass(frozen=True)
class Quadratic:
    """log L(pi) = -pi^T precision pi / 2 + information^T pi + constant, near some pi.

    Attributes:
        precision: H, shape (10, 10); may be singular.
        information: b, shape (10,).
    """

    precision: Array
    information: Array

    def widen(self, covariance: Array) -> "Quadratic":
        """The same after an error of the parameters with this covariance, shape (10, 10)."""
        A = np.linalg.inv(np.eye(NUM_PARAMETERS) + self.precision @ covariance)
        precision = A @ self.precision
        return Quadratic(0.5 * (precision + precision.T), A @ self.information)

    def about(self, origin: Array) -> "Quadratic":
        """The same as a function of pi - origin, origin of shape (10,)."""
        return Quadratic(self.precision, self.information - self.precision @ origin)


class _Projection(NamedTuple):
    """Products at N bodies with A = d x / d (g, h) and T = d x / d pi, of each channel."""

    AKA: Array  # (N, C, 2, 2)
    AKx: Array  # (N, C, 2)
    TKA: Array  # (N, C, 10, 2)
    TKx: Array  # (C, 10)


class PayloadLikelihood:
    """log p(signals of a run | pi), but for a constant.

    A signal is x = A beta + T delta + friction + error with beta = (g, h) ~ N(gain, gain_covariance), delta the
    phantom payload, A = (1, s) (tau_arm + Y pi) and T = (g + h s) Y at the gains' means.
    """

    def __init__(self, statistics: JointStatistics, prior: ChannelPrior, long_run_variance: Array) -> None:
        """Integrates friction out.

        Args:
            statistics: Sums over the run.
            prior: What is known of everything but the payload.
            long_run_variance: Variance of an error times the number of samples that share it, of each channel, shape
                (C,): as if that many fewer samples had been taken, each independent.
        """
        self.prior = prior
        products = statistics.products / long_run_variance[:, None, None]
        F = prior.friction_sd[:, :, None] * np.eye(3)
        cross = F @ products[:, FRICTION, _KEPT]  # (C, 3, 23)
        inner = np.eye(3) + F @ products[:, FRICTION, FRICTION] @ F
        # F u with u the posterior mean of standardised friction is linear in the residual without friction.
        self._friction = F @ np.linalg.solve(inner, cross)
        K = products[:, _KEPT[:, None], _KEPT] - cross.transpose(0, 2, 1) @ np.linalg.solve(inner, cross)
        self._K = K[:, :_NUM_LOAD, :_NUM_LOAD].reshape(-1, 2, _HALF, 2, _HALF)
        self._Kx = K[:, :_NUM_LOAD, _NUM_LOAD].reshape(-1, 2, _HALF)
        self._xx = K[:, _NUM_LOAD, _NUM_LOAD]
        self._L = _factor(prior.gain_covariance)
        self._phantom_root = _factor(prior.phantom_covariance)
        self._has_phantom = bool(self._phantom_root.any())
        g = prior.gain
        self._TKT = np.einsum("ca,caibj,cb->ij", g, self._K[:, :, 1:, :, 1:], g, optimize=True)

    def compute_log_likelihood(self, pi: Array) -> Array:
        """Computes log L at N bodies, pi of shape (N, 10), up to one constant for all; shape (N,)."""
        g, L = self.prior.gain, self._L
        at = self._project(pi, g)
        AKg = np.einsum("ncab,cb->nca", at.AKA, g)
        quadratic = self._xx.sum() - np.einsum("nca,ca->n", 2.0 * at.AKx - AKg, g)
        c = np.einsum("cba,ncb->nca", L, at.AKx - AKg)
        inverse, determinant = _invert_2x2(np.eye(2) + L.transpose(0, 2, 1) @ at.AKA @ L)
        Mc = (inverse @ c[..., None])[..., 0]
        log_likelihood: Array = -0.5 * (quadratic - (c * Mc).sum(axis=(1, 2)) + np.log(determinant).sum(axis=1))
        if self._has_phantom:
            # Channel by channel and gain by gain side by side: one product of (10, 2C) and (2C, 10) a body.
            D = (at.TKA @ L).transpose(0, 2, 1, 3).reshape(len(pi), NUM_PARAMETERS, -1)
            DM = (at.TKA @ L @ inverse).transpose(0, 2, 1, 3).reshape(D.shape)
            precision = self._TKT - DM @ D.transpose(0, 2, 1)
            information = (
                at.TKx.sum(axis=0)
                - np.einsum("ncib,cb->ni", at.TKA, g)
                - np.einsum("nij,nj->ni", DM, c.reshape(len(pi), -1))
            )
            root = self._phantom_root
            M = np.eye(NUM_PARAMETERS) + root.T @ precision @ root
            log_likelihood += _log_normal_integral(M, information @ root)
        return log_likelihood

    def linearise(self, pi: Array) -> Quadratic:
        """Builds the quadratic that log L is near a body, shape (10,), products of two errors dropped."""
        gain, _ = self.estimate_gains(pi)
        at = self._project(pi[None], gain)
        g, L = self.prior.gain, self._L
        H = np.einsum("ca,caibj,cb->ij", gain, self._K[:, :, 1:, :, 1:], gain, optimize=True)
        c = np.einsum("cba,cb->ca", L, at.AKx[0] - np.einsum("cab,cb->ca", at.AKA[0], g))
        inverse, _ = _invert_2x2(np.eye(2) + L.transpose(0, 2, 1) @ at.AKA[0] @ L)
        D = at.TKA[0] @ L
        H -= (D @ inverse @ D.transpose(0, 2, 1)).sum(axis=0)
        b = (at.TKx - (at.TKA[0] @ g[:, :, None] + D @ inverse @ c[..., None])[..., 0]).sum(axis=0)
        quadratic = Quadratic(0.5 * (H + H.T), b + H @ pi)
        if not self._has_phantom:
            return quadratic
        # The phantom's mean is in the load already: only its spread is left.
        return quadratic.widen(self.prior.phantom_covariance)

    def estimate_gains(self, pi: Array) -> tuple[Array, Array]:
        """Posterior of g and h given a body, shape (10,): means, (C, 2), and covariances, (C, 2, 2)."""
        g, L = self.prior.gain, self._L
        at = self._project(pi[None], g)
        inverse, _ = _invert_2x2(np.eye(2) + L.transpose(0, 2, 1) @ at.AKA[0] @ L)
        covariance = L @ inverse @ L.transpose(0, 2, 1)
        residual = at.AKx[0] - np.einsum("cab,cb->ca", at.AKA[0], g)
        return g + np.einsum("cab,cb->ca", covariance, residual), covariance

    def build_residual_weights(self, pi: Array) -> Array:
        """Builds w such that w^T z is the residual, all unknowns at their best given a body; shape (C, 26)."""
        gain, _ = self.estimate_gains(pi)
        load = self._extend(pi[None])[0]
        w = np.zeros((len(gain), NUM_COLUMNS))
        w[:, LOAD] = -(gain[:, :, None] * load).reshape(len(gain), -1)
        w[:, SIGNAL] = 1.0
        w[:, FRICTION] = -np.einsum("cfi,ci->cf", self._friction, w[:, _KEPT])
        return w

    def _extend(self, pi: Array) -> Array:
        """The load's coefficients [1, pi + phantom], shape (N, 11)."""
        return np.concatenate([np.ones((len(pi), 1)), pi + self.prior.phantom], axis=1)

    def _project(self, pi: Array, gain: Array) -> _Projection:
        load = self._extend(pi)
        KA = (self._K.reshape(-1, _HALF) @ load.T).T.reshape(len(pi), -1, 2, _HALF, 2)
        return _Projection(
            np.einsum("ni,ncaib->ncab", load, KA, optimize=True),
            np.einsum("ni,cai->nca", load, self._Kx, optimize=True),
            np.einsum("ca,ncaib->ncib", gain, KA[:, :, :, 1:], optimize=True),
            np.einsum("ca,cai->ci", gain, self._Kx[:, :, 1:]),
        )


def _factor(covariance: Array) -> Array:
    """Square roots of covariances that may be singular, L L^T."""
    values, vectors = np.linalg.eigh(covariance)
    root: Array = vectors * np.sqrt(np.maximum(values, 0.0))[..., None, :]
    return root


def _log_normal_integral(M: Array, f: Array) -> Array:
    """Computes f^T M^-1 f / 2 - log det M / 2 of N positive definite M, (N, r, r), and f, (N, r)."""
    # The last pivot of the bordered matrix's Cholesky factor is what f^T M^-1 f leaves of its corner.
    corner = 2.0 + np.einsum("nr,nr->n", f, f)  # M is at least the identity, so f^T M^-1 f is at most f^T f
    bordered = np.concatenate([M, f[:, None, :]], axis=1)
    bordered = np.concatenate([bordered, np.append(f, corner[:, None], axis=1)[:, :, None]], axis=2)
    pivots = np.diagonal(np.linalg.cholesky(bordered), axis1=1, axis2=2)
    integral: Array = 0.5 * (corner - pivots[:, -1] ** 2) - np.log(pivots[:, :-1]).sum(axis=1)
    return integral


def _invert_2x2(M: Array) -> tuple[Array, Array]:
    """Inverses and determinants of many 2 by 2 matrices, several times faster than a solver."""
    a, b, c, d = M[..., 0, 0], M[..., 0, 1], M[..., 1, 0], M[..., 1, 1]
    determinant = a * d - b * c
    inverse = (
        np.stack([np.stack([d, -b], axis=-1), np.stack([-c, a], axis=-1)], axis=-2) / determinant[..., None, None]
    )
    return inverse, determinant
