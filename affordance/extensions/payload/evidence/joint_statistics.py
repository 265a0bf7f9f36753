"""Sufficient statistics of a run for its payload: sums of products for each channel.

A channel is a joint with a measured torque or current, or one of the six components of a wrist sensor. The signal
model is

    x = g (tau_arm + Y pi) + h s (tau_arm + Y pi) + c_C d + c_v v + c_0 + g J vdot + e

with gain g, load friction h = mu g, direction of motion d, s = d sign(load), friction c, and rotor inertia J
reflected to the joint. Every term is linear in z = [tau_arm, Y, s tau_arm, s Y, d, v, 1, vdot, x], which has 27
entries. For any values of the unknowns the residual is therefore w^T z, and its sum of squares is w^T S w, where S is
the sum of z z^T. No term is linearised and no information is lost. The same sums over blocks of some seconds measure
the correlation of errors in neighbouring samples.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array, Mask

# Columns of z.
ARM = 0
LOAD = slice(0, 22)  # tau_arm and Y, then both times s
FRICTION = slice(22, 25)
ROTOR = 25
SIGNAL = 26
NUM_COLUMNS = 27


class ChannelSamples(NamedTuple):
    """N samples of C channels."""

    Y: Array  # payload regressors, shape (N, C, 10)
    tau_arm: Array  # torque of the arm, included in the signal or subtracted, shape (N, C), [N m]
    load_sign: Array  # factor s of load friction, shape (N, C), from -1 to 1
    direction: Array  # direction of motion d, -1, 0 or 1, shape (N, C)
    velocity: Array  # joint velocities, shape (N, C), [rad/s]
    acceleration: Array  # joint accelerations, shape (N, C), [rad/s^2]
    signal: Array  # signal x, shape (N, C), in the unit of its kind
    used: Mask  # True where a sample is used, shape (N, C)

    @classmethod
    def of_joints(
        cls, Y: Array, v: Array, vdot: Array, signal: Array, *, arm_torque: Array, min_speed: float
    ) -> "ChannelSamples":
        """Builds the samples of joints. Samples slower than the minimum speed, [rad/s], are not used.

        The load is assumed to have the sign of the arm's own torque, (N, n), even if this torque was subtracted.
        """
        direction = np.sign(v)
        sign = direction * np.sign(arm_torque)
        return cls(Y, arm_torque, sign, direction, v, vdot, signal, np.abs(v) >= min_speed)

    def select(self, rows: Mask | slice) -> "ChannelSamples":
        """Selects samples by their rows."""
        return self._replace(**{name: values[rows] for name, values in self._asdict().items()})

    def build_columns(self) -> Array:
        """Builds the vectors z, shape (C, N, 27). Unused samples are zero."""
        num, channels = self.velocity.shape
        half = LOAD.stop // 2
        z = np.empty((channels, num, NUM_COLUMNS))
        z[..., ARM] = self.tau_arm.T
        z[..., 1:half] = self.Y.transpose(1, 0, 2)
        z[..., half : LOAD.stop] = z[..., :half] * self.load_sign.T[..., None]
        z[..., FRICTION] = 1.0
        z[..., FRICTION.start] = self.direction.T
        z[..., FRICTION.start + 1] = self.velocity.T
        z[..., ROTOR] = self.acceleration.T
        z[..., SIGNAL] = self.signal.T
        z *= self.used.T[..., None]
        return z


@dataclass(frozen=True)
class JointStatistics:
    """Sums of products over the samples of a run."""

    products: Array  # sum of z z^T of each channel, shape (C, 27, 27)
    block_products: Array  # sum of b b^T, where b is the sum of z over a complete block, shape (C, 27, 27)
    # Sum of (a b^T + b a^T) / 2 over neighbouring complete blocks with sums a and b, shape (C, 27, 27).
    neighbour_products: Array
    block_sum: Array  # sum of z over the incomplete last block, shape (C, 27)
    counts: Array  # number of used samples of each channel, shape (C,)
    block_length: int  # number of rows in a block
    num_rows: int  # number of rows, including unused rows

    @property
    def num_channels(self) -> int:
        """Number of channels C."""
        return len(self.counts)

    def sum_squares(self, w: Array) -> Array:
        """Computes each channel's sum of squared residuals w^T z, (C,), with w of shape (C, 27)."""
        total: Array = np.einsum("ci,cij,cj->c", w, self.products, w)
        return np.maximum(total, 0.0)  # only rounding remains if there are no errors

    def sum_block_squares(self, w: Array) -> Array:
        """Computes each channel's sum of squared block sums of residuals, (C,), including the incomplete block."""
        whole: Array = np.einsum("ci,cij,cj->c", w, self.block_products, w)
        unfinished: Array = np.einsum("ci,ci->c", w, self.block_sum) ** 2
        return whole + unfinished

    def correlate_blocks(self, w: Array) -> Array:
        """Computes the correlation of residuals w^T z between neighbouring blocks, shape (C,)."""
        squares, between = (
            np.einsum("ci,cij,cj->c", w, each, w) for each in (self.block_products, self.neighbour_products)
        )
        correlation: Array = between / np.maximum(squares, np.finfo(float).tiny)
        return correlation


def compute_statistics(samples: ChannelSamples, block_length: int) -> JointStatistics:
    """Computes the sums over a run."""
    z = samples.build_columns()
    num_rows = z.shape[1]
    sums = np.add.reduceat(z, np.arange(0, num_rows, block_length), axis=1)  # (C, blocks, 27)
    whole = num_rows % block_length == 0
    closed = sums if whole else sums[:, :-1]
    neighbours = closed[:, :-1].transpose(0, 2, 1) @ closed[:, 1:]
    return JointStatistics(
        z.transpose(0, 2, 1) @ z,
        closed.transpose(0, 2, 1) @ closed,
        0.5 * (neighbours + neighbours.transpose(0, 2, 1)),
        np.zeros_like(z[:, 0]) if whole else sums[:, -1],
        samples.used.sum(axis=0, dtype=float),
        block_length,
        num_rows,
    )
