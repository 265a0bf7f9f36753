"""Evidence by a force-torque sensor at the wrist: six channels, with no joint between them and the load.

    [f; n] = W pi + offset + error

with pi all that is mounted on the sensor. The empty hand (gripper, cables) and the sensor's offset are found from a
run with an empty hand, the tare, and accounted for with their uncertainty.
"""

from dataclasses import replace

import numpy as np

from affordance.arrays import Array
from affordance.identification.evidence import Evidence, no_phantom
from affordance.identification.gains import Gains, build_nominal_gains
from affordance.identification.joint_statistics import SIGNAL, ChannelSamples
from affordance.identification.model_error import build_phantom_covariance, estimate_phantom_mass
from affordance.identification.payload_fit import estimate_variance, list_friction_sds
from affordance.identification.payload_likelihood import ChannelPrior, PayloadLikelihood
from affordance.identification.preparation import PreparedRun
from affordance.identification.robot_chain import RobotChain
from affordance.identification.run import WRENCH_COLUMNS, Run
from affordance.identification.settings import IdentificationSettings, SignalKind
from affordance.objects.inertia import NUM_PARAMETERS
from affordance.plant.wrench_regressor import compute_wrench_regressors

# SD of an offset before a tare, as a multiple of its drift.
_RAW_OFFSET = 20.0
# Prior SDs of the empty hand, kilograms at some centimetres: mass, first moment, moment of inertia.
_TARE_SD = np.array([3.0, *[0.5] * 3, *[0.1] * 6])
_STRETCH = 4.0  # length of the empty run's stretches that measure errors that do not average out, [s]
_NUM_PASSES = 4


def build_wrist_evidence(
    robot: RobotChain,
    loaded: Run,
    prepared: PreparedRun,
    empty: PreparedRun | None,
    settings: IdentificationSettings,
) -> Evidence:
    """Builds the evidence of a wrist sensor.

    Args:
        robot: Model of the arm, whose tip is the sensor.
        loaded: Run with the load.
        prepared: Even samples of the loaded run.
        empty: Even samples of a run with an empty hand; None if all that is mounted on the sensor is the load.
        settings: Identification settings.
    """
    phantom, covariance = no_phantom()
    evidence = Evidence(
        source=loaded.source,
        analysis="wrist sensor without a tare: all that hangs on it is the load",
        kind=SignalKind.WRENCH,
        channel_names=WRENCH_COLUMNS,
        times=prepared.times,
        samples=_build_samples(robot, prepared, prepared.signal),
        motion=prepared.motion,
        arm_torque=np.zeros_like(prepared.signal),
        is_difference=False,
        rate=prepared.rate,
        cutoff=prepared.cutoff,
        least_variance=np.zeros(len(WRENCH_COLUMNS)),
        phantom=phantom,
        phantom_covariance=covariance,
        friction_scale=_RAW_OFFSET,
    )
    if empty is None or not settings.tare:
        return evidence
    return _tare(evidence, robot, empty, settings)


def build_wrist_gains(settings: IdentificationSettings) -> Gains:
    """Builds the gains of a wrist sensor."""
    return build_nominal_gains(WRENCH_COLUMNS, SignalKind.WRENCH, settings)


def _build_samples(robot: RobotChain, prepared: PreparedRun, signal: Array) -> ChannelSamples:
    W = compute_wrench_regressors(robot.chain, prepared.q, prepared.v, prepared.vdot)
    zero = np.zeros_like(signal)
    used = np.ones(signal.shape, dtype=bool)
    # Force first, as sensors and their messages have it.
    return ChannelSamples(W[:, [3, 4, 5, 0, 1, 2]], zero, zero, zero, zero, signal, used)


def _tare(evidence: Evidence, robot: RobotChain, empty: PreparedRun, settings: IdentificationSettings) -> Evidence:
    """Tares with an empty run: the sensor's offset is subtracted, and the empty hand becomes the phantom payload."""
    of_empty = _replace_run(evidence, robot, empty)
    statistics = of_empty.compute_statistics(settings)
    num = statistics.num_channels
    zero = np.zeros(NUM_PARAMETERS)
    prior = ChannelPrior(
        np.tile([1.0, 0.0], (num, 1)),
        np.zeros((num, 2, 2)),
        np.zeros((num, 3)),
        list_friction_sds(evidence, settings),
        zero,
        np.zeros((NUM_PARAMETERS, NUM_PARAMETERS)),
    )
    variance = np.maximum(statistics.products[:, SIGNAL, SIGNAL] / statistics.counts, np.finfo(float).tiny)
    for _ in range(_NUM_PASSES):
        likelihood = PayloadLikelihood(statistics, prior, variance)
        quadratic = likelihood.linearise(zero)
        covariance = np.linalg.inv(quadratic.precision + np.diag(_TARE_SD**-2))
        tare = covariance @ quadratic.information
        weights = likelihood.build_residual_weights(tare)
        variance = estimate_variance(statistics, weights, of_empty.describe_errors(settings))
    phantom_mass = 0.0
    if settings.floor:
        phantom_mass = estimate_phantom_mass(
            [
                PayloadLikelihood(part.compute_statistics(settings), prior, variance).linearise(tare).about(tare)
                for part in of_empty.split(_STRETCH)
            ]
        )
    offset = -weights[:, 24]
    loaded = evidence.samples._replace(signal=evidence.samples.signal - offset)
    return replace(
        evidence,
        analysis=f"wrist sensor, tared: the empty hand holds {1e3 * tare[0]:.0f} g",
        samples=loaded,
        friction_scale=1.0,
        least_variance=variance,
        phantom=tare,
        phantom_covariance=covariance + build_phantom_covariance(phantom_mass),
        notes=(f"an empty hand seems to hold {1e3 * phantom_mass:.0f} g more or less now and then",),
    )


def _replace_run(evidence: Evidence, robot: RobotChain, prepared: PreparedRun) -> Evidence:
    return replace(
        evidence,
        times=prepared.times,
        samples=_build_samples(robot, prepared, prepared.signal),
        motion=prepared.motion,
        arm_torque=np.zeros_like(prepared.signal),
        rate=prepared.rate,
        cutoff=prepared.cutoff,
    )
