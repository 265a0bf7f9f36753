"""Gains of joints: signal per torque, and friction that is proportional to the load.

Manufacturers calibrate torque sensors. Robots' files do not contain gains of motor currents, which are estimated with
a load of known mass or, less accurately, from the arm's own weight.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Self

import numpy as np
from pydantic import Field, model_validator

from affordance.arguments import check_kind
from affordance.arrays import Array
from affordance.exceptions import BadValueError
from affordance.extensions.payload.settings import IdentificationSettings, SignalKind
from affordance.files.atomic import write_json
from affordance.files.constraints import Name, OneOf, StrPath, Text, Vector, Within, check_path, complain
from affordance.files.data_model import DataModel, load_model

type _Triple = tuple[float, float, float]


@dataclass(frozen=True)
class Gains:
    """Gains and friction of an arm's joints.

    Attributes:
        joint_names: Names of the joints.
        kind: Kind of the signal.
        mean: Means of each joint's gain g, and of h = mu g with the load friction mu, shape (n, 2), [unit of the
            signal per N m].
        covariance: Covariance of g and h for each joint, shape (n, 2, 2).
        common_sd: Relative standard deviation of a factor common to all gains.
        friction: Means of each joint's Coulomb friction, viscous friction and offset, shape (n, 3), in the signal's
            unit.
        friction_sd: Standard deviations of friction, shape (n, 3); None for the prior of the signal's kind, if
            friction was not calibrated.
        least_variance: Long-run variance of the error in the calibration runs, shape (n,).
        source: Origin of the gains, in words.
        robot: Fingerprint of the arm that was calibrated; empty if unknown.
        is_by_weight: True if the gains were estimated from the arm's own weight, so that they share the errors of its
            file.
        own_weight: Ratio of own-weight signal in the empty run to the signal predicted from gain and robot's file,
            and the relative error of this ratio, shape (n, 2); NaN for joints that cannot be tested, None if unknown.
            The file's errors are the same in every run, so a change of the ratio reveals another controller.

    Example:
        >>> from affordance import Robot
        >>> from affordance.extensions.payload.evidence.gains import build_nominal_gains
        >>> from affordance.extensions.payload.settings import DEFAULT_SETTINGS, SignalKind
        >>> gains = build_nominal_gains(Robot().joint_names, SignalKind.JOINT_TORQUE, DEFAULT_SETTINGS)
        >>> gains.joint_names[0], round(gains.common_sd, 2)
        ('shoulder_azimuth', 0.01)
    """

    joint_names: tuple[str, ...]
    kind: SignalKind
    mean: Array
    covariance: Array
    common_sd: float
    friction: Array
    friction_sd: Array | None
    least_variance: Array
    source: str
    robot: str = ""
    is_by_weight: bool = False
    own_weight: Array | None = None

    def __repr__(self) -> str:
        means = ", ".join(f"{name} {gain:.4g}" for name, gain in zip(self.joint_names, self.mean[:, 0], strict=True))
        return f"Gains({self.kind.value}: {means}; {self.source})"

    @property
    def load_friction(self) -> Array:
        """Load friction mu of each joint, shape (n,); zero for a joint that never moved."""
        g, h = self.mean.T
        mu: Array = np.divide(h, g, out=np.zeros_like(g), where=g != 0.0)
        return mu

    def widen(self) -> "Gains":
        """Replaces all gains with the median of their absolute values, uncertain by about 50 %."""
        typical = np.median(np.abs(self.mean[:, 0]))
        mean = np.tile([typical, 0.0], (len(self.mean), 1))
        covariance = np.tile(typical**2 * np.diag([0.25, 0.01]), (len(self.mean), 1, 1))
        return replace(self, mean=mean, covariance=covariance)

    def with_drift(self, settings: IdentificationSettings) -> "Gains":
        """Returns the gains for another run, with uncertainty widened by drift."""
        prior = settings.get_prior(self.kind)
        drift = np.zeros_like(self.covariance)
        g = self.mean[:, 0]
        drift[:, 0, 0] = (prior.drift_own_sd * g) ** 2
        # Load friction drifts only if the signal contains gear friction.
        if self.mean[:, 1].any() or prior.load_friction_sd > 0.0:
            drift[:, 1, 1] = (settings.load_friction_drift * g) ** 2
        friction_sd = self.friction_sd
        if friction_sd is not None:
            friction_sd = np.hypot(friction_sd, settings.friction_drift * np.abs(self.friction))
        common_sd = float(np.hypot(self.common_sd, prior.drift_common_sd))
        return replace(self, covariance=self.covariance + drift, common_sd=common_sd, friction_sd=friction_sd)


def build_nominal_gains(joint_names: tuple[str, ...], kind: SignalKind, settings: IdentificationSettings) -> Gains:
    """Builds the gains of torque signals before any calibration."""
    prior = settings.get_prior(kind)
    num = len(joint_names)
    common_sd, own_sd = (
        float(np.hypot(*each))
        for each in ((prior.scale_common_sd, prior.drift_common_sd), (prior.scale_own_sd, prior.drift_own_sd))
    )
    covariance = np.tile(np.diag([own_sd**2, prior.load_friction_sd**2]), (num, 1, 1))
    mean = np.tile([1.0, prior.load_friction], (num, 1))
    source = f"the signal is a torque; gains known to {100 * common_sd:.2g} % in common and {100 * own_sd:.2g} % each"
    return Gains(joint_names, kind, mean, covariance, common_sd, np.zeros((num, 3)), None, np.zeros(num), source)


def write_gains(path: StrPath, gains: Gains) -> None:
    """Writes gains as JSON, which is also valid YAML, in full precision.

    Raises:
        BadArgumentError: The argument is not of class Gains.
    """
    check_kind("gains", gains, Gains)
    joints = {}
    for i, name in enumerate(gains.joint_names):
        joints[name] = {
            "gain": gains.mean[i, 0],
            "load_friction": gains.load_friction[i],
            "covariance": gains.covariance[i, [0, 0, 1], [0, 1, 1]],
            "noise_variance": gains.least_variance[i],
        }
        if gains.friction_sd is not None:
            joints[name] |= {"friction": gains.friction[i], "friction_sd": gains.friction_sd[i]}
        if gains.own_weight is not None and np.isfinite(gains.own_weight[i]).all():
            joints[name]["own_weight"] = gains.own_weight[i]
    head = {"source": gains.source, "robot": gains.robot, "signal": gains.kind.value, "common_sd": gains.common_sd}
    write_json(check_path("path", path), head | {"joints": joints})


def read_gains(path: StrPath) -> Gains:
    """Reads gains from a file that ``write_gains`` wrote.

    Raises:
        BadValueError: The file or one of its values is wrong; the message names it.
    """
    return load_model(check_path("path", path), _GainsEntry).build()


class JointEntry(DataModel):
    """Gain, load friction and friction of a joint in a file."""

    gain: Annotated[float, Within(-1e6, 1e6), Field(description="Gain g, signal per N m.")]
    load_friction: Annotated[float, Within(-2.0, 2.0), Field(description="Share of the load lost in friction, mu.")]
    covariance: Annotated[
        _Triple, Vector(3, Within(-1e12, 1e12)), Field(description="var(g), cov(g, h), var(h); h = mu g.")
    ]
    noise_variance: Annotated[float, Within(0.0, 1e12), Field(description="Long-run variance of the error.")]
    friction: Annotated[
        Annotated[_Triple, Vector(3, Within())] | None,
        Field(description="Coulomb friction, viscous friction and offset."),
    ] = None
    friction_sd: Annotated[
        Annotated[_Triple, Vector(3, Within(0.0))] | None, Field(description="Standard deviations of friction.")
    ] = None
    own_weight: Annotated[
        Annotated[tuple[float, float], Vector(2, Within(1e-6, 1e6))] | None,
        Field(description="Own-weight signal over the one that gain and file predict, and its relative error."),
    ] = None

    @model_validator(mode="after")
    def check_values(self) -> Self:
        """Rejects a zero gain and invalid covariances."""
        gg, gh, hh = self.covariance
        if self.gain == 0.0:
            raise complain("is 0, must not be 0", "gain")
        if gg < 0.0 or hh < 0.0 or gh**2 > gg * hh * (1.0 + 1e-9):
            raise complain(f"is [{gg:g}, {gh:g}, {hh:g}], must be a covariance of two numbers", "covariance")
        if (self.friction is None) != (self.friction_sd is None):
            raise complain("is missing", "friction" if self.friction is None else "friction_sd")
        return self


class _GainsEntry(DataModel):
    """Contents of a gains file."""

    source: Annotated[str, Text(), Field(description="Origin of the gains, in words.")]
    robot: Annotated[str, Field(description="Fingerprint of the arm; empty if unknown.")] = ""
    signal: Annotated[SignalKind, OneOf(SignalKind), Field(description="Kind of the signal.")]
    common_sd: Annotated[
        float, Within(0.0, 1.0), Field(description="Relative standard deviation of a factor common to all gains.")
    ]
    joints: Annotated[dict[Name, JointEntry], Field(min_length=1, description="Gains by joint name.")]

    @model_validator(mode="after")
    def check_friction(self) -> Self:
        given = sum(joint.friction is not None for joint in self.joints.values())
        if 0 < given < len(self.joints):
            problem = f"give friction for {given} joints, must give it for all {len(self.joints)} or for none"
            raise complain(problem, "joints")
        return self

    def build(self) -> Gains:
        each = list(self.joints.values())
        friction = [joint.friction for joint in each]
        is_calibrated = None not in friction
        return Gains(
            tuple(self.joints),
            self.signal,
            np.array([[joint.gain, joint.load_friction * joint.gain] for joint in each]),
            np.array([joint.covariance for joint in each])[:, [[0, 1], [1, 2]]],
            self.common_sd,
            np.array(friction if is_calibrated else np.zeros((len(each), 3))),
            np.array([joint.friction_sd for joint in each]) if is_calibrated else None,
            np.array([joint.noise_variance for joint in each]),
            self.source,
            self.robot,
            own_weight=np.array([joint.own_weight or (np.nan, np.nan) for joint in each]),
        )


def arrange_gains(gains: Gains, joint_names: tuple[str, ...], path: Path | str) -> Gains:
    """Reorders the gains to match an arm's joints.

    Raises:
        BadValueError: A joint has no gain.
    """
    missing = [name for name in joint_names if name not in gains.joint_names]
    if missing:
        raise BadValueError(path, "joints", f"are {', '.join(gains.joint_names)}, must include {', '.join(missing)}")
    order = [gains.joint_names.index(name) for name in joint_names]
    return replace(
        gains,
        joint_names=joint_names,
        mean=gains.mean[order],
        covariance=gains.covariance[order],
        friction=gains.friction[order],
        friction_sd=None if gains.friction_sd is None else gains.friction_sd[order],
        least_variance=gains.least_variance[order],
        own_weight=None if gains.own_weight is None else gains.own_weight[order],
    )
