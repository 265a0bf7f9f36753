"""Log-Cholesky coordinates of the pseudo-inertia: ten parameters that are always physically consistent.

    J = m [[S S^T + c c^T, c], [c^T, 1]],    theta = (ln m, c, ln diag S, s12, s13, s23)

S is upper triangular. Every theta is a body with positive mass and a positive definite matrix of second moments about
its centre of mass, and every such body has exactly one theta (Rucker & Wensing 2022, IEEE RA-L 7:2932-2939). Priors
on mass and centre of mass are easily stated, because both are coordinates.
"""

import numpy as np

from affordance.arrays import Array, Mask
from affordance.objects.inertia import NUM_PARAMETERS, pseudo_inertia_from_parameters

_OFF = (np.array([0, 0, 1]), np.array([1, 2, 2]))  # rows and columns of s12, s13, s23
_DIAGONAL = np.arange(3)
_ROWS, _COLUMNS = (np.concatenate([_DIAGONAL, off]) for off in _OFF)  # rows and columns of ln diag S, s12, s13, s23


def parameters_from_theta(theta: Array) -> Array:
    """Converts theta, shape (..., 10), to the ten parameters, shape (..., 10)."""
    m, c = np.exp(theta[..., 0]), theta[..., 1:4]
    S = _build_root(theta)
    G = S @ np.swapaxes(S, -1, -2) + c[..., :, None] * c[..., None, :]
    pi = np.empty(theta.shape)
    pi[..., 0] = 1.0
    pi[..., 1:4] = c
    pi[..., 4:] = _list_moments(G)
    return pi * m[..., None]


def theta_from_parameters(pi: Array) -> Array:
    """Converts ten parameters, shape (..., 10), to theta, shape (..., 10).

    Raises:
        numpy.linalg.LinAlgError: The parameters do not belong to a body with positive volume.
    """
    J = pseudo_inertia_from_parameters(pi)
    m = J[..., 3, 3]
    c = J[..., :3, 3] / m[..., None]
    G = J[..., :3, :3] / m[..., None, None] - c[..., :, None] * c[..., None, :]
    # Reversing rows and columns turns Cholesky's lower triangle into the upper triangle S.
    S = np.linalg.cholesky(G[..., ::-1, ::-1])[..., ::-1, ::-1]
    theta = np.empty(pi.shape)
    theta[..., 0] = np.log(m)
    theta[..., 1:4] = c
    theta[..., 4:7] = np.log(S[..., _DIAGONAL, _DIAGONAL])
    theta[..., 7:] = S[..., _OFF[0], _OFF[1]]
    return theta


def thicken(pi: Array) -> Array:
    """Thickens bodies, (..., 10), by a micrometre, so that even the thinnest has a positive volume after rounding.

    Bodies of many metres become thicker by more, but by less than a millionth of their size.
    """
    thick = pi.copy()
    thick[..., 4:7] += 1e-12 * pi[..., :1] + 1e-13 * np.abs(pi[..., 4:7]).sum(axis=-1, keepdims=True)
    return thick


def compute_jacobian(theta: Array, pi: Array | None = None) -> Array:
    """Computes the Jacobian of the ten parameters with respect to theta, shape (10, 10).

    ``pi`` is the vector of parameters at theta, (10,); None to compute it.
    """
    m, c = np.exp(theta[0]), theta[1:4]
    S = _build_root(theta)
    D = np.zeros((NUM_PARAMETERS, NUM_PARAMETERS))
    D[:, 0] = parameters_from_theta(theta) if pi is None else pi
    dG = np.zeros((9, 3, 3))
    D[_DIAGONAL + 1, _DIAGONAL + 1] = m
    dG[_DIAGONAL, _DIAGONAL] = c
    dG[np.arange(3, 9), _ROWS] = S[:, _COLUMNS].T
    dG[_DIAGONAL + 3, _DIAGONAL] *= S[_DIAGONAL, _DIAGONAL, None]
    D[4:, 1:] = m * _list_moments(dG + dG.transpose(0, 2, 1)).T
    return D


def is_possible(pi: Array) -> Mask:
    """Returns a mask, (N,), that is True for parameters, (N, 10), with a positive definite pseudo-inertia."""
    possible: Mask = np.linalg.eigvalsh(pseudo_inertia_from_parameters(pi))[:, 0] > 0.0
    return possible


def _build_root(theta: Array) -> Array:
    S = np.zeros((*theta.shape[:-1], 3, 3))
    S[..., _DIAGONAL, _DIAGONAL] = np.exp(theta[..., 4:7])
    S[..., _OFF[0], _OFF[1]] = theta[..., 7:]
    return S


def _list_moments(G: Array) -> Array:
    """Computes Ixx, Iyy, Izz, Ixy, Ixz, Iyz from matrices of second moments G, shape (..., 3, 3)."""
    diagonal = G[..., _DIAGONAL, _DIAGONAL]
    moments = diagonal.sum(axis=-1, keepdims=True) - diagonal
    return np.concatenate([moments, -G[..., _OFF[0], _OFF[1]]], axis=-1)
