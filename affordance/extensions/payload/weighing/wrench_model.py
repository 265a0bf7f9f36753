"""Models force and torque of a resting load with two linear regressions.

    f = m g_S + offset + error,    t = c x m g_S + offset + error

The unknowns are mass m, first moment m c and offsets; g_S is gravity in the sensor's axes. Each axis has a gain that
multiplies the load's contribution.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.extensions.payload.settings import PRIORS, SignalKind
from affordance.extensions.payload.weighing.bayes import Regression, regress
from affordance.extensions.payload.weighing.poses import Poses

GRAVITY = 9.81  # [m/s^2]; varies by a quarter of a per cent over the Earth
# Relative SDs of the axes' gains, equally probable, around the SD of a wrist sensor in the settings of ``identify``.
GAIN_SD = PRIORS[SignalKind.WRENCH].scale_own_sd
_SPREADS = GAIN_SD * np.array([0.1, 0.3, 1.0, 2.0, 4.0])
# Prior SDs of weight and offsets, relative to the wrench, and of the centre of mass along each axis, [m].
_BROAD, _REACH = 10.0, 0.5
_LEAST_SIZE = 1e-3  # lower bound of wrench and mass in these priors, [N], [N m], [kg]


class Interpretation(NamedTuple):
    """Interpretation of a table.

    Attributes:
        axes: Axes of the wrench, "sensor" or "base".
        is_inverted: True if the table has orientations of the base in the sensor's axes.
    """

    axes: str = "sensor"
    is_inverted: bool = False

    def apply(self, poses: Poses, down_B: Array) -> tuple[Array, Array]:
        """Computes gravity, (N, 3), [m/s^2], and the wrench, (N, 6), in the sensor's axes."""
        if poses.R_BS is None:
            return GRAVITY * poses.down_S, poses.wrench
        R_BS = poses.R_BS.transpose(0, 2, 1) if self.is_inverted else poses.R_BS
        wrench = poses.wrench.reshape(-1, 2, 3)
        turned = wrench @ R_BS if self.axes == "base" else wrench
        return GRAVITY * (down_B @ R_BS), turned.reshape(-1, 6)


class WrenchModel(NamedTuple):
    """Linear models of force and torque with unknown load, gains and offsets.

    Gains multiply the load's contribution in a first fit.
    """

    columns: tuple[Array, Array]  # shapes (3 N, 7) and (3 N, 9)
    signals: tuple[Array, Array]  # (3 N,) each
    sds: tuple[Array, Array]  # prior SDs for each spread of the gains, shapes (S, 7) and (S, 9)
    loads: tuple[Array, Array]  # contribution of the load in the first fit, (N, 3) each

    def fit(self, extra: Sequence[tuple[Array, Array]] = ()) -> tuple[Regression, Regression]:
        """Fits forces and torques, each with additional columns and their prior SDs."""
        fits = []
        for kind, (X, y, sds) in enumerate(zip(self.columns, self.signals, self.sds, strict=True)):
            if extra:
                more, more_sds = extra[kind]
                X, sds = np.column_stack([X, more]), np.column_stack([sds, np.tile(more_sds, (len(sds), 1))])
            fits.append(regress(X, y, sds))
        return fits[0], fits[1]


def build_model(gravity: Array, wrench: Array) -> WrenchModel:
    """Builds the regressions of wrenches, (N, 6), on gravity in the sensor's axes, (N, 3), [m/s^2]."""
    offset = np.tile(np.eye(3), (len(gravity), 1))
    basis = np.stack([np.cross(axis, gravity) for axis in np.eye(3)], axis=2).reshape(-1, 3)
    signals = wrench[:, :3].ravel(), wrench[:, 3:].ravel()
    columns, sds, loads = [], [], []
    mass = 0.0
    for kind, (of_load, y) in enumerate(zip((gravity.reshape(-1, 1), basis), signals, strict=True)):
        first = np.column_stack([of_load, offset])
        broad = _BROAD * max(float(np.sqrt((y**2).mean())), _LEAST_SIZE)
        few = np.full(of_load.shape[1], _REACH * max(abs(mass), _LEAST_SIZE) if kind else broad / GRAVITY)
        offset_sds = np.full(3, broad)
        solution = regress(first, y, np.concatenate([few, offset_sds])[None]).mean
        load = of_load @ solution[: of_load.shape[1]]
        mass = solution[0]
        gains = load[:, None] * offset
        columns.append(np.column_stack([of_load, gains, offset]))
        sds.append(np.array([[*few, *[spread] * 3, *offset_sds] for spread in _SPREADS]))
        loads.append(load.reshape(-1, 3))
    return WrenchModel((columns[0], columns[1]), signals, (sds[0], sds[1]), (loads[0], loads[1]))


def sum_evidence(fits: tuple[Regression, Regression]) -> float:
    """Adds the log evidence of forces and torques."""
    return fits[0].log_evidence + fits[1].log_evidence


def compute_residual(model: WrenchModel, fits: tuple[Regression, Regression]) -> Array:
    """Computes the residual of wrenches after subtracting the load, gains and offsets, shape (N, 6)."""
    parts = [(y - X @ fit.mean).reshape(-1, 3) for X, y, fit in zip(model.columns, model.signals, fits, strict=True)]
    return np.concatenate(parts, axis=1)
