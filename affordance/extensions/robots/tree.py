"""Represents a robot as a Drake plant without geometry, with joints that can be frozen."""

import difflib
import logging
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from logging.handlers import BufferingHandler
from pathlib import Path

import numpy as np
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BodyIndex, Frame, FrameIndex, Joint, PrismaticJoint, RevoluteJoint, RigidBody
from pydrake.systems.framework import Context

from affordance.exceptions import BadValueError, ModelFileError
from affordance.extensions.robots.description import Description, JointNotes


@dataclass(frozen=True)
class RobotTree:
    """Bodies and joints of a robot as parsed by Drake, with Drake's warnings as remarks."""

    description: Description
    plant: MultibodyPlant  # finalized plant without geometry; every root is welded to the world
    remarks: tuple[str, ...] = ()
    roots: tuple[str, ...] = ()  # names of the links without a parent joint

    @cached_property
    def joints_above(self) -> dict[BodyIndex, Joint]:
        """Joint that carries each body."""
        joints = map(self.plant.get_joint, self.plant.GetJointIndices())
        return {joint.child_body().index(): joint for joint in joints}

    def climb(self, body: RigidBody) -> Iterator[Joint]:
        """Yields the joints from a body up to the world."""
        while body.index() in self.joints_above:
            joint = self.joints_above[body.index()]
            yield joint
            body = joint.parent_body()

    def list_above(self, body: RigidBody) -> list[RigidBody]:
        """Lists the bodies above a body, up to the world."""
        return [joint.parent_body() for joint in self.climb(body)]

    @cached_property
    def joints_below(self) -> dict[BodyIndex, list[Joint]]:
        """Joints that each body carries."""
        below: dict[BodyIndex, list[Joint]] = {}
        for joint in self.joints_above.values():
            below.setdefault(joint.parent_body().index(), []).append(joint)
        return below

    def list_children(self, body: RigidBody) -> list[Joint]:
        """Lists the joints that a body carries."""
        return self.joints_below.get(body.index(), [])

    def key(self, element: Joint | RigidBody) -> str:
        """Returns the key of a joint or link in the description: its name, in an SDF after the model's name."""
        model = f"{self.plant.GetModelInstanceName(element.model_instance())}::"
        return f"{model if self.description.kind == 'sdf' else ''}{element.name()}"

    def note(self, joint: Joint) -> JointNotes:
        """Returns the data of a joint that Drake does not keep."""
        return self.description.joints.get(self.key(joint)) or JointNotes()

    def list_frames(self) -> list[Frame]:
        """Lists the links and frames that the file names, without Drake's auxiliary frames."""
        frames = [self.plant.get_frame(FrameIndex(i)) for i in range(1, self.plant.num_frames())]
        known = self.description.frames
        return [
            frame
            for frame in frames
            if frame.is_body_frame()
            or self.description.kind == "directives"
            or frame.scoped_name().get_full() in known
        ]

    def find_frame(self, name: str, option: str) -> Frame | None:
        """Finds a link or frame by its name, or by ``model::name`` if several models use the name.

        Args:
            name: Name of the link or frame.
            option: Option that gave the name, for messages.

        Returns: The frame; None if there is none.

        Raises:
            BadValueError: The name is ambiguous or that of a joint; the message suggests names.
        """
        named = {frame.scoped_name().get_full(): frame for frame in self.list_frames()}
        found = {full: frame for full, frame in named.items() if name in (frame.name(), full)}
        if len(found) == 1:
            return next(iter(found.values()))
        path = self.description.path
        if found:
            raise BadValueError(
                option, "", f"is {name!r}, which {path} has more than once: {', '.join(sorted(found))}"
            )
        joints = {joint.name(): joint for joint in self.joints_above.values()}
        if name in joints:
            child = joints[name].child_body().name()
            raise BadValueError(option, "", f"is {name!r}, which is a joint of {path}, must be a link: {child}?")
        return None


def build_tree(description: Description) -> RobotTree:
    """Parses a robot without geometry, so that no meshes or packages are needed.

    Raises:
        BadValueError: Links and joints do not form a tree.
        ModelFileError: Drake cannot parse the text, or no joint moves.
    """
    plant = MultibodyPlant(0.0)
    with _collect_remarks() as collector:
        try:
            kind = "xml" if description.kind == "mjcf" else description.kind
            Parser(plant).AddModelsFromString(description.text, kind)
            roots = _list_roots(description.path, plant)
            for root in roots:
                plant.WeldFrames(plant.world_frame(), root.body_frame())
            plant.Finalize()
        except (RuntimeError, ValueError, SystemExit) as error:  # Drake may exit if its own checks fail
            raise ModelFileError(description.path, f"cannot be parsed: {_clean(str(error))}") from error
    if not any(plant.get_joint(index).num_velocities() for index in plant.GetJointIndices()):
        raise ModelFileError(description.path, "has no joint that moves")
    remarks = dict.fromkeys(_clean(record.getMessage()) for record in collector.buffer)
    return RobotTree(description, plant, tuple(remarks), tuple(root.name() for root in roots))


def _list_roots(path: Path, plant: MultibodyPlant) -> list[RigidBody]:
    """Lists the links without a parent joint. Two parent joints, or a loop, raise a BadValueError."""
    above: dict[BodyIndex, Joint] = {}
    for joint in map(plant.get_joint, plant.GetJointIndices()):
        child = joint.child_body()
        if child.index() in above:
            problem = f"is the child of two joints, {above[child.index()].name()} and {joint.name()}, must be of one"
            raise BadValueError(path, f"link {child.name()}", problem)
        above[child.index()] = joint
    for index in above:
        seen, body = {index}, index
        while body in above:
            body = above[body].parent_body().index()
            if body in seen:
                problem = "is part of a loop of joints, must be connected to the robot's root"
                raise BadValueError(path, f"link {plant.get_body(body).name()}", problem)
            seen.add(body)
    bodies = map(plant.get_body, map(BodyIndex, range(1, plant.num_bodies())))
    return [body for body in bodies if body.index() not in above]


def _clean(text: str) -> str:
    """Removes source locations and internal names from Drake's messages."""
    text = " ".join(text.split())
    failed = re.search(r"Failure at \S+ in (.*)$", text)
    text = failed[1] if failed else text
    return re.sub(
        r"(<(literal|data)-string>)?(\.(urdf|sdf|xml))?(:\d+)?: (?=error|warning)|(error|warning): ", "", text
    )


@contextmanager
def _collect_remarks() -> Iterator[BufferingHandler]:
    """Collects Drake's warnings instead of printing them."""
    log, collector = logging.getLogger("drake"), BufferingHandler(sys.maxsize)
    handlers, propagate = log.handlers, log.propagate
    log.handlers, log.propagate = [collector], False
    try:
        yield collector
    finally:
        log.handlers, log.propagate = handlers, propagate


def check_posture(tree: RobotTree, posture: Mapping[str, float]) -> None:
    """Checks that joint positions can be set and are within limits. The first fault raises a BadValueError."""
    joints = {joint.name(): joint for joint in tree.joints_above.values() if joint.num_velocities()}
    for name, value in posture.items():
        joint = joints.get(name)
        if joint is None:
            near = difflib.get_close_matches(name, joints, n=3, cutoff=0.4) or sorted(joints)[:8]
            problem = f"names {name!r}, which is not a moving joint of {tree.description.path}"
            raise BadValueError("--posture", "", f"{problem}; nearest: {', '.join(near)}")
        mimic = tree.note(joint).mimic
        if mimic is not None:
            raise BadValueError("--posture", "", f"names {name!r}, which follows {mimic.leader}")
        if not isinstance(joint, RevoluteJoint | PrismaticJoint):
            raise BadValueError("--posture", "", f"names {name!r}, which is of type {joint.type_name()}")
        low, high = joint.position_lower_limits()[0], joint.position_upper_limits()[0]
        if not low <= value <= high:
            raise BadValueError("--posture", "", f"sets {name} to {value:g}, must be from {low:g} to {high:g}")


def freeze(
    tree: RobotTree, moving: Sequence[Joint], posture: Mapping[str, float]
) -> tuple[Context, dict[str, float]]:
    """Builds a context with moving joints at zero and all other joints frozen.

    A joint is frozen at its position in ``posture``, otherwise at its default, clipped to its limits. A joint that
    follows another joint is frozen at the position that its leader's position determines.

    Returns: The context, and the positions of the frozen joints by name, [rad] or [m].
    """
    context = tree.plant.CreateDefaultContext()
    own = {joint.index() for joint in moving}
    movable = [joint for joint in tree.joints_above.values() if isinstance(joint, RevoluteJoint | PrismaticJoint)]
    by_name = {(joint.model_instance(), joint.name()): joint for joint in movable}
    values: dict[str, float] = {}

    def find(joint: RevoluteJoint | PrismaticJoint, followed: tuple[str, ...] = ()) -> float:
        mimic, name = tree.note(joint).mimic, joint.name()
        low, high = joint.position_lower_limits()[0], joint.position_upper_limits()[0]
        leader = None if mimic is None else by_name.get((joint.model_instance(), mimic.leader))
        if mimic is not None and not mimic.leader:
            return mimic.offset
        if mimic is not None and leader is not None and name not in followed:
            return mimic.compute(find(leader, (*followed, name)))
        default = 0.0 if joint.index() in own else joint.default_positions()[0]
        return float(posture.get(name, np.clip(default, low, high)))

    for joint in movable:
        value = 0.0
        if joint.index() not in own:
            value = values[joint.name()] = find(joint)
        if isinstance(joint, RevoluteJoint):
            joint.set_angle(context, value)
        else:
            joint.set_translation(context, value)
    return context, values
