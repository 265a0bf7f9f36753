"""Compares the payload that is set on a controller with the payload identified from a run."""

from typing import Any, NamedTuple

import numpy as np
import scipy

from affordance.arguments import check_number
from affordance.arrays import Array
from affordance.extensions.payload.payload_setting import PayloadSetting
from affordance.extensions.payload.posterior.payload_belief import PayloadBelief
from affordance.objects.inertia import build_transform_map

TOLERANCE = 0.05
# Payload mass below which the tolerance no longer shrinks, [kg], because small errors of a light payload do not
# matter; and lever arm that converts a mass tolerance into a first-moment tolerance, [m].
_LEAST, _LEVER = 1.0, 0.2
_SCALE = np.array([1.0, _LEVER, _LEVER, _LEVER])  # tolerances of mass and first moment per tolerance of mass
# Least probability of a setting that is judged right, and plausibility below which it is judged wrong.
_RIGHT, _WRONG = 0.5, 0.05
_SAME = np.eye(4)  # pose of a frame in itself
# Variance added to mass and first moment to make their covariance regular, as a share of the squared tolerances.
_EXACT = 1e-12


class ClaimVerdict(NamedTuple):
    """Comparison of a payload setting with the identified payload."""

    probability: float  # probability that mass and first moment are right within the tolerance
    # Posterior probability of payloads whose mass and first moment are farther from the posterior mean, in
    # Mahalanobis distance, than the nearest payload within the tolerance of the setting; 1 if the mean is within the
    # tolerance.
    plausibility: float
    mass_tolerance: float  # largest error of a mass that counts as right, [kg]
    moment_tolerance: float  # largest error of a first moment that counts as right, [kg m]
    # Largest torque error of each joint during the run if the setting is used and the posterior mean is true, shape
    # (C,), [N m].
    torque_error: Array
    # True if the set moments were compared; None if none are set; False if the run cannot check them, because they
    # cause less torque than the allowed errors of mass and first moment.
    moments_compared: bool | None = None

    @property
    def verdict(self) -> str:
        """Verdict: right, wrong or open.

        A wide posterior gives every setting a low probability. A setting is therefore wrong only if it is implausible
        under the posterior.
        """
        if self.probability >= _RIGHT:
            return "right"
        return "wrong" if self.plausibility < _WRONG else "open"


class Claim(NamedTuple):
    """Payload setting from a file, with its verdict."""

    file: str
    setting: PayloadSetting
    comparison: ClaimVerdict

    def to_dict(self) -> dict[str, Any]:
        """Returns file, verdict and setting for JSON."""
        verdict = {"file": self.file, "verdict": self.comparison.verdict}
        return verdict | self.comparison._asdict() | self.setting._asdict()


def judge_claim(
    belief: PayloadBelief, claimed: PayloadSetting, tolerance: float = TOLERANCE, X_FT: Array = _SAME
) -> ClaimVerdict:
    """Tests if a payload setting agrees with the identified payload.

    A setting is right if its mass and first moment are within their tolerances. The tolerance of the mass is relative
    to the set mass, or to 1 kg for lighter payloads. The tolerance of the first moment is 0.2 m times the tolerance
    of the mass.

    Moments of inertia are right if the torque due to their errors is at most the torque that the tolerances of mass
    and first moment cause. Slow motions rarely reveal the moments. If both the set moments and at least 95 % of the
    posterior cause less torque than allowed, ``moments_compared`` is False.

    Args:
        belief: Posterior of the whole payload, in the frame T of the tip.
        claimed: Setting of the whole payload, in the frame F of the flange.
        tolerance: Relative tolerance of the mass, from 0.001 to 1.
        X_FT: Pose of T in F, shape (4, 4).

    Raises:
        BadArgumentError: The tolerance is out of bounds.
    """
    check_number("tolerance", tolerance, 1e-3, 1.0)
    mass = tolerance * max(claimed.mass, _LEAST)
    to_flange, to_tip = (build_transform_map(X) for X in (X_FT, np.linalg.inv(X_FT)))
    away = belief.bodies.pi @ to_flange.T - claimed.parameters
    right = (np.abs(away[:, 0]) <= mass) & (np.linalg.norm(away[:, 1:4], axis=1) <= _LEVER * mass)
    Y, weights = belief.fit.evidence.samples.Y @ to_tip, belief.bodies.weights
    torque = Y @ (to_flange @ belief.parameters - claimed.parameters)
    plausibility = _measure_plausibility(away[:, :4] / (mass * _SCALE), weights)
    moments_compared = None
    if claimed.inertia is not None:
        # RMS torques over the run due to the allowed errors of mass and first moment, and due to moments of inertia.
        squares = np.einsum("nci,ncj->cij", Y, Y, optimize=True) / len(Y)
        allowed = mass * (
            np.sqrt(squares[:, 0, 0]) + _LEVER * np.sqrt(np.trace(squares[:, 1:4, 1:4], axis1=1, axis2=2))
        )
        of_moments = squares[:, 4:, 4:]
        fits = (_measure_torques(of_moments, away[:, 4:]) <= allowed).all(axis=1)
        right, plausibility = right & fits, min(plausibility, float(weights[fits].sum()))
        all_set = _measure_torques(of_moments, claimed.inertia[None])
        moments_compared = bool((all_set > allowed).any() or weights[~fits].sum() >= _WRONG)
    probability = float(np.clip(weights[right].sum(), 0.0, 1.0))
    largest = np.abs(torque).max(axis=0)
    return ClaimVerdict(probability, plausibility, mass, _LEVER * mass, largest, moments_compared)


def _measure_torques(squares: Array, moments: Array) -> Array:
    """Computes RMS torques over the run, (S, C), [N m], of moments of inertia, (S, 6).

    ``squares`` contains the mean products of the regressor columns of the moments, shape (C, 6, 6).
    """
    of_joints: Array = np.einsum("si,cij,sj->sc", moments, squares, moments, optimize=True)
    return np.sqrt(np.maximum(of_joints, 0.0))


def _measure_plausibility(away: Array, weights: Array) -> float:
    """Computes the posterior probability of deviations farther from the mean than the nearest tolerated deviation.

    Distances are Mahalanobis distances. A deviation is tolerated if its first component is from -1 to 1 and the other
    three have a norm of at most 1.

    Args:
        away: Deviations of mass and first moment from the setting, in units of their tolerances, shape (N, 4).
        weights: Weights of the samples, shape (N,).
    """
    mean = weights @ away
    scatter = away - mean
    precision = np.linalg.inv((scatter * weights[:, None]).T @ scatter + _EXACT * np.eye(4))
    nearest = _find_nearest(precision, mean) - mean
    squares = np.einsum("ni,ij,nj->n", scatter, precision, scatter, optimize=True)
    return float(np.clip(weights[squares >= nearest @ precision @ nearest].sum(), 0.0, 1.0))


def _find_nearest(precision: Array, mean: Array) -> Array:
    """Finds the tolerated deviation nearest to a mean, (4,), for a precision matrix, (4, 4)."""
    # The first component is minimised out for each vector of the others, and clipped at the tolerance.
    row, rest = precision[0, 1:] / precision[0, 0], precision[1:, 1:]
    vector = _find_nearest_vector(rest - precision[0, 0] * np.outer(row, row), mean[1:])
    first = mean[0] - row @ (vector - mean[1:])
    if abs(first) > 1.0:
        first = np.sign(first)
        given = np.linalg.solve(rest, precision[0, 0] * row) * (first - mean[0])
        vector = _find_nearest_vector(rest, mean[1:] - given)
    return np.concatenate([[first], vector])


def _find_nearest_vector(precision: Array, mean: Array) -> Array:
    """Finds the vector with norm at most 1 that is nearest to a mean, (3,), for a precision matrix, (3, 3)."""
    if np.linalg.norm(mean) <= 1.0:
        return mean
    values, vectors = np.linalg.eigh(precision)
    along = values * (vectors.T @ mean)

    def measure(multiplier: float) -> float:
        """Computes the excess of the vector's norm over 1 for a Lagrange multiplier of the norm constraint."""
        return float(np.linalg.norm(along / (values + multiplier))) - 1.0

    multiplier = scipy.optimize.brentq(measure, 0.0, np.linalg.norm(along))
    nearest: Array = vectors @ (along / (values + multiplier))
    return nearest
