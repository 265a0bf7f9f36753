"""Comparison of two files of one robot, joint by joint; their formats may differ.

Link frames differ between formats, so only frame-independent numbers are compared.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.tree import RevoluteJoint

from affordance.arrays import Array
from affordance.exceptions import BadValueError
from affordance.extensions.robots.arm_checks import find_limits
from affordance.extensions.robots.chain import choose_tip, find_chain, group_bodies
from affordance.extensions.robots.reader import read_robot
from affordance.extensions.robots.reduced_arm import sum_inertia
from affordance.extensions.robots.tree import build_tree, freeze

# Relative difference above which numbers count as different: files round to three or four digits.
TOLERANCE = 0.01
# Absolute differences below these are rounding: a tenth of a millimetre, of a gram, of a degree.
_ROUNDING = {"mass": 1e-4, "offset": 1e-4, "moment": 1e-7, "length": 1e-4, "range": 2e-3}
# Sine of the angle between axes below which they count as parallel.
_PARALLEL = 1e-6
NAMES = {
    "mass": "mass (kg)",
    "offset": "centre from axis (m)",
    "moment": "largest moment (kg m^2)",
    "length": "to the next axis (m)",
    "range": "range (rad)",
    "velocity": "velocity (rad/s)",
    "effort": "effort (N m)",
}


@dataclass(frozen=True)
class JointData:
    """Frame-independent data of a joint and of everything that moves with its link."""

    joint: str
    mass: float  # [kg]
    offset: float  # distance of the centre of mass from the joint's axis, [m]
    moment: float  # largest principal moment of inertia about the centre of mass, [kg m^2]
    length: float  # distance of the next joint's axis, or of the tip, from the axis, [m]
    range: float  # width of the position limits, [rad]; infinite without limits
    velocity: float  # velocity limit, [rad/s]; infinite without one
    effort: float  # torque limit, [N m]; infinite without one


class Compared(NamedTuple):
    """Corresponding joints of two chains, and the names of the data in which they differ."""

    one: JointData
    other: JointData
    differing: tuple[str, ...]


def read_joints(path: Path, tip: str = "") -> list[JointData]:
    """Reads the data of an arm's joints up to a tip, by default the longest limb's.

    Limits may be missing, and impossible inertias are replaced by the nearest possible ones. Errors are those of
    ``read_arm``.
    """
    tree = build_tree(read_robot(path))
    chain = find_chain(tree, tip or choose_tip(tree)[0], None)
    context, _ = freeze(tree, chain.joints, {})
    found = []
    groups = group_bodies(tree, chain)
    ends = [*(joint.frame_on_parent() for joint in chain.joints[1:]), chain.tip]
    next_axes = [*(joint.revolute_axis() for joint in chain.joints[1:]), None]
    none: dict[str, dict[str, float]] = {"effort": {}, "velocity": {}, "rotor_inertia": {}}
    for joint, bodies, end, next_axis in zip(chain.joints, groups, ends, next_axes, strict=True):
        frame = joint.frame_on_child()
        inertial = sum_inertia(tree, context, frame, bodies)
        axis, p_com = joint.revolute_axis(), np.array(inertial.place)
        limits = find_limits(joint, tree.note(joint), none, has_damping=True)
        found.append(
            JointData(
                joint.name(),
                inertial.mass,
                float(np.linalg.norm(np.cross(axis, p_com))),
                _compute_largest_moment(inertial.moments) if inertial.mass else 0.0,
                _compute_distance(axis, end.CalcPose(context, frame), next_axis),
                _compute_range(joint),
                limits.velocity,
                np.inf if limits.effort is None else limits.effort,
            )
        )
    return found


def compare(one: Sequence[JointData], other: Sequence[JointData]) -> list[Compared]:
    """Compares the joints of two arms in order; different numbers of joints raise a BadValueError."""
    if len(one) != len(other):
        names = (", ".join(each.joint for each in joints) for joints in (one, other))
        problem = f"have {len(one)} joints ({next(names)}) and {len(other)} ({next(names)}), must have equally many"
        raise BadValueError("the arms", "", f"{problem}; --tip and --other-tip name their ends")
    return [Compared(a, b, tuple(_list_differing(a, b))) for a, b in zip(one, other, strict=True)]


def _list_differing(one: JointData, other: JointData) -> list[str]:
    names = []
    for name in NAMES:
        a, b = float(getattr(one, name)), float(getattr(other, name))
        if a != b and not (
            np.isfinite([a, b]).all() and abs(a - b) <= max(TOLERANCE * max(abs(a), abs(b)), _ROUNDING.get(name, 0.0))
        ):
            names.append(name)
    return names


def _compute_distance(axis: Array, X_ME: RigidTransform, next_axis: Array | None) -> float:
    """Computes the distance, [m], from an axis through the origin to another axis, or to a point if that is None."""
    p = X_ME.translation()
    from_point = float(np.linalg.norm(np.cross(axis, p)))
    if next_axis is None:
        return from_point
    across = np.cross(axis, X_ME.rotation().matrix() @ next_axis)
    length = float(np.linalg.norm(across))
    return from_point if length < _PARALLEL else abs(float(across @ p)) / length


def _compute_range(joint: RevoluteJoint) -> float:
    return float(joint.position_upper_limits()[0] - joint.position_lower_limits()[0])


def _compute_largest_moment(moments: Sequence[float]) -> float:
    a, b, c, d, e, f = moments
    matrix: Array = np.array([[a, d, e], [d, b, f], [e, f, c]])
    return float(np.linalg.eigvalsh(matrix)[-1])
