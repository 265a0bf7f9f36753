"""Reading the chain of an arm from a robot description, with Drake.

A URDF is read without its meshes and whatever else Drake need not know for kinematics and inertia; a directives file
(.dmd.yaml) is one of our own arms. Joints beside the chain from base to tip stay at their default positions.
"""

import difflib
import logging
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BodyIndex, Frame, Joint, RevoluteJoint, RigidBody
from pydrake.systems.framework import Context

from affordance.exceptions import ModelFileError
from affordance.identification.robot_chain import RobotChain
from affordance.objects.inertia import parameters_from_spatial_inertia
from affordance.plant.arm import HAND_FRAME, parse_arm
from affordance.plant.chain_kinematics import SerialChain

# What a URDF holds for other programs, or what Drake would open files for.
_STRIPPED = ("visual", "collision", "mimic", "transmission", "material", "safety_controller", "gazebo")


def load_robot(path: Path, tip: str = HAND_FRAME, base: str | None = None) -> RobotChain:
    """Reads an arm.

    Args:
        path: A URDF, SDF or MJCF file, or Drake model directives (.dmd.yaml).
        tip: Link (or frame) to which the payload is fixed.
        base: Link in which gravity and poses are expressed and above which all joints are still; None for as far as
            revolute joints go.

    Raises:
        ModelFileError: The file cannot be read, or lacks the tip or the base, or joints between them are not
            revolute, or a link of the chain has an impossible mass.
    """
    plant = MultibodyPlant(0.0)
    try:
        if path.name.endswith((".dmd.yaml", ".dmd.yml")):
            parse_arm(plant, path)
        else:
            _parse_description(plant, path)
    except OSError as error:
        raise ModelFileError(path, f"cannot be read: {error.strerror}") from error
    tip_frame = _find_frame(plant, path, tip)
    parents = {joint.child_body().index(): joint for joint in _list_joints(plant)}
    joints: list[Joint] = []
    body = tip_frame.body()
    while body.index() in parents and body.name() != base:
        joint = parents[body.index()]
        if joint.num_velocities():
            if not isinstance(joint, RevoluteJoint):
                if base is None and joints:
                    break
                problem = f"has {joint.name()} of type {joint.type_name()} between base and {tip}, must be revolute"
                raise ModelFileError(path, problem)
            joints.insert(0, joint)
        body = joint.parent_body()
    if base is not None and body.name() != base:
        raise ModelFileError(
            path, f"has no link {base} above {tip}{_suggest(base, _names_above(tip_frame, parents))}"
        )
    if not joints:
        raise ModelFileError(path, f"has no revolute joint above {tip}")
    plant.Finalize()
    context = plant.CreateDefaultContext()
    for joint in joints:
        plant.SetPositions(context, np.where(_slots(plant, joint), 0.0, plant.GetPositions(context)))
    # In a file without a base link's own place, the body above the chain is the base.
    root = body.body_frame() if base is not None else _find_root(joints[0], parents)
    return RobotChain(
        str(path),
        tuple(joint.name() for joint in joints),
        tip,
        _read_chain(plant, context, root, joints, tip_frame),
        _read_links(plant, context, joints, parents),
    )


def _parse_description(plant: MultibodyPlant, path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    parser = Parser(plant)
    level = logging.getLogger("drake").level
    try:
        if path.suffix == ".urdf":
            root = ET.fromstring(text)
            for element in root.iter():
                for child in [child for child in element if child.tag in _STRIPPED]:
                    element.remove(child)
            _check_masses(root, path)
            logging.getLogger("drake").setLevel(logging.ERROR)  # it warns of all it leaves out, friction for one
            parser.AddModelsFromString(ET.tostring(root, encoding="unicode"), "urdf")
        else:
            parser.AddModels(str(path))
    except ET.ParseError as error:
        raise ModelFileError(path, f"is not XML: {error}") from error
    except RuntimeError as error:
        raise ModelFileError(path, str(error)) from error
    finally:
        logging.getLogger("drake").setLevel(level)


def _check_masses(root: ET.Element, path: Path) -> None:
    """Drake gives a link of a mass below zero, or of inertia without mass, another one and goes on."""
    for link in root.iter("link"):
        mass = link.find("inertial/mass")
        if mass is None:
            continue
        try:
            value = float(mass.get("value", "nan"))
        except ValueError:
            value = np.nan
        if not 0.0 <= value < np.inf:
            problem = f"gives link {link.get('name')} a mass of {mass.get('value')}, must be at least 0 kg"
            raise ModelFileError(path, problem)
        if value == 0.0:
            link.remove(link.find("inertial"))  # type: ignore[arg-type]


def _list_joints(plant: MultibodyPlant) -> list[Joint]:
    return [plant.get_joint(index) for index in plant.GetJointIndices()]


def _find_frame(plant: MultibodyPlant, path: Path, name: str) -> Frame:
    try:
        return plant.GetFrameByName(name)
    except RuntimeError as error:
        names = [plant.get_body(BodyIndex(i)).name() for i in range(1, plant.num_bodies())]
        raise ModelFileError(path, f"has no link {name}{_suggest(name, names)}") from error


def _suggest(name: str, names: list[str]) -> str:
    near = difflib.get_close_matches(name, names, n=1, cutoff=0.5)
    return f", the nearest is {near[0]}" if near else f", must be one of {', '.join(names)}"


def _names_above(tip: Frame, parents: dict[BodyIndex, Joint]) -> list[str]:
    names, body = [], tip.body()
    while body.index() in parents:
        body = parents[body.index()].parent_body()
        names.append(body.name())
    return names


def _find_root(first: Joint, parents: dict[BodyIndex, Joint]) -> Frame:
    """The frame of the link that stands still below the first joint: the uppermost one fixed to its parent."""
    body: RigidBody = first.parent_body()
    while body.index() in parents and parents[body.index()].num_velocities() == 0:
        above = parents[body.index()].parent_body()
        if above.name() == "world":
            break
        body = above
    return body.body_frame()


def _slots(plant: MultibodyPlant, joint: Joint) -> list[bool]:
    return [i == joint.position_start() for i in range(plant.num_positions())]


def _read_chain(plant: MultibodyPlant, context: Context, root: Frame, joints: list[Joint], tip: Frame) -> SerialChain:
    poses: list[RigidTransform] = []
    previous = root
    for joint in joints:
        poses.append(joint.frame_on_parent().CalcPose(context, previous))
        previous = joint.frame_on_child()
    X_MT = tip.CalcPose(context, previous)
    return SerialChain(
        np.array([X_PF.rotation().matrix() for X_PF in poses]),
        np.array([X_PF.translation() for X_PF in poses]),
        np.array([joint.revolute_axis() for joint in joints if isinstance(joint, RevoluteJoint)]),
        X_MT.rotation().matrix(),
        X_MT.translation(),
        plant.gravity_field().gravity_vector(),
    )


def _read_links(
    plant: MultibodyPlant, context: Context, joints: list[Joint], parents: dict[BodyIndex, Joint]
) -> np.ndarray:
    """Parameters of each link of the chain with all that hangs on it."""
    slots = {joint.index(): slot for slot, joint in enumerate(joints)}
    bodies: list[list[BodyIndex]] = [[] for _ in joints]
    for index in map(BodyIndex, range(1, plant.num_bodies())):
        above = index
        while above in parents and parents[above].index() not in slots:
            above = parents[above].parent_body().index()
        if above in parents:
            bodies[slots[parents[above].index()]].append(index)
    return np.array(
        [
            parameters_from_spatial_inertia(plant.CalcSpatialInertia(context, joint.frame_on_child(), indices))
            for joint, indices in zip(joints, bodies, strict=True)
        ]
    )
