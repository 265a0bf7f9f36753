"""Direction of gravity from a wrist sensor in held postures, which shows tilts of base and sensor.

At rest the force is R^T m g + offset. It is linear in the three numbers m g and in the three of the offset, so a few
postures show gravity's direction along with the load.
"""

from typing import NamedTuple

import numpy as np
import scipy

from affordance.arrays import Array
from affordance.extensions.payload.recording.run import Run
from affordance.objects.inertia import NUM_PARAMETERS
from affordance.plant.serial_chain import SerialChain

# SD of the tilt of a base that was meant to be level, and of a sensor's mounting, about each axis: three degrees,
# [rad].
_TILT_SD = 0.05
# Prior SDs of the weight and of the force offsets, [N].
_WEIGHT_SD, _OFFSET_SD = 1e3, 1e2


class Tilt(NamedTuple):
    """Direction of gravity in the base frame."""

    gravity: Array  # gravity, shape (3,), [m/s^2], with the described length
    described: Array  # gravity according to the description, shape (3,), [m/s^2]
    axes: Array  # two directions perpendicular to the described gravity, shape (2, 3)
    covariance: Array  # covariance of the tilt along these axes, shape (2, 2), [rad^2]
    apparent: float  # angle to the described gravity, from the forces alone, [rad]
    apparent_sd: float  # standard deviation of that angle, [rad]

    def describe(self) -> str:
        """Describes the tilt in words."""
        angle = np.degrees(measure_angle(self.gravity, self.described))
        sd = np.degrees(np.sqrt(np.trace(self.covariance)))
        return f"according to the forces, gravity is {angle:.1f} +- {sd:.1f} deg from its described direction"

    def measure_errors(self, robot: SerialChain, Y: Array, signal: Array, q: Array) -> Array:
        """Computes the covariance of the load that the tilt's uncertainty causes, shape (10, 10).

        Args:
            robot: The arm, with this gravity.
            Y: Regressors of the six channels, shape (N, 6, 10).
            signal: Signals, with or without an offset, shape (N, 6).
            q: Joint angles of the postures, shape (N, n), [rad].
        """

        def fit(W: Array) -> Array:
            """Fits mass, first moment and offsets."""
            of_offset = np.tile(np.eye(6), (len(W), 1, 1))
            A = np.concatenate([W[:, :, :4], of_offset], axis=2).reshape(-1, 10)
            solution: Array = np.linalg.lstsq(A, signal.ravel())[0][:4]
            return solution

        before = fit(Y)
        covariance = np.zeros((NUM_PARAMETERS, NUM_PARAMETERS))
        values, vectors = np.linalg.eigh(self.covariance)
        for value, vector in zip(values, vectors.T, strict=True):
            change = np.linalg.norm(self.gravity) * np.sqrt(max(value, 0.0)) * (vector @ self.axes)
            tilted = compute_force_regressors(robot.with_gravity(self.gravity + change), q)
            step = fit(tilted) - before
            covariance[:4, :4] += np.outer(step, step)
        return covariance


def measure_angle(a: Array, b: Array) -> float:
    """Computes the angle between two vectors, [rad]."""
    return float(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b))


def compute_force_regressors(robot: SerialChain, q: Array) -> Array:
    """Computes the regressors of a sensor's forces and moments at rest, forces first, shape (N, 6, 10)."""
    rest = np.zeros_like(q)
    forces: Array = robot.compute_wrench_regressors(q, rest, rest)[:, [3, 4, 5, 0, 1, 2]]
    return forces


def find_tilt(robot: SerialChain, run: Run) -> Tilt:
    """Estimates the direction of gravity from the forces of a run of postures."""
    described = robot.gravity_W
    length = float(np.linalg.norm(described))
    # Forces of one kilogram with gravity along each axis of the base.
    of_axes = [compute_force_regressors(robot.with_gravity(length * axis), run.q)[:, :3, 0] for axis in np.eye(3)]
    columns = np.stack(of_axes, axis=2)
    A = np.concatenate([columns, np.tile(np.eye(3), (len(columns), 1, 1))], axis=2).reshape(-1, 6)
    b = run.signal[:, :3].ravel()
    prior = np.repeat([_WEIGHT_SD / length, _OFFSET_SD], 3) ** -2.0
    left = b - A @ np.linalg.lstsq(A, b)[0]
    variance = max(float(left @ left) / max(len(b) - 6, 1), np.finfo(float).tiny)
    covariance = np.linalg.inv(A.T @ A / variance + np.diag(prior))
    weight = (covariance @ (A.T @ b) / variance)[:3]
    mass = float(np.linalg.norm(weight))
    axes = scipy.linalg.null_space(described[None] / length).T
    found = axes @ weight / max(mass, np.finfo(float).tiny)
    of_forces = axes @ covariance[:3, :3] @ axes.T / max(mass**2, np.finfo(float).tiny)
    C = np.linalg.inv(np.linalg.inv(of_forces) + np.eye(2) / _TILT_SD**2)
    tilt = C @ np.linalg.solve(of_forces, found)
    gravity = described / length + tilt @ axes
    apparent = measure_angle(weight, described)
    sd = float(np.sqrt(np.trace(of_forces)))
    return Tilt(length * gravity / np.linalg.norm(gravity), described, axes, C, apparent, sd)
