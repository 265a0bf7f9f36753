"""Models of evidence other than measured torques: identified payloads, and densities from earlier versions."""

from dataclasses import dataclass

import numpy as np

from affordance.arrays import Array
from affordance.belief.likelihood import Likelihood, Quadratic
from affordance.objects.inertia import NUM_PARAMETERS, Geometry


@dataclass(frozen=True)
class PayloadQuadratic:
    """Quadratic log likelihood of an identified payload's ten parameters.

    The features are the precision H, row by row, followed by the information vector b.
    """

    def num_features(self, num_joints: int) -> int:
        """Returns the number of entries of H and b."""
        return NUM_PARAMETERS * (NUM_PARAMETERS + 1)

    def compute_likelihood(
        self, features: Array, num_samples: int, num_joints: int, geometry: Geometry, rho: Array
    ) -> Likelihood:
        """Computes the likelihood of densities; errors of the geometry are evaluated at rho, (M,).

        The log likelihood of the best-fitting parameters is zero.
        """
        return unpack(features).widen(geometry.compute_covariance(rho)).restrict(geometry.Phi)


def pack(quadratic: Quadratic) -> Array:
    """Packs a quadratic as features of ``PayloadQuadratic``, shape (110,)."""
    return np.concatenate([quadratic.precision.ravel(), quadratic.information])


def unpack(features: Array) -> Quadratic:
    """Unpacks the features of ``PayloadQuadratic``, shape (110,)."""
    size = NUM_PARAMETERS**2
    return Quadratic(features[:size].reshape(NUM_PARAMETERS, NUM_PARAMETERS), features[size:])
