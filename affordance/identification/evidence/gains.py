"""Gains of joints: signal per newton metre, and the share of the load that is lost in friction.

Torque sensors are calibrated by their makers. Gains of motor currents stand in no robot's file: they are found with a
load of known mass or, less accurately, from the arm's own weight.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from affordance.arguments import StrPath, check_kind, check_path
from affordance.arrays import Array
from affordance.exceptions import BadValueError
from affordance.files.atomic import write_text
from affordance.files.record import read_record
from affordance.identification.settings import IdentificationSettings, SignalKind


@dataclass(frozen=True)
class Gains:
    """Gains and friction of an arm's joints.

    Attributes:
        joint_names: Names of the joints.
        kind: Kind of the signal.
        mean: Means of g and h = mu g of each joint, shape (n, 2), [unit of the signal per N m].
        covariance: Covariance of g and h, joint by joint, shape (n, 2, 2).
        common_sd: Relative standard deviation of a factor common to all gains.
        friction: Means of c_C, c_v, c_0 of each joint, shape (n, 3), in the signal's unit.
        friction_sd: Standard deviations of friction, shape (n, 3); None if friction was not calibrated, so that the
            prior of the signal's kind applies in its place.
        least_variance: Long-run variance of the error in the runs of calibration, shape (n,).
        source: Origin of the gains, in words.
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

    def __repr__(self) -> str:
        means = ", ".join(f"{name} {gain:.4g}" for name, gain in zip(self.joint_names, self.mean[:, 0], strict=True))
        return f"Gains({self.kind.value}: {means}; {self.source})"

    @property
    def load_friction(self) -> Array:
        """Load friction mu of each joint, shape (n,)."""
        mu: Array = self.mean[:, 1] / self.mean[:, 0]
        return mu

    def with_drift(self, settings: IdentificationSettings) -> "Gains":
        """Returns the gains for another run, their uncertainty widened by drift."""
        prior = settings.get_prior(self.kind)
        drift = np.zeros_like(self.covariance)
        g = self.mean[:, 0]
        drift[:, 0, 0] = (prior.gain_sd * g) ** 2
        # Only signals that contain gear friction.
        if self.mean[:, 1].any() or prior.load_friction_sd > 0.0:
            drift[:, 1, 1] = (settings.load_friction_drift * settings.load_friction * g) ** 2
        friction_sd = self.friction_sd
        if friction_sd is not None:
            friction_sd = np.hypot(friction_sd, settings.friction_drift * np.abs(self.friction))
        return replace(self, covariance=self.covariance + drift, friction_sd=friction_sd)


def build_nominal_gains(joint_names: tuple[str, ...], kind: SignalKind, settings: IdentificationSettings) -> Gains:
    """Builds the gains of signals that are torques, before any calibration."""
    prior = settings.get_prior(kind)
    num = len(joint_names)
    covariance = np.tile(np.diag([prior.gain_sd**2, prior.load_friction_sd**2]), (num, 1, 1))
    mean = np.tile([1.0, prior.load_friction], (num, 1))
    source = f"the signal is a torque; gains good to {100 * prior.gain_sd:g} %"
    return Gains(joint_names, kind, mean, covariance, 0.0, np.zeros((num, 3)), None, np.zeros(num), source)


def write_gains(path: StrPath, gains: Gains) -> None:
    """Writes gains as YAML, in full precision, for ``read_gains``.

    Raises:
        BadArgumentError: The argument is not of class Gains.
    """
    check_kind("gains", gains, Gains)
    lines = [f"source: {gains.source!r}", f"signal: {gains.kind.value}", f"common_sd: {gains.common_sd!r}", "joints:"]
    for name, mean, covariance, variance in zip(
        gains.joint_names, gains.mean, gains.covariance, gains.least_variance, strict=True
    ):
        lines += [
            f"  {name}:",
            f"    gain: {float(mean[0])!r}  # {gains.kind.unit} per N m",
            f"    load_friction: {float(mean[1] / mean[0])!r}",
            f"    covariance: {_list(covariance[[0, 0, 1], [0, 1, 1]])}  # of g, of g and h = mu g, of h",
            f"    noise_variance: {float(variance)!r}",
        ]
        if gains.friction_sd is not None:
            place = gains.joint_names.index(name)
            lines += [
                f"    friction: {_list(gains.friction[place])}  # direction, velocity, offset",
                f"    friction_sd: {_list(gains.friction_sd[place])}",
            ]
    write_text(check_path("path", path), "\n".join(lines) + "\n")


def _list(values: Array) -> str:
    return f"[{', '.join(repr(float(value)) for value in values)}]"


def read_gains(path: StrPath) -> Gains:
    """Reads gains that ``write_gains`` wrote.

    Raises:
        BadValueError: The file or one of its values is wrong; the message says which and how.
    """
    path = check_path("path", path)
    record = read_record(path)
    source, kind = record.text("source"), record.text("signal")
    kinds: Mapping[str, Any] = {kind.value: kind for kind in SignalKind}
    if kind not in kinds:
        raise record.error("signal", f"is {kind!r}, must be one of {', '.join(kinds)}")
    common_sd = record.number("common_sd", low=0.0, high=1.0)
    names, means, covariances, variances, frictions = [], [], [], [], []
    for name, joint in record.record("joints").named_records():
        gain, mu = joint.number("gain", low=-1e6, high=1e6), joint.number("load_friction", low=-2.0, high=2.0)
        if gain == 0.0:
            raise joint.error("gain", "is 0, must be another number")
        gg, gh, hh = joint.vector("covariance", 3)
        if gg < 0.0 or hh < 0.0 or gh**2 > gg * hh * (1.0 + 1e-9):
            raise joint.error("covariance", f"is [{gg:g}, {gh:g}, {hh:g}], must be that of two numbers")
        names.append(name)
        means.append([gain, mu * gain])
        covariances.append([[gg, gh], [gh, hh]])
        variances.append(joint.number("noise_variance", low=0.0, high=1e12))
        if joint.has("friction"):
            frictions.append([joint.vector("friction", 3), joint.vector("friction_sd", 3, low=0.0)])
        joint.finish()
    record.finish()
    if frictions and len(frictions) < len(names):
        raise record.error("joints", f"give friction of {len(frictions)} joints, must of all {len(names)} or of none")
    friction = np.array(frictions) if frictions else None
    return Gains(
        tuple(names),
        kinds[kind],
        np.array(means),
        np.array(covariances),
        common_sd,
        np.zeros((len(names), 3)) if friction is None else friction[:, 0],
        None if friction is None else friction[:, 1],
        np.array(variances),
        source,
    )


def arrange_gains(gains: Gains, joint_names: tuple[str, ...], path: Path | str) -> Gains:
    """Returns the gains in the order of an arm's joints.

    Raises:
        BadValueError: A joint of the arm has no gain.
    """
    missing = [name for name in joint_names if name not in gains.joint_names]
    if missing:
        raise BadValueError(path, "joints", f"are {', '.join(gains.joint_names)}, must name {', '.join(missing)}")
    order = [gains.joint_names.index(name) for name in joint_names]
    return replace(
        gains,
        joint_names=joint_names,
        mean=gains.mean[order],
        covariance=gains.covariance[order],
        friction=gains.friction[order],
        friction_sd=None if gains.friction_sd is None else gains.friction_sd[order],
        least_variance=gains.least_variance[order],
    )
