"""Evidence of a loaded run: samples from which the empty arm is subtracted, or in which it is modelled.

Every analysis (repeated motion, fitted arm, arm's file, wrist sensor) builds an ``Evidence``, which is all that
inference needs.
"""

import itertools
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
import scipy

from affordance.arrays import Array
from affordance.extensions.payload.evidence.joint_statistics import (
    SIGNAL,
    ChannelSamples,
    JointStatistics,
    compute_statistics,
)
from affordance.extensions.payload.recording.preparation import PreparedRun
from affordance.extensions.payload.recording.run import WRENCH_COLUMNS, Run
from affordance.extensions.payload.settings import IdentificationSettings, SignalKind
from affordance.objects.inertia import NUM_PARAMETERS
from affordance.plant.serial_chain import ChainDynamics, SerialChain

# Numbers of unknowns that postures determine: offset of a channel; mass and first moment of the load; and for a wrist
# sensor three each in the forces and moments, including the two angles of gravity.
_OFFSET, _OF_LOAD, _OF_WRENCH = 1.0, 4.0, 3.0
# Weight of the mean variance of similar channels, in postures.
_SHRINKAGE = 4.0
_RESOLUTION = 2.0**-16  # least error relative to the signal: resolution of a 16-bit converter
_LEVEL, _NORMAL = 0.95, 1.6448536  # upper end of a 90 % interval, as a quantile and in normal SDs


def estimate_variance_at_rest(statistics: JointStatistics, weights: Array, alike: tuple[slice, ...]) -> Array:
    """Estimates each channel's error variance from a few postures, shape (C,).

    A posture counts as one sample, because its error persists as long as it is held. Each channel's variance is
    shrunk towards the mean over channels with similar errors, and widened so that a normal error has the 90 %
    interval of Student's t. It is at least the variance due to the sensor's resolution, because the errors of
    noise-free tables would be zero.

    Args:
        statistics: Sums over the postures.
        weights: Weights w of the residual w^T z, shape (C, 27).
        alike: Groups of channels with errors of similar size.
    """
    variance = np.empty(statistics.num_channels)
    squares = statistics.sum_squares(weights)
    shared = _OF_LOAD if len(alike) == 1 else _OF_WRENCH
    for group in alike:
        counts = statistics.counts[group]
        freedom = np.maximum(counts - _OFFSET - shared / len(counts), 0.0)
        mean = squares[group].sum() / max(freedom.sum(), 1.0)
        sure = freedom + _SHRINKAGE
        widening = scipy.special.stdtrit(np.minimum(sure, max(freedom.sum(), 1.0)), _LEVEL) / _NORMAL
        resolution = _RESOLUTION**2 * statistics.products[group, SIGNAL, SIGNAL].sum() / max(counts.sum(), 1.0)
        variance[group] = np.maximum(widening**2 * (squares[group] + _SHRINKAGE * mean) / sure, resolution)
    result: Array = np.maximum(variance, np.finfo(float).tiny)
    return result


# Degrees of freedom that the fit removes from the residual: shared by all channels, and for each channel's friction.
_SHARED, _OWN = 10.0, 3.0
# Lower bound of the residual degrees of freedom, unless there are even fewer samples.
_FEWEST = 2.0
# Ratio of a wrist sensor's moment offsets to its force offsets, a typical lever arm, [m].
MOMENT_SHARE = 0.1

# For errors with the correlation exp(-|t| / T) in blocks of length x T: correlation of the sums of neighbouring
# blocks, and ratio of the long-run variance to the variance of the sums. T is from zero to twenty blocks.
_X = np.geomspace(50.0, 0.05, 200)
_BETWEEN = _X - 1.0 + np.exp(-_X)
_CORRELATIONS = np.append(0.0, 0.5 * (1.0 - np.exp(-_X)) ** 2 / _BETWEEN)
_ALIKE = np.append(1.0, _X / _BETWEEN)


class ErrorModel(NamedTuple):
    """Prior knowledge about the errors of a run."""

    alike: float  # number of neighbouring samples that the filter correlates; 1 if none
    correlated: bool  # True if errors may be correlated over longer times
    least_variance: Array  # lower bound of the long-run variance from earlier runs, shape (C,), [signal unit squared]
    # Groups of channels with errors of similar size in a run of held postures; empty for a moving arm.
    alike_at_rest: tuple[slice, ...] = ()
    drifts: bool = False  # True if errors may last for many blocks, like a wrist sensor's drift

    def estimate_variance(self, statistics: JointStatistics, weights: Array) -> Array:
        """Estimates each channel's long-run error variance, shape (C,).

        The estimate is the sum of squared block sums of the residual divided by the number of samples. This equals
        the variance of a sample times the number of samples that share its error. If the sensor drifts, the estimate
        is multiplied by the number of blocks that share an error, which follows from the correlation of neighbouring
        blocks. The result is at least the variance if only the filter correlates errors, and at least the variance of
        earlier runs. If a channel has no more independent samples than fitted unknowns, its residual is
        uninformative, and the whole signal may be error. For postures see ``estimate_variance_at_rest``.

        Args:
            statistics: Sums over the run.
            weights: Weights w of the residual w^T z, shape (C, 27).
        """
        if self.alike_at_rest:
            estimate = estimate_variance_at_rest(statistics, weights, self.alike_at_rest)
            return np.where(statistics.counts > 0, np.maximum(estimate, self.least_variance), 1.0)
        count = np.maximum(statistics.counts, 1.0)
        fitted = self._count_fitted(statistics)
        all_of_it = statistics.products[:, SIGNAL, SIGNAL]
        squares = np.where(count > fitted * self.alike, statistics.sum_squares(weights), all_of_it)
        single = np.maximum(squares / count, np.finfo(float).tiny)
        variance = single * self.alike
        if self.correlated:
            blocks = statistics.sum_block_squares(weights) / count
            variance = np.maximum(variance, blocks * self._count_alike_blocks(statistics, weights))
        independent = count * single / variance
        variance = variance * independent / np.maximum(independent - fitted, np.minimum(independent, _FEWEST))
        return np.where(statistics.counts > 0, np.maximum(variance, self.least_variance), 1.0)

    def _count_alike_blocks(self, statistics: JointStatistics, weights: Array) -> Array:
        """Estimates the number of neighbouring blocks that share an error, (C,), at least one."""
        if not self.drifts:
            return np.ones(statistics.num_channels)
        alike: Array = np.interp(statistics.correlate_blocks(weights), _CORRELATIONS, _ALIKE)
        return alike

    def count_freedom(self, statistics: JointStatistics, weights: Array) -> Array:
        """Computes each channel's degrees of freedom, (C,): independent errors minus fitted unknowns."""
        count = np.maximum(statistics.counts, 1.0)
        of_block = statistics.block_length * self._count_alike_blocks(statistics, weights)
        errors = count / (of_block if self.correlated else self.alike)
        return np.maximum(errors - self._count_fitted(statistics), np.minimum(errors, _FEWEST))

    def _count_fitted(self, statistics: JointStatistics) -> float:
        """Returns the number of fitted unknowns per channel. Channels that drift have no friction."""
        return (_OFFSET if self.drifts else _OWN) + _SHARED / statistics.num_channels


@dataclass(frozen=True)
class Evidence:
    """Samples of a loaded run, with the model of their errors."""

    source: str  # file of the loaded run
    analysis: str  # treatment of the empty arm, in words
    kind: SignalKind
    channel_names: tuple[str, ...]  # names of the joints, or of the components of the wrench
    prepared: PreparedRun  # evenly spaced samples of the run, with their times, motion and filter
    rate: float  # sampling rate, [Hz]
    samples: ChannelSamples  # samples of all channels, with the empty arm subtracted or modelled
    arm_torque: Array  # torque of the empty arm, which determines the load's sign, shape (N, C), [N m]
    is_difference: bool  # True if the signal of the empty arm was subtracted
    # True if the subtracted signal was recorded with the same motion; False if a model of the arm predicted it.
    is_repeated: bool = False
    # Lower bound of the long-run variance from earlier runs, shape (C,), or (1,) for all channels,
    # [signal unit squared].
    least_variance: Array = field(default_factory=lambda: np.zeros(1))
    # Mean of the phantom payload, which is the apparent load of an empty hand, shape (10,).
    phantom: Array = field(default_factory=lambda: np.zeros(NUM_PARAMETERS))
    # Covariance of the phantom payload, including errors that do not average out, shape (10, 10).
    phantom_covariance: Array = field(default_factory=lambda: np.zeros((NUM_PARAMETERS, NUM_PARAMETERS)))
    friction_scale: float = 1.0  # ratio of the friction in the signal to its change between two runs
    # Standard deviations of the friction that remains after subtracting an arm fitted to other runs, shape (C, 3), in
    # the signal's unit; None for the prior of the signal's kind.
    friction_left: Array | None = None
    notes: tuple[str, ...] = ()  # findings of the analysis, in words

    def select(self, rows: slice) -> "Evidence":
        """Selects samples of the run by their rows."""
        return replace(
            self,
            prepared=self.prepared.select(rows),
            samples=self.samples.select(rows),
            arm_torque=self.arm_torque[rows],
        )

    def split(self, length: float) -> list["Evidence"]:
        """Splits the run into stretches of about a given length, [s]."""
        num_samples = len(self.prepared.times)
        parts = max(1, round(num_samples / (length * self.rate)))
        edges = np.linspace(0, num_samples, parts + 1).astype(int)
        return [self.select(slice(int(a), int(b))) for a, b in itertools.pairwise(edges)]

    def list_friction_sds(self, settings: IdentificationSettings) -> Array:
        """Returns prior SDs of Coulomb friction, viscous friction and offset, (C, 3).

        A wrist sensor has only offsets.
        """
        if self.friction_left is not None:
            return self.friction_left
        sd = self.friction_scale * settings.get_prior(self.kind).friction_sd
        if self.kind is not SignalKind.WRENCH:
            return np.full((len(self.channel_names), 3), sd)
        return np.outer(np.where(np.arange(6) < 3, 1.0, MOMENT_SHARE), [0.0, 0.0, sd])

    def list_change_sds(self, gain: Array, settings: IdentificationSettings) -> tuple[Array, Array]:
        """Returns SDs of gain changes since the subtracted run: common, and individual for each channel, (C,)."""
        if not self.is_difference:
            return np.zeros_like(gain), np.zeros_like(gain)
        prior = settings.get_prior(self.kind)
        return prior.change_common_sd * np.abs(gain), prior.change_own_sd * np.abs(gain)

    def list_rotor_sds(self) -> Array:
        """Returns prior SDs of rotor inertia times gain, (C,), large enough to explain the whole signal.

        Robots' files do not contain rotor inertias. Reflected to the joints of a UR10e, they are .4 to 7 kg m^2. They
        cancel in a difference, and do not affect wrist sensors or link-side torque sensors.
        """
        samples = self.samples
        signal, vdot = (
            np.sqrt((samples.used * each**2).sum(axis=0)) for each in (samples.signal, samples.acceleration)
        )
        moves = (vdot > 0.0) & self.kind.feels_gears & (not self.is_difference)
        return np.divide(signal, vdot, out=np.zeros_like(signal), where=moves)

    def build_error_model(self, settings: IdentificationSettings) -> ErrorModel:
        """Builds the error model of this run."""
        errors = build_error_model(self.rate, self.prepared.cutoff, self.least_variance, settings)
        errors = errors._replace(drifts=self.kind is SignalKind.WRENCH)
        return errors._replace(alike_at_rest=self._list_alike()) if self.is_at_rest else errors

    @property
    def is_at_rest(self) -> bool:
        """True if the run consists of held postures."""
        return not self.prepared.v.any()

    def _list_alike(self) -> tuple[slice, ...]:
        """Lists groups of channels with similar errors: forces and moments, or all joints."""
        return (slice(3), slice(3, 6)) if self.kind is SignalKind.WRENCH else (slice(len(self.channel_names)),)

    def compute_statistics(self, settings: IdentificationSettings) -> JointStatistics:
        """Computes the sums of products over the run."""
        return compute_statistics(self.samples, max(1, round(settings.block * self.rate)))

    def with_load(self, pi: Array) -> "Evidence":
        """Updates the signs of load friction for a payload pi, (10,).

        Load friction is mu |tau|, opposite to the motion. In a difference of two runs it is mu (|tau_arm + Y pi| -
        |tau_arm|), so the load sign s is d times the bracket over Y pi. It is from -1 to 1, and equals d
        sign(tau_arm) if the arm's torque is larger than the load's.
        """
        payload = self.samples.Y @ pi
        total = self.arm_torque + payload
        if self.is_difference:
            small = np.abs(payload) < 1e-9
            share = (np.abs(total) - np.abs(self.arm_torque)) / np.where(small, 1.0, payload)
            sign = np.where(small, np.sign(self.arm_torque), share)
        else:
            sign = np.sign(total)
        return replace(self, samples=self.samples._replace(load_sign=self.samples.direction * sign))


def build_error_model(
    rate: float, cutoff: float, least_variance: Array, settings: IdentificationSettings
) -> ErrorModel:
    """Builds the error model of signals with a sampling rate and a filter cut-off, both in [Hz]."""
    alike = max(rate / (2.0 * cutoff), 1.0) if settings.correlated_noise else 1.0
    return ErrorModel(alike, settings.correlated_noise, least_variance)


def build_evidence(
    robot: SerialChain,
    source: str,
    kind: SignalKind,
    prepared: PreparedRun,
    settings: IdentificationSettings,
    *,
    analysis: str,
    is_difference: bool,
    dynamics: ChainDynamics | None = None,
) -> Evidence:
    """Builds the evidence of all channels, without the model errors of a particular analysis.

    Torques that a controller subtracted are restored. The dynamics of the motion are computed for joint signals if
    not given. The other arguments become fields with the same names.
    """
    zero = np.zeros_like(prepared.signal)
    if kind is SignalKind.WRENCH:
        names: tuple[str, ...] = WRENCH_COLUMNS
        arm_torque = zero
        # Forces are first, as in sensor messages.
        W = robot.compute_wrench_regressors(*prepared.motion)[:, [3, 4, 5, 0, 1, 2]]
        samples = ChannelSamples(W, zero, zero, zero, zero, zero, prepared.signal, np.ones(zero.shape, dtype=bool))
    else:
        _, arm_torque, Y = dynamics or robot.compute_dynamics(*prepared.motion)
        names = robot.joint_names
        samples = ChannelSamples.of_joints(
            Y,
            prepared.v,
            prepared.vdot,
            prepared.signal,
            arm_torque=arm_torque,
            min_speed=settings.min_speed,
        )
    return Evidence(source, analysis, kind, names, prepared, prepared.rate, samples, arm_torque, is_difference)


def restore_compensated(robot: SerialChain, run: Run, prepared: PreparedRun, gain: Array) -> Array:
    """Adds the torques that a controller subtracted to the signal, (N, n). The gain has shape (n,)."""
    description, signal = run.description, prepared.signal
    rest = np.zeros_like(prepared.v)
    motion = (prepared.q, rest, rest) if description.leaves_inertia else prepared.motion
    if description.compensates_arm:
        signal = signal + gain * robot.compute_arm_torques(*motion)
    if description.compensated_payload.any():
        payload = robot.compute_payload_regressors(*motion) @ description.compensated_payload
        signal = signal + gain * payload
    return signal
