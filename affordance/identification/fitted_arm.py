"""The empty arm by regression: its links' inertias and its friction, fitted to runs with an empty hand.

    x_j = g_j (tau_file,j + W_j dpi + F_j f_j) + e

with tau_file the torques by the arm's file, W the links' regressors, dpi what the file's inertias are off by, one set
for all joints, and F_j friction of joint j. Everything has a normal prior, so this is one linear solve, and the last
link takes up what an empty hand seems to hold (the tare). Sums of products are kept in cells of half a second, so
that a fit that leaves some of them out costs no second look at the samples.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from affordance.arrays import Array, Mask
from affordance.exceptions import BadValueError
from affordance.identification.gains import Gains
from affordance.identification.preparation import PreparedRun
from affordance.identification.robot_chain import RobotChain
from affordance.identification.settings import IdentificationSettings

CELL = 0.5  # [s]
# Files give inertias of links to some ten per cent. On a Panda's empty run errors of prediction hardly depend on it
# for shares from 0.1 to 1. Lengths make a share of a mass one of a first moment and of a moment of inertia.
_SHARE, _LENGTH = 0.3, 0.2
# Friction: direction, velocity, constant, load, square and cube root of velocity, rotor inertia.
_NUM_FRICTION = 7
_NUM_PASSES = 3
# Samples of a band-limited signal that agree, where a first fit has yet to say how many do, [s].
_FIRST_AGREEMENT = 0.5


@dataclass(frozen=True)
class FittedArm:
    """A fitted empty arm.

    Attributes:
        robot: The arm.
        gain: Unit of the signal per N m, shape (n,).
        link_change: dpi, shape (10 n,).
        friction: f, shape (n, 7), [N m and its derivatives].
        link_root: Square root of the covariance of dpi, L L^T, shape (10 n, 10 n).
    """

    robot: RobotChain
    gain: Array
    link_change: Array
    friction: Array
    link_root: Array

    def predict(self, prepared: PreparedRun) -> Array:
        """Predicts the signal of the empty arm along a motion, shape (N, n)."""
        W = self.robot.compute_link_regressors(prepared.q, prepared.v, prepared.vdot)
        tau_file = W @ self.robot.link_parameters.ravel()
        friction = np.einsum("njf,jf->nj", _list_friction(prepared.v, prepared.vdot, tau_file), self.friction)
        signal: Array = self.gain * (tau_file + W @ self.link_change + friction)
        return signal


class ArmRegression:
    """Sums of products of empty runs, ready to be solved with any cells left out."""

    def __init__(
        self,
        robot: RobotChain,
        runs: Sequence[PreparedRun],
        signals: Sequence[Array],
        gains: Gains,
        settings: IdentificationSettings,
    ) -> None:
        """Sums up.

        Args:
            robot: The arm, its gravity that of the runs.
            runs: Motions with an empty hand.
            signals: Of each, shape (N, n).
            gains: Of the joints; only their means are used.
            settings: The least speed.

        Raises:
            BadValueError: The runs are too short.
        """
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
        # Rows of a run that make one cell, by run.
        self.cell_lengths = [round(CELL * run.rate) for run in runs]
        if not self._counts.sum(axis=0).all():
            still = [
                name for name, count in zip(robot.joint_names, self._counts.sum(axis=0), strict=True) if not count
            ]
            problem = f"has no sample in which {', '.join(still)} moves faster than {settings.min_speed:g} rad/s"
            raise BadValueError("the empty run", "v", problem)

    @property
    def num_cells(self) -> int:
        """Number of cells, over all runs."""
        return len(self.run_of_cell)

    def fit(self, kept: Mask) -> FittedArm:
        """Fits the arm to some of the cells, shape (num_cells,)."""
        products = self._products[kept].sum(axis=0)  # (n, P + 1, P + 1)
        counts = np.maximum(self._counts[kept].sum(axis=0), 1.0)
        num_joints, num_links = self.robot.num_joints, len(self._scale)
        signal = np.sqrt(products[:, -1, -1] / counts)
        friction_sd = np.maximum(signal, np.finfo(float).tiny)
        variance = (0.1 * signal) ** 2 * _FIRST_AGREEMENT / CELL * self._count_rows()
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
        """Long-run variance of a residual, in blocks of four cells, (n,), [(N m)^2]."""
        sums = np.einsum("kji,ji->kj", self._sums, weights) * kept[:, None]
        starts = np.arange(0, len(sums), 4)
        blocks = np.add.reduceat(sums, starts, axis=0)
        counts = np.maximum(self._counts[kept].sum(axis=0), 1.0)
        squares = np.einsum("ji,jil,jl->j", weights, self._products[kept].sum(axis=0), weights)
        variance: Array = np.maximum((blocks**2).sum(axis=0), squares) / counts
        return variance

    def _count_rows(self) -> float:
        return float(np.mean(self.cell_lengths))

    def _build_columns(self, run: PreparedRun, signal: Array, settings: IdentificationSettings) -> tuple[Array, Mask]:
        """Columns W, F and the signal less the file's torque, joint by joint, (n, N, P + 1), and which count."""
        W = self.robot.compute_link_regressors(run.q, run.v, run.vdot)
        tau_file = W @ self.robot.link_parameters.ravel()
        rest = signal / self.gain - tau_file
        used = np.abs(run.v) >= settings.min_speed
        columns = np.concatenate(
            [W * self._scale, _list_friction(run.v, run.vdot, tau_file), rest[..., None]], axis=2
        )
        return (columns * used[..., None]).transpose(1, 0, 2), used


def predict_friction(fitted: FittedArm, v: Array, vdot: Array, tau_file: Array) -> Array:
    """Predicts friction and rotor inertia at one state, velocities, accelerations and file torques (n,); [N m]."""
    torque: Array = (_list_friction(v, vdot, tau_file) * fitted.friction).sum(axis=-1)
    return torque


def _list_friction(v: Array, vdot: Array, tau_file: Array) -> Array:
    """Columns of friction and rotor inertia, shape (..., n, 7)."""
    direction = np.sign(v)
    columns = [direction, v, np.ones_like(v), np.abs(tau_file) * direction, v * np.abs(v), np.cbrt(v), vdot]
    return np.stack(columns, axis=-1)


def build_link_scale(robot: RobotChain) -> Array:
    """Standard deviations of what a file's inertias are off by, link by link, shape (10 n,)."""
    masses = robot.link_parameters[:, 0]
    masses = _SHARE * np.maximum(masses, 0.1 * masses.mean() + 1e-6)
    unit = np.array([1.0, *[_LENGTH] * 3, *[_LENGTH**2] * 6])
    return np.outer(masses, unit).ravel()
