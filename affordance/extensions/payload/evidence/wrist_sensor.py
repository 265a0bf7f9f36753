"""Evidence from a force-torque sensor at the wrist: six channels, with no joint between them and the load.

    [f; n] = W pi + offset + error

with pi all that is mounted on the sensor. The empty hand (gripper, cables) and the sensor's offset are estimated from
a run with an empty hand, the tare, and their uncertainty is taken into account.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from affordance.extensions.payload.evidence.evidence import Evidence, build_evidence
from affordance.extensions.payload.evidence.gains import Gains
from affordance.extensions.payload.evidence.gravity_tilt import find_tilt
from affordance.extensions.payload.evidence.joint_statistics import SIGNAL
from affordance.extensions.payload.evidence.model_error import build_phantom_covariance, estimate_phantom_mass
from affordance.extensions.payload.evidence.paired_runs import get_only
from affordance.extensions.payload.evidence.payload_likelihood import ChannelPrior, PayloadLikelihood
from affordance.extensions.payload.recording.preparation import prepare_alike
from affordance.extensions.payload.recording.run import Run
from affordance.extensions.payload.settings import IdentificationSettings, SignalKind
from affordance.objects.inertia import NUM_PARAMETERS
from affordance.plant.serial_chain import SerialChain

# SD of an offset before a tare, as a multiple of the offset's drift.
_RAW_OFFSET = 20.0
# Prior SDs of the empty hand's mass, first moment and moments of inertia: kilograms at some centimetres.
_TARE_SD = np.array([3.0, *[0.5] * 3, *[0.1] * 6])
_STRETCH = 4.0  # length of the empty run's stretches, from which errors that do not average out are estimated, [s]
_NUM_PASSES = 4


def build_wrist_evidence(
    robot: SerialChain, loaded: Run, empty: Sequence[Run], gains: Gains, settings: IdentificationSettings
) -> Evidence:
    """Builds the evidence of a sensor at the tip; without an empty run, all that is mounted on it is the load.

    Raises:
        BadValueError: There are several empty runs.
    """
    runs = [loaded, get_only(empty, "a wrist sensor's tare")] if empty else [loaded]
    analysis = "wrist sensor without a tare: everything mounted on it counts as load"
    tilt = None
    if loaded.description.postures:
        tilt = find_tilt(robot, loaded)
        robot = robot.with_gravity(tilt.gravity)
    evidence, *tare = [
        replace(
            build_evidence(
                robot, loaded.source, SignalKind.WRENCH, prepared, settings, analysis=analysis, is_difference=False
            ),
            friction_scale=_RAW_OFFSET,
        )
        for prepared in prepare_alike(runs, settings)
    ]
    evidence = _tare(evidence, tare[0], settings) if tare and settings.tare else evidence
    if tilt is None:
        return evidence
    errors = tilt.measure_errors(robot, evidence.samples.Y, evidence.samples.signal, evidence.prepared.q)
    notes = (*evidence.notes, tilt.describe())
    return replace(evidence, phantom_covariance=evidence.phantom_covariance + errors, notes=notes)


def _tare(evidence: Evidence, of_empty: Evidence, settings: IdentificationSettings) -> Evidence:
    """Tares with an empty run: subtracts the sensor's offset, and makes the empty hand the phantom payload."""
    statistics = of_empty.compute_statistics(settings)
    num = statistics.num_channels
    zero = np.zeros(NUM_PARAMETERS)
    prior = ChannelPrior(
        np.tile([1.0, 0.0], (num, 1)),
        np.zeros((num, 2, 2)),
        np.zeros((num, 3)),
        evidence.list_friction_sds(settings),
    )
    variance = np.maximum(statistics.products[:, SIGNAL, SIGNAL] / statistics.counts, np.finfo(float).tiny)
    for _ in range(_NUM_PASSES):
        likelihood = PayloadLikelihood(statistics, prior, variance)
        quadratic = likelihood.linearise(zero)
        covariance = np.linalg.inv(quadratic.precision + np.diag(_TARE_SD**-2))
        tare = covariance @ quadratic.information
        weights = likelihood.build_residual_weights(tare)
        variance = of_empty.build_error_model(settings).estimate_variance(statistics, weights)
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
        analysis=f"wrist sensor, tared: the empty hand weighs {1e3 * tare[0]:.0f} g",
        samples=loaded,
        friction_scale=1.0,
        least_variance=variance,
        phantom=tare,
        phantom_covariance=covariance + build_phantom_covariance(phantom_mass),
        notes=(f"the apparent load of the empty hand varies by {1e3 * phantom_mass:.0f} g (one SD)",),
    )
