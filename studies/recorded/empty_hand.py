"""Apparent payload of an empty hand, which must be zero within its error if other results are to be trusted."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.identification.evidence.evidence import restore_compensated
from affordance.identification.evidence.gains import Gains
from affordance.identification.evidence.payload_likelihood import PayloadLikelihood
from affordance.identification.evidence.unpaired_runs import fit_empty_arm, subtract_arm
from affordance.identification.posterior.payload_fit import build_channel_prior
from affordance.identification.recording.preparation import prepare
from affordance.identification.recording.run import Run
from affordance.identification.settings import IdentificationSettings
from affordance.plant.serial_chain import SerialChain

# Prior SDs of an apparent payload, whose numbers may have either sign: mass, first moment, moments of inertia.
_SD = np.array([5.0, *[0.5] * 3, *[0.1] * 6])


class ApparentPayload(NamedTuple):
    """Apparent payload of an empty hand; it may be negative and is usually not a physically consistent body."""

    parameters: Array  # mean of the ten parameters, shape (10,)
    covariance: Array  # covariance of the ten parameters, shape (10, 10)

    @property
    def mass_sd(self) -> float:
        """Standard deviation of the mass, [kg]."""
        return float(np.sqrt(self.covariance[0, 0]))


def weigh_empty_hand(robot: SerialChain, run: Run, gains: Gains, settings: IdentificationSettings) -> ApparentPayload:
    """Estimates the apparent payload of an empty run; each stretch is predicted by an arm fitted to the others.

    ``gains`` must include drift.
    """
    run = run.arrange(robot.joint_names)
    robot = robot.with_gravity(run.description.gravity)
    prepared = prepare(run, settings)
    signal = restore_compensated(robot, run, prepared, gains.mean[:, 0])
    arm = fit_empty_arm(robot, [prepared], [signal], gains, settings)
    residual = arm.residual[0]
    rows = np.flatnonzero(np.isfinite(residual[:, 0]))
    evidence = subtract_arm(robot, arm, run, prepared.select(rows), settings)
    evidence = replace(evidence, samples=evidence.samples._replace(signal=residual[rows]))
    statistics = evidence.compute_statistics(settings)
    prior = build_channel_prior(evidence, gains, settings)
    likelihood = PayloadLikelihood(statistics, prior, arm.least_variance)
    quadratic = likelihood.linearise(np.zeros(10)).widen(prior.phantom_covariance)
    covariance = np.linalg.inv(quadratic.precision + np.diag(_SD**-2))
    return ApparentPayload(covariance @ quadratic.information, covariance)
