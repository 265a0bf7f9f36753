"""Comparison of the payload that is set on a controller with the one that a run shows."""

from typing import NamedTuple

import numpy as np

from affordance.arguments import check_number
from affordance.arrays import Array
from affordance.identification.payload_formats import PayloadSetting
from affordance.identification.posterior.payload_belief import PayloadBelief

TOLERANCE = 0.05
# Least mass to which the tolerance refers, [kg], as errors of a light payload matter no more than its weight, and
# lever at which a mass counts as a first moment, [m].
_LEAST, _LEVER = 1.0, 0.2
# Probability from which a setting is called right, and below which wrong.
_RIGHT, _WRONG = 0.5, 0.05


class ClaimVerdict(NamedTuple):
    """Comparison of a payload setting with a belief.

    Attributes:
        probability: Probability that mass and first moment are right within the tolerance.
        mass_tolerance: Largest error of a right mass, [kg].
        moment_tolerance: Largest error of a right first moment, [kg m].
        torque_error: Largest error over the run of each joint's torque if the setting is used, by the mean of the
            belief, shape (C,), [N m].
    """

    probability: float
    mass_tolerance: float
    moment_tolerance: float
    torque_error: Array

    @property
    def verdict(self) -> str:
        """Verdict in a word: right, wrong or open."""
        if self.probability >= _RIGHT:
            return "right"
        return "wrong" if self.probability < _WRONG else "open"


def judge_claim(belief: PayloadBelief, claimed: PayloadSetting, tolerance: float = TOLERANCE) -> ClaimVerdict:
    """Judges the payload that is set on a controller by the payload that a run shows.

    A setting is right if its mass is within the tolerance times the mass set, or times 1 kg for lighter ones, and its
    first moment within 0.2 m times that. Moments of inertia count in the torques only: slow motions do not show them.

    Args:
        belief: Posterior of the whole payload at the tip.
        claimed: Payload that is set on the controller, in the frame of the tip.
        tolerance: Relative tolerance of the mass.

    Raises:
        BadArgumentError: The tolerance is not from 0.001 to 1.
    """
    check_number("tolerance", tolerance, 1e-3, 1.0)
    mass = tolerance * max(claimed.mass, _LEAST)
    away = belief.bodies.pi - claimed.parameters
    right = (np.abs(away[:, 0]) <= mass) & (np.linalg.norm(away[:, 1:4], axis=1) <= _LEVER * mass)
    torque = belief.fit.evidence.samples.Y @ (belief.parameters - claimed.parameters)
    probability = float(np.clip(belief.bodies.weights[right].sum(), 0.0, 1.0))
    return ClaimVerdict(probability, mass, _LEVER * mass, np.abs(torque).max(axis=0))
