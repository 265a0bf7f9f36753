"""Comparison of the payload that is set on a controller with the one that a run shows."""

from typing import Any, NamedTuple

import numpy as np
import scipy

from affordance.arguments import check_number
from affordance.arrays import Array
from affordance.identification.payload_formats import PayloadSetting
from affordance.identification.posterior.payload_belief import PayloadBelief
from affordance.objects.inertia import build_transform_map

TOLERANCE = 0.05
# Least mass to which the tolerance refers, [kg], as errors of a light payload matter no more than its weight, and
# lever at which a mass counts as a first moment, [m].
_LEAST, _LEVER = 1.0, 0.2
_SCALE = np.array([1.0, _LEVER, _LEVER, _LEVER])  # tolerances of mass and first moment per tolerance of the mass
# Probability from which a setting is called right, and plausibility below which wrong.
_RIGHT, _WRONG = 0.5, 0.05
_SAME = np.eye(4)  # pose of a frame in itself
# Variance of mass and first moment below which they count as exact, as a share of the squared tolerances.
_EXACT = 1e-12


class ClaimVerdict(NamedTuple):
    """Comparison of a payload setting with a belief."""

    probability: float  # probability that mass and first moment are right within the tolerance
    # Probability of a payload farther from the mean of the belief, in standard deviations of mass and first moment,
    # than the nearest one within the tolerance of the setting; 1 if the mean is right.
    plausibility: float
    mass_tolerance: float  # largest error of a right mass, [kg]
    moment_tolerance: float  # largest error of a right first moment, [kg m]
    # Largest error over the run of each joint's torque if the setting is used, by the mean of the belief, shape (C,),
    # [N m].
    torque_error: Array
    # False if moments are set but could not be compared, as they cause less torque in the run than a right mass and
    # first moment may be wrong by; True if they were compared; None if none are set.
    moments_compared: bool | None = None

    @property
    def verdict(self) -> str:
        """Verdict in a word: right, wrong or open.

        A belief much wider than the tolerance gives any setting a small probability; wrong is one that it excludes.
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
    """Judges the payload that is set on a controller by the payload that a run shows.

    A setting is right if its mass is within the tolerance times the mass set, or times 1 kg for lighter ones, and its
    first moment within 0.2 m times that. Moments of inertia that are set count by their torques: they may be wrong by
    no more than a right mass and first moment make them, which slow motions hardly ever show. If those that are
    set cause less than that, and so do 95 % of what is believed, the run cannot check them (``moments_compared``).
    The setting is in the frame F of the flange, in which the pose of the belief's frame T is X_FT, (4, 4); both
    payloads are whole. A tolerance that is not from 0.001 to 1 raises a BadArgumentError.
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
        # Root mean squares over the run: of what a right mass and first moment may be off by, and of the moments.
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
    """Computes root mean squares over the run of what moments, (S, 6), cause at each joint, (S, C), [N m].

    The mean products of the moments' columns of the regressor have the shape (C, 6, 6).
    """
    of_joints: Array = np.einsum("si,cij,sj->sc", moments, squares, moments, optimize=True)
    return np.sqrt(np.maximum(of_joints, 0.0))


def _measure_plausibility(away: Array, weights: Array) -> float:
    """Computes the weight of deviations that are farther from their mean than the nearest one within the tolerance.

    Deviations from the setting in mass and first moment are in units of the tolerances, shape (N, 4): right is a
    first number from -1 to 1, and a vector of the others of length up to 1. Distances are by the covariance.
    """
    mean = weights @ away
    scatter = away - mean
    precision = np.linalg.inv((scatter * weights[:, None]).T @ scatter + _EXACT * np.eye(4))
    nearest = _find_nearest(precision, mean) - mean
    squares = np.einsum("ni,ij,nj->n", scatter, precision, scatter, optimize=True)
    return float(np.clip(weights[squares >= nearest @ precision @ nearest].sum(), 0.0, 1.0))


def _find_nearest(precision: Array, mean: Array) -> Array:
    """Finds the deviation within the tolerance that is nearest to a mean, shape (4,), by a precision, (4, 4)."""
    # With the best first number for each vector of the others; clipped if that is beyond the tolerance.
    row, rest = precision[0, 1:] / precision[0, 0], precision[1:, 1:]
    vector = _find_nearest_vector(rest - precision[0, 0] * np.outer(row, row), mean[1:])
    first = mean[0] - row @ (vector - mean[1:])
    if abs(first) > 1.0:
        first = np.sign(first)
        given = np.linalg.solve(rest, precision[0, 0] * row) * (first - mean[0])
        vector = _find_nearest_vector(rest, mean[1:] - given)
    return np.concatenate([[first], vector])


def _find_nearest_vector(precision: Array, mean: Array) -> Array:
    """Finds the vector of length up to 1 that is nearest to a mean, shape (3,), by a precision, (3, 3)."""
    if np.linalg.norm(mean) <= 1.0:
        return mean
    values, vectors = np.linalg.eigh(precision)
    along = values * (vectors.T @ mean)

    def measure(multiplier: float) -> float:
        """Returns by how much the vector with Lagrange's multiplier of the length is too long."""
        return float(np.linalg.norm(along / (values + multiplier))) - 1.0

    multiplier = scipy.optimize.brentq(measure, 0.0, np.linalg.norm(along))
    nearest: Array = vectors @ (along / (values + multiplier))
    return nearest
