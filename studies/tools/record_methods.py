"""Inertial parameters from a force-torque record: from part densities, by least squares, and by the authors' method.

In these records the sensor measures F = m (a + g), where g is the acceleration of gravity: the weight of the tool and
the force that accelerates it have the same sign. The authors simulated and read them that way; a real sensor measures
m (a - g). All quantities are expressed in the frame S of the sensor, and about its origin.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import nnls

from affordance.arrays import Array
from affordance.belief.density_belief import DensityBelief, Prior
from affordance.objects.inertia import NUM_PARAMETERS
from affordance.plant.wrench_regressor import compute_wrench_regressor
from studies.tools.record_file import Recording

GRAVITY_W = np.array([0.0, 0.0, -9.81])
# Accelerations below which the authors take the robot to be at rest, [m/s^2, rad/s^2].
_AT_REST = 1.0
# Least standard deviations of wrenches, which are used for records without noise, [N], [N m].
_LEAST_FORCE_SD, _LEAST_TORQUE_SD = 1e-3, 1e-5
_NUM_ITERATIONS = 8
# Density at which the effect of acceleration errors is evaluated at first, [kg/m^3].
_FIRST_DENSITY = 3000.0


class Noise(NamedTuple):
    """Standard deviations of the noise added to a record."""

    acceleration: float  # standard deviation of linear acceleration, [m/s^2]
    angular_acceleration: float  # standard deviation of angular acceleration, [rad/s^2]
    force: float  # standard deviation of force, [N]
    torque: float  # standard deviation of torque, [N m]


# Noise levels as the authors define them.
NOISES = {
    "none": Noise(0.0, 0.0, 0.0, 0.0),
    "low": Noise(0.025, 0.25, 0.05, 0.0025),
    "moderate": Noise(0.05, 0.5, 0.1, 0.005),
    "high": Noise(0.1, 1.0, 0.2, 0.01),
}


class Measured(NamedTuple):
    """Record in the frame of its sensor, with noise, at N times."""

    g_S: Array  # acceleration of gravity, shape (N, 3), [m/s^2]
    a_S: Array  # linear acceleration, shape (N, 3), [m/s^2]
    alpha_S: Array  # angular acceleration, shape (N, 3), [rad/s^2]
    w_S: Array  # angular velocity, shape (N, 3), [rad/s]
    wrench_S: Array  # torque, followed by force, shape (N, 6), [N m, N]


def add_noise(recording: Recording, noise: Noise, rng: np.random.Generator) -> Measured:
    """Expresses a record in the frame of its sensor, and adds independent errors to every number."""
    R_WS = recording.X_WS[:, :3, :3]

    def express(vectors_W: Array, sd: float) -> Array:
        expressed: Array = np.einsum("nji,nj->ni", R_WS, vectors_W) + sd * rng.standard_normal(vectors_W.shape)
        return expressed

    return Measured(
        np.einsum("nji,j->ni", R_WS, GRAVITY_W),
        express(recording.a_WS, noise.acceleration),
        express(recording.alpha_WS, noise.angular_acceleration),
        express(recording.w_WS, 0.0),
        np.hstack([express(recording.torque_W, noise.torque), express(recording.force_W, noise.force)]),
    )


def build_regressors(measured: Measured) -> Array:
    """Builds the matrices W with wrench = W pi at each time, shape (N, 6, 10)."""
    return compute_wrench_regressor(np.stack([measured.a_S + measured.g_S, measured.alpha_S, measured.w_S], axis=1))


def solve_least_squares(measured: Measured) -> Array:
    """Estimates all ten parameters by ordinary least squares (Atkeson, An and Hollerbach 1986), shape (10,)."""
    W = build_regressors(measured).reshape(-1, NUM_PARAMETERS)
    pi: Array = np.linalg.lstsq(W, measured.wrench_S.ravel(), rcond=None)[0]
    return pi


class PointParts(NamedTuple):
    """Tool as the authors describe it: points, each with a volume, that belong to K parts."""

    p_SQ: Array  # positions of the points, shape (P, 3), [m]
    volumes: Array  # volumes of the points, shape (P,), [m^3]
    part: Array  # index of each point's part, shape (P,)

    def build_inertia_map(self) -> Array:
        """Computes the parameters of each part at 1 kg/m^3, as point masses, shape (10, K)."""
        columns = []
        for number in np.unique(self.part):
            own = self.part == number
            points, volumes = self.p_SQ[own], self.volumes[own]
            x, y, z = points.T
            moments = [y**2 + z**2, x**2 + z**2, x**2 + y**2, -x * y, -x * z, -y * z]
            columns.append([volumes.sum(), *(volumes @ points), *(volumes @ moment for moment in moments)])
        return np.array(columns, dtype=float).T


def solve_at_rest(measured: Measured, Phi: Array) -> Array:
    """Estimates nonnegative part masses by least squares on samples at rest (Nadeau, Giamou and Kelly 2023).

    Phi has the parameters of each part at 1 kg/m^3, (10, K); returns inertial parameters, (10,).
    """
    sizes = np.linalg.norm([measured.a_S, measured.alpha_S], axis=-1)  # (2, N)
    resting = (sizes < _AT_REST).all(axis=0)
    nothing = np.zeros_like(measured.g_S[resting])
    still = Measured(measured.g_S[resting], nothing, nothing, nothing, measured.wrench_S[resting])
    columns = build_regressors(still) @ (Phi / Phi[0])
    masses, _ = nnls(columns.reshape(-1, Phi.shape[1]), still.wrench_S.ravel())
    pi: Array = (Phi / Phi[0]) @ masses
    return pi


def infer_densities(measured: Measured, Phi: Array, noise: Noise, prior: Prior) -> DensityBelief:
    """Infers the densities of a tool's materials from all samples.

    Phi has the parameters of each material at 1 kg/m^3, (10, M). Errors of acceleration count as errors of the
    corresponding wrench, R = R_w + sum_k s_k^2 (B_k pi)(B_k pi)^T, where B_k is the derivative of W with respect to
    the k-th acceleration; R is evaluated at the estimated densities by fixed-point iteration. The expected
    contribution of these errors to the products of W with itself is subtracted.
    """
    W = build_regressors(measured)
    count = len(W)
    still, moved = np.zeros((1, 3, 3)), np.zeros((6, 3, 3))
    moved[np.arange(6), np.arange(6) // 3, np.arange(6) % 3] = 1.0
    B = compute_wrench_regressor(moved) - compute_wrench_regressor(still)  # (6, 6, 10)
    variances = np.repeat([noise.acceleration**2, noise.angular_acceleration**2], 3)
    sds = [max(noise.torque, _LEAST_TORQUE_SD), max(noise.force, _LEAST_FORCE_SD)]
    of_wrench = np.diag(np.repeat(sds, 3)) ** 2
    rho = np.full(Phi.shape[1], _FIRST_DENSITY)
    unknown = DensityBelief(np.zeros((0, 0)), np.zeros(0)).extend(prior, Phi.shape[1])
    belief = unknown
    for _ in range(_NUM_ITERATIONS):
        effects = B @ (Phi @ rho)  # (6, 6)
        R = of_wrench + np.einsum("k,ki,kj->ij", variances, effects, effects)
        weighted = np.linalg.solve(R, W)  # (N, 6, 10)
        gram = np.einsum("nij,nik->jk", W, weighted)
        gram -= count * np.einsum("k,kij,kil->jl", variances, B, np.linalg.solve(R, B))
        gram = _keep_positive(Phi.T @ gram @ Phi)
        shift = Phi.T @ np.einsum("nij,ni->j", weighted, measured.wrench_S)
        belief = replace(
            unknown, precision=unknown.precision + gram, information_vector=unknown.information_vector + shift
        )
        rho = belief.compute_mean()
    return belief


def _keep_positive(gram: Array) -> Array:
    """Returns the nearest matrix without negative eigenvalues, which the subtraction of expectations can cause."""
    values, vectors = np.linalg.eigh(0.5 * (gram + gram.T))
    kept: Array = (vectors * np.maximum(values, 0.0)) @ vectors.T
    return kept
