"""Regression model of the empty arm, fitted to runs with an empty hand.

    x_j = g_j (tau_file,j + W_j dpi + F_j f_j) + e

Here tau_file are the torques according to the arm's file, W the regressors of the links, dpi the errors of the file's
inertial parameters, which all joints share, and F_j the friction columns of joint j. All unknowns have normal priors,
so the fit is one linear solve. The last link absorbs the apparent payload of an empty hand (the tare). Sums of
products are stored for cells of half a second, so that cells can be left out without repeating the sums.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from affordance.arrays import Array, Mask
from affordance.exceptions import BadValueError
from affordance.extensions.payload.evidence.gains import Gains
from affordance.extensions.payload.recording.preparation import PreparedRun
from affordance.extensions.payload.settings import IdentificationSettings
from affordance.plant.serial_chain import SerialChain

CELL = 0.5  # [s]
# Relative SD of the link masses in a file, and the length that converts it to SDs of first moments and moments of
# inertia, [m]. Files are accurate to about ten per cent. Prediction errors of a Panda's empty run hardly depend on
# this value from 0.1 to 1.
_SHARE, _LENGTH = 0.3, 0.2
# Number of friction columns: direction, velocity, constant, load, square and cube root of velocity, rotor inertia.
_NUM_FRICTION = 7
_OF_MOTION = np.array([True, True, False, True, True, True, False])  # all except offset and rotor inertia
_NUM_PASSES = 3
# Correlation time of the errors until a first fit gives residuals, [s]: an assumption.
_FIRST_AGREEMENT = 0.5


@dataclass(frozen=True)
class FittedArm:
    """Model of the empty arm, fitted to runs."""

    robot: SerialChain  # model of the arm from its file
    gain: Array  # gain of each joint, shape (n,), [unit of the signal per N m]
    link_change: Array  # change dpi of the links' parameters, shape (10 n,)
    friction: Array  # friction coefficients f, shape (n, 7), [N m per unit of the column]
    link_root: Array  # square root L of the covariance of dpi, L L^T, shape (10 n, 10 n)
    # Long-run variance of the prediction errors, shape (n,), in the signal's unit squared. This field and the
    # following fields are set if cross-validation measured the errors.
    least_variance: Array = field(default_factory=lambda: np.zeros(1))
    phantom_mass: float = 0.0  # standard deviation of the apparent mass in an empty hand, [kg]
    # Standard deviations of friction changes (direction, velocity, offset) between runs, shape (n, 3).
    friction_left: Array = field(default_factory=lambda: np.zeros((1, 3)))
    # Prediction errors of each run, shape (N, n) each. The fit that predicts a stretch does not use it.
    residual: tuple[Array, ...] = ()

    def predict(self, prepared: PreparedRun) -> Array:
        """Predicts the signal of the empty arm for a motion, shape (N, n)."""
        W = self.robot.compute_link_regressors(prepared.q, prepared.v, prepared.vdot)
        tau_file = W @ self.robot.link_parameters.ravel()
        friction = np.einsum("njf,jf->nj", _list_friction(prepared.v, prepared.vdot, tau_file), self.friction)
        signal: Array = self.gain * (tau_file + W @ self.link_change + friction)
        return signal

    def measure_friction(self, runs: Sequence[PreparedRun], min_speed: float) -> tuple[Array, Array]:
        """Computes each joint's RMS friction, without offset, and RMS speed, (n,) each.

        Friction is in the signal's unit, speed in [rad/s]. Samples slower than ``min_speed``, [rad/s], are left out.
        """
        coefficients = np.where(_OF_MOTION, self.friction, 0.0)
        v = np.concatenate([run.v for run in runs])
        tau = np.concatenate([self.robot.compute_arm_torques(*run.motion) for run in runs])
        used = np.abs(v) >= min_speed
        count = np.maximum(used.sum(axis=0), 1)
        friction = (_list_friction(v, np.zeros_like(v), tau) * coefficients).sum(axis=-1)
        size, speed = (np.sqrt((used * each**2).sum(axis=0) / count) for each in (friction, v))
        return np.abs(self.gain) * size, np.maximum(speed, min_speed)


class ArmRegression:
    """Sums of products of empty runs, from which an arm can be fitted to any subset of cells."""

    def __init__(
        self,
        robot: SerialChain,
        runs: Sequence[PreparedRun],
        signals: Sequence[Array],
        gains: Gains,
        settings: IdentificationSettings,
    ) -> None:
        """Computes the sums of all cells from signals with shape (N, n) and mean gains.

        Raises:
            BadValueError: A joint never moves faster than the minimum speed.
        """
        moves = np.any([(np.abs(run.v) >= settings.min_speed).any(axis=0) for run in runs], axis=0)
        if not moves.all():
            still = ", ".join(np.array(robot.joint_names)[~moves])
            problem = f"has no sample in which {still} moves faster than {settings.min_speed:g} rad/s"
            raise BadValueError("the empty run", "v", problem)
        self.robot = robot
        self.gain = gains.mean[:, 0]
        self._scale = build_link_scale(robot)
        products, sums, counts, run_of_cell = [], [], [], []
        for number, (run, signal) in enumerate(zip(runs, signals, strict=True)):
            columns, used = self._build_columns(run, signal, settings)
            length = round(CELL * run.rate)
            num_cells = len(signal) // length
            cells = columns[:, : num_cells * length].reshape(robot.num_joints, num_cells, length, -1)
            products.append(np.einsum("jkni,jknl->kjil", cells, cells, optimize=True))
            sums.append(cells.sum(axis=2).transpose(1, 0, 2))
            counts.append(used[: num_cells * length].reshape(num_cells, length, -1).sum(axis=1))
            run_of_cell += [number] * num_cells
        self._products, self._sums = np.concatenate(products), np.concatenate(sums)
        self._counts = np.concatenate(counts)
        self.run_of_cell = np.array(run_of_cell)
        # Number of rows per cell, for each run.
        self.cell_lengths = [round(CELL * run.rate) for run in runs]

    @property
    def num_cells(self) -> int:
        """Number of cells in all runs."""
        return len(self.run_of_cell)

    def fit(self, kept: Mask) -> FittedArm:
        """Fits the arm to some of the cells, given as a mask with shape (num_cells,)."""
        products = self._products[kept].sum(axis=0)  # (n, P + 1, P + 1)
        counts = np.maximum(self._counts[kept].sum(axis=0), 1.0)
        num_joints, num_links = self.robot.num_joints, len(self._scale)
        signal = np.sqrt(products[:, -1, -1] / counts)
        friction_sd = np.maximum(signal, np.finfo(float).tiny)
        variance = (0.1 * signal) ** 2 * _FIRST_AGREEMENT / CELL * float(np.mean(self.cell_lengths))
        for _ in range(_NUM_PASSES):
            size = num_links + num_joints * _NUM_FRICTION
            A, b = np.eye(size), np.zeros(size)
            for j, G in enumerate(products / np.maximum(variance, np.finfo(float).tiny)[:, None, None]):
                own = num_links + j * _NUM_FRICTION + np.arange(_NUM_FRICTION)
                index = np.concatenate([np.arange(num_links), own])
                scale = np.concatenate([np.ones(num_links), np.full(_NUM_FRICTION, friction_sd[j])])
                A[np.ix_(index, index)] += scale[:, None] * G[:-1, :-1] * scale
                b[index] += scale * G[:-1, -1]
            solution = np.linalg.solve(A, b)
            links, friction = (
                solution[:num_links],
                solution[num_links:].reshape(num_joints, -1) * friction_sd[:, None],
            )
            weights = np.column_stack([np.tile(-links, (num_joints, 1)), -friction, np.ones(num_joints)])
            variance = self._measure_variance(kept, weights)
        covariance = np.linalg.inv(A)[:num_links, :num_links]
        root = self._scale[:, None] * np.linalg.cholesky(0.5 * (covariance + covariance.T))
        return FittedArm(self.robot, self.gain, self._scale * links, friction, root)

    def _measure_variance(self, kept: Mask, weights: Array) -> Array:
        """Computes the long-run variance of the residual from blocks of four cells, (n,), [(N m)^2]."""
        sums = np.einsum("kji,ji->kj", self._sums, weights) * kept[:, None]
        starts = np.arange(0, len(sums), 4)
        blocks = np.add.reduceat(sums, starts, axis=0)
        counts = np.maximum(self._counts[kept].sum(axis=0), 1.0)
        squares = np.einsum("ji,jil,jl->j", weights, self._products[kept].sum(axis=0), weights)
        variance: Array = np.maximum((blocks**2).sum(axis=0), squares) / counts
        return variance

    def _build_columns(self, run: PreparedRun, signal: Array, settings: IdentificationSettings) -> tuple[Array, Mask]:
        """Builds each joint's regression columns, (n, N, P + 1), and a mask of used samples.

        The columns are W, F, and the signal minus the torque according to the file.
        """
        W = self.robot.compute_link_regressors(run.q, run.v, run.vdot)
        tau_file = W @ self.robot.link_parameters.ravel()
        rest = signal / self.gain - tau_file
        used = np.abs(run.v) >= settings.min_speed
        columns = np.concatenate(
            [W * self._scale, _list_friction(run.v, run.vdot, tau_file), rest[..., None]], axis=2
        )
        return (columns * used[..., None]).transpose(1, 0, 2), used


def _list_friction(v: Array, vdot: Array, tau_file: Array) -> Array:
    """Builds the regressor columns of friction and rotor inertia, shape (..., n, 7)."""
    direction = np.sign(v)
    columns = [direction, v, np.ones_like(v), np.abs(tau_file) * direction, v * np.abs(v), np.cbrt(v), vdot]
    return np.stack(columns, axis=-1)


def build_link_scale(robot: SerialChain) -> Array:
    """Builds the prior SDs of the file's inertial parameters for all links, shape (10 n,)."""
    masses = robot.link_parameters[:, 0]
    masses = _SHARE * np.maximum(masses, 0.1 * masses.mean() + 1e-6)
    unit = np.array([1.0, *[_LENGTH] * 3, *[_LENGTH**2] * 6])
    return np.outer(masses, unit).ravel()
