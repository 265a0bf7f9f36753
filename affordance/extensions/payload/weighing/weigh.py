"""Mass and centre of mass of what a force-torque sensor bears, from poses at rest, without a robot's file.

    f = m g_S + offset + error,    t = c x m g_S + offset + error,    g_S gravity in the sensor's axes

Forces and torques are two linear regressions, each with an unknown error variance. A gain of each axis multiplies
what the load causes. Axes of the wrench, its sign and the sense of the orientations are chosen by evidence.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.extensions.payload.settings import PRIORS, SignalKind
from affordance.extensions.payload.weighing.bayes import Regression, regress
from affordance.extensions.payload.weighing.poses import WRENCH, Poses

GRAVITY = 9.81  # [m/s^2]; it varies by a quarter of a per cent over the Earth
_NUM_SAMPLES = 20_000
# Prior SDs of weight and offsets, relative to the wrench, and of the centre of mass along each axis, [m].
_BROAD, _REACH = 10.0, 0.5
_LEAST_SIZE = 1e-3  # least size of a wrench and of a mass in these priors, [N], [N m], [kg]
# Relative SDs of the axes' gains, equally probable, about that of a wrist sensor in the settings, and of a factor
# common to all axes.
_SPREADS = PRIORS[SignalKind.WRENCH].scale_own_sd * np.array([0.1, 0.3, 1.0, 2.0, 4.0])
_COMMON_SD = PRIORS[SignalKind.WRENCH].scale_common_sd
# Odds above which one reading of the table is taken, and odds of a doubt.
_TAKEN, _DOUBTED = np.log(20.0), np.log(100.0)
_INVERTED = -np.log(10.0)  # prior odds that the orientations are those of the base in the sensor
# SDs of what is doubted: errors of the axes, relative to the load, and share of the last pose that is left.
_TURNED_SD, _LAG_SD = 0.3, 0.3
_ANGLE = 3.0  # angle between sensor and orientations from which axes count as turned, [deg]
_UNEXPLAINED, _LENGTH_SPREAD = 0.5, 0.03
_SEEN_MASS, _SEEN_CENTRE = 0.4, 0.1  # largest SDs of what is seen: relative, as for identify, and [m]
_HELPS = 0.95  # a next pose that leaves a larger share of all SDs is not worth it


class Interpretation(NamedTuple):
    """Way to read the table.

    Attributes:
        axes: Axes of the wrench, "sensor" or "base".
        is_inverted: True if the orientations are those of the base in the sensor's axes.
    """

    axes: str = "sensor"
    is_inverted: bool = False

    def apply(self, poses: Poses, down_B: Array) -> tuple[Array, Array]:
        """Returns gravity, (N, 3), [m/s^2], and the wrench, (N, 6), both in the sensor's axes."""
        if poses.R_BS is None:
            return GRAVITY * poses.down_S, poses.wrench
        R_BS = poses.R_BS.transpose(0, 2, 1) if self.is_inverted else poses.R_BS
        wrench = poses.wrench.reshape(-1, 2, 3)
        turned = wrench @ R_BS if self.axes == "base" else wrench
        return GRAVITY * (down_B @ R_BS), turned.reshape(-1, 6)


class _Model(NamedTuple):
    """Columns of force and torque on mass or first moment, the axes' gains, and offsets; gains follow a first fit."""

    columns: tuple[Array, Array]  # shapes (3 N, 7) and (3 N, 9)
    signals: tuple[Array, Array]  # (3 N,) each
    sds: tuple[Array, Array]  # prior SDs for each spread of the gains, shapes (S, 7) and (S, 9)
    loads: tuple[Array, Array]  # what the load causes according to the first fit, (N, 3) each

    def fit(self, extra: Sequence[tuple[Array, Array]] = ((), ())) -> tuple[Regression, Regression]:
        """Fits forces and torques, each with further columns and their SDs."""
        fits = []
        for X, y, sds, more in zip(self.columns, self.signals, self.sds, extra, strict=True):
            if more:
                X, sds = np.column_stack([X, more[0]]), np.column_stack([sds, np.tile(more[1], (len(sds), 1))])
            fits.append(regress(X, y, sds))
        return fits[0], fits[1]


def _build_model(gravity: Array, wrench: Array) -> _Model:
    offset = np.tile(np.eye(3), (len(gravity), 1))
    basis = np.stack([np.cross(axis, gravity) for axis in np.eye(3)], axis=2).reshape(-1, 3)
    signals = wrench[:, :3].ravel(), wrench[:, 3:].ravel()
    columns, sds, loads = [], [], []
    mass = 0.0
    for kind, (of_load, y) in enumerate(zip((gravity.reshape(-1, 1), basis), signals, strict=True)):
        first = np.column_stack([of_load, offset])
        broad = _BROAD * max(float(np.sqrt((y**2).mean())), _LEAST_SIZE)
        few = np.full(of_load.shape[1], _REACH * max(abs(mass), _LEAST_SIZE) if kind else broad / GRAVITY)
        offset_sds = np.full(3, broad)
        solution = regress(first, y, np.concatenate([few, offset_sds])[None]).mean
        load = of_load @ solution[: of_load.shape[1]]
        mass = solution[0]
        gains = load[:, None] * offset
        columns.append(np.column_stack([of_load, gains, offset]))
        sds.append(np.array([[*few, *[spread] * 3, *offset_sds] for spread in _SPREADS]))
        loads.append(load.reshape(-1, 3))
    return _Model((columns[0], columns[1]), signals, (sds[0], sds[1]), (loads[0], loads[1]))


def _sum_evidence(fits: tuple[Regression, Regression]) -> float:
    return fits[0].log_evidence + fits[1].log_evidence


class Weighing(NamedTuple):
    """What a sensor bears: samples of the posterior, how the table was read, and reasons for doubt."""

    source: str
    poses: Poses
    axes: str  # axes of the wrench, "sensor" or "base"
    force_on: str  # what the wrench acts on, "robot" or "object"
    samples: Array  # mass, centre of mass, offsets of force and torque, shape (S, 10), [kg], [m], [N], [N m]
    residual: Array  # root mean square residual of each axis, shape (6,), [N], [N m]
    doubts: tuple[str, ...]
    notes: tuple[str, ...]
    next_pose: str  # sentence about the pose to measure next

    @property
    def mass(self) -> float:
        """Posterior mean of the mass, [kg]."""
        return float(self.samples[:, 0].mean())

    @property
    def parameters(self) -> Array:
        """Samples of mass and first moment m, m c, shape (S, 4), [kg], [kg m]."""
        return np.column_stack([self.samples[:, 0], self.samples[:, :1] * self.samples[:, 1:4]])

    @property
    def centre_of_mass(self) -> Array:
        """Centre of mass in the sensor's axes: the mean first moment over the mean mass, shape (3,), [m]."""
        mean = self.parameters.mean(axis=0)
        return np.asarray(mean[1:] / mean[0])

    @property
    def sd(self) -> Array:
        """SDs of mass, centre and offsets, shape (10,)."""
        return np.asarray(self.samples.std(axis=0))

    @property
    def intervals(self) -> Array:
        """Ends low50, high50, low90, high90 of the intervals of mass, centre and offsets, shape (10, 4)."""
        return np.quantile(self.samples, [0.25, 0.75, 0.05, 0.95], axis=0).T

    @property
    def shows_mass(self) -> bool:
        """True if the poses show the mass."""
        return bool(self.sd[0] <= _SEEN_MASS * self.mass)

    @property
    def is_trusted(self) -> bool:
        """True if no reason for doubt was found."""
        return not self.doubts

    @property
    def unseen(self) -> tuple[str, ...]:
        """What the poses do not show, a sentence each."""
        axes = ", ".join(name for name, sd in zip("xyz", self.sd[1:4], strict=True) if sd > _SEEN_CENTRE)
        return (f"the centre of mass along {axes}: tilt the sensor about two axes",) if axes else ()

    def to_dict(self) -> dict[str, Any]:
        """Returns all results for JSON, in SI units, with the keys of ``identify``."""
        ends, parameters = self.intervals, self.parameters
        return {
            "trusted": self.is_trusted,
            "doubts": list(self.doubts),
            "source": self.source,
            "analysis": "force-torque sensor at rest",
            "frame": "sensor",
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
            "mass_seen": self.shows_mass,
            "not_seen": list(self.unseen),
            "next_pose": self.next_pose,
        }


def weigh(
    poses: Poses, *, axes: str = "", force_on: str = "", down_B: Sequence[float] = (0.0, 0.0, -1.0), seed: int = 0
) -> Weighing:
    """Weighs what a force-torque sensor bears in poses at rest.

    Args:
        poses: Poses from ``read_poses``.
        axes: Axes of the wrench, "sensor" or "base"; empty to find them by evidence.
        force_on: What the wrench acts on, "robot" or "object"; empty to find it by evidence.
        down_B: Direction in which gravity pulls, in the base, shape (3,).
        seed: Seed of the samples.
    """
    down = np.array(down_B) / np.linalg.norm(down_B)
    ways = [Interpretation()]
    if poses.R_BS is not None:
        ways = [Interpretation(each, inverse) for each in ("sensor", "base") for inverse in (False, True)]
    models = [_build_model(*way.apply(poses, down)) for way in ways]
    fits = [model.fit() for model in models]
    odds = np.array([_sum_evidence(fit) + way.is_inverted * _INVERTED for way, fit in zip(ways, fits, strict=True)])
    allowed = np.array([not axes or way.axes == axes for way in ways])
    best = int(np.argmax(np.where(allowed, odds, -np.inf)))
    way, model, (forces, torques) = ways[best], models[best], fits[best]
    doubts, notes = _compare_ways(ways, odds, best, axes)
    sign = 1.0 if forces.mean[0] >= 0.0 else -1.0
    found = "robot" if sign > 0.0 else "object"
    if force_on and force_on != found:
        doubts.append(
            f"the wrench acts on the {found}, not on the {force_on}: it, or gravity, has another sign than was said"
        )
    doubts += _find_doubts(poses, model, (forces, torques))
    rng = np.random.default_rng(seed)
    of_force, of_torque = forces.draw(_NUM_SAMPLES, rng), torques.draw(_NUM_SAMPLES, rng)
    possible = sign * of_force[:, 0] > 0.0
    of_force, of_torque = of_force[possible], of_torque[possible]
    common = 1.0 + _COMMON_SD * rng.standard_normal(len(of_force))
    centres = of_torque[:, :3] / of_force[:, :1]
    offsets = of_force[:, 4:], of_torque[:, 6:]
    samples = np.column_stack([sign * of_force[:, 0] * common, centres, *offsets])
    residual = _compute_residual(model, (forces, torques))
    if poses.num_left_out:
        notes.append(f"{poses.num_left_out} rows between the poses are left out")
    return Weighing(
        poses.source,
        poses,
        way.axes,
        found,
        samples,
        np.sqrt((residual**2).mean(axis=0)),
        tuple(doubts),
        tuple(notes),
        _advise(model, forces, torques),
    )


def _compute_residual(model: _Model, fits: tuple[Regression, Regression]) -> Array:
    """Computes what mass, first moment, gains and offsets leave, shape (N, 6)."""
    parts = [(y - X @ fit.mean).reshape(-1, 3) for X, y, fit in zip(model.columns, model.signals, fits, strict=True)]
    return np.concatenate(parts, axis=1)


def _compare_ways(ways: Sequence[Interpretation], odds: Array, best: int, axes: str) -> tuple[list[str], list[str]]:
    """Compares ways to read the table; returns doubts and notes."""
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
    elif axes and behind < -_DOUBTED:
        doubts.append(f"the wrench seems to be in the {other}'s axes, not in the {axes}'s")
    inverted = max(odd for each, odd in zip(ways, odds, strict=True) if each.is_inverted != way.is_inverted)
    if way.axes == "base":
        notes.append("the wrench is in the base's axes; it was turned into the sensor's")
    if way.is_inverted:
        said = "the orientations are those of the base in the sensor's axes"
        (notes if odds[best] - inverted > _DOUBTED else doubts).append(f"{said}, not of the sensor in the base's")
    return doubts, notes


def _find_doubts(poses: Poses, model: _Model, fits: tuple[Regression, Regression]) -> list[str]:
    """Finds what explains the wrenches much better than a load, gains and offsets; a sentence each."""
    doubts, plain, num = [], _sum_evidence(fits), len(poses.counts)
    for name, y, left in zip(
        ("forces", "torques"), model.signals, np.split(_compute_residual(model, fits), 2, axis=1), strict=True
    ):
        whole = y.reshape(-1, 3) - y.reshape(-1, 3).mean(axis=0)
        share = float((left**2).sum() / max((whole**2).sum(), np.finfo(float).tiny))
        if share > _UNEXPLAINED and name == "forces":
            doubts.append(f"the load leaves {100.0 * share:.0f} % of the {name} unexplained")
    sizes = [max(float(np.sqrt((load**2).mean())), 1e-6) for load in model.loads]
    offset = np.tile(np.eye(3), (num, 1)).reshape(num, 3, 3)

    def vary(course: Array) -> float:
        """Returns the log evidence of offsets that follow a course, (N,)."""
        column = (course[:, None, None] * offset).reshape(-1, 3)
        return _sum_evidence(model.fit([(column, np.full(3, size)) for size in sizes]))

    of_steps = np.array([vary((np.arange(num) >= k).astype(float)) for k in range(2, num - 1)])
    drift = vary(np.linspace(-1.0, 1.0, num)) - plain
    step = float(np.log(np.exp(of_steps - of_steps.max()).mean()) + of_steps.max()) - plain
    before = [np.concatenate([load[:1], load[:-1]]) - load for load in model.loads]
    lag = _sum_evidence(model.fit([(each.reshape(-1, 1), np.array([_LAG_SD])) for each in before])) - plain
    turned_columns = [
        np.einsum("nl,kj->njkl", load, np.eye(3)).reshape(-1, 9) for load in model.loads
    ]  # errors of nine entries of a matrix that should be the identity
    turned_fits = model.fit([(each, np.full(9, _TURNED_SD)) for each in turned_columns])
    turned = _sum_evidence(turned_fits) - plain
    found = max((step, "step"), (drift, "drift"), (lag, "lag"), (turned, "turned"))
    if found[0] > _DOUBTED:
        if found[1] == "step":
            k = int(of_steps.argmax()) + 2
            doubts.append(f"the offsets change before pose {k + 1}: the sensor was zeroed or struck half-way")
        elif found[1] == "drift":
            doubts.append("the offsets drift from pose to pose: let the sensor warm up, or zero it more often")
        elif found[1] == "lag":
            doubts.append("the wrench still shows the pose before: it is filtered; wait longer in each pose")
        else:
            M = np.eye(3) + turned_fits[0].mean[7:].reshape(3, 3)
            doubts.append(_describe_axes(M, turned_fits[0].mean[0], turned_fits[0].mean[1:4]))
    if len(poses.lengths) and np.ptp(poses.lengths) > _LENGTH_SPREAD * poses.lengths.mean():
        share = 100.0 * np.ptp(poses.lengths) / poses.lengths.mean()
        doubts.append(f"the accelerometer's readings differ in length by {share:.0f} %: it has offsets, or it moved")
    return doubts


def _describe_axes(M: Array, mass: float, gains: Array) -> str:
    """Describes forces that are M, (3, 3), times those of the load: turned or stretched."""
    U, _, Vt = np.linalg.svd(M)
    turn = U @ Vt
    angle = float(np.degrees(np.arccos(np.clip(0.5 * (np.trace(turn) - 1.0), -1.0, 1.0))))
    if angle > _ANGLE:
        axis = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
        shown = ", ".join(f"{value:.1f}" for value in axis / max(np.linalg.norm(axis), 1e-9))
        return f"the sensor's axes are turned by about {angle:.0f} deg about ({shown}) against the orientations"
    masses = np.abs(mass * (np.diagonal(M) + gains))
    shown = ", ".join(f"{name} {each:.3g}" for name, each in zip("xyz", masses, strict=True))
    return f"the axes disagree about the mass: {shown} kg"


def _advise(model: _Model, forces: Regression, torques: Regression) -> str:
    """Finds the direction of gravity that would narrow mass and centre of mass most, in words."""
    cells = [int(np.argmax(fit.weights)) for fit in (forces, torques)]
    mass, moment = forces.mean[0], torques.mean[:3]
    tried = [np.array(each, dtype=float) for each in np.ndindex(3, 3, 3) if each != (1, 1, 1)]

    def predict(down: Array | None) -> tuple[float, float]:
        """Predicts the SDs of mass, [kg], and centre of mass along its least known axis, [m], with one more pose."""
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
    (mass_before, centre_before), (mass_after, centre_after) = before, after[best]
    return (
        f"with gravity along {along} of the sensor: SD of the mass {1e3 * mass_before:.2g} to {1e3 * mass_after:.2g} "
        f"g, of the centre of mass {1e3 * centre_before:.2g} to {1e3 * centre_after:.2g} mm"
    )
