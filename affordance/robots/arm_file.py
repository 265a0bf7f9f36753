"""Writing an arm as an SDF, and its base pose and home posture as Drake model directives."""

from collections.abc import Iterable, Mapping, Sequence
from xml.sax.saxutils import escape, quoteattr

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw

from affordance.arrays import Array
from affordance.robots.description import MOMENTS, SHAPES, Inertial, Visual
from affordance.robots.reduced_arm import ReducedArm, ReducedLink, describe_pose

BASE = "base"
# The base is fixed to the world, so its inertia has no effect; Drake requires one nevertheless.
_BASE_INERTIAL = Inertial(1.0, (0.0,) * 3, (0.0,) * 3, (0.01, 0.01, 0.01, 0.0, 0.0, 0.0))


def write_arm(arm: ReducedArm, visuals: Mapping[str, Sequence[Visual]], source: str) -> str:
    """Writes an arm as an SDF that strict parsing accepts.

    Args:
        arm: Arm to write.
        visuals: Shapes by the name of a link of the written file: ``base`` or a link of the arm.
        source: Description of the arm's source, for the comment at the top.
    """
    names = name_links(arm)
    parts = [
        '<?xml version="1.0"?>',
        f"<!-- Made by affordance import-arm of {escape(source).replace('--', '- -')}. SI units. -->",
        '<sdf version="1.9" xmlns:drake="http://drake.mit.edu">',
        '  <model name="arm">',
        *_write_link(BASE, "", _BASE_INERTIAL, visuals.get(BASE, ())),
    ]
    before = BASE
    for name, link in zip(names, arm.links, strict=True):
        pose = f"<pose relative_to={quoteattr(before)}>{_show_pose(link.X_PL)}</pose>"
        parts += _write_link(name, pose, link.inertial, visuals.get(name, ()))
        parts += _write_joint(link, before, name)
        before = name
    parts += [
        f'    <frame name="hand_grip" attached_to={quoteattr(before)}>',
        f"      <pose>{_show_pose(arm.X_LH)}</pose>",
        "    </frame>",
        "  </model>",
        "</sdf>",
    ]
    return "\n".join(parts) + "\n"


def write_directives(home: Mapping[str, float], X_WB: RigidTransform) -> str:
    """Writes the directives that load the arm, hold it in a posture, and weld its base to the world.

    Args:
        home: Angle of every joint in the posture in which objects are held, [rad].
        X_WB: Pose of the base in the world.
    """
    angles = "\n".join(f"        {_quote(name)}: [{float(angle)!r}]" for name, angle in home.items())
    (x, y, z), rpy = describe_pose(X_WB)
    turned = f"\n        rotation: !Rpy {{deg: {[float(angle) for angle in np.degrees(rpy)]}}}" if any(rpy) else ""
    return (
        "# Where the imported arm stands and how it holds objects; see report.txt in this folder.\n"
        "directives:\n"
        "  - add_model:\n"
        "      name: arm\n"
        "      file: package://affordance_models/arm.sdf\n"
        "      default_joint_positions: # radians\n"
        f"{angles}\n"
        "  - add_weld:\n"
        "      parent: world\n"
        f"      child: arm::{BASE}\n"
        "      X_PC:\n"
        f"        translation: [{x!r}, {y!r}, {z!r}]{turned}\n"
    )


def name_links(arm: ReducedArm) -> list[str]:
    """Lists the names of the written links: those of the file, changed where they clash with base or hand frame."""
    names: list[str] = []
    for link in arm.links:
        name = link.name
        while name in (BASE, "hand_grip", "world", *names) or "::" in name or not name:
            name = f"{name.replace('::', '_')}_link"
        names.append(name)
    return names


def _write_link(name: str, pose: str, inertial: Inertial, visuals: Sequence[Visual]) -> list[str]:
    pose_of_mass = (*inertial.place, *inertial.rpy)
    moments = "".join(f"<{tag}>{value!r}</{tag}>" for tag, value in zip(MOMENTS, inertial.moments, strict=True))
    return [
        f"    <link name={quoteattr(name)}>",
        *([f"      {pose}"] if pose else []),
        "      <inertial>",
        *([f"        <pose>{_join(pose_of_mass)}</pose>"] if any(pose_of_mass) else []),
        f"        <mass>{inertial.mass!r}</mass>",
        f"        <inertia>{moments}</inertia>",
        "      </inertial>",
        *(line for k, visual in enumerate(visuals) for line in _write_visual(f"{name}_visual_{k}", visual)),
        "    </link>",
    ]


def _write_joint(link: ReducedLink, parent: str, child: str) -> list[str]:
    rotor = []
    if link.rotor_inertia:
        rotor = [
            f"      <drake:rotor_inertia>{link.rotor_inertia!r}</drake:rotor_inertia>",
            "      <drake:gear_ratio>1</drake:gear_ratio>",
        ]
    return [
        f'    <joint name={quoteattr(link.joint)} type="revolute">',
        f"      <parent>{escape(parent)}</parent>",
        f"      <child>{escape(child)}</child>",
        "      <axis>",
        f"        <xyz>{_join(link.axis)}</xyz>",
        *([f"        <dynamics><damping>{link.damping!r}</damping></dynamics>"] if link.damping else []),
        "        <limit>",
        f"          <lower>{link.lower!r}</lower><upper>{link.upper!r}</upper>",
        f"          <velocity>{link.velocity!r}</velocity><effort>{link.effort!r}</effort>",
        "        </limit>",
        "      </axis>",
        *rotor,
        "    </joint>",
    ]


def _write_visual(name: str, visual: Visual) -> list[str]:
    tags = SHAPES.get(visual.shape, ("uri", "scale"))
    if visual.shape == "mesh":
        values = [escape(visual.mesh), _join(visual.sizes)]
    else:
        values = [_join(visual.sizes)] if len(tags) == 1 else [repr(value) for value in visual.sizes]
    geometry = "".join(f"<{tag}>{value}</{tag}>" for tag, value in zip(tags, values, strict=True))
    return [
        f"      <visual name={quoteattr(name)}>",
        f"        <pose>{_join((*visual.place, *visual.rpy))}</pose>",
        f"        <geometry><{visual.shape}>{geometry}</{visual.shape}></geometry>",
        f"        <material><diffuse>{_join(visual.colour or (0.7, 0.84, 0.93, 1.0))}</diffuse></material>",
        "      </visual>",
    ]


def _show_pose(X: RigidTransform) -> str:
    place, rpy = describe_pose(X)
    return _join((*place, *rpy))


def _join(values: Iterable[float]) -> str:
    return " ".join(repr(value) for value in values)


def _quote(name: str) -> str:
    return '"' + name.replace("\\", "\\\\").replace('"', '\\"') + '"'


def turn_base(X_WB: RigidTransform, R_WH: Array, height: float | None) -> RigidTransform:
    """Computes the pose of the base once it is turned about the vertical so that the hand points along Wx.

    Args:
        X_WB: Pose of the base in the file.
        R_WH: Axes of the hand in its home posture there, (3, 3).
        height: Height of the base above the world's origin, [m]; None for the file's.
    """
    yaw = float(np.arctan2(R_WH[1, 0], R_WH[0, 0]))
    R_WB = X_WB.rotation()
    if yaw:
        R_WB = RollPitchYaw(0.0, 0.0, -yaw).ToRotationMatrix() @ R_WB
    z = X_WB.translation()[2] if height is None else height
    return RigidTransform(R_WB, np.array([0.0, 0.0, float(z)]))
