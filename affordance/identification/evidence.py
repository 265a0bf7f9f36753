"""Evidence of a loaded run: its samples, with the empty arm subtracted or modelled.

Every analysis (repeated motion, fitted arm, arm's file, wrist sensor) builds it, and inference uses nothing else.
"""

import itertools
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.identification.joint_statistics import ChannelSamples, JointStatistics, compute_statistics
from affordance.identification.preparation import Motion
from affordance.identification.settings import IdentificationSettings, SignalKind
from affordance.objects.inertia import NUM_PARAMETERS


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
    phantom: Array
    phantom_covariance: Array
    friction_scale: float = 1.0
    notes: tuple[str, ...] = ()

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


def no_phantom() -> tuple[Array, Array]:
    """Returns zero mean and covariance: the phantom payload of an exact arm model."""
    return np.zeros(NUM_PARAMETERS), np.zeros((NUM_PARAMETERS, NUM_PARAMETERS))
