"""Bayesian linear regression with unknown error variance and unknown SD of some coefficients."""

from typing import NamedTuple

import numpy as np

from affordance.arrays import Array

# Logarithmic grid of the errors' SD, in units of the least-squares estimate.
_RELATIVE = np.geomspace(1.0 / 30.0, 12.0, 60)
_LEAST = 1e-4  # least SD of errors relative to the measured quantity; no sensor is better
_STEP = float(np.log(_RELATIVE[1] / _RELATIVE[0]))


class Regression(NamedTuple):
    """Posterior of the coefficients: a mixture of C normals, one per grid cell of prior SDs and error SD."""

    log_evidence: float
    weights: Array  # probabilities of the cells, shape (C,)
    sigmas: Array  # SD of the errors in each cell, shape (C,)
    means: Array  # means of the coefficients, shape (C, k)
    precisions: Array  # precision matrices of the coefficients, shape (C, k, k)

    def draw(self, num: int, rng: np.random.Generator) -> Array:
        """Draws coefficients from the posterior, shape (num, k)."""
        counts = rng.multinomial(num, self.weights)
        parts = [
            self.means[c]
            + np.linalg.solve(
                np.linalg.cholesky(self.precisions[c]).T, rng.standard_normal((len(self.means[c]), n))
            ).T
            for c, n in enumerate(counts)
            if n
        ]
        return np.asarray(rng.permutation(np.concatenate(parts)))

    @property
    def mean(self) -> Array:
        """Posterior mean of the coefficients, shape (k,)."""
        return np.asarray(self.weights @ self.means)


def regress(X: Array, y: Array, sds: Array) -> Regression:
    """Fits y = X b + e with errors e of unknown variance, using Bayes' rule.

    The SD of the errors has Jeffreys's prior, and the coefficients are normal about zero. The alternative sets of
    prior SDs are equally probable. With one set, the posterior is Student's t.

    Args:
        X: Columns, shape (n, k).
        y: Measurements, shape (n,).
        sds: Prior SDs of the coefficients in each of S sets, shape (S, k).
    """
    size = np.sqrt(y @ y / len(y)) + np.finfo(float).tiny
    solution, _, rank, _ = np.linalg.lstsq(X, y, rcond=1e-9)
    left = y - X @ solution
    typical = np.sqrt(left @ left / max(len(y) - int(rank), 1))
    relative = np.maximum(typical * _RELATIVE, _LEAST * size)
    sigmas, sds = np.tile(relative, len(sds)), np.repeat(sds, len(_RELATIVE), axis=0)
    # In units of the prior SDs, so that rounding errors are small for coefficients that the data do not determine.
    outer = sds[:, :, None] * sds[:, None]
    precisions = X.T @ X * outer / sigmas[:, None, None] ** 2 + np.eye(X.shape[1])
    information = sds * (X.T @ y) / sigmas[:, None] ** 2
    scaled = np.linalg.solve(precisions, information[..., None])[..., 0]
    means = sds * scaled
    exponent = ((y - means @ X.T) ** 2).sum(axis=1) / sigmas**2 + (scaled**2).sum(axis=1)
    log = -0.5 * exponent - 0.5 * np.linalg.slogdet(precisions)[1] - len(y) * np.log(sigmas)
    top = float(log.max())
    weights = np.exp(log - top)
    log_evidence = top + float(np.log(weights.sum() * _STEP * len(_RELATIVE) / len(sigmas)))
    return Regression(log_evidence, weights / weights.sum(), sigmas, means, precisions / outer)
