"""The arm alone: what is fixed to each of its links becomes part of it.

Frames: L the frame of a link, which is that of the joint it hangs on, moving with it; B the base; H the hand, at the
tip, Hx out of it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix
from pydrake.multibody.tree import BodyIndex, Frame, RigidBody
from pydrake.systems.framework import Context

from affordance.exceptions import BadValueError
from affordance.robots.chain import Chain
from affordance.robots.description import Inertial, as_triple
from affordance.robots.limbs import FEWEST_JOINTS
from affordance.robots.tree import RobotTree


@dataclass(frozen=True)
class ReducedLink:
    """A link of the arm, and the joint it hangs on.

    Attributes:
        name: Of the link whose joint it is.
        joint: Of the joint.
        X_PL: Pose of L in the link before, B for the first, with the joint at zero.
        axis: Of the joint, in L, (3,).
        lower: [rad].
        upper: [rad].
        velocity: Largest rate, [rad/s].
        effort: Largest torque, [N m].
        damping: [N m s/rad].
        rotor_inertia: As felt at the joint, [kg m^2].
        inertial: Of all that moves with it, in L.
        bodies: Which links that is, the joint's own first, and where they are.
    """

    name: str
    joint: str
    X_PL: RigidTransform
    axis: tuple[float, float, float]
    lower: float
    upper: float
    velocity: float
    effort: float
    damping: float
    rotor_inertia: float
    inertial: Inertial
    bodies: tuple[tuple[str, RigidTransform], ...]


@dataclass(frozen=True)
class ReducedArm:
    """An arm fixed to the world.

    Attributes:
        base: Name of the link it is fixed by.
        X_WB: Where that is with the robot's root upright at the world's origin.
        links: From base to tip.
        X_LH: Pose of the hand in the last link.
        out_axis: Which axis of the tip's frame points out of the hand, such as ``-z``.
        base_bodies: What is fixed to the base, and where in B; all that carries it.
        frozen: Values of the joints that are frozen, [rad] or [m].
    """

    base: str
    X_WB: RigidTransform
    links: tuple[ReducedLink, ...]
    X_LH: RigidTransform
    out_axis: str
    base_bodies: tuple[tuple[str, RigidTransform], ...]
    frozen: Mapping[str, float]

    @property
    def joint_names(self) -> list[str]:
        """Names of its joints."""
        return [link.joint for link in self.links]

    @property
    def mass(self) -> float:
        """Of all that moves, [kg]."""
        return sum(link.inertial.mass for link in self.links)

    def changed(self, *, damping: bool, rotor_inertia: Mapping[str, float]) -> "ReducedArm":
        """The same arm with or without the file's damping, and with the rotors' inertia that is given by joint."""
        links = tuple(
            replace(
                link,
                damping=link.damping if damping else 0.0,
                rotor_inertia=rotor_inertia.get(link.joint, link.rotor_inertia),
            )
            for link in self.links
        )
        return replace(self, links=links)


def reduce_arm(
    tree: RobotTree,
    chain: Chain,
    context: Context,
    frozen: Mapping[str, float],
    *,
    out_axis: str | None = None,
    effort: Mapping[str, float] | None = None,
) -> ReducedArm:
    """Makes an arm of a chain.

    Args:
        tree: The robot.
        chain: Its arm.
        context: The plant's, chain at zero and all other joints where they are frozen.
        frozen: Where that is.
        out_axis: Which axis of the tip points out of the hand; None to find one.
        effort: Limits of torque by joint, in place of the file's, [N m]; None for none.

    Raises:
        BadValueError: A link of the arm has an impossible inertia, or a joint impossible limits, no limit of torque,
            or a rate of zero.
    """
    names = [joint.name() for joint in chain.joints]
    efforts = {joint.name(): (effort or {}).get(joint.name(), tree.note(joint).effort) for joint in chain.joints}
    _check_joints(tree, chain, efforts)
    slots = {joint.child_body().index(): k for k, joint in enumerate(chain.joints)}

    def find_slot(body: RigidBody) -> int:
        """The link a body belongs to; -1 for what carries the arm."""
        if body.index() in slots:
            return slots[body.index()]
        joint = tree.joints_above.get(body.index())
        return -1 if joint is None else find_slot(joint.parent_body())

    groups: dict[int, list[RigidBody]] = {}
    for index in map(BodyIndex, range(1, tree.plant.num_bodies())):
        body = tree.plant.get_body(index)
        groups.setdefault(find_slot(body), []).append(body)
    _check_inertias(tree, [body for slot, bodies in groups.items() if slot >= 0 for body in bodies])

    links: list[ReducedLink] = []
    before: Frame = chain.base.body_frame()
    for slot, joint in enumerate(chain.joints):
        frame = joint.frame_on_child()
        group = sorted(groups[slot], key=lambda body: body.index() != joint.child_body().index())
        limit = efforts[names[slot]]
        assert limit is not None  # it was checked
        links.append(
            ReducedLink(
                name=joint.child_body().name(),
                joint=names[slot],
                X_PL=_compose(tree, context, before, frame),
                axis=as_triple(joint.revolute_axis()),
                lower=float(joint.position_lower_limits()[0]),
                upper=float(joint.position_upper_limits()[0]),
                velocity=float(joint.velocity_upper_limits()[0]),
                effort=limit,
                damping=float(joint.default_damping()),
                rotor_inertia=tree.note(joint).rotor_inertia,
                inertial=_sum_inertia(tree, context, frame, group),
                bodies=tuple((tree.key(body), body.body_frame().CalcPose(context, frame)) for body in group),
            )
        )
        before = frame
    X_LT = _compose(tree, context, before, chain.tip)
    axis = out_axis or find_out_axis(X_LT, [link.X_PL for link in links])
    carried = [body for body in groups.get(-1, []) if _carries(tree, body, chain.base)]
    return ReducedArm(
        base=chain.base.name(),
        X_WB=chain.base.body_frame().CalcPoseInWorld(context),
        links=tuple(links),
        X_LH=_simplify(X_LT @ RigidTransform(_turn_to(axis))),
        out_axis=axis,
        base_bodies=tuple(
            (tree.key(body), body.body_frame().CalcPose(context, chain.base.body_frame())) for body in carried
        ),
        frozen=dict(frozen),
    )


def find_out_axis(X_LT: RigidTransform, X_PLs: list[RigidTransform]) -> str:
    """Finds the axis of the tip that points out of the hand.

    It is the signed axis nearest to the line to the tip from the last joint that lies more than 3 cm before it.
    """
    p_T = X_LT.translation()  # from the joint looked at to the tip, in the frame of that joint
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
    """Rotation R_TH of the hand in the tip's frame, Hx along a signed axis of it."""
    columns = {"x": (0, 1, 2), "y": (1, 2, 0), "z": (2, 0, 1)}[axis[-1]]
    R = np.eye(3)[:, columns]
    if axis.startswith("-"):
        R = R @ np.diag([-1.0, -1.0, 1.0])
    return RotationMatrix(R)


def turn_up(axis: str) -> RigidTransform:
    """Turns a robot whose root has a signed axis pointing up so that it stands."""
    # The rotation that puts x along the axis, turned over to put the axis along z.
    return RigidTransform(RotationMatrix.MakeYRotation(-0.5 * np.pi) @ _turn_to(axis).inverse())


def _check_inertias(tree: RobotTree, bodies: list[RigidBody]) -> None:
    for body in bodies:
        fault = tree.description.faults.get(tree.key(body))
        if fault:
            raise BadValueError(tree.description.path, f"link {body.name()}", f"{fault}; it is part of the arm")


def _check_joints(tree: RobotTree, chain: Chain, efforts: Mapping[str, float | None]) -> None:
    """Rejects joints that cannot move an arm, and says what may help.

    Raises:
        BadValueError: A joint has impossible limits, no limit of torque, or a rate of zero.
    """
    path = tree.description.path
    for joint in chain.joints:
        key, notes = f"joint {joint.name()}", tree.note(joint)
        if notes.fault:
            raise BadValueError(path, key, notes.fault)
        effort, velocity = efforts[joint.name()], float(joint.velocity_upper_limits()[0])
        if effort is None or not effort > 0.0:
            found = "has no limit of torque (effort), must have one of more than 0 N m"
            if effort is not None:
                found = f"has a limit of torque (effort) of {effort:g} N m, must be more than 0"
            raise BadValueError(path, key, f"{found}; {_suggest_efforts(chain, efforts)}")
        if not velocity > 0.0:
            raise BadValueError(path, key, f"has a velocity limit of {velocity:g} rad/s, must be more than 0")
        low, high = joint.position_lower_limits()[0], joint.position_upper_limits()[0]
        if not low < high:
            raise BadValueError(path, key, f"has position limits from {low:g} to {high:g} rad, must be a range")


def _suggest_efforts(chain: Chain, efforts: Mapping[str, float | None]) -> str:
    """Says how to do without limits of torque that a file does not have."""
    lacking = [k for k, joint in enumerate(chain.joints) if not (efforts[joint.name()] or 0.0) > 0.0]
    names = [f"{chain.joints[k].name()}=VALUE" for k in lacking]
    given = "VALUE" if len(lacking) == len(chain.joints) else " ".join(names)
    ways = f"--effort {given} gives limits (N m)"
    below = len(chain.joints) - len(lacking)
    if lacking == list(range(len(lacking))) and below >= FEWEST_JOINTS:
        ways += f", --base {chain.joints[lacking[-1]].child_body().name()} leaves out what lies below"
    return ways


def _carries(tree: RobotTree, body: RigidBody, base: RigidBody) -> bool:
    """Whether a body is the base, or above it: what is drawn as the arm's support."""
    above = {joint.parent_body().index() for joint in tree.climb(base)}
    return body.index() == base.index() or body.index() in above


def _compose(tree: RobotTree, context: Context, first: Frame, last: Frame) -> RigidTransform:
    """Pose of a frame in another further up, without a detour by the world, which would cost the last digits."""
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


def _sum_inertia(tree: RobotTree, context: Context, frame: Frame, bodies: list[RigidBody]) -> Inertial:
    """Inertia of bodies as if they were one, in a frame; a single body's numbers are the file's own."""
    if len(bodies) == 1 and frame.GetFixedPoseInBodyFrame().IsExactlyIdentity():
        written = tree.description.inertials.get(tree.key(bodies[0]))
        if written is not None and written.in_link:
            return written
    with_mass = [body.index() for body in bodies if body.default_mass() > 0.0]
    if not with_mass:
        return Inertial(0.0, (0.0,) * 3, (0.0,) * 3, (0.0,) * 6)
    total = tree.plant.CalcSpatialInertia(context, frame, with_mass)
    mass, p_com = total.get_mass(), total.get_com()
    moments = total.Shift(p_com).CalcRotationalInertia()
    Ixx, Iyy, Izz = (float(value) for value in moments.get_moments())
    Ixy, Ixz, Iyz = (float(value) for value in moments.get_products())
    return Inertial(float(mass), as_triple(p_com), (0.0,) * 3, (Ixx, Iyy, Izz, Ixy, Ixz, Iyz))


def _simplify(X: RigidTransform) -> RigidTransform:
    """The same pose, without what is rounding in its rotation where that is none at all."""
    return RigidTransform(X.translation()) if X.rotation().IsNearlyIdentity(1e-15) else X


def describe_pose(X: RigidTransform) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Place, [m], and roll, pitch and yaw, [rad], of a pose."""
    rpy = RollPitchYaw(X.rotation()).vector()
    return as_triple(X.translation()), as_triple(rpy)
