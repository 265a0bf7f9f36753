"""Extracts an arm from a robot, and merges bodies that are fixed to each other.

Frames: L is a link, at the moving frame of its joint; B is the base; H is the hand at the tip, with Hx pointing
outwards.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix
from pydrake.multibody.tree import BodyIndex, Frame, RigidBody
from pydrake.systems.framework import Context

from affordance.arguments import check_kind, check_number
from affordance.exceptions import BadValueError
from affordance.extensions.robots.arm_checks import check_arm, find_limits
from affordance.extensions.robots.chain import Chain, group_bodies
from affordance.extensions.robots.description import Inertial
from affordance.extensions.robots.tree import RobotTree


@dataclass(frozen=True)
class ImportOptions:
    """Options for importing an arm from a robot's file.

    Attributes:
        tip: Link or frame at the end of the arm, where it holds objects; empty for the end of the longest limb.
        base: Link that is fixed to the world; None to search for it.
        out_axis: Axis of the tip that points out of the hand; None to search for it.
        posture: Positions of joints, [rad] or [m]. Joints outside the arm are frozen there, and joints of the arm
            have these positions in the home posture.
        rotor_inertia: Reflected inertia of rotor and gears, [kg m^2], for each joint; the empty name applies to every
            joint.
        effort: Torque limits, [N m], that replace the file's, for each joint; the empty name applies to every joint.
        velocity: Velocity limits, [rad/s], that replace the file's, for each joint; the empty name applies to every
            joint.
        damping: True to keep the file's damping.
        height: Height of the base above the world's origin, [m]; None for the height in the file.
        up: Axis of the robot's root that points up, such as ``-y``; None to derive it from the file's gravity, or
            else z.
        roll: Angle about the hand's x from the tip's axes to the hand's axes, [rad], which depends on the mounting of
            the gripper. None to rotate the hand so that its z is up in the home posture.
        mend_inertia: True to replace all impossible inertias of the arm with the nearest possible inertias, even if
            they are not negligible.
        gravcomp: True to respect gravity compensation by the simulator (MuJoCo's gravcomp), which raises an error if
            a link of the arm has it; False to ignore it, so that the motors carry all links.
        xacro: Arguments of a xacro template, which is then run as a program; None refuses templates.
        packages: Folders of packages that a template uses, by name, in addition to nearby packages.

    Example:
        >>> from affordance import ImportOptions
        >>> options = ImportOptions("tool0", effort={"": 100.0})  # for every joint
        >>> options.tip
        'tool0'
    """

    tip: str = ""
    base: str | None = None
    out_axis: str | None = None
    posture: Mapping[str, float] = field(default_factory=dict)
    rotor_inertia: Mapping[str, float] = field(default_factory=dict)
    effort: Mapping[str, float] = field(default_factory=dict)
    velocity: Mapping[str, float] = field(default_factory=dict)
    damping: bool = True
    height: float | None = None
    up: str | None = None
    roll: float | None = None
    mend_inertia: bool = False
    gravcomp: bool = True
    xacro: Mapping[str, str] | None = None
    packages: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Checks the types of all values. Names are checked later, against the file.

        Raises:
            BadArgumentError: A value has the wrong type.
        """
        for name in ("tip", "base", "out_axis", "up"):
            if getattr(self, name) is not None or name == "tip":
                check_kind(name, getattr(self, name), str)
        check_kind("damping", self.damping, bool)
        for name in ("posture", "rotor_inertia", "effort"):
            for joint, value in check_kind(name, getattr(self, name), Mapping, "values by joint").items():
                check_number(f"{name}[{check_kind(f'joint of {name}', joint, str)!r}]", value)
        for name in ("height", "roll"):
            if getattr(self, name) is not None:
                check_number(name, getattr(self, name))


@dataclass(frozen=True)
class ReducedLink:
    """Link of the arm, with the joint that carries it."""

    name: str  # name of the joint's own link
    joint: str
    X_PL: RigidTransform  # pose of L in the previous link (B for the first) with the joint at zero
    axis: tuple[float, ...]  # axis of the joint, in L, (3,)
    lower: float  # position limit, [rad]
    upper: float  # position limit, [rad]
    velocity: float  # velocity limit, [rad/s]
    acceleration: float | None  # acceleration limit, [rad/s^2]; None if not given
    effort: float  # torque limit, [N m]
    damping: float  # [N m s/rad]
    rotor_inertia: float  # reflected inertia of rotor and gears at the joint, [kg m^2]
    inertial: Inertial  # inertia of everything that moves with the link, in L
    # Names of the merged links, the joint's own first, with their poses in L.
    bodies: tuple[tuple[str, RigidTransform], ...]


@dataclass(frozen=True)
class ReducedArm:
    """Arm fixed to the world."""

    tree: RobotTree
    chain: Chain  # joints of the arm in the robot
    options: ImportOptions
    X_WB: RigidTransform  # pose of the base with the robot's root upright at the world's origin
    links: tuple[ReducedLink, ...]  # links from base to tip
    X_LT: RigidTransform  # pose of the file's tip frame in the last link
    X_LH: RigidTransform  # pose of the hand in the last link: the tip's, rotated so that Hx points outwards
    out_axis: str  # axis of the tip frame that points out of the hand, such as ``-z``
    roll: float  # angle about Hx from the tip's axes to the hand's axes, [rad]
    # Names of the base and the links above it, with their poses in B.
    base_bodies: tuple[tuple[str, RigidTransform], ...]
    frozen: Mapping[str, float]  # positions of the frozen joints, [rad] or [m]
    mended: tuple[str, ...]  # names of links whose impossible inertia was replaced with the nearest possible inertia
    why_tip: str = ""  # reason for the choice of the tip, and the other ends; empty if the tip was given

    @property
    def up(self) -> str:
        """Axis of the robot's root that points up."""
        return self.options.up or self.tree.description.up or "z"

    @property
    def base(self) -> str:
        """Name of the link that is fixed to the world."""
        return str(self.chain.base.name())

    @property
    def joint_names(self) -> list[str]:
        """Names of the joints, from base to tip."""
        return [link.joint for link in self.links]

    def roll_hand(self, angle: float) -> "ReducedArm":
        """Returns the arm with its hand rotated further about its x, [rad]."""
        if angle == 0.0:
            return self
        X_LH = self.X_LH @ RigidTransform(RotationMatrix.MakeXRotation(angle))
        return replace(self, X_LH=X_LH, roll=self.roll + angle)

    @property
    def mass(self) -> float:
        """Mass of all moving links, [kg]."""
        return sum(link.inertial.mass for link in self.links)


def reduce_arm(
    tree: RobotTree, chain: Chain, context: Context, frozen: Mapping[str, float], options: ImportOptions
) -> ReducedArm:
    """Extracts a chain of a robot as an arm.

    In the context, the chain must be at zero and other joints must be frozen.

    Raises:
        BadValueError: Links have impossible inertias, joints have impossible limits, no torque limit or a velocity
            limit of zero (one error names all of them), or an option names a joint that the arm does not have.
    """
    names = [joint.name() for joint in chain.joints]
    by_kind = {"effort": options.effort, "velocity": options.velocity, "rotor_inertia": options.rotor_inertia}
    for kind, given in by_kind.items():
        option = f"--{kind.replace('_', '-')}"
        if unknown := [name for name in given if name and name not in names]:
            problem = f"names {unknown[0]!r}, which is not a joint of the arm, must be one of {', '.join(names)}"
            raise BadValueError(option, "", problem)
    limits = {
        joint.name(): find_limits(joint, tree.note(joint), by_kind, has_damping=options.damping)
        for joint in chain.joints
    }
    groups = group_bodies(tree, chain)
    mends = {"mends": options.mend_inertia, "carries": not options.gravcomp}
    mended = check_arm(tree, chain, context, groups, limits, **mends)
    links: list[ReducedLink] = []
    before: Frame = chain.base.body_frame()
    for joint, bodies in zip(chain.joints, groups, strict=True):
        name, child, frame = joint.name(), joint.child_body(), joint.frame_on_child()
        limit = limits[name]
        assert limit.effort is not None  # checked above
        group = [child, *(body for body in bodies if body.index() != child.index())]
        links.append(
            ReducedLink(
                name=child.name(),
                joint=name,
                X_PL=_compose(tree, context, before, frame),
                axis=tuple(joint.revolute_axis().tolist()),
                lower=float(joint.position_lower_limits()[0]),
                upper=float(joint.position_upper_limits()[0]),
                velocity=limit.velocity,
                acceleration=fastest if 0.0 < (fastest := joint.acceleration_upper_limits()[0]) < np.inf else None,
                effort=limit.effort,
                damping=limit.damping,
                rotor_inertia=limit.rotor_inertia,
                inertial=sum_inertia(tree, context, frame, group),
                bodies=_place(tree, context, frame, group),
            )
        )
        before = frame
    X_LT = _compose(tree, context, before, chain.tip)
    axis = options.out_axis or find_out_axis(X_LT, [link.X_PL for link in links])
    X_LH = X_LT @ RigidTransform(_turn_to(axis))
    if X_LH.rotation().IsNearlyIdentity(1e-15):  # up to rounding
        X_LH = RigidTransform(X_LH.translation())
    base_frame = chain.base.body_frame()
    support = sorted({int(body.index()) for body in (chain.base, *tree.list_above(chain.base))} - {0})
    X_WB, up = base_frame.CalcPoseInWorld(context), options.up or tree.description.up or "z"
    arm = ReducedArm(
        tree=tree,
        chain=chain,
        options=options,
        X_WB=X_WB if up == "z" else turn_up(up) @ X_WB,
        links=tuple(links),
        X_LT=X_LT,
        X_LH=X_LH,
        out_axis=axis,
        roll=0.0,
        base_bodies=_place(tree, context, base_frame, [tree.plant.get_body(BodyIndex(index)) for index in support]),
        frozen=frozen,
        mended=mended,
    )
    return arm.roll_hand(options.roll or 0.0)


def _place(
    tree: RobotTree, context: Context, frame: Frame, bodies: Sequence[RigidBody]
) -> tuple[tuple[str, RigidTransform], ...]:
    """Lists bodies by name with their poses in a frame."""
    return tuple((tree.key(body), body.body_frame().CalcPose(context, frame)) for body in bodies)


def find_out_axis(X_LT: RigidTransform, X_PLs: list[RigidTransform]) -> str:
    """Finds the axis of the tip that points out of the hand.

    It is the signed axis closest to the line from the last joint to the tip. Joints within 3 cm of the tip are
    ignored.
    """
    p_T = X_LT.translation()  # from the current joint to the tip, in that joint's frame
    R_JT = X_LT.rotation().matrix()
    for X_PL in reversed(X_PLs):
        if np.linalg.norm(p_T) > 0.03:
            break
        p_T = X_PL.rotation().matrix() @ p_T + X_PL.translation()
        R_JT = X_PL.rotation().matrix() @ R_JT
    along = R_JT.T @ p_T
    worst = int(np.argmax(np.abs(along)))
    return ("-" if along[worst] < 0.0 else "") + "xyz"[worst]


def _turn_to(axis: str) -> RotationMatrix:
    """Computes the rotation R_TH that aligns Hx with a signed axis of the tip."""
    columns = {"x": (0, 1, 2), "y": (1, 2, 0), "z": (2, 0, 1)}[axis[-1]]
    R = np.eye(3)[:, columns]
    if axis.startswith("-"):
        R = R @ np.diag([-1.0, -1.0, 1.0])
    return RotationMatrix(R)


def turn_up(axis: str) -> RigidTransform:
    """Computes the rotation that turns a signed axis of the root upwards."""
    # First undo the rotation that turns x to the axis, then turn x to z.
    return RigidTransform(RotationMatrix.MakeYRotation(-0.5 * np.pi) @ _turn_to(axis).inverse())


def _compose(tree: RobotTree, context: Context, first: Frame, last: Frame) -> RigidTransform:
    """Computes the pose of one frame in another, joint by joint, because a detour via the world would lose digits."""
    X = last.GetFixedPoseInBodyFrame()
    body = last.body()
    while body.index() != first.body().index():
        joint = tree.joints_above[body.index()]
        X_PF = joint.frame_on_parent().GetFixedPoseInBodyFrame()
        X_FM = joint.frame_on_child().CalcPose(context, joint.frame_on_parent())
        if np.allclose(X_FM.GetAsMatrix4(), np.eye(4), rtol=0.0, atol=1e-15):
            X_FM = RigidTransform()
        X_MB = joint.frame_on_child().GetFixedPoseInBodyFrame().inverse()
        X = X_PF @ X_FM @ X_MB @ X
        body = joint.parent_body()
    X_first: RigidTransform = first.GetFixedPoseInBodyFrame().inverse() @ X
    return X_first


def sum_inertia(tree: RobotTree, context: Context, frame: Frame, bodies: list[RigidBody]) -> Inertial:
    """Computes the combined inertia of bodies in a frame. A single body keeps the numbers in the file."""
    if len(bodies) == 1 and frame.GetFixedPoseInBodyFrame().IsExactlyIdentity():
        written = tree.description.inertials.get(tree.key(bodies[0]))
        if written is not None and written.in_link:
            return written
    with_mass = [body.index() for body in bodies if body.default_mass() > 0.0]
    if not with_mass:
        return Inertial(0.0, (0.0,) * 3, (0.0,) * 3, (0.0,) * 6)
    total = tree.plant.CalcSpatialInertia(context, frame, with_mass)
    p_com = total.get_com()
    moments = total.Shift(p_com).CalcRotationalInertia()
    values = (*moments.get_moments().tolist(), *moments.get_products().tolist())
    return Inertial(float(total.get_mass()), tuple(p_com.tolist()), (0.0,) * 3, values)


def describe_pose(X: RigidTransform) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Converts a pose to position, [m], and roll, pitch and yaw, [rad]."""
    return tuple(X.translation().tolist()), tuple(RollPitchYaw(X.rotation()).vector().tolist())
