"""Reads an arm for identification from a robot's file, as a chain of joints with the inertias of its links.

No limits are needed, because the arm does not move. Joints outside the chain are frozen at their defaults, and their
bodies are merged into the link of the chain to which they are attached.
"""

import re
from pathlib import Path
from typing import NamedTuple
from xml.sax.saxutils import unescape

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RigidBody

from affordance.arguments import check_kind
from affordance.arrays import Array
from affordance.exceptions import BadValueError, ModelFileError
from affordance.extensions.robots.arm_checks import check_arm
from affordance.extensions.robots.chain import find_chain, group_bodies
from affordance.extensions.robots.description import Description
from affordance.extensions.robots.reader import read_robot
from affordance.extensions.robots.tree import RobotTree, build_tree, freeze
from affordance.files.bounded import ROBOT, read_text
from affordance.files.constraints import StrPath, check_path
from affordance.plant.arm import ARM
from affordance.plant.chain_plant import read_chain
from affordance.plant.load import HAND_FRAME, parse_arm
from affordance.plant.serial_chain import SerialChain

# Comment that the importer writes above an arm (arm.sdf.j2), with the robot's file and its tip.
_IMPORTED = re.compile(r"<!-- Made by affordance import-arm of .*, tip (.+)\. SI units\. -->")
_ALIKE = 1e-6  # largest distance between hand and tip that count as one point, [m]


def load_robot(path: StrPath, tip: str = HAND_FRAME, base: str | None = None) -> SerialChain:
    """Reads an arm from a robot's file.

    Args:
        path: URDF, SDF or MJCF file, Drake model directives (.dmd.yaml), or a folder that ``import_arm`` wrote.
        tip: Link or frame to which the payload is fixed.
        base: Link in which gravity and poses are expressed; joints above it must not move. None for the uppermost
            link that is fixed to the link where the limb begins.

    Raises:
        BadValueError: The file cannot be read, the tip or the base is not in it, a joint between them is not
            revolute, or a link of the chain has an impossible inertia.
        ModelFileError: Drake cannot parse the file.
    """
    path = check_path("path", path)
    check_kind("tip", tip, str)
    if base is not None:
        check_kind("base", base, str)
    if path.is_dir():
        path = path / ARM.name
    is_directives = path.name.endswith((".dmd.yaml", ".dmd.yml"))
    tree = _build_directives(path) if is_directives else build_tree(read_robot(path))
    chain = find_chain(tree, tip, base)
    context, _ = freeze(tree, chain.joints, {})
    root = chain.base if base is not None else _find_root(tree, chain.base)
    bodies_by_joint = group_bodies(tree, chain)
    check_arm(tree, chain, context, bodies_by_joint, carries=True)
    groups = [{body.index() for body in bodies} for bodies in bodies_by_joint]
    return read_chain(path, tree.plant, context, root.body_frame(), chain.joints, chain.tip, tip, groups)


def _build_directives(path: Path) -> RobotTree:
    """Builds a robot from Drake model directives, which are the format of the program's own arms."""
    if not path.exists():
        raise ModelFileError(path, "does not exist")
    plant = MultibodyPlant(0.0)
    parse_arm(plant, path)
    plant.Finalize()
    return RobotTree(Description(path, "directives"), plant)


def _find_root(tree: RobotTree, base: RigidBody) -> RigidBody:
    """Finds the uppermost link to which the base is fixed. Drivers express gravity and poses in its frame."""
    for joint in tree.climb(base):
        if joint.num_velocities() or joint.parent_body().name() == "world":
            break
        base = joint.parent_body()
    return base


class Flange(NamedTuple):
    """Frame F in which a controller expects a payload.

    The frame is defined in the robot's file. Unlike the hand frame, it is not rotated.
    """

    name: str
    X_FT: Array  # pose of the tip T, which carries the payload, in F, shape (4, 4)


def find_flange(robot: SerialChain, name: str = "", base: str | None = None) -> Flange | None:
    """Finds the flange of an arm: a named frame, or the tip of the robot's file.

    Args:
        robot: Arm up to the tip T.
        name: Frame of the arm's file that is fixed to the tip; empty for the tip of the robot's file.
        base: Base with which the arm was read; None if none was named.

    Returns: The flange; None if the tip is the project's hand frame and the tip of the robot's file is unknown.

    Raises:
        BadValueError: The file has no such frame, or the frame can move relative to the tip.
    """
    if not name:
        is_ours = robot.tip == HAND_FRAME and Path(robot.source).name.endswith((".dmd.yaml", ".dmd.yml"))
        name = find_imported_tip(Path(robot.source).parent) or "" if is_ours else robot.tip
        if not name:
            return None
    if name == robot.tip:
        return Flange(name, np.eye(4))
    try:
        other = load_robot(robot.source, name, base)
    except BadValueError as error:
        raise BadValueError(
            "--flange" if error.source == "--tip" else error.source, error.key, error.problem
        ) from error
    if other.joint_names != robot.joint_names:
        problem = f"is {name!r}, which moves relative to the tip, {robot.tip}, must be fixed to it"
        raise BadValueError("--flange", "", problem)
    X_FT = np.eye(4)
    X_FT[:3, :3] = other.R_MT.T @ robot.R_MT
    X_FT[:3, 3] = other.R_MT.T @ (robot.p_MT - other.p_MT)
    return Flange(name, X_FT)


def find_imported_tip(folder: Path) -> str | None:
    """Finds the frame of an imported arm that was the tip in the robot's file.

    Returns: Name of the frame; empty if the arm has no such frame; None if ``import_arm`` did not write the folder.
    """
    path = folder / "arm.sdf"
    imported = _IMPORTED.search(read_text(path, ROBOT)) if path.is_file() else None
    if imported is None:
        return None
    name = unescape(imported[1])
    if name == HAND_FRAME or not name.isprintable():
        return ""
    hand = load_robot(folder / ARM.name, HAND_FRAME)
    for written in (name, f"{name}_link"):  # with the suffix if a joint has this name
        try:
            tip = load_robot(folder / ARM.name, written)
        except BadValueError:
            continue
        if tip.joint_names == hand.joint_names and np.allclose(tip.p_MT, hand.p_MT, rtol=0.0, atol=_ALIKE):
            return written
    return ""
