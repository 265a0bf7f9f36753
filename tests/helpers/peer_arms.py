"""Builds this project's arm in two other dynamics libraries, from models/arm.sdf without Drake."""

from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np
import pinocchio
import roboticstoolbox

from affordance.arrays import Array
from affordance.files.model_folder import MODELS


class LinkData(NamedTuple):
    """Moving body and its revolute joint, expressed in the joint's frame."""

    p_parent: Array  # position of the joint in the parent body, (3,), [m]
    axis: Array
    mass: float
    p_com: Array  # position of the centre of mass, (3,), [m]
    I_com: Array  # rotational inertia about the centre of mass, (3, 3), [kg m^2]


def read_links() -> list[LinkData]:
    """Reads the chain of links from the SDF file."""
    model = _read_model()
    links = {link.get("name"): link for link in model.findall("link")}
    chain = []
    for joint in model.findall("joint"):
        link = links[_text(joint, "child")]
        pose = _find(link, "pose")
        assert pose.get("relative_to") == _text(joint, "parent")
        inertial = _find(link, "inertial")
        place = _numbers(inertial, "pose") if inertial.find("pose") is not None else np.zeros(6)
        assert not place[3:].any()
        Ixx, Iyy, Izz, Ixy, Ixz, Iyz = (
            float(_text(inertial, f"inertia/{entry}")) for entry in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
        )
        chain.append(
            LinkData(
                _numbers(link, "pose")[:3],
                _numbers(joint, "axis/xyz"),
                float(_text(inertial, "mass")),
                place[:3],
                np.array([[Ixx, Ixy, Ixz], [Ixy, Iyy, Iyz], [Ixz, Iyz, Izz]]),
            )
        )
    return chain


def read_grip() -> Array:
    """Reads the position of the hand's frame H in the last link, (3,), [m]."""
    (frame,) = (frame for frame in _read_model().findall("frame") if frame.get("name") == "hand_grip")
    return _numbers(frame, "pose")[:3]


def _read_model() -> ElementTree.Element:
    return _find(ElementTree.parse(MODELS / "arm.sdf").getroot(), "model")


def _find(element: ElementTree.Element, path: str) -> ElementTree.Element:
    found = element.find(path)
    assert found is not None, path
    return found


def _text(element: ElementTree.Element, path: str) -> str:
    return (_find(element, path).text or "").strip()


def _numbers(element: ElementTree.Element, path: str) -> Array:
    return np.array([float(number) for number in _text(element, path).split()])


def build_pinocchio() -> pinocchio.Model:
    """Builds the arm in Pinocchio; its frame ``grip`` is H."""
    model = pinocchio.Model()
    parent = 0
    for number, link in enumerate(read_links()):
        place = pinocchio.SE3(np.eye(3), link.p_parent)
        parent = model.addJoint(parent, pinocchio.JointModelRevoluteUnaligned(link.axis), place, f"joint_{number}")
        model.appendBodyToJoint(
            parent, pinocchio.Inertia(link.mass, link.p_com, link.I_com), pinocchio.SE3.Identity()
        )
    grip = pinocchio.Frame("grip", parent, 0, pinocchio.SE3(np.eye(3), read_grip()), pinocchio.FrameType.OP_FRAME)
    model.addFrame(grip)
    return model


def build_toolbox_arm() -> tuple[roboticstoolbox.Robot, Array]:
    """Builds the arm in the Robotics Toolbox for Python, which only supports positive joint axes.

    Returns:
        Arm, and the signs, (num_joints,), by which its angles and torques must be multiplied.
    """
    rotations = (roboticstoolbox.ET.Rx, roboticstoolbox.ET.Ry, roboticstoolbox.ET.Rz)
    links: list[roboticstoolbox.Link] = []
    signs = []
    for link in read_links():
        assert not link.p_parent[1:].any()
        axis = int(np.abs(link.axis).argmax())
        ets = roboticstoolbox.ET.tx(link.p_parent[0]) * rotations[axis]()
        parent = links[-1] if links else None
        links.append(roboticstoolbox.Link(ets, m=link.mass, r=link.p_com, I=link.I_com, parent=parent))
        signs.append(link.axis[axis])
    # The toolbox defines gravity as the acceleration of a body in free fall.
    return roboticstoolbox.Robot(links, gravity=[0.0, 0.0, -9.81]), np.array(signs)
