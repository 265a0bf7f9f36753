"""Computes mass and centre of mass of a load on a force-torque sensor, from poses at rest.

No robot file is needed. Bayes factors decide which axes and sign the wrench has, and if the orientations are
inverted.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.extensions.payload.settings import PRIORS, SignalKind
from affordance.extensions.payload.weighing.bayes import Regression
from affordance.extensions.payload.weighing.poses import FEWEST, WRENCH, Poses
from affordance.extensions.payload.weighing.weigh_doubts import DOUBTED, check_torques, find_doubts
from affordance.extensions.payload.weighing.wrench_model import (
    GRAVITY,
    Interpretation,
    build_model,
    compute_residual,
    sum_evidence,
)

_NUM_SAMPLES = 20_000
_COMMON_SD = PRIORS[SignalKind.WRENCH].scale_common_sd  # relative SD of a factor common to all axes
_TAKEN = float(np.log(20.0))  # log odds above which the axes of the wrench are certain
_INVERTED = -float(np.log(10.0))  # prior log odds that the orientations are inverted, of the base in the sensor
_SEEN_MASS, _SEEN_CENTRE = 0.4, 0.1  # largest SDs of mass, relative as in identify, and centre, [m]
_LIGHT = 0.1  # mass below which little or nothing is held, [kg]
# Number of 25 simulated tables in which a sensor turned by 8 degrees was noticed: 5 with four poses, 25 with five.
_FIFTH = "; a fifth would also show whether the sensor is turned against the orientations, which four hardly do"
_HELPS = 0.95  # ratio of SDs above which another pose is not worth it


class Weighing(NamedTuple):
    """Load on a force-torque sensor: posterior, interpretation of the table, and doubts."""

    poses: Poses
    axes: str  # axes of the wrench, "sensor" or "base"
    force_on: str  # body on which the wrench acts, "robot" or "object"
    samples: Array  # mass, centre of mass, offsets of force and torque, shape (S, 10), [kg], [m], [N], [N m]
    residual: Array  # root mean square residual of each axis, shape (6,), [N], [N m]
    next_pose: str = ""  # sentence about the best next pose
    doubts: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def mass(self) -> float:
        """Posterior mean of the mass, [kg]."""
        return float(self.samples[:, 0].mean())

    @property
    def parameters(self) -> Array:
        """Posterior samples of mass and first moment m, m c, (S, 4), [kg], [kg m]."""
        return np.column_stack([self.samples[:, 0], self.samples[:, :1] * self.samples[:, 1:4]])

    @property
    def centre_of_mass(self) -> Array:
        """Centre of mass in the sensor's axes, mean first moment over mean mass, shape (3,), [m]."""
        mean = self.parameters.mean(axis=0)
        return np.asarray(mean[1:] / mean[0])

    @property
    def sd(self) -> Array:
        """SDs of mass, centre and offsets, shape (10,)."""
        return np.asarray(self.samples.std(axis=0))

    @property
    def intervals(self) -> Array:
        """Intervals of mass, centre and offsets, shape (10, 4): low50, high50, low90, high90."""
        return np.quantile(self.samples, [0.25, 0.75, 0.05, 0.95], axis=0).T

    @property
    def is_light(self) -> bool:
        """True if the mass is small, with a large relative uncertainty."""
        is_small = self.intervals[0, 3] < _LIGHT and self.residual[:3].max() < _LIGHT * GRAVITY
        return bool(is_small and self.sd[0] > _SEEN_MASS * self.mass)

    @property
    def shows_mass(self) -> bool:
        """True if the poses determine the mass, or show that little or nothing is held."""
        return self.is_light or bool(self.sd[0] <= _SEEN_MASS * self.mass)

    @property
    def is_trusted(self) -> bool:
        """True if no reason for doubt was found."""
        return not self.doubts

    @property
    def unseen(self) -> tuple[str, ...]:
        """Parameters that the poses do not determine, with the remedy, one sentence each."""
        axes = ", ".join(name for name, sd in zip("xyz", self.sd[1:4], strict=True) if sd > _SEEN_CENTRE)
        return (f"the centre of mass along {axes}: tilt the sensor about two axes",) if axes else ()

    def to_dict(self) -> dict[str, Any]:
        """Converts all results for JSON, in SI units, with the keys of ``identify``."""
        ends, parameters = self.intervals, self.parameters
        return {
            "trusted": self.is_trusted,
            "doubts": list(self.doubts),
            "source": self.poses.source,
            "analysis": "force-torque sensor at rest",
            "mass_kg": self.mass,
            "mass_sd_kg": self.sd[0],
            "mass_interval50": ends[0, :2],
            "mass_interval90": ends[0, 2:],
            "com_m": self.centre_of_mass,
            "com_sd_m": self.sd[1:4],
            "com_interval50": ends[1:4, :2],
            "com_interval90": ends[1:4, 2:],
            "parameters": parameters.mean(axis=0),
            "parameters_covariance": np.cov(parameters.T),
            "offset_order": list(WRENCH),
            "offset": self.samples[:, 4:].mean(axis=0),
            "offset_sd": self.sd[4:],
            "offset_interval50": ends[4:, :2],
            "offset_interval90": ends[4:, 2:],
            "residual_rms": self.residual,
            "poses": len(self.poses.counts),
            "orientation": self.poses.form,
            "wrench_axes": self.axes,
            "force_on": self.force_on,
            "found": list(self.notes),
            "rows_left_out": self.poses.num_left_out,
            "mass_seen": self.shows_mass,
            "not_seen": list(self.unseen),
            "next_pose": self.next_pose,
        }


def weigh(
    poses: Poses, *, axes: str = "", force_on: str = "", down_B: Sequence[float] = (0.0, 0.0, -1.0), seed: int = 0
) -> Weighing:
    """Estimates the load on a force-torque sensor from poses at rest.

    Args:
        poses: Poses from ``read_poses``.
        axes: Axes of the wrench, "sensor" or "base"; empty to choose them by their evidence.
        force_on: Body on which the wrench acts, "robot" or "object"; empty to choose it by its evidence.
        down_B: Direction of gravity in the base, shape (3,).
        seed: Seed of the samples.
    """
    down = np.array(down_B) / np.linalg.norm(down_B)
    ways = [Interpretation()]
    if poses.R_BS is not None:
        ways = [Interpretation(each, inverse) for each in ("sensor", "base") for inverse in (False, True)]
    models = [build_model(*way.apply(poses, down)) for way in ways]
    fits = [model.fit() for model in models]
    odds = np.array([sum_evidence(fit) + way.is_inverted * _INVERTED for way, fit in zip(ways, fits, strict=True)])
    allowed = np.array([not axes or way.axes == axes for way in ways])
    best = int(np.argmax(np.where(allowed, odds, -np.inf)))
    way, model, (forces, torques) = ways[best], models[best], fits[best]
    rng = np.random.default_rng(seed)
    of_force, of_torque = forces.draw(_NUM_SAMPLES, rng), torques.draw(_NUM_SAMPLES, rng)
    sign = 1.0 if forces.mean[0] >= 0.0 else -1.0
    possible = sign * of_force[:, 0] > 0.0
    of_force, of_torque = of_force[possible], of_torque[possible]
    common = 1.0 + _COMMON_SD * rng.standard_normal(len(of_force))
    centres = of_torque[:, :3] / of_force[:, :1]
    weighing = Weighing(
        poses,
        way.axes,
        "robot" if sign > 0.0 else "object",
        np.column_stack([sign * of_force[:, 0] * common, centres, of_force[:, 4:], of_torque[:, 6:]]),
        np.sqrt((compute_residual(model, (forces, torques)) ** 2).mean(axis=0)),
    )
    advice = _advise(weighing, forces, torques)
    weighing = weighing._replace(next_pose=advice + _FIFTH if len(poses.counts) == FEWEST else advice)
    if weighing.is_light:
        return weighing._replace(doubts=tuple(check_torques(model)))
    doubts, notes = _compare_ways(ways, odds, best, axes)
    if force_on and force_on != weighing.force_on:
        seems = f"the wrench seems to act on the {weighing.force_on}, not on the {force_on}"
        doubts.append(f"{seems}: it, or gravity, has the opposite sign")
    doubts += find_doubts(poses, model, (forces, torques))
    odds_mistaken = {
        said: max(sum_evidence(build_model(*each.apply(poses._replace(R_BS=R_BS), down)).fit()) for each in ways)
        for said, R_BS in poses.mistaken.items()
    }
    said = max(odds_mistaken, key=odds_mistaken.__getitem__, default="")
    if said and odds_mistaken[said] - sum_evidence((forces, torques)) > DOUBTED:
        doubts.append(said)
    return weighing._replace(doubts=tuple(doubts), notes=tuple(notes))


def _compare_ways(ways: Sequence[Interpretation], odds: Array, best: int, axes: str) -> tuple[list[str], list[str]]:
    """Compares interpretations of the table. Returns doubts and notes."""
    if len(ways) == 1:
        return [], []
    doubts, notes, way = [], [], ways[best]
    others = [odd for each, odd in zip(ways, odds, strict=True) if each.axes != way.axes]
    behind = float(odds[best] - max(others))
    other = "base" if way.axes == "sensor" else "sensor"
    if not axes and behind < _TAKEN:
        doubts.append(
            f"the poses do not show whether the wrench is in the axes of the sensor or the base (--axes {other})"
        )
    elif axes and behind < -DOUBTED:
        doubts.append(f"the wrench seems to be in the {other}'s axes, not in the {axes}'s")
    inverted = max(odd for each, odd in zip(ways, odds, strict=True) if each.is_inverted != way.is_inverted)
    if way.axes == "base":
        notes.append("the wrench is in the base's axes; it was turned into the sensor's")
    if way.is_inverted:
        said = "the orientations are those of the base in the sensor's axes"
        (notes if odds[best] - inverted > DOUBTED else doubts).append(f"{said}, not of the sensor in the base's")
    return doubts, notes


def _advise(weighing: Weighing, forces: Regression, torques: Regression) -> str:
    """Describes the direction of gravity that would reduce the SDs of mass and centre of mass most."""
    cells = [int(np.argmax(fit.weights)) for fit in (forces, torques)]
    mass, moment = forces.mean[0], torques.mean[:3]
    tried = [np.array(each, dtype=float) for each in np.ndindex(3, 3, 3) if each != (1, 1, 1)]

    def predict(down: Array | None) -> tuple[float, float]:
        """Predicts the SDs of mass, [kg], and centre of mass, [m], with one more pose.

        The SD of the centre is along its least certain axis.
        """
        covariances = []
        for kind, (fit, c) in enumerate(zip((forces, torques), cells, strict=True)):
            A = fit.precisions[c]
            if down is not None:
                basis = np.stack([np.cross(axis, down) for axis in np.eye(3)], axis=1) if kind else down[:, None]
                gains = np.diag(basis @ (moment if kind else np.array([mass])))
                X = np.column_stack([basis, gains, np.eye(3)])
                A = A + X.T @ X / fit.sigmas[c] ** 2
            covariances.append(np.linalg.inv(A))
        of_mass, of_moment = covariances[0][0, 0], covariances[1][:3, :3]
        centre = moment / mass
        of_centre = (of_moment + of_mass * np.outer(centre, centre)) / mass**2
        return float(np.hypot(np.sqrt(of_mass), _COMMON_SD * mass)), float(np.sqrt(np.diagonal(of_centre).max()))

    before = predict(None)
    downs = [(each - 1.0) / np.linalg.norm(each - 1.0) for each in tried]
    after = [predict(GRAVITY * down) for down in downs]
    scores = [sd[0] / before[0] * sd[1] / before[1] for sd in after]
    best = int(np.argmin(scores))
    if min(after[best][0] / before[0], after[best][1] / before[1]) > _HELPS:
        return "no single further pose narrows mass or centre of mass by more than 5 %"
    signs = [f"{'+' if value > 0 else '-'}{name}" for name, value in zip("xyz", downs[best], strict=True) if value]
    along = signs[0] if len(signs) == 1 else f"halfway between {' and '.join(signs)}"
    # The ratios of SDs come from typical grid cells; the SDs before average over all cells.
    mass_before, centre_before = 1e3 * weighing.sd[0], 1e3 * weighing.sd[1:4].max()
    mass_after, centre_after = (
        old * new / was for old, new, was in zip((mass_before, centre_before), after[best], before, strict=True)
    )
    return (
        f"with gravity along {along} of the sensor: SD of the mass {mass_before:.2g} to {mass_after:.2g} "
        f"g, of the centre of mass {centre_before:.2g} to {centre_after:.2g} mm"
    )
