"""Writes an arm as SDF, and its base pose and home posture as Drake model directives."""

import json
from collections.abc import Callable, Mapping, Sequence
from typing import Any
from xml.sax.saxutils import escape, quoteattr

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw

from affordance.arrays import Array
from affordance.extensions.robots.description import MOMENTS, SHAPES, Inertial, Visual
from affordance.extensions.robots.reduced_arm import ReducedArm, describe_pose
from affordance.files.template import render_template
from affordance.plant.load import HAND_FRAME

BASE = "base"
# Reserved names that no joint of a written arm may have.
RESERVED = (HAND_FRAME, "world")
# Drake requires an inertia for the base, although it has no effect because the base is fixed to the world.
_BASE_INERTIAL = Inertial(1.0, (0.0,) * 3, (0.0,) * 3, (0.01, 0.01, 0.01, 0.0, 0.0, 0.0))
_FILTERS: dict[str, Callable[..., str]] = {
    "text": escape,
    "quoted": quoteattr,
    "numbers": lambda values: " ".join(map(repr, values)),
}


def write_arm(arm: ReducedArm, visuals: Mapping[str, Sequence[Visual]], source: str) -> str:
    """Formats an arm as SDF that strict parsers accept.

    Args:
        arm: Arm to write.
        visuals: Shapes for each link name, or for ``base``.
        source: Robot file and tip, named in a comment.
    """
    parts: list[tuple[Any, ...]] = [(name_base(arm), "", None, _BASE_INERTIAL, (), visuals.get(BASE, ()))]
    for name, link in zip(name_links(arm), arm.links, strict=True):
        pose = sum(describe_pose(link.X_PL), ())
        parts.append((name, parts[-1][0], link, link.inertial, pose, visuals.get(name, ())))
    frames = {HAND_FRAME: sum(describe_pose(arm.X_LH), ())}
    tip = name_tip(arm)
    if tip not in (*RESERVED, *(part[0] for part in parts)) and "::" not in tip:
        frames[tip] = sum(describe_pose(arm.X_LT), ())  # lets recordings use it as the tip
    return render_template(
        "affordance.extensions.robots",
        "arm.sdf.j2",
        escapes=False,
        filters=_FILTERS,
        source=source,
        parts=parts,
        frames=frames,
        moments=MOMENTS,
        shapes=SHAPES,
    )


def write_directives(arm: ReducedArm, home: Array) -> str:
    """Formats model directives that load the arm with a fixed base in its home posture, [rad]."""
    pairs = zip(arm.joint_names, home.tolist(), strict=True)
    angles = "\n".join(f"        {json.dumps(name, ensure_ascii=False)}: [{angle!r}]" for name, angle in pairs)
    (x, y, z), rpy = describe_pose(arm.X_WB)
    turned = f"\n        rotation: !Rpy {{deg: {[float(angle) for angle in np.degrees(rpy)]}}}" if any(rpy) else ""
    return (
        "# Base pose and home posture of the imported arm; see report.txt in this folder.\n"
        "directives:\n"
        "  - add_model:\n"
        "      name: arm\n"
        "      file: package://affordance_models/arm.sdf\n"
        "      default_joint_positions: # radians\n"
        f"{angles}\n"
        "  - add_weld:\n"
        "      parent: world\n"
        f"      child: arm::{name_base(arm)}\n"
        "      X_PC:\n"
        f"        translation: [{x!r}, {y!r}, {z!r}]{turned}\n"
    )


def name_base(arm: ReducedArm) -> str:
    """Returns a name for the written base that differs from all joint names, because names in an SDF are unique."""
    return _find_unused(BASE, arm.joint_names)


def name_tip(arm: ReducedArm) -> str:
    """Returns the name of the written tip frame: the file's name, or a variant if it is already used."""
    return _find_unused(arm.options.tip, arm.joint_names)


def name_links(arm: ReducedArm) -> list[str]:
    """Returns the names of the written links: the file's names, changed only if they are already used."""
    taken = [*RESERVED, name_base(arm), *arm.joint_names]
    if not arm.X_LT.IsExactlyIdentity():
        taken.append(name_tip(arm))
    names: list[str] = []
    for link in arm.links:
        names.append(_find_unused(link.name.replace("::", "_"), (*taken, *names, "")))
    return names


def _find_unused(name: str, taken: Sequence[str]) -> str:
    while name in taken:
        name = f"{name}_link"
    return name


def turn_base(X_WB: RigidTransform, R_WH: Array, height: float | None) -> RigidTransform:
    """Rotates the base about the vertical so that the hand, with axes R_WH, points along Wx.

    ``height`` is the height above the world's origin, [m]; None keeps the height in the file.
    """
    yaw = float(np.arctan2(R_WH[1, 0], R_WH[0, 0]))
    R_WB = X_WB.rotation()
    if yaw:
        R_WB = RollPitchYaw(0.0, 0.0, -yaw).ToRotationMatrix() @ R_WB
    z = X_WB.translation()[2] if height is None else height
    return RigidTransform(R_WB, np.array([0.0, 0.0, float(z)]))
