"""What is made by hand is straight: a part that may lie along the axis of its tool is taken to do so.

A picture leaves a part's centre and axes uncertain by fractions of a millimetre and of a degree. Where what is seen
agrees with the part lying on the tool's axis Tx, with its own axes along those of T, this is believed: the fit is
conditioned on it, as by Bayes' rule where the regular is so much more probable beforehand that only clear evidence
speaks against it. Frame T throughout.
"""

import numpy as np
from scipy.stats import chi2

from affordance.arrays import Array
from affordance.vision.pixels.ellipsoid_fit import NUM_NUMBERS, Fit, SeenEllipsoid, build_strain, deform

_STRAINS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
# Centre beside the axis (y, z), and products of the shape matrix (xy, xz, yz): 0 for a part that lies straight.
_NUM_CONDITIONS = 5
# A straight part is taken for a crooked one in one case of a thousand.
_MAX_CHI2 = float(chi2.ppf(0.999, _NUM_CONDITIONS))


def express_fit(fit: Fit, X_TC: Array) -> Fit:
    """Expresses a fit in another frame T, by the pose of its own frame C in it, (4, 4)."""
    R = X_TC[:3, :3]
    turn = np.zeros((NUM_NUMBERS, NUM_NUMBERS))
    turn[:3, :3] = R
    for column in range(6):
        turn[3:, 3 + column] = _list_strains(R @ build_strain(np.eye(6)[column]) @ R.T)
    ellipsoid = SeenEllipsoid(R @ fit.ellipsoid.centre + X_TC[:3, 3], R @ fit.ellipsoid.shape_matrix @ R.T)
    return fit._replace(ellipsoid=ellipsoid, covariance=turn @ fit.covariance @ turn.T)


def straighten(fit: Fit) -> Fit:
    """Conditions a fit in T on lying straight, if what is seen agrees with it; else returns it as it is."""
    centre, S = fit.ellipsoid
    value = np.array([centre[1], centre[2], S[0, 1], S[0, 2], S[1, 2]])
    H = np.zeros((_NUM_CONDITIONS, NUM_NUMBERS))
    H[0, 1] = H[1, 2] = 1.0
    for column in range(6):
        E = build_strain(np.eye(6)[column])
        change = E @ S + S @ E
        H[2:, 3 + column] = change[0, 1], change[0, 2], change[1, 2]
    P = fit.covariance
    gain = np.linalg.solve(H @ P @ H.T, H @ P).T
    if value @ np.linalg.solve(H @ P @ H.T, value) > _MAX_CHI2:
        return fit
    moved = deform(fit.ellipsoid, -gain @ value)
    # To first order the conditions are met; what is left of second order is taken away.
    ellipsoid = SeenEllipsoid(moved.centre * [1.0, 0.0, 0.0], np.diag(np.diag(moved.shape_matrix)))
    covariance = P - gain @ H @ P
    return fit._replace(ellipsoid=ellipsoid, covariance=0.5 * (covariance + covariance.T))


def _list_strains(E: Array) -> list[float]:
    """xx, yy, zz, xy, xz, yz of a symmetric matrix."""
    return [float(E[i, j]) for i, j in _STRAINS]
