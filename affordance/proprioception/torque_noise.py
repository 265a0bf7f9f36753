"""Observation models of proprioception: errors of measured joint torques and accelerations.

A noise model summarises a trial as the running mean of a feature vector, so the estimator is recursive. The mean is
then converted to a likelihood of the object's densities. Each sample is tau = tau_arm + Y Phi rho + error, where tau
is the measured torque, tau_arm the torque of the arm alone, and Y the payload regressor.
"""

from dataclasses import dataclass
from typing import Annotated, Protocol, runtime_checkable

import numpy as np

from affordance.arrays import Array
from affordance.belief.holds import Felt
from affordance.belief.likelihood import Likelihood
from affordance.files.constraints import CheckedFields, Setting, Within
from affordance.objects.inertia import NUM_PARAMETERS, Geometry
from affordance.runs.random_streams import Stream


@runtime_checkable
class NoiseModel(Protocol):
    """Model of torque errors, which draws errors and converts measured torques to a likelihood."""

    def num_features(self, num_joints: int) -> int:
        """Returns the length of a sample's feature vector."""

    def compute_features(self, tau: Array, tau_arm: Array, Y: Array) -> Array:
        """Computes the feature vector of one sample.

        Args:
            tau: Measured torques, (num_joints,), [N m].
            tau_arm: Torques of the arm alone, (num_joints,), [N m].
            Y: Payload regressor, (num_joints, 10).
        """

    def describe(self, features: Array, num_samples: int, num_joints: int, geometry: Geometry) -> Felt:
        """Converts a trial's mean features, (num_features,), to a likelihood of the densities."""

    def draw_trial_errors(self, seed: tuple[int, ...], num_joints: int) -> tuple[Array, Array]:
        """Draws the gain and offset errors of a trial, shape (num_joints,) each."""

    def draw_sample_error(self, seed: tuple[int, ...], tau: Array) -> Array | None:
        """Draws the error of one sample at true torques tau, (num_joints,), [N m].

        Returns:
            The error, or None if errors are constant during a trial.
        """

    def compute_sd(self, tau: Array) -> Array:
        """Computes the standard deviation of a sample's error at true torques tau, (num_joints,) each, [N m]."""


@dataclass(frozen=True)
class WeberNoise(CheckedFields):
    """Noise of human force perception: one measurement per trial, with a Weber fraction and an absolute threshold.

    The measurement is the mean torque during the hold. At joint j its standard deviation is sqrt(threshold^2 +
    (weber_fraction tau_j)^2), where tau_j is the mean total torque, including the weight of the arm. To obtain this
    standard deviation exactly, a gain and an offset are drawn once per trial. If samples are independent, they are
    drawn for each of the n samples, and the variance of the mean is divided by n. This is exact if the torque is
    constant, as at rest.

    Attributes:
        weber_fraction: Weber fraction w, dimensionless.
        threshold: Absolute threshold s0, [N m].
        independent_samples: True if every sample is an independent measurement.

    Example:
        >>> from affordance import Settings, WeberNoise
        >>> Settings(noise=WeberNoise(weber_fraction=0.1)).noise.weber_fraction
        0.1
    """

    weber_fraction: Annotated[
        float,
        Within(0.0, 1.0),
        Setting("1", "force perception of hand and arm (Pang, Tan & Durlach 1991; Jones, Hunter & Irwin 1992)"),
    ] = 0.07
    threshold: Annotated[
        float, Within(0.0, 1e3), Setting("N m", "smallest torque felt at the elbow (Kim & Asbeck 2021)")
    ] = 0.097
    independent_samples: Annotated[
        bool, Setting("", "chosen after seeing results of other noise structures (docs/trust.md)")
    ] = False

    def num_features(self, num_joints: int) -> int:
        """Returns the total number of elements in tau, tau_arm and Y."""
        return num_joints * (2 + NUM_PARAMETERS)

    def compute_features(self, tau: Array, tau_arm: Array, Y: Array) -> Array:
        """Concatenates measured torques tau, torques of the arm alone tau_arm, and the flattened regressor Y."""
        return np.concatenate([tau, tau_arm, Y.ravel()])

    def describe(self, features: Array, num_samples: int, num_joints: int, geometry: Geometry) -> Felt:
        """Converts the mean torque to a likelihood. Its error depends on the torque, and so on the densities."""
        tau, tau_arm = features[:num_joints], features[num_joints : 2 * num_joints]
        Y = features[2 * num_joints :].reshape(num_joints, NUM_PARAMETERS)
        return Felt.from_torques(
            tau[None],
            tau_arm[None],
            (Y @ geometry.Phi)[None],
            (self.threshold, self.weber_fraction),
            num_samples if self.independent_samples else 1,
            (Y @ geometry.Phi_errors)[None],
        )

    def draw_trial_errors(self, seed: tuple[int, ...], num_joints: int) -> tuple[Array, Array]:
        """Draws a gain error and an offset for each joint. Both are zero if samples are independent."""
        if self.independent_samples:
            return np.zeros(num_joints), np.zeros(num_joints)
        rng = np.random.default_rng(seed)
        gain = self.weber_fraction * rng.standard_normal(num_joints)
        return gain, self.threshold * rng.standard_normal(num_joints)

    def draw_sample_error(self, seed: tuple[int, ...], tau: Array) -> Array | None:
        """Draws the error of an independent sample from a gain error and an offset.

        Returns:
            The error, or None if errors are constant during a trial.
        """
        if not self.independent_samples:
            return None
        gain, offset = np.random.default_rng(seed).standard_normal((2, len(tau)))
        error: Array = self.weber_fraction * gain * tau + self.threshold * offset
        return error

    def compute_sd(self, tau: Array) -> Array:
        """Computes standard deviations from threshold and Weber fraction, shape (num_joints,), [N m]."""
        return np.hypot(self.threshold, self.weber_fraction * tau)


@dataclass(frozen=True)
class WhiteNoise(CheckedFields):
    """White noise, as in a robot's torque sensors: each sample has an independent error.

    Attributes:
        sd: Standard deviation of a sample's error at every joint, [N m].

    Example:
        >>> from affordance import Settings, WhiteNoise
        >>> Settings(noise=WhiteNoise(sd=0.5)).noise.sd
        0.5
    """

    sd: Annotated[
        float,
        Within(1e-6, 1e4),
        Setting("N m", "a hundredth of the strongest joint's torque limit (docs/decisions/0004-noise.md)"),
    ] = 0.7

    def num_features(self, num_joints: int) -> int:
        """Returns the total number of elements in Y^T Y, Y^T r and r^T r (see ``compute_features``)."""
        return NUM_PARAMETERS**2 + NUM_PARAMETERS + 1

    def compute_features(self, tau: Array, tau_arm: Array, Y: Array) -> Array:
        """Computes the terms of the normal equations: Y^T Y, Y^T r and r^T r, with load torque r = tau - tau_arm."""
        residual = tau - tau_arm
        return np.concatenate([(Y.T @ Y).ravel(), Y.T @ residual, [residual @ residual]])

    def describe(self, features: Array, num_samples: int, num_joints: int, geometry: Geometry) -> Felt:
        """Converts the sums over all samples to a quadratic log likelihood."""
        sums = num_samples * features / self.sd**2
        YtY = sums[: NUM_PARAMETERS**2].reshape(NUM_PARAMETERS, NUM_PARAMETERS)
        log_scale = num_samples * num_joints * np.log(2.0 * np.pi * self.sd**2)
        of_body = Likelihood(
            0.5 * (YtY + YtY.T),
            sums[NUM_PARAMETERS**2 : -1],
            -0.5 * float(sums[-1] + log_scale),
            -0.5 * float(log_scale),
            num_samples * num_joints,
        )
        return Felt.from_quadratic(of_body, geometry.Phi, geometry.Phi_errors)

    def draw_trial_errors(self, seed: tuple[int, ...], num_joints: int) -> tuple[Array, Array]:
        """Returns zeros, because no error is constant during a trial."""
        return np.zeros(num_joints), np.zeros(num_joints)

    def draw_sample_error(self, seed: tuple[int, ...], tau: Array) -> Array | None:
        """Draws white noise for each joint."""
        return self.sd * np.random.default_rng(seed).standard_normal(len(tau))

    def compute_sd(self, tau: Array) -> Array:
        """Returns the standard deviation, which does not depend on torque."""
        return np.full(len(tau), self.sd)


def draw_acceleration_error(sd: float, seed: tuple[int, ...], num_joints: int) -> Array:
    """Draws the acceleration error of a trial, shape (num_joints,), [rad/s^2].

    The paper and the estimator assume exact accelerations. The error acts through the whole mass matrix, including
    the arm's (docs/decisions/0004-noise.md).
    """
    if sd == 0.0:
        return np.zeros(num_joints)
    return sd * np.random.default_rng((*seed, Stream.ACCELERATION)).standard_normal(num_joints)
