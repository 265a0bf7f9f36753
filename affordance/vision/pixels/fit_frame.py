"""Change of frame of a fitted part, with its uncertainty."""

import numpy as np

from affordance.arrays import Array
from affordance.vision.pixels.ellipsoid_fit import INDICES, NUM_NUMBERS, Fit, SeenEllipsoid, build_strain


def express_fit(fit: Fit, X_TC: Array) -> Fit:
    """Expresses a fit in another frame T, given the pose X_TC of its frame C, (4, 4)."""
    R = X_TC[:3, :3]
    turn = np.zeros((NUM_NUMBERS, NUM_NUMBERS))
    turn[:3, :3] = R
    for column in range(6):
        turn[3:, 3 + column] = _list_strains(R @ build_strain(np.eye(6)[column]) @ R.T)
    ellipsoid = SeenEllipsoid(R @ fit.ellipsoid.centre + X_TC[:3, 3], R @ fit.ellipsoid.shape_matrix @ R.T)
    return fit._replace(ellipsoid=ellipsoid, covariance=turn @ fit.covariance @ turn.T)


def _list_strains(E: Array) -> list[float]:
    """Lists the elements xx, yy, zz, xy, xz, yz of a symmetric matrix."""
    return [float(E[i, j]) for i, j in INDICES]
