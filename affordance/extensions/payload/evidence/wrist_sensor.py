"""Builds evidence from a six-axis force-torque sensor at the wrist.

    [f; n] = W pi + offset + error

Here pi is the whole load on the sensor. There are no joints between sensor and load. A run with an empty hand (the
tare) determines the load of the hand (gripper, cables) and the sensor's offset, with their uncertainty.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import scipy

from affordance.arrays import Array
from affordance.extensions.payload.evidence.evidence import Evidence, build_evidence
from affordance.extensions.payload.evidence.gains import Gains
from affordance.extensions.payload.evidence.joint_statistics import SIGNAL
from affordance.extensions.payload.evidence.model_error import build_phantom_covariance, estimate_phantom_mass
from affordance.extensions.payload.evidence.paired_runs import get_only
from affordance.extensions.payload.evidence.payload_likelihood import ChannelPrior, PayloadLikelihood
from affordance.extensions.payload.recording.preparation import prepare_alike
from affordance.extensions.payload.recording.run import Run
from affordance.extensions.payload.settings import IdentificationSettings, SignalKind
from affordance.objects.inertia import NUM_PARAMETERS
from affordance.plant.serial_chain import SerialChain

# SD of the tilt of a nominally level base, and of a sensor's mounting, about each axis: three degrees, [rad].
_TILT_SD = 0.05
# Prior SDs of the weight and of the force offsets, [N].
_WEIGHT_SD, _OFFSET_SD = 1e3, 1e2


class Tilt(NamedTuple):
    """Direction of gravity in the base frame, which reveals tilts of base and sensor.

    At rest the force is R^T m g + offset, which is linear in m g and the offset. A few postures therefore determine
    the direction of gravity together with the load.
    """

    gravity: Array  # gravity, shape (3,), [m/s^2], with the magnitude in the description
    described: Array  # gravity according to the description, shape (3,), [m/s^2]
    axes: Array  # two directions perpendicular to the described gravity, shape (2, 3)
    covariance: Array  # covariance of the tilt along these axes, shape (2, 2), [rad^2]

    def describe(self) -> str:
        """Describes the tilt in words."""
        angle = np.degrees(measure_angle(self.gravity, self.described))
        sd = np.degrees(np.sqrt(np.trace(self.covariance)))
        return f"according to the forces, gravity is {angle:.1f} +- {sd:.1f} deg from its described direction"

    def measure_errors(self, robot: SerialChain, Y: Array, signal: Array, q: Array) -> Array:
        """Computes the load's covariance due to the uncertain tilt, shape (10, 10).

        Args:
            robot: Arm with this gravity.
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
    """Computes the regressors of a resting sensor's forces, then moments, (N, 6, 10)."""
    rest = np.zeros_like(q)
    forces: Array = robot.compute_wrench_regressors(q, rest, rest)[:, [3, 4, 5, 0, 1, 2]]
    return forces


def express_in_sensor(robot: SerialChain, run: Run) -> Run:
    """Expresses a base-frame wrench in the sensor's axes. Other runs are returned unchanged."""
    if not run.description.wrench_in_base:
        return run
    rest = np.zeros_like(run.q)
    R_BS = robot.compute_motion(run.q, rest, rest).R_WT
    description = replace(run.description, wrench_in_base=False)
    return replace(run, description=description, signal=(run.signal.reshape(-1, 2, 3) @ R_BS).reshape(-1, 6))


def find_tilt(robot: SerialChain, run: Run) -> Tilt:
    """Estimates the direction of gravity from the forces in a run of postures."""
    described = robot.gravity_W
    length = float(np.linalg.norm(described))
    # Forces due to one kilogram with gravity along each axis of the base.
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
    return Tilt(length * gravity / np.linalg.norm(gravity), described, axes, C)


# SD of an offset without a tare, as a multiple of the offset's drift.
_RAW_OFFSET = 20.0
# Prior SDs of the empty hand's mass, first moment and moments of inertia: a few kilograms at some centimetres.
_TARE_SD = np.array([3.0, *[0.5] * 3, *[0.1] * 6])
_STRETCH = 4.0  # length of stretches of the empty run, for estimating errors that do not average out, [s]
_NUM_PASSES = 4


def build_wrist_evidence(
    robot: SerialChain, loaded: Run, empty: Sequence[Run], gains: Gains, settings: IdentificationSettings
) -> Evidence:
    """Builds the evidence of a sensor at the tip. Without an empty run, everything on the sensor is load.

    Raises:
        BadValueError: There are several empty runs.
    """
    runs = [loaded, get_only(empty, "a wrist sensor's tare")] if empty else [loaded]
    analysis = "wrist sensor without a tare: everything mounted on it counts as load"
    tilt = None
    if loaded.description.postures:
        tilt = find_tilt(robot, loaded)
        robot = robot.with_gravity(tilt.gravity)
    evidence, *tare = [
        replace(
            build_evidence(
                robot, loaded.source, SignalKind.WRENCH, prepared, settings, analysis=analysis, is_difference=False
            ),
            friction_scale=_RAW_OFFSET,
        )
        for prepared in prepare_alike(runs, settings)
    ]
    evidence = _tare(evidence, tare[0], settings) if tare else evidence
    if tilt is None:
        return evidence
    errors = tilt.measure_errors(robot, evidence.samples.Y, evidence.samples.signal, evidence.prepared.q)
    notes = (*evidence.notes, tilt.describe())
    return replace(evidence, phantom_covariance=evidence.phantom_covariance + errors, notes=notes)


def _tare(evidence: Evidence, of_empty: Evidence, settings: IdentificationSettings) -> Evidence:
    """Subtracts the offset of an empty run. The empty hand becomes the phantom payload."""
    statistics = of_empty.compute_statistics(settings)
    num = statistics.num_channels
    zero = np.zeros(NUM_PARAMETERS)
    prior = ChannelPrior(
        np.tile([1.0, 0.0], (num, 1)),
        np.zeros((num, 2, 2)),
        np.zeros((num, 3)),
        evidence.list_friction_sds(settings),
    )
    variance = np.maximum(statistics.products[:, SIGNAL, SIGNAL] / statistics.counts, np.finfo(float).tiny)
    for _ in range(_NUM_PASSES):
        likelihood = PayloadLikelihood(statistics, prior, variance)
        quadratic = likelihood.linearise(zero)
        covariance = np.linalg.inv(quadratic.precision + np.diag(_TARE_SD**-2))
        tare = covariance @ quadratic.information
        weights = likelihood.build_residual_weights(tare)
        variance = of_empty.build_error_model(settings).estimate_variance(statistics, weights)
    phantom_mass = 0.0
    if settings.floor:
        phantom_mass = estimate_phantom_mass(
            [
                PayloadLikelihood(part.compute_statistics(settings), prior, variance).linearise(tare).about(tare)
                for part in of_empty.split(_STRETCH)
            ]
        )
    offset = -weights[:, 24]
    loaded = evidence.samples._replace(signal=evidence.samples.signal - offset)
    return replace(
        evidence,
        analysis=f"wrist sensor, tared: the empty hand weighs {1e3 * tare[0]:.0f} g",
        samples=loaded,
        friction_scale=1.0,
        least_variance=variance,
        phantom=tare,
        phantom_covariance=covariance + build_phantom_covariance(phantom_mass),
        notes=(f"the apparent load of the empty hand varies by {1e3 * phantom_mass:.0f} g (one SD)",),
    )
