"""Compares the payload that is set on a controller with the payload in a run."""

from typing import Any, NamedTuple

import numpy as np
import scipy

from affordance.arguments import check_number
from affordance.arrays import Array
from affordance.extensions.payload.payload_setting import PayloadSetting
from affordance.extensions.payload.posterior.payload_belief import PayloadBelief
from affordance.objects.inertia import build_transform_map

TOLERANCE = 0.05
# Least mass to which the tolerance applies, [kg], as the errors of a light payload matter no more than its weight,
# and lever at which a mass tolerance becomes that of a first moment, [m].
_LEAST, _LEVER = 1.0, 0.2
_SCALE = np.array([1.0, _LEVER, _LEVER, _LEVER])  # tolerances of mass and first moment, relative to that of the mass
# Probability above which a setting is right, and plausibility below which it is wrong.
_RIGHT, _WRONG = 0.5, 0.05
_SAME = np.eye(4)  # pose of a frame in itself
# Variance of mass and first moment below which they count as exact, as a share of the squared tolerances.
_EXACT = 1e-12


class ClaimVerdict(NamedTuple):
    """Comparison of a payload setting with a belief."""

    probability: float  # probability that mass and first moment are right within the tolerance
    # Probability of a payload that is farther from the mean of the belief, in standard deviations of mass and first
    # moment, than the nearest payload within the tolerance of the setting; 1 if the mean itself is within the
    # tolerance.
    plausibility: float
    mass_tolerance: float  # largest error of a mass that counts as right, [kg]
    moment_tolerance: float  # largest error of a first moment that counts as right, [kg m]
    # Largest torque error over the run at each joint if the setting is used, according to the mean of the belief,
    # shape (C,), [N m].
    torque_error: Array
    # True if the moments that are set were compared; None if none are set; False if the run cannot check them,
    # because they cause less torque than mass and first moment may be wrong by.
    moments_compared: bool | None = None

    @property
    def verdict(self) -> str:
        """Verdict: right, wrong or open.

        A belief that is much wider than the tolerance gives every setting a small probability, so a setting is wrong
        only if the belief excludes it.
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
    """Compares the payload that is set on a controller with the payload in a run.

    A setting is right if its mass is within the tolerance times the set mass, or times 1 kg for lighter payloads, and
    its first moment is within 0.2 m times that. Moments of inertia are compared by their torques. The allowed error
    is the torque that the tolerances of mass and first moment cause. Slow motions hardly ever show the moments: if
    both the set moments and 95 % of the believed ones cause less torque than this, ``moments_compared`` is False.

    Args:
        belief: Belief about the whole payload, in the frame T of the tip.
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
        # Torques, root mean square over the run: those of the allowed errors of mass and first moment, and those of
        # moments.
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
    """Computes RMS torques, (S, C), [N m], of moments of inertia, (S, 6), over the run.

    ``squares`` holds the mean products of the regressor's columns of the moments, shape (C, 6, 6).
    """
    of_joints: Array = np.einsum("si,cij,sj->sc", moments, squares, moments, optimize=True)
    return np.sqrt(np.maximum(of_joints, 0.0))


def _measure_plausibility(away: Array, weights: Array) -> float:
    """Computes the probability of deviations beyond the nearest tolerated one. Distance is from their mean.

    Deviations from the setting in mass and first moment are in units of their tolerances, shape (N, 4). A deviation
    is within the tolerance if its first number is from -1 to 1 and the vector of the others has a length of at most
    1. Distances are Mahalanobis distances.
    """
    mean = weights @ away
    scatter = away - mean
    precision = np.linalg.inv((scatter * weights[:, None]).T @ scatter + _EXACT * np.eye(4))
    nearest = _find_nearest(precision, mean) - mean
    squares = np.einsum("ni,ij,nj->n", scatter, precision, scatter, optimize=True)
    return float(np.clip(weights[squares >= nearest @ precision @ nearest].sum(), 0.0, 1.0))


def _find_nearest(precision: Array, mean: Array) -> Array:
    """Finds the tolerated deviation nearest to a mean, (4,), under a precision, (4, 4)."""
    # The first number is optimised out for each vector of the others, and clipped where it exceeds the tolerance.
    row, rest = precision[0, 1:] / precision[0, 0], precision[1:, 1:]
    vector = _find_nearest_vector(rest - precision[0, 0] * np.outer(row, row), mean[1:])
    first = mean[0] - row @ (vector - mean[1:])
    if abs(first) > 1.0:
        first = np.sign(first)
        given = np.linalg.solve(rest, precision[0, 0] * row) * (first - mean[0])
        vector = _find_nearest_vector(rest, mean[1:] - given)
    return np.concatenate([[first], vector])


def _find_nearest_vector(precision: Array, mean: Array) -> Array:
    """Finds the vector of length up to 1 nearest to a mean, (3,). The precision is (3, 3)."""
    if np.linalg.norm(mean) <= 1.0:
        return mean
    values, vectors = np.linalg.eigh(precision)
    along = values * (vectors.T @ mean)

    def measure(multiplier: float) -> float:
        """Computes by how much the vector's length exceeds 1 at a Lagrange multiplier.

        The multiplier belongs to the constraint.
        """
        return float(np.linalg.norm(along / (values + multiplier))) - 1.0

    multiplier = scipy.optimize.brentq(measure, 0.0, np.linalg.norm(along))
    nearest: Array = vectors @ (along / (values + multiplier))
    return nearest
