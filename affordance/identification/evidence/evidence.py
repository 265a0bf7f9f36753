"""Evidence of a loaded run: its samples, with the empty arm subtracted or modelled.

Every analysis (repeated motion, fitted arm, arm's file, wrist sensor) builds it, and inference uses nothing else.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.identification.evidence.joint_statistics import ChannelSamples, JointStatistics, compute_statistics
from affordance.identification.recording.preparation import Motion, PreparedRun
from affordance.identification.recording.run import Run
from affordance.identification.settings import IdentificationSettings, SignalKind
from affordance.objects.inertia import NUM_PARAMETERS

# Degrees of freedom that the fit takes from the residual: ten, shared by the channels, and friction of each.
_SHARED, _OWN = 10.0, 3.0
# Residual degrees of freedom are taken as at least this, or as the number of samples if that is less.
_FEWEST = 2.0
# Ratio of moment offsets to force offsets of a wrist sensor, by the lever arms of its forces, [m].
MOMENT_SHARE = 0.1


class ErrorModel(NamedTuple):
    """Prior knowledge of a run's errors.

    Attributes:
        alike: Number of neighbouring samples that the filter correlates; 1 for none.
        correlated: True if errors may be correlated over longer times.
        least_variance: Lower bound of the long-run variance by earlier runs, shape (C,), [signal unit squared].
    """

    alike: float
    correlated: bool
    least_variance: Array

    def estimate_variance(self, statistics: JointStatistics, weights: Array) -> Array:
        """Estimates the long-run variance of each channel's error from a residual, shape (C,).

        The estimate is the sum of squared block sums of the residual over the number of samples: the variance of one
        sample times the number of samples that share its error. Its lower bounds are the variance with correlation by
        the filter alone, and that of earlier runs.

        Args:
            statistics: Sums over the run.
            weights: Weights w with w^T z the residual, shape (C, 26).
        """
        count = np.maximum(statistics.counts, 1.0)
        single = np.maximum(statistics.sum_squares(weights) / count, np.finfo(float).tiny)
        variance = single * self.alike
        if self.correlated:
            variance = np.maximum(variance, statistics.sum_block_squares(weights) / count)
        independent = count * single / variance
        fitted = _OWN + _SHARED / statistics.num_channels
        variance = variance * independent / np.maximum(independent - fitted, np.minimum(independent, _FEWEST))
        return np.where(statistics.counts > 0, np.maximum(variance, self.least_variance), 1.0)


@dataclass(frozen=True)
class Evidence:
    """Samples of a loaded run and the model of their errors.

    Attributes:
        source: File of the loaded run.
        analysis: Treatment of the empty arm, in words.
        kind: Kind of the signal.
        channel_names: Names of the joints, or of the components of the wrench.
        times: Times of the samples, shape (N,), [s].
        samples: Samples of all channels; the empty arm is subtracted, or modelled by tau_arm.
        motion: Joint motion at the samples.
        arm_torque: Torque of the arm alone, for the sign of the load, shape (N, C), [N m].
        is_difference: True if the signal is what the load added to the same motion.
        rate: Sampling rate, [Hz].
        cutoff: Cut-off of the low-pass filter, [Hz].
        least_variance: Lower bound of the long-run variance by earlier runs, shape (C,), [signal unit squared].
        phantom: Mean of the phantom payload, which an empty hand appears to hold, shape (10,).
        phantom_covariance: Covariance of the phantom payload, with errors that do not average out, shape (10, 10).
        friction_scale: Ratio of the friction in the signal to its change between two runs.
        notes: Findings of the analysis, in words.
    """

    source: str
    analysis: str
    kind: SignalKind
    channel_names: tuple[str, ...]
    times: Array
    samples: ChannelSamples
    motion: Motion
    arm_torque: Array
    is_difference: bool
    rate: float
    cutoff: float
    least_variance: Array
    phantom: Array = field(default_factory=lambda: np.zeros(NUM_PARAMETERS))
    phantom_covariance: Array = field(default_factory=lambda: np.zeros((NUM_PARAMETERS, NUM_PARAMETERS)))
    friction_scale: float = 1.0
    notes: tuple[str, ...] = ()

    @classmethod
    def from_run(
        cls,
        run: Run,
        prepared: PreparedRun,
        samples: ChannelSamples,
        channel_names: Sequence[str],
        *,
        analysis: str,
        arm_torque: Array,
        is_difference: bool,
        lag: float = 0.0,
    ) -> "Evidence":
        """Builds the evidence of a run without errors of the arm's model, to which each analysis adds its own.

        Args:
            run: Loaded run.
            prepared: Even samples of its motion.
            samples: Samples of all channels.
            channel_names: Names of the channels.
            analysis: Treatment of the empty arm, in words.
            arm_torque: Torque of the arm alone, shape (N, C), [N m].
            is_difference: True if the signal is what the load added to the same motion.
            lag: Lag of the run's clock behind the times of the samples, [s].
        """
        return cls(
            source=run.source,
            analysis=analysis,
            kind=run.description.kind,
            channel_names=tuple(channel_names),
            times=prepared.times + lag,
            samples=samples,
            motion=prepared.motion,
            arm_torque=arm_torque,
            is_difference=is_difference,
            rate=prepared.rate,
            cutoff=prepared.cutoff,
            least_variance=np.zeros(len(channel_names)),
        )

    def select(self, rows: slice) -> "Evidence":
        """Returns a part of the run."""
        return replace(
            self,
            times=self.times[rows],
            samples=self.samples.select(rows),
            motion=Motion(*(values[rows] for values in self.motion)),
            arm_torque=self.arm_torque[rows],
        )

    def split(self, length: float) -> list["Evidence"]:
        """Splits the run into stretches of about the given length, [s]."""
        parts = max(1, round(len(self.times) / (length * self.rate)))
        edges = np.linspace(0, len(self.times), parts + 1).astype(int)
        return [self.select(slice(int(a), int(b))) for a, b in itertools.pairwise(edges)]

    def list_friction_sds(self, settings: IdentificationSettings) -> Array:
        """Returns prior SDs of Coulomb and viscous friction and offset, (C, 3); a wrist sensor has offsets only."""
        sd = self.friction_scale * settings.get_prior(self.kind).friction_sd
        if self.kind is not SignalKind.WRENCH:
            return np.full((len(self.channel_names), 3), sd)
        return np.outer(np.where(np.arange(6) < 3, 1.0, MOMENT_SHARE), [0.0, 0.0, sd])

    def describe_errors(self, settings: IdentificationSettings) -> ErrorModel:
        """Builds the error model of this run."""
        return describe_errors(self.rate, self.cutoff, self.least_variance, settings)

    def compute_statistics(self, settings: IdentificationSettings) -> JointStatistics:
        """Computes the sums over the run."""
        return compute_statistics(self.samples, max(1, round(settings.block * self.rate)))

    def with_load(self, pi: Array) -> "Evidence":
        """Returns the evidence with the load signs that a payload causes, pi of shape (10,).

        Friction is mu |tau| along the motion. In a difference of two runs it is mu (|tau_arm + Y pi| - |tau_arm|), so
        s is d times the bracket over Y pi: between -1 and 1, and d sign(tau_arm) if the arm's torque is the larger.
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


def describe_errors(
    rate: float, cutoff: float, least_variance: Array, settings: IdentificationSettings
) -> ErrorModel:
    """Builds the error model of signals sampled at a rate, [Hz], and low-passed at a cut-off, [Hz]."""
    alike = max(rate / (2.0 * cutoff), 1.0) if settings.correlated_noise else 1.0
    return ErrorModel(alike, settings.correlated_noise, least_variance)
