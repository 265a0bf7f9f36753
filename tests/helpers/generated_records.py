"""Generated force-torque records of a held tool, with the sign of the data set's."""

import numpy as np
from scipy.spatial.transform import Rotation

from affordance.arrays import Array
from studies.tools.data_set import compute_central_inertia
from studies.tools.record_file import Recording


def record_tool(pi: Array, rng: np.random.Generator) -> Recording:
    """Wrench at the sensor, F = m (a_com + g) and its torque, by Newton and Euler rather than by a regressor."""
    count = 200
    R = Rotation.random(count, random_state=1).as_matrix()
    w, alpha, a = (scale * rng.standard_normal((count, 3)) for scale in (0.3, 0.5, 0.5))
    mass, p_S = pi[0], pi[1:4] / pi[0]
    I_S = compute_central_inertia(pi)
    r = np.einsum("nij,j->ni", R, p_S)
    a_com = a + np.cross(alpha, r) + np.cross(w, np.cross(w, r))
    force = mass * (a_com + np.array([0, 0, -9.81]))
    I_W = R @ I_S @ R.transpose(0, 2, 1)
    spin = np.einsum("nij,nj->ni", I_W, w)
    torque = np.einsum("nij,nj->ni", I_W, alpha) + np.cross(w, spin) + np.cross(r, force)
    X = np.tile(np.eye(4), (count, 1, 1))
    X[:, :3, :3] = R
    return Recording(X, X, w, a, alpha, force, torque)
