"""Study of objects weighed on a servo arm, from the position errors of its servos alone.

The signal is the deviation of each servo from its set point. Gain and friction of each servo are estimated from two
objects with known torques, and then used to identify the third object. The model error is estimated from the same two
objects: each of them is identified with the other's gains.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.identification.evidence.evidence import Evidence
from affordance.identification.evidence.gains import Gains
from affordance.identification.evidence.joint_statistics import ChannelSamples
from affordance.identification.evidence.model_error import build_phantom_covariance, estimate_phantom_mass
from affordance.identification.evidence.payload_likelihood import PayloadLikelihood
from affordance.identification.posterior.calibration import calibrate_gains
from affordance.identification.posterior.inference import infer
from affordance.identification.posterior.payload_belief import PayloadBelief
from affordance.identification.posterior.payload_fit import build_channel_prior
from affordance.identification.recording.preparation import PreparedRun
from affordance.identification.settings import IdentificationSettings, SignalKind, SignalPrior
from studies.recorded.clones import WeighedObject

# Prior of servo position errors, in radians per newton metre. Servo gears lose more of the load to friction than an
# arm's, so the prior of load friction is broad; gains drift as on any robot.
SERVO_PRIOR = SignalPrior(
    scale_common_sd=0.0,
    scale_own_sd=0.0,
    drift_common_sd=0.0,
    drift_own_sd=0.02,
    change_common_sd=0.0,
    change_own_sd=0.0,
    load_friction=0.0,
    load_friction_sd=0.5,
    friction_sd=0.3,
)
# Postures are held one after the other, so there are no velocities and no filter.
_RATE = 1.0


class WeighedResult(NamedTuple):
    """Results of the study on weighed objects."""

    numbers: dict[str, Any]  # numbers for metrics.json
    details: dict[str, Any]  # further numbers, for details.json
    beliefs: dict[str, PayloadBelief]  # posteriors, by name of the object


def study_weighed_objects(objects: dict[str, WeighedObject], settings: IdentificationSettings) -> WeighedResult:
    """Identifies each object with gains from the others."""
    beliefs, inside = {}, []
    details: dict[str, dict[str, Any]] = {}
    for name, weighed in objects.items():
        evidence, gains = calibrate_by_others(objects, name, settings)
        belief = beliefs[name] = infer(evidence, gains, settings=settings)
        low, high = belief.mass_interval90
        inside.append(low <= weighed.mass <= high)
        first_moment = belief.bodies.pi[:, 1:4]
        mean = belief.bodies.weights @ first_moment
        sd = np.sqrt(belief.bodies.weights @ (first_moment - mean) ** 2)
        of_object = {
            "mass_g": 1e3 * belief.mass,
            "mass_sd_g": 1e3 * belief.mass_sd,
            "true_g": 1e3 * weighed.mass,
            "error_g": 1e3 * (belief.mass - weighed.mass),
            "floor_g": 1e3 * float(np.sqrt(evidence.phantom_covariance[0, 0])),
            "first_moment": {"mean_g_cm": 1e5 * mean, "sd_g_cm": 1e5 * sd, "true_g_cm": 1e5 * weighed.first_moment},
            "load_friction": belief.load_friction,
        }
        for key, value in of_object.items():
            details.setdefault(key, {})[name] = value
    numbers = {"inside": sum(inside), "rmse_g": float(np.sqrt(np.mean(np.square(list(details["error_g"].values())))))}
    return WeighedResult(numbers, details, beliefs)


def calibrate_by_others(
    objects: dict[str, WeighedObject], name: str, settings: IdentificationSettings
) -> tuple[Evidence, Gains]:
    """Builds the evidence of an object; gains with their drift, and the model error, come from the other objects."""
    others = [other for key, other in objects.items() if key != name]
    gains = calibrate_gains(_build_known(others), None, settings).with_drift(settings)
    floor = build_phantom_covariance(_estimate_floor(others, settings))
    return replace(_build_unknown(objects[name]), phantom_covariance=floor), gains


def _estimate_floor(objects: Sequence[WeighedObject], settings: IdentificationSettings) -> float:
    """Estimates the model error as a phantom mass, [kg], from one known object with gains from the other."""
    misfits = []
    for known in objects:
        others = [other for other in objects if other is not known]
        gains = calibrate_gains(_build_known(others), None, settings).with_drift(settings)
        evidence = _build_unknown(known)
        truth = np.zeros(10)
        truth[:4] = known.mass, *known.first_moment
        statistics = evidence.with_load(truth).compute_statistics(settings)
        prior = build_channel_prior(evidence, gains, settings)
        misfits.append(PayloadLikelihood(statistics, prior, gains.least_variance).linearise(truth).about(truth))
    return estimate_phantom_mass(misfits)


def _build_known(objects: Sequence[WeighedObject]) -> Evidence:
    """Builds the evidence of objects whose load is known and therefore treated as part of the arm."""
    torque = np.concatenate(
        [each.arm_torque + each.regressors @ np.array([each.mass, *each.first_moment]) for each in objects]
    )
    deviation = np.concatenate([each.deviation for each in objects])
    direction = np.concatenate([each.direction for each in objects])
    return _build(np.zeros((*torque.shape, 10)), torque, deviation, direction)


def _build_unknown(weighed: WeighedObject) -> Evidence:
    Y = np.zeros((*weighed.arm_torque.shape, 10))
    Y[..., :4] = weighed.regressors
    return _build(Y, weighed.arm_torque, weighed.deviation, weighed.direction)


def _build(Y: Array, torque: Array, deviation: Array, direction: Array) -> Evidence:
    num_samples, num_joints = torque.shape
    zero = np.zeros_like(torque)  # at rest there is no motion
    samples = ChannelSamples(Y, torque, direction * np.sign(torque), direction, zero, deviation, direction != 0.0)
    return Evidence(
        source="lbipe",
        analysis="static postures; torques of the empty arm as computed by its owners",
        kind=SignalKind.CURRENT,
        channel_names=tuple(f"servo {j + 1}" for j in range(num_joints)),
        prepared=PreparedRun(np.arange(num_samples) / _RATE, zero, zero, zero, deviation, _RATE / 2.0),
        rate=_RATE,
        samples=samples,
        arm_torque=torque,
        is_difference=False,
    )
