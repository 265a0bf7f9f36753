"""A robot as Drake parses it: a scratch plant, fixed to the world, whose joints can be asked for by name."""

import difflib
import logging
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BodyIndex, Frame, FrameIndex, Joint, RigidBody

from affordance.exceptions import BadValueError, ModelFileError
from affordance.robots.description import Description

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

    def find_frame(self, name: str, option: str) -> Frame:
        """Finds a link or frame by its name, or by ``model::name`` where models share it.

        Args:
            name: Its name.
            option: The command-line option that names it.

        Raises:
            BadValueError: There is none of that name, or more than one; the message names those that fit.
        """
        frames = [self.plant.get_frame(FrameIndex(i)) for i in range(1, self.plant.num_frames())]
        named = [(frame, frame.name(), frame.scoped_name().get_full()) for frame in frames if frame.name()]
        found = {full: frame for frame, short, full in named if name in (short, full)}
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
        links = [self.plant.get_body(BodyIndex(i)).name() for i in range(1, self.plant.num_bodies())]
        near = difflib.get_close_matches(name, [*links, *(short for _, short, _ in named)], n=3, cutoff=0.4)
        hint = f"nearest: {', '.join(dict.fromkeys(near))}" if near else f"it has {', '.join(links[:8])}"
        raise BadValueError(option, "", f"is {name!r}, which {path} has not; {hint}")


def build_tree(description: Description) -> RobotTree:
    """Parses a robot without geometry: no mesh is opened, and packages do not matter.

    Raises:
        ModelFileError: Drake cannot parse it.
    """
    plant = MultibodyPlant(0.0)
    with _collect_remarks() as remarks:
        try:
            Parser(plant).AddModelsFromString(description.text, _DRAKE_NAMES[description.kind])
            joints = [plant.get_joint(index) for index in plant.GetJointIndices()]
            hanging = {joint.child_body().index() for joint in joints}
            for index in map(BodyIndex, range(1, plant.num_bodies())):
                if index not in hanging:
                    plant.WeldFrames(plant.world_frame(), plant.get_body(index).body_frame())
            plant.Finalize()
        except (RuntimeError, ValueError) as error:
            problem = " ".join(str(error).split()).replace("<literal-string>", "")
            raise ModelFileError(description.path, f"cannot be parsed: {problem}") from error
    joints_above = {}
    for joint in map(plant.get_joint, plant.GetJointIndices()):
        joints_above[joint.child_body().index()] = joint
    if not any(joint.num_velocities() for joint in joints_above.values()):
        raise ModelFileError(description.path, "has no joint that moves")
    return RobotTree(description, plant, joints_above, tuple(dict.fromkeys(remarks)))


class _Collector(logging.Handler):
    """Keeps what is logged."""

    def __init__(self, remarks: list[str]) -> None:
        super().__init__()
        self._remarks = remarks

    def emit(self, record: logging.LogRecord) -> None:
        """Keeps a message."""
        self._remarks.append(" ".join(record.getMessage().split()).replace("<literal-string>.urdf:", "line "))


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
