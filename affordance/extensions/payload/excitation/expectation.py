"""Predicts the standard deviations that ``identify`` would give after a planned motion.

The regressors of the motion are known in advance, and the signal is predicted for the expected body. As in
identification, all nuisance parameters are integrated out: gains, load friction, friction, correlated errors, and
model errors that do not average out. Designs that assume white noise neglect these. They prefer postures with the
largest lever arms, and are overoptimistic.
"""

import enum
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import NamedTuple, Self

import numpy as np

from affordance.arrays import Array
from affordance.extensions.payload.evidence.evidence import Evidence, build_evidence
from affordance.extensions.payload.evidence.gains import Gains, arrange_gains, build_nominal_gains, read_gains
from affordance.extensions.payload.evidence.joint_statistics import LOAD, NUM_COLUMNS, SIGNAL, JointStatistics
from affordance.extensions.payload.evidence.model_error import build_phantom_covariance
from affordance.extensions.payload.evidence.payload_likelihood import PayloadLikelihood
from affordance.extensions.payload.posterior.log_cholesky import (
    compute_jacobian,
    parameters_from_theta,
)
from affordance.extensions.payload.posterior.payload_fit import PayloadFit, build_channel_prior
from affordance.extensions.payload.posterior.solid_prior import SolidPrior
from affordance.extensions.payload.recording.preparation import PreparedRun
from affordance.extensions.payload.settings import DEFAULT_SETTINGS, IdentificationSettings, SignalKind
from affordance.plant.serial_chain import ChainDynamics, SerialChain

# Errors of joint torques if no gains file is given: square root of the long-run variance density divided by the
# torque limit, [sqrt(s)]. It is .0015 to .006 for a Panda's joints and .0008 to .0013 for a UR10e's joints.
_ERROR = 0.002
# Number of bodies over which a prediction is averaged, and the relative SD of their masses.
_NUM_BODIES, _MASS_SD = 4, 0.1


class Aim(enum.Enum):
    """Quantity whose standard deviation a motion should minimise."""

    MASS = "mass"
    COM = "com"
    INERTIA = "inertia"


class Spread(NamedTuple):
    """Standard deviations that ``identify`` would give after a motion."""

    mass: float  # standard deviation of the mass, [kg]
    com: float  # SD of the centre of mass, root sum of squares over coordinates, [m]
    inertia: float  # SD of the moments about the centre of mass, root sum of squares over entries, [kg m^2]

    def get(self, aim: Aim) -> float:
        """Returns the standard deviation of a quantity."""
        value: float = getattr(self, aim.value)
        return value


@dataclass(frozen=True)
class Expectation:
    """Prior knowledge that determines how precisely a run identifies the payload."""

    robot: SerialChain  # model of the arm, with its mounting
    gains: Gains  # gains before the run, including drift
    # Density of each joint's long-run error variance, shape (n,), in the signal's unit squared times seconds. It is
    # the variance times the sampling interval, which does not depend on the rate.
    error_density: Array
    # Log-Cholesky coordinates of possible bodies, shape (K, 10). Variances are averaged over these bodies.
    bodies: Array
    # Covariance of the phantom payload, an error that does not average out over time, shape (10, 10).
    floor: Array = field(default_factory=lambda: np.zeros((10, 10)))
    settings: IdentificationSettings = DEFAULT_SETTINGS

    @classmethod
    def of_load(cls, robot: SerialChain, gains: Gains, error_density: Array, *, mass: float, floor: float) -> Self:
        """Builds the expectation for a body of about a given mass in the hand.

        Args:
            robot: Model of the arm.
            gains: Gains before the run, including drift.
            error_density: Density of each joint's long-run error variance, shape (n,).
            mass: Mass of the body, [kg].
            floor: Part of the mass's standard deviation that never averages out, [kg].
        """
        prior = SolidPrior.for_hand().with_mass(mass, _MASS_SD * mass)
        bodies = prior.draw_theta(np.random.default_rng(0), _NUM_BODIES)
        return cls(robot, gains, error_density, bodies, build_phantom_covariance(floor))

    @classmethod
    def after_run(cls, robot: SerialChain, gains: Gains, fit: PayloadFit, settings: IdentificationSettings) -> Self:
        """Builds the expectation for a run's most probable body, with the gains that were known before the run."""
        density, floor = fit.long_run_variance / fit.evidence.rate, fit.evidence.phantom_covariance
        return cls(robot, gains, density, fit.mode.theta[None], floor, settings=settings)

    def build_evidence(self, motion: PreparedRun, dynamics: ChainDynamics | None = None) -> Evidence:
        """Builds the expected evidence of a motion after an empty run is subtracted.

        The sign of load friction follows from the mean body. The dynamics of the motion are computed if not given.
        """
        evidence = build_evidence(
            self.robot,
            "planned motion",
            self.gains.kind,
            motion,
            self.settings,
            analysis="planned",
            is_difference=True,
            dynamics=dynamics,
        )
        known = replace(
            evidence,
            is_repeated=True,
            least_variance=self.error_density * motion.rate,
            phantom_covariance=self.floor,
        )
        return known.with_load(parameters_from_theta(self.bodies).mean(axis=0))

    def predict(self, motion: PreparedRun, dynamics: ChainDynamics | None = None) -> Spread:
        """Predicts the standard deviations after a motion. The motion's signal is not used."""
        evidence = self.build_evidence(motion, dynamics)
        return self.measure(evidence, evidence.compute_statistics(self.settings))

    @cached_property
    def _precision(self) -> Array:
        """Inverse prior covariance of a body, (10, 10), widened by the common factor of the gains."""
        return SolidPrior.for_hand().with_common_factor(self.gains.common_sd).precision

    @cached_property
    def _derivatives(self) -> list[tuple[Array, Array, Array]]:
        """Parameters of each body, (10,), their derivatives, (10, 10), and derivatives of the moments, (3, 10).

        Derivatives are with respect to theta. The moments are about the centre of mass.
        """
        return [
            (
                parameters_from_theta(theta),
                compute_jacobian(theta),
                compute_jacobian(np.where(_IS_COM, 0.0, theta))[4:7],
            )
            for theta in self.bodies
        ]

    def measure(self, evidence: Evidence, statistics: JointStatistics) -> Spread:
        """Computes the RMS standard deviations over the bodies from a motion's sums of products."""
        prior = build_channel_prior(evidence, self.gains, self.settings)
        squares = []
        for pi, D, about in self._derivatives:
            filled = fill_signal(statistics, self.gains.mean, pi, has_arm=prior.has_arm)
            likelihood = PayloadLikelihood(filled, prior, evidence.least_variance)
            H = likelihood.linearise(pi).widen(self.floor).precision
            C = np.linalg.inv(D.T @ H @ D + self._precision)
            C[0, 0] += self.gains.common_sd**2
            squares.append(
                [
                    C[0, 0] * pi[0] ** 2,
                    C[1:4, 1:4].trace(),
                    (about @ C @ about.T).trace(),
                ]
            )
        return Spread(*(float(each) for each in np.sqrt(np.mean(squares, axis=0))))


def find_errors(
    joint_names: tuple[str, ...], tau_max: Array, kind: SignalKind, path: Path | None = None
) -> tuple[Gains, Array]:
    """Reads gains and long-run error densities from a gains file.

    Without a file, typical values are derived from the torque limits.

    Raises:
        BadValueError: The gains file is invalid.
    """
    if path is None:
        return build_nominal_gains(joint_names, kind, DEFAULT_SETTINGS), np.square(_ERROR * tau_max)
    gains = arrange_gains(read_gains(path), joint_names, path).with_drift(DEFAULT_SETTINGS)
    return gains, gains.least_variance / DEFAULT_SETTINGS.max_rate


_IS_COM = np.isin(np.arange(10), (1, 2, 3))


def fill_signal(statistics: JointStatistics, gain: Array, pi: Array, *, has_arm: bool = True) -> JointStatistics:
    """Replaces the signal in the sums of products with the error-free signal of a load.

    The gains g and h have shape (n, 2). ``has_arm`` is False if the arm's torque was subtracted from the signal.
    """
    weights = np.tile(np.eye(NUM_COLUMNS), (statistics.num_channels, 1, 1))
    weights[:, SIGNAL, SIGNAL] = 0.0
    load = np.concatenate([[float(has_arm)], pi])
    weights[:, LOAD, SIGNAL] = (gain[:, :, None] * load).reshape(len(gain), -1)
    return replace(statistics, products=weights.transpose(0, 2, 1) @ statistics.products @ weights)


def format_sd(number: float) -> str:
    """Formats a standard deviation with two significant digits, without an exponent."""
    return np.format_float_positional(number, precision=2, fractional=False, trim="-")
