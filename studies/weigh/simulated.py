"""Simulates poses of a force-torque sensor, with offsets, gains, noise and orientation errors.

Rotations are computed with SciPy, so that the truth is independent of the tested code.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from affordance.arrays import Array
from affordance.extensions.payload.weighing.poses import FORMS, WRENCH

NOISES = (0.03, 0.2, 1.0)  # SDs of a pose's mean force along each axis, [N]; a twentieth in [N m] for torques
NUM_POSES = (4, 6, 10, 20, 40)
_GRAVITY = np.array([0.0, 0.0, -9.81])
_ROW_NOISE = 0.5  # SD of a row about the mean of its pose, relative to the noise of the mean
_GAIN_SD, _COMMON_SD = 0.01, 0.005  # SDs of the gain of each axis, and of a factor common to all
_TILT_SD = np.radians(0.3)  # SD of orientation errors about each axis, [rad]


class SimulatedPoses(NamedTuple):
    """Simulated table and the true load."""

    form: str
    noise: float  # [N]
    num: int  # number of poses
    axes: str  # axes of the wrench, "sensor" or "base"
    rotations: Rotation  # true orientations of the sensor in the base
    mass: float  # [kg]
    centre: Array  # centre of mass in the sensor's axes, shape (3,), [m]
    columns: dict[str, Array]  # columns of the table by name, (rows,) each

    def write(self, path: Path) -> Path:
        """Writes the table as CSV."""
        rows = np.column_stack(list(self.columns.values()))
        np.savetxt(path, rows, delimiter=",", header=",".join(self.columns), comments="", fmt="%.8g")
        return path


def simulate_poses(seed: int, repeat: int) -> SimulatedPoses:
    """Simulates a table of poses.

    Successive repeats cycle through forms of orientation, noises and numbers of poses.
    """
    rng = np.random.default_rng((seed, repeat))
    form = tuple(FORMS)[repeat % len(FORMS)]
    noise = NOISES[repeat // len(FORMS) % len(NOISES)]
    num = NUM_POSES[repeat // (len(FORMS) * len(NOISES)) % len(NUM_POSES)]
    axes = "base" if form not in ("gravity", "accelerometer") and rng.random() < 0.4 else "sensor"
    mass, centre = float(np.exp(rng.uniform(np.log(0.3), np.log(5.0)))), rng.uniform(-0.12, 0.12, 3)
    # Two thirds of the tables contain all directions; in the others the tilt is at most about 60 degrees.
    small = Rotation.from_rotvec(rng.uniform(-0.8, 0.8, (num, 3)))
    R = Rotation.random(num, rng=rng) if rng.random() < 0.67 else Rotation.random(rng=rng) * small
    weight = mass * R.inv().apply(_GRAVITY)
    sign = rng.choice([-1.0, 1.0])
    gains = 1.0 + _COMMON_SD * rng.standard_normal() + _GAIN_SD * rng.standard_normal(6)
    scale = noise * np.array([1.0, 1.0, 1.0, 0.05, 0.05, 0.05])
    wrench = sign * gains * np.column_stack([weight, np.cross(centre, weight)])
    wrench += scale * (rng.standard_normal((num, 6)) + rng.uniform(-20.0, 20.0, 6))
    if axes == "base":
        wrench = np.column_stack([R.apply(wrench[:, :3]), R.apply(wrench[:, 3:])])
    stated = R * Rotation.from_rotvec(_TILT_SD * rng.standard_normal((num, 3)))
    counts = rng.integers(1, 30) * np.ones(num, dtype=int)
    rows = np.repeat(wrench, counts, axis=0)
    rows = rows + _ROW_NOISE * scale * rng.standard_normal(rows.shape)
    orientation = np.repeat(_list_orientations(form, stated), counts, axis=0)
    columns = dict(zip((*WRENCH, *FORMS[form]), np.column_stack([rows, orientation]).T, strict=True))
    return SimulatedPoses(form, noise, num, axes, R, mass, centre, columns)


def _list_orientations(form: str, stated: Rotation) -> Array:
    """Computes the columns of a form of orientation, shape (N, k)."""
    down = stated.inv().apply(_GRAVITY)
    return np.asarray(
        {
            "quaternion": stated.as_quat(scalar_first=True),
            "matrix": stated.as_matrix().reshape(-1, 9),
            "rpy": stated.as_euler("xyz"),
            "rotation_vector": stated.as_rotvec(),
            "gravity": down,
            "accelerometer": -down,
        }[form]
    )
