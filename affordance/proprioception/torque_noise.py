"""Errors of measured joint torques: the observation models of proprioception.

Both models reduce a trial to the running mean of a feature vector, so that the estimator is recursive whichever is
chosen, and turn that mean into a likelihood of the held object's densities. With tau the measured torque, tau_arm
that of the arm alone, and Y the payload regressor, every sample says  tau = tau_arm + Y Phi rho + error.
"""

from dataclasses import dataclass
from typing import Annotated, Protocol, runtime_checkable

import numpy as np

from affordance.arrays import Array
from affordance.belief.likelihood import Likelihood
from affordance.checked_fields import Setting, check_fields
from affordance.files.data_model import Within
from affordance.objects.geometry import Geometry
from affordance.objects.inertia import NUM_PARAMETERS


@runtime_checkable
class NoiseModel(Protocol):
    """What proprioception adds to the true torques, and what its samples therefore say."""

    def num_features(self, num_joints: int) -> int:
        """Length of the feature vector that is averaged."""

    def compute_features(self, tau: Array, tau_arm: Array, Y: Array) -> Array:
        """Features of one sample; tau and tau_arm of shape (num_joints,), Y of shape (num_joints, 10)."""

    def compute_likelihood(
        self, features: Array, num_samples: int, num_joints: int, geometry: Geometry, rho: Array
    ) -> Likelihood:
        """Likelihood of the densities given the mean features of a trial.

        Args:
            features: Mean features, shape (num_features,).
            num_samples: How many samples they are the mean of, at least 1.
            num_joints: Number of joints.
            geometry: Phi and its uncertainty.
            rho: Densities at which errors that grow with torque are evaluated, shape (M,), [kg/m^3].
        """

    def draw_trial_errors(self, seed: tuple[int, ...], num_joints: int) -> tuple[Array, Array]:
        """Draws gain and offset errors that last a whole trial, each of shape (num_joints,)."""

    def draw_sample_error(self, seed: tuple[int, ...], tau: Array) -> Array | None:
        """Draws an error that is new in every sample, at true torques tau, (num_joints,), [N m]; None for none."""

    def compute_sd(self, tau: Array) -> Array:
        """Standard deviation of the error of a sample at true torques tau, (num_joints,) each, [N m]."""


@dataclass(frozen=True)
class WeberNoise:
    """One measurement a trial, with errors of a Weber fraction and an absolute threshold.

    The measurement is the mean torque of the hold. Its standard deviation at joint j is
    sqrt(threshold^2 + (weber_fraction tau_j)^2), with tau_j the mean total torque, the arm's own weight included.
    As drawn, the error is a gain and an offset that last the trial, which gives the mean exactly that deviation.
    Where samples are independent, gain and offset are new in each of n, and the mean's variance is an nth of that:
    exactly where the torque is constant, as at rest.

    Attributes:
        weber_fraction: Weber fraction w, dimensionless.
        threshold: Absolute threshold s0, [N m].
        independent_samples: Whether every sample is a percept of its own.
    """

    weber_fraction: Annotated[
        float,
        Within(0.0, 1.0),
        Setting("1", "force felt by hand and arm (Pang, Tan & Durlach 1991; Jones, Hunter & Irwin 1992)"),
    ] = 0.07
    threshold: Annotated[
        float, Within(0.0, 1e3), Setting("N m", "smallest torque felt at the elbow (Kim & Asbeck 2021)")
    ] = 0.097
    independent_samples: Annotated[
        bool, Setting("", "one measurement a trial was chosen after others were seen (docs/trust.md)")
    ] = False

    def __post_init__(self) -> None:
        """Checks the numbers.

        Raises:
            BadArgumentError: One is not finite, or out of bounds.
        """
        check_fields(self)

    def num_features(self, num_joints: int) -> int:
        """tau, tau_arm and Y, flattened."""
        return num_joints * (2 + NUM_PARAMETERS)

    def compute_features(self, tau: Array, tau_arm: Array, Y: Array) -> Array:
        """tau, tau_arm and Y, flattened."""
        return np.concatenate([tau, tau_arm, Y.ravel()])

    def compute_likelihood(
        self, features: Array, num_samples: int, num_joints: int, geometry: Geometry, rho: Array
    ) -> Likelihood:
        """Likelihood of the mean torque; errors are evaluated at the torque that rho predicts."""
        tau, tau_arm = features[:num_joints], features[num_joints : 2 * num_joints]
        Y = features[2 * num_joints :].reshape(num_joints, NUM_PARAMETERS)
        regressor = Y @ geometry.Phi  # (num_joints, M)
        predicted = tau_arm + regressor @ rho
        num_percepts = num_samples if self.independent_samples else 1
        covariance = np.diag(self.threshold**2 + (self.weber_fraction * predicted) ** 2) / num_percepts
        if len(geometry.Phi_errors):
            covariance += Y @ geometry.compute_covariance(rho) @ Y.T
        weighted = np.linalg.solve(covariance, np.column_stack([regressor, tau - tau_arm]))
        residual = tau - tau_arm
        log_scale = np.linalg.slogdet(2.0 * np.pi * covariance)[1]
        return Likelihood(
            regressor.T @ weighted[:, :-1],
            regressor.T @ weighted[:, -1],
            -0.5 * float(residual @ weighted[:, -1] + log_scale),
            -0.5 * float(log_scale),
            num_joints,
        )

    def draw_trial_errors(self, seed: tuple[int, ...], num_joints: int) -> tuple[Array, Array]:
        """A gain error and an offset a joint; none that last where samples are independent."""
        if self.independent_samples:
            return np.zeros(num_joints), np.zeros(num_joints)
        rng = np.random.default_rng(seed)
        gain = self.weber_fraction * rng.standard_normal(num_joints)
        return gain, self.threshold * rng.standard_normal(num_joints)

    def draw_sample_error(self, seed: tuple[int, ...], tau: Array) -> Array | None:
        """Gain error and offset of a sample that is a percept of its own; None where the error is the trial's."""
        if not self.independent_samples:
            return None
        gain, offset = np.random.default_rng(seed).standard_normal((2, len(tau)))
        error: Array = self.weber_fraction * gain * tau + self.threshold * offset
        return error

    def compute_sd(self, tau: Array) -> Array:
        """Threshold and Weber fraction together."""
        return np.hypot(self.threshold, self.weber_fraction * tau)


@dataclass(frozen=True)
class WhiteNoise:
    """The engineer's model: every sample has an independent error, as torque sensors of robots have.

    Attributes:
        sd: Standard deviation of a sample's error at every joint, [N m].
    """

    sd: Annotated[
        float,
        Within(1e-12, 1e4),
        Setting("N m", "a hundredth of what the strongest joint bears (docs/decisions/0019-calibration.md)"),
    ] = 0.7

    def __post_init__(self) -> None:
        """Checks the number.

        Raises:
            BadArgumentError: It is not finite, or out of bounds.
        """
        check_fields(self)

    def num_features(self, num_joints: int) -> int:
        """Y^T Y, Y^T r and r^T r, flattened."""
        return NUM_PARAMETERS**2 + NUM_PARAMETERS + 1

    def compute_features(self, tau: Array, tau_arm: Array, Y: Array) -> Array:
        """Y^T Y, Y^T r and r^T r with r = tau - tau_arm: what the normal equations are made of."""
        residual = tau - tau_arm
        return np.concatenate([(Y.T @ Y).ravel(), Y.T @ residual, [residual @ residual]])

    def compute_likelihood(
        self, features: Array, num_samples: int, num_joints: int, geometry: Geometry, rho: Array
    ) -> Likelihood:
        """Likelihood of all samples; it does not depend on rho, and takes the geometry for exact."""
        sums = num_samples * features / self.sd**2
        YtY = sums[: NUM_PARAMETERS**2].reshape(NUM_PARAMETERS, NUM_PARAMETERS)
        log_scale = num_samples * num_joints * np.log(2.0 * np.pi * self.sd**2)
        return Likelihood(
            geometry.Phi.T @ YtY @ geometry.Phi,
            geometry.Phi.T @ sums[NUM_PARAMETERS**2 : -1],
            -0.5 * float(sums[-1] + log_scale),
            -0.5 * float(log_scale),
            num_samples * num_joints,
        )

    def draw_trial_errors(self, seed: tuple[int, ...], num_joints: int) -> tuple[Array, Array]:
        """None that lasts."""
        return np.zeros(num_joints), np.zeros(num_joints)

    def draw_sample_error(self, seed: tuple[int, ...], tau: Array) -> Array | None:
        """White noise."""
        return self.sd * np.random.default_rng(seed).standard_normal(len(tau))

    def compute_sd(self, tau: Array) -> Array:
        """The same at every torque."""
        return np.full(len(tau), self.sd)
