"""Reads an arm for identification from a robot's file: a chain of joints, and its links' inertias.

Nothing is written, and no limits are needed because nothing will move. Joints outside the chain are frozen at their
defaults, and the bodies beyond them are added to the link of the chain that carries them.
"""

from pathlib import Path

from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RigidBody

from affordance.arguments import check_kind
from affordance.exceptions import ModelFileError
from affordance.extensions.robots.arm_checks import check_arm
from affordance.extensions.robots.chain import find_chain, group_bodies
from affordance.extensions.robots.description import Description
from affordance.extensions.robots.reader import read_robot
from affordance.extensions.robots.tree import RobotTree, build_tree, freeze
from affordance.files.constraints import StrPath, check_path
from affordance.plant.arm import ARM
from affordance.plant.chain_plant import read_chain
from affordance.plant.load import HAND_FRAME, parse_arm
from affordance.plant.serial_chain import SerialChain


def load_robot(path: StrPath, tip: str = HAND_FRAME, base: str | None = None) -> SerialChain:
    """Reads an arm from a robot's file.

    Args:
        path: URDF, SDF or MJCF file, Drake model directives (.dmd.yaml), or a folder that ``import_arm`` wrote.
        tip: Link or frame to which the payload is fixed.
        base: Link in which gravity and poses are expressed and above which no joint moves; None for the uppermost
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
    """Builds a robot from Drake model directives, the format of the program's own arms."""
    if not path.exists():
        raise ModelFileError(path, "does not exist")
    plant = MultibodyPlant(0.0)
    parse_arm(plant, path)
    plant.Finalize()
    return RobotTree(Description(path, "directives"), plant)


def _find_root(tree: RobotTree, base: RigidBody) -> RigidBody:
    """Finds the uppermost link that the base is fixed to; drivers express gravity and poses in it."""
    for joint in tree.climb(base):
        if joint.num_velocities() or joint.parent_body().name() == "world":
            break
        base = joint.parent_body()
    return base
