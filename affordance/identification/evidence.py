"""What a loaded run says, once what the empty arm does is taken off: samples ready for the sums.

Whatever the analysis (a repeated motion, a fitted arm, the arm's file, a wrist sensor), what follows sees only this.
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
    """What is known of a run's errors before it is looked at.

    Attributes:
        alike: Neighbouring samples that the filter made alike; 1 for none.
        correlated: Whether errors may agree for longer than that.
        least_variance: What earlier runs say a long-run variance is at least, shape (C,).
    """

    alike: float
    correlated: bool
    least_variance: Array


@dataclass(frozen=True)
class Evidence:
    """Samples of a loaded run, and how far they can be trusted.

    Attributes:
        source: File of the loaded run.
        analysis: How the empty arm was taken off, in words.
        kind: What the signal is.
        channel_names: Joints, or components of the wrench.
        times: Shape (N,), [s].
        samples: Signals without the empty arm.
        motion: The motion they were taken in.
        arm_torque: The arm's own torque, for the sign of the load, shape (N, C), [N m].
        is_difference: Whether the signal is what a load added to the same motion.
        rate: Samples a second.
        cutoff: Of the filter they went through, [Hz].
        least_variance: What earlier runs say a long-run variance is at least, shape (C,), in its unit squared.
        phantom: What the empty hand seems to hold, shape (10,).
        phantom_covariance: Its uncertainty and what does not average out, shape (10, 10).
        friction_scale: Friction in the signal over what two runs differ in.
        notes: What was found on the way, in words.
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
        """A part of the run."""
        return replace(
            self,
            times=self.times[rows],
            samples=self.samples.select(rows),
            motion=Motion(*(values[rows] for values in self.motion)),
            arm_torque=self.arm_torque[rows],
        )

    def split(self, length: float) -> list["Evidence"]:
        """Stretches of about a length, [s]."""
        parts = max(1, round(len(self.times) / (length * self.rate)))
        edges = np.linspace(0, len(self.times), parts + 1).astype(int)
        return [self.select(slice(int(a), int(b))) for a, b in itertools.pairwise(edges)]

    def describe_errors(self, settings: IdentificationSettings) -> ErrorModel:
        """What is known of this run's errors beforehand."""
        return describe_errors(self.rate, self.cutoff, self.least_variance, settings)

    def compute_statistics(self, settings: IdentificationSettings) -> JointStatistics:
        """The sums over the run."""
        return compute_statistics(self.samples, max(1, round(settings.block * self.rate)))

    def with_load(self, pi: Array) -> "Evidence":
        """The same with the sign of the load as a payload makes it, pi of shape (10,).

        Friction is mu |tau| along the motion. Of a difference of two runs it is mu (|tau_arm + Y pi| - |tau_arm|), so
        s is that over Y pi: between -1 and 1, and d sign(tau_arm) where the arm's torque is the larger.
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
    """What is known of errors of signals at a rate, [Hz], low-passed at a cut-off, [Hz]."""
    alike = max(rate / (2.0 * cutoff), 1.0) if settings.correlated_noise else 1.0
    return ErrorModel(alike, settings.correlated_noise, least_variance)


def no_phantom() -> tuple[Array, Array]:
    """An arm whose model is right: mean and covariance of nothing."""
    return np.zeros(NUM_PARAMETERS), np.zeros((NUM_PARAMETERS, NUM_PARAMETERS))
