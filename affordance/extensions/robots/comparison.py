"""Compares two files of one robot, joint by joint. Their formats may differ.

Link frames and base poses differ between formats. The arms are therefore aligned from base to tip, with all joints at
zero: each axis is moved onto the corresponding axis, and then the bodies on its link are compared. Each difference is
thus reported once, at its joint, and not again at every joint after it. As an independent check, mass matrices and
gravity torques are compared at random postures.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from pydrake.common.eigen_geometry import AngleAxis
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.tree import JacobianWrtVariable
from pydrake.systems.framework import Context

from affordance.arrays import Array, build_symmetric
from affordance.exceptions import BadValueError
from affordance.extensions.robots.arm_checks import find_limits, gather
from affordance.extensions.robots.chain import Chain, choose_tip, find_chain, group_bodies
from affordance.extensions.robots.description import EARTH, build_pose
from affordance.extensions.robots.reader import read_robot
from affordance.extensions.robots.reduced_arm import sum_inertia, turn_up
from affordance.extensions.robots.tree import RobotTree, build_tree, freeze
from affordance.plant.arm import ARM
from affordance.plant.load import load_arm

# Relative difference above which numbers differ, because files round to three or four digits.
TOLERANCE = 0.01
# Absolute differences that count as rounding: mass, [kg], length, [m], angle, [rad], moment of inertia, [kg m^2].
_GRAM, _LENGTH, _ANGLE, _MOMENT = 1e-4, 1e-4, 2e-3, 1e-7
_ROUNDING = {"mass": _GRAM, "lower": _ANGLE, "upper": _ANGLE, "rotor": _MOMENT}
# Number of postures at which mass matrices and gravity torques are compared.
POSTURES = 20
# Sines of angles, and lengths [m], from which a link's rotation about its axis can be determined.
_SHOWS, _SHOWS_LENGTH = 0.1, 1e-3
# Numbers in the files; the other names are distances between the aligned arms.
STATED = ("mass", "lower", "upper", "velocity", "effort", "rotor")
NAMES = {
    "axis": "axis (rad)",
    "place": "place of axis (m)",
    "zero": "zero (rad)",
    "mass": "mass (kg)",
    "centre": "centre of mass (m)",
    "moments": "moments (kg m^2)",
    "tip": "tip (m)",
    "lower": "lower limit (rad)",
    "upper": "upper limit (rad)",
    "velocity": "velocity (rad/s)",
    "effort": "effort (N m)",
    "rotor": "rotor inertia (kg m^2)",
}


@dataclass(frozen=True)
class JointData:
    """Joint with everything that moves with its link, in the world frame with all joints at zero."""

    joint: str
    place: Array  # a point on the axis, (3,), [m]
    axis: Array  # direction of the axis, (3,)
    mass: float  # [kg]
    centre: Array  # centre of mass, (3,), [m]
    moments: Array  # inertia about the centre of mass, (3, 3), [kg m^2]
    lower: float  # position limit, [rad]; infinite without one
    upper: float  # position limit, [rad]; infinite without one
    velocity: float | None  # velocity limit, [rad/s]; infinite without one; None if the format has none
    effort: float  # torque limit, [N m]; infinite without one
    rotor: float | None  # reflected rotor inertia, [kg m^2]; None if not given in a format that seldom does


class ArmData(NamedTuple):
    """Arm from a file, in the world frame with all joints at zero."""

    joints: tuple[JointData, ...]
    tip: str
    faults: tuple[str, ...]  # impossible inertias, for which the nearest possible inertias are used
    p_tip: Array  # position of the tip, (3,), [m]
    up: Array  # unit vector opposite to gravity, (3,)
    X_WB: RigidTransform  # pose of the base
    # Computes the mass matrix without rotors, (N, N), and gravity torques, (N,), at joint angles, (N,), [rad].
    compute: Callable[[Array], tuple[Array, Array]]


class Compared(NamedTuple):
    """Pair of corresponding joints."""

    one: JointData
    other: JointData
    apart: dict[str, float]  # distances between the arms, by name
    differing: tuple[str, ...]  # names of the quantities that differ


class Comparison(NamedTuple):
    """Differences between two arms."""

    joints: tuple[Compared, ...]
    # Largest difference of an entry at random postures, relative to the diagonal entries of its row and column.
    mass_matrix: float
    gravity: float  # largest difference of a gravity torque there, relative to the joint's largest
    remarks: tuple[str, ...]  # quantities that were not compared, and harmless differences

    @property
    def differs(self) -> bool:
        """True if a joint differs, or the mass matrices or gravity torques differ."""
        return any(each.differing for each in self.joints) or max(self.mass_matrix, self.gravity) > TOLERANCE


def read_joints(path: Path, tip: str = "") -> ArmData:
    """Reads an arm up to a tip, by default the end of the longest limb, or from a folder of ``import-arm``.

    Limits may be missing, and impossible inertias are replaced with the nearest possible inertias. Errors are as in
    ``read_arm``.
    """
    tree = build_tree(read_robot(path / "arm.sdf" if path.is_dir() else path))
    chain = find_chain(tree, tip or choose_tip(tree)[0], None)
    context, _ = freeze(tree, chain.joints, {})
    kind = tree.description.kind
    none: dict[str, dict[str, float]] = {"effort": {}, "velocity": {}, "rotor_inertia": {}}
    found = []
    for joint, bodies in zip(chain.joints, group_bodies(tree, chain), strict=True):
        frame = joint.frame_on_child()
        X_WL, inertial = frame.CalcPoseInWorld(context), sum_inertia(tree, context, frame, bodies)
        R_WL = X_WL.rotation().matrix()
        R = R_WL @ build_pose(inertial.place, inertial.rpy)[:3, :3]
        limits = find_limits(joint, tree.note(joint), none, has_damping=True)
        found.append(
            JointData(
                joint.name(),
                X_WL.translation(),
                R_WL @ joint.revolute_axis(),
                inertial.mass,
                X_WL.translation() + R_WL @ np.array(inertial.place),
                R @ build_symmetric(inertial.moments) @ R.T,
                float(joint.position_lower_limits()[0]),
                float(joint.position_upper_limits()[0]),
                None if kind == "mjcf" else limits.velocity,
                np.inf if limits.effort is None else limits.effort,
                limits.rotor_inertia if kind == "mjcf" or limits.rotor_inertia else None,
            )
        )
    X_WB, p_tip = chain.base.body_frame().CalcPoseInWorld(context), chain.tip.CalcPoseInWorld(context).translation()
    up = _find_up(path) if path.is_dir() else turn_up(tree.description.up or "z").rotation().matrix()[2]
    names = [tree.key(body) for group in group_bodies(tree, chain) for body in group]
    mended = [(name, tree.description.mended[name][0]) for name in names if name in tree.description.mended]
    faults = gather(("link", name, fault, "") for name, fault in mended)
    said = tuple(f"{path.name}: {where} {fault}; the nearest possible one is compared" for where, fault, _ in faults)
    return ArmData(tuple(found), str(chain.tip.name()), said, p_tip, up, X_WB, _make_model(tree, chain, context, up))


def _find_up(folder: Path) -> Array:
    """Computes the upward direction in the base frame of an imported arm, (3,)."""
    arm = load_arm(folder / ARM.name)
    base = arm.plant.GetJointByName(arm.joint_names[0]).parent_body().body_frame()
    up: Array = base.CalcPoseInWorld(arm.plant.CreateDefaultContext()).rotation().matrix()[2]
    return up


def _make_model(tree: RobotTree, chain: Chain, context: Context, up: Array) -> Callable[[Array], tuple[Array, Array]]:
    """Returns a function that computes a chain's mass matrix and gravity torques."""
    plant, world, wrt = tree.plant, tree.plant.world_frame(), JacobianWrtVariable.kV
    rows, mass = [joint.velocity_start() for joint in chain.joints], plant.CalcTotalMass(context)

    def compute(q: Array) -> tuple[Array, Array]:
        for joint, angle in zip(chain.joints, q, strict=True):
            joint.set_angle(context, angle)
        J = plant.CalcJacobianCenterOfMassTranslationalVelocity(context, wrt, world, world)
        return plant.CalcMassMatrix(context)[np.ix_(rows, rows)], EARTH[2] * mass * up @ J[:, rows]

    return compute


def compare(one: ArmData, other: ArmData, *, same_tip: bool = False) -> Comparison:
    """Compares the joints of two arms in order.

    Tips are compared if ``same_tip`` is set, or if they have the same name.

    Raises:
        BadValueError: The arms have different numbers of joints.
    """
    counts = [len(arm.joints) for arm in (one, other)]
    if counts[0] != counts[1]:
        names = [", ".join(each.joint for each in arm.joints) for arm in (one, other)]
        problem = f"have {counts[0]} joints ({names[0]}) and {counts[1]} ({names[1]}), must have equally many"
        raise BadValueError("the arms", "", f"{problem}; --tip and --other-tip name their ends")
    same_tip = same_tip or one.tip == other.tip
    laid = _lay_over(one, other, same_tip=same_tip)
    joints = tuple(
        Compared(a, b, apart, (*differing, *_list_stated(a, b)))
        for a, b, apart, differing in zip(one.joints, other.joints, laid.apart, laid.differing, strict=True)
    )
    return Comparison(joints, *_compare_models(one, other), tuple(_list_remarks(one, other, laid, same_tip=same_tip)))


def _list_stated(one: JointData, other: JointData) -> Iterator[str]:
    """Lists the names of numbers that differ, except numbers that a file's format cannot contain."""
    for name in STATED:
        a, b = getattr(one, name), getattr(other, name)
        if a is None or b is None or a == b:
            continue
        size = one.upper - one.lower if name in ("lower", "upper") else max(abs(a), abs(b))
        if not (
            math.isfinite(a) and math.isfinite(b) and abs(a - b) <= max(TOLERANCE * size, _ROUNDING.get(name, 0.0))
        ):
            yield name


def _list_remarks(one: ArmData, other: ArmData, laid: "_Laid", *, same_tip: bool) -> Iterator[str]:
    yield from dict.fromkeys((*one.faults, *other.faults))
    pairs = list(zip(one.joints, other.joints, strict=True))
    if any((a.velocity is None) != (b.velocity is None) for a, b in pairs):
        yield "velocity limits are not compared: an MJCF has none"
    if any((a.rotor is None) != (b.rotor is None) and (a.rotor or b.rotor) for a, b in pairs):
        yield "rotor inertias are not compared: only one file states them"
    X = other.X_WB.inverse() @ laid.X @ one.X_WB
    angle, length = AngleAxis(X.rotation().matrix()).angle(), float(np.linalg.norm(X.translation()))
    if angle > _ANGLE or length > _LENGTH:
        moved = f"by {1000.0 * length:.3g} mm and {math.degrees(angle):.3g} degrees"
        yield f"their base frames differ, {moved}; the arms are compared from the first joint on"
    if not same_tip and laid.apart[-1]["tip"] > _LENGTH:
        length = 1000.0 * laid.apart[-1]["tip"]
        yield f"the tips {one.tip} and {other.tip}, {length:.3g} mm apart, are not compared (--tip, --other-tip)"


def _compare_models(one: ArmData, other: ArmData) -> tuple[float, float]:
    """Computes the largest relative differences of mass matrices and gravity torques at random postures.

    Differences that a shift of all masses by a tenth of a millimetre can cause count as rounding.
    """
    postures = np.random.default_rng(0).uniform(-np.pi, np.pi, (POSTURES, len(one.joints)))
    (M, g), (M_other, g_other) = (
        map(np.array, zip(*map(arm.compute, postures), strict=True)) for arm in (one, other)
    )
    masses = np.maximum(*(np.array([each.mass for each in arm.joints]) for arm in (one, other)))
    beyond = masses[::-1].cumsum()[::-1]
    root = np.sqrt(np.maximum(np.maximum(*(each.diagonal(axis1=1, axis2=2) for each in (M, M_other))), _MOMENT))
    rounding = _LENGTH * np.sqrt(np.minimum.outer(beyond, beyond)) * (root[:, :, None] + root[:, None, :])
    in_matrix = (np.abs(M - M_other) - rounding - _MOMENT) / (root[:, :, None] * root[:, None, :])
    largest = np.abs([*g, *g_other]).max(axis=0)
    in_torque = (np.abs(g - g_other) + EARTH[2] * _LENGTH * beyond) / np.maximum(largest, 1e-12)
    return max(float(in_matrix.max()), 0.0), max(float(in_torque.max()), 0.0)


class _Laid(NamedTuple):
    """Alignment of one arm with the other."""

    apart: list[dict[str, float]]  # distances by name, for each joint
    differing: list[list[str]]  # names of distances that exceed rounding, for each joint
    X: RigidTransform  # pose that maps the base of the first arm to the base of the second
    ways: list[list[float]]  # shifts or rotations that may reduce the number of differences, for each step

    @property
    def number(self) -> int:
        """Number of differences."""
        return sum(map(len, self.differing))


def _lay_over(one: ArmData, other: ArmData, *, same_tip: bool) -> _Laid:
    """Aligns the first arm with the second so that few numbers differ.

    The first arm may be shifted along its first axis and rotated about the vertical, because bases may differ. A
    different zero of a joint counts as one difference. If an axis differs, the link may have rotated with it or not.
    """
    steps, unturned = [0.0] * (1 + len(one.joints)), frozenset[int]()
    laid, before = _lay(one, other, steps, unturned, same_tip=same_tip), math.inf
    while laid.number < before:
        before = laid.number
        for k in range(len(steps)):
            tries = [([*steps[:k], steps[k] + way, *steps[k + 1 :]], unturned) for way in laid.ways[k]]
            for new_steps, new_unturned in [*tries, (steps, unturned ^ {k - 1})]:
                found = _lay(one, other, new_steps, new_unturned, same_tip=same_tip)
                if found.number < laid.number:
                    steps, unturned, laid = new_steps, new_unturned, found
                    break
    return laid


def _lay(one: ArmData, other: ArmData, steps: Sequence[float], unturned: frozenset[int], *, same_tip: bool) -> _Laid:
    """Aligns the first arm with the second for given steps.

    The first step is a shift along the first axis, [m]. The others are rotations about each axis, [rad]. The links
    ``unturned`` are not rotated from the first arm's axis to the second arm's axis.
    """
    R = _turn_least(one.up, other.up)
    first, of_other = one.joints[0], other.joints[0]
    flat = [_cross_out(other.up, axis) for axis in (R @ first.axis, of_other.axis)]
    is_upright = min(map(np.linalg.norm, flat)) < _ANGLE
    if not is_upright:
        R = _turn_about(other.up, _find_angle(other.up, *flat)) @ R
    # Along the first axis the base is at its position in the file, plus the first step.
    p = other.X_WB @ one.X_WB.inverse() @ first.place
    p = of_other.place + of_other.axis * (of_other.axis @ (p - of_other.place) + steps[0])
    t = p - R @ first.place
    spin = _turn_about(of_other.axis, steps[1]) if is_upright else np.eye(3)
    laid = _Laid([], [], RigidTransform(RotationMatrix(spin @ R), p - spin @ R @ first.place), [[]])
    if len(one.joints) > 1:
        laid.ways[0].extend(_list_shifts(R, t, one.joints[:2], other.joints[:2]))
    before = 0.0  # length of the link that carries the joint
    for k, (a, b) in enumerate(zip(one.joints, other.joints, strict=True)):
        axis, p = R @ a.axis, R @ a.place + t
        onto = b.axis if axis @ b.axis >= 0.0 else -b.axis
        on_axis = b.place + onto * (onto @ (p - b.place))
        R = _turn_about(onto, steps[1 + k]) @ (np.eye(3) if k in unturned else _turn_least(axis, onto)) @ R
        t = on_axis - R @ a.place
        is_last = k + 1 == len(one.joints)
        next_place = one.p_tip if is_last else one.joints[k + 1].place
        length = float(np.linalg.norm(next_place - a.place))
        size = max(length, float(np.linalg.norm(a.centre - a.place)))
        apart = {
            "axis": math.atan2(float(np.linalg.norm(np.cross(axis, b.axis))), float(axis @ b.axis)),
            "place": float(np.linalg.norm(on_axis - p)),
            "zero": 0.0 if k == 0 and is_upright else abs(math.remainder(steps[1 + k], 2.0 * math.pi)),
            "centre": float(np.linalg.norm(R @ a.centre + t - b.centre)) if a.mass and b.mass else 0.0,
            "moments": float(np.abs(np.linalg.eigvalsh(R @ a.moments @ R.T - b.moments)).max()),
        }
        largest = max(float(np.linalg.eigvalsh(each.moments)[-1]) for each in (a, b))
        bounds = {
            "axis": _ANGLE,
            "place": max(TOLERANCE * before, _LENGTH),
            "zero": _ANGLE,
            "centre": max(TOLERANCE * size, _LENGTH),
            "moments": max(TOLERANCE * largest, _MOMENT),
        }
        if is_last:
            apart["tip"] = float(np.linalg.norm(R @ one.p_tip + t - other.p_tip))
            bounds["tip"] = max(TOLERANCE * size, _LENGTH) if same_tip else math.inf
        laid.apart.append(apart)
        laid.differing.append([name for name, value in apart.items() if value > bounds[name]])
        pair = None if is_last else (one.joints[k + 1], other.joints[k + 1])
        laid.ways.append(list(_list_spins(R, t, onto, (a, b), pair)))
        before = length
    return laid


def _list_shifts(R: Array, t: Array, one: Sequence[JointData], other: Sequence[JointData]) -> Iterator[float]:
    """Lists shifts along the first axis that align the second axes or the centres of mass."""
    (a, a_next), (b, b_next) = one, other
    heights = []
    for first, second in ((a, a_next), (b, b_next)):
        # Point on the first axis nearest to the second axis: the points differ by a multiple of the common normal.
        across = np.cross(first.axis, second.axis)
        if np.linalg.norm(across) > _SHOWS:
            from_first = np.linalg.solve(
                np.column_stack([first.axis, -second.axis, across]), second.place - first.place
            )[0]
            heights.append(first.place + first.axis * from_first)
    if len(heights) == 2:
        yield float(b.axis @ (heights[1] - R @ heights[0] - t))
    if a.mass and b.mass:
        yield float(b.axis @ (b.centre - R @ a.centre - t))


def _list_spins(
    R: Array, t: Array, axis: Array, pair: tuple[JointData, JointData], following: tuple[JointData, JointData] | None
) -> Iterator[float]:
    """Lists rotations about an axis that align the next axes or the centres of mass."""
    a, b = pair
    arrows = []
    if following is not None:
        a_next, b_next = following
        arrows.append((R @ a_next.axis, b_next.axis, _SHOWS))
        arrows.append((-R @ a_next.axis, b_next.axis, _SHOWS))
        arrows.append((R @ (a_next.place - a.place), b_next.place - b.place, _SHOWS_LENGTH))
    if a.mass and b.mass:
        arrows.append((R @ (a.centre - a.place), b.centre - b.place, _SHOWS_LENGTH))
    for arrow, of_other, least in arrows:
        flat = [_cross_out(axis, each) for each in (arrow, of_other)]
        if min(map(np.linalg.norm, flat)) > least:
            yield _find_angle(axis, *flat)


def _cross_out(axis: Array, arrow: Array) -> Array:
    """Computes the component of a vector perpendicular to a unit axis."""
    flat: Array = arrow - axis * (axis @ arrow)
    return flat


def _find_angle(axis: Array, arrow: Array, onto: Array) -> float:
    """Computes the angle about an axis between two vectors perpendicular to it."""
    return math.atan2(float(axis @ np.cross(arrow, onto)), float(arrow @ onto))


def _turn_about(axis: Array, angle: float) -> Array:
    R: Array = RotationMatrix(AngleAxis(angle, axis / np.linalg.norm(axis))).matrix()
    return R


def _turn_least(arrow: Array, onto: Array) -> Array:
    """Computes the smallest rotation from one vector to another."""
    across = np.cross(arrow, onto)
    sine, cosine = float(np.linalg.norm(across)), float(arrow @ onto)
    if sine < 1e-12 and cosine > 0.0:
        return np.eye(3)
    if sine < 1e-12:  # any axis perpendicular to the vector
        across = np.cross(arrow, np.eye(3)[int(np.argmin(np.abs(arrow)))])
    return _turn_about(across, math.atan2(sine, cosine))
