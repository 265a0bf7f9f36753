"""A robot as Drake parses it: a scratch plant, fixed to the world, whose joints can be asked for by name."""

import logging
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BodyIndex, Frame, FrameIndex, Joint, RigidBody

from affordance.exceptions import BadValueError, ModelFileError
from affordance.robots.description import Description, JointNotes

_DRAKE_NAMES = {"urdf": "urdf", "sdf": "sdf", "mjcf": "xml"}


@dataclass(frozen=True)
class RobotTree:
    """A robot's bodies and joints.

    Attributes:
        description: What its file says.
        plant: The finalized plant, without geometry, every root welded to the world.
        joints_above: The joint that each body hangs on.
        remarks: What Drake had to say about the file.
    """

    description: Description
    plant: MultibodyPlant
    joints_above: dict[BodyIndex, Joint]
    remarks: tuple[str, ...]

    def climb(self, body: RigidBody) -> Iterator[Joint]:
        """Lists the joints from a body up to the world."""
        while body.index() in self.joints_above:
            joint = self.joints_above[body.index()]
            yield joint
            body = joint.parent_body()

    def key(self, element: Joint | RigidBody) -> str:
        """The name of a joint or link in its description: with that of its model, where a file can have several."""
        model = f"{self.plant.GetModelInstanceName(element.model_instance())}::"
        return f"{model if self.description.kind == 'sdf' else ''}{element.name()}"

    def note(self, joint: Joint) -> JointNotes:
        """Returns what the file says of a joint and Drake does not keep."""
        return self.description.joints.get(self.key(joint)) or JointNotes(joint.type_name())

    def list_frames(self) -> list[Frame]:
        """Lists links and frames that the file names, without those that Drake makes for itself."""
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
        """Finds a link or frame by its name, or by ``model::name`` where models share it; None if there is none.

        Args:
            name: Its name.
            option: The command-line option that names it.

        Raises:
            BadValueError: It is that of a joint, or there are several; the message names what fits.
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
    """Parses a robot without geometry: no mesh is opened, and packages do not matter.

    Raises:
        BadValueError: Its links and joints are no tree.
        ModelFileError: Drake cannot parse it.
    """
    plant = MultibodyPlant(0.0)
    with _collect_remarks() as remarks:
        try:
            Parser(plant).AddModelsFromString(description.text, _DRAKE_NAMES[description.kind])
            _check_is_tree(description.path, plant)
            joints = [plant.get_joint(index) for index in plant.GetJointIndices()]
            hanging = {joint.child_body().index() for joint in joints}
            for index in map(BodyIndex, range(1, plant.num_bodies())):
                if index not in hanging:
                    plant.WeldFrames(plant.world_frame(), plant.get_body(index).body_frame())
            plant.Finalize()
        except (RuntimeError, ValueError, SystemExit) as error:  # Drake ends the program where its own checks fail
            raise ModelFileError(description.path, f"cannot be parsed: {_clean(str(error))}") from error
    joints_above = list_joints_above(plant)
    if not any(joint.num_velocities() for joint in joints_above.values()):
        raise ModelFileError(description.path, "has no joint that moves")
    return RobotTree(description, plant, joints_above, tuple(dict.fromkeys(remarks)))


def _check_is_tree(path: Path, plant: MultibodyPlant) -> None:
    """Rejects a link with two parent joints, and loops of joints.

    Raises:
        BadValueError: There is one.
    """
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


def _clean(text: str) -> str:
    """What Drake says, without what is only about its own program or about a text that the user never saw."""
    text = " ".join(text.split())
    failed = re.search(r"Failure at \S+ in (.*)$", text)
    text = failed[1] if failed else text
    return re.sub(
        r"(<(literal|data)-string>)?(\.(urdf|sdf|xml))?(:\d+)?: (?=error|warning)|(error|warning): ", "", text
    )


def list_joints_above(plant: MultibodyPlant) -> dict[BodyIndex, Joint]:
    """Lists the joint that each body of a finalized plant hangs on."""
    joints = map(plant.get_joint, plant.GetJointIndices())
    return {joint.child_body().index(): joint for joint in joints}


class _Collector(logging.Handler):
    """Keeps what is logged."""

    def __init__(self, remarks: list[str]) -> None:
        super().__init__()
        self._remarks = remarks

    def emit(self, record: logging.LogRecord) -> None:
        """Keeps a message."""
        self._remarks.append(_clean(record.getMessage()))


@contextmanager
def _collect_remarks() -> Iterator[list[str]]:
    """Collects what Drake warns of, in place of printing it."""
    log = logging.getLogger("drake")
    remarks: list[str] = []
    handler, propagate = _Collector(remarks), log.propagate
    handlers = log.handlers[:]
    log.handlers, log.propagate = [handler], False
    try:
        yield remarks
    finally:
        log.handlers, log.propagate = handlers, propagate
