"""From a robot's file to the arm alone, in a posture to hold things in; nothing is written here."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant

from affordance.exceptions import BadValueError, ModelFileError
from affordance.robots.arm_file import BASE, turn_base, write_arm
from affordance.robots.chain import Chain, find_chain
from affordance.robots.frozen import check_posture, freeze, parse_values
from affordance.robots.home import ArmStatics, HomePosture, find_home
from affordance.robots.reader import read_robot
from affordance.robots.reduced_arm import ReducedArm, reduce_arm, turn_up
from affordance.robots.tree import RobotTree, build_tree

AXES = ("x", "y", "z", "-x", "-y", "-z")
# A mass matrix is singular if the least of its eigenvalues is less than this part of the largest, as where a link
# without mass turns about an axis of its own.
_LEAST_EIGENVALUE = 1e-12


@dataclass(frozen=True)
class ImportOptions:
    """What a user says of an arm besides its file.

    Attributes:
        tip: Link or frame at its end, where it holds things.
        base: Link that is fixed to the world; None to find one.
        out_axis: Which axis of the tip points out of the hand; None to find one.
        posture: Values of joints: where those that are not the arm's are frozen, and the arm's own in its home
            posture, [rad] or [m].
        rotor_inertia: Of rotor and gears as felt at joints, by joint; of every joint under the empty name, [kg m^2].
        effort: Limits of torque in place of the file's, by joint; of every joint under the empty name, [N m].
        damping: Whether the file's damping is kept.
        height: Of the base above the world's origin, [m]; the file's if None.
        up: Which axis of the robot's root points up; z in all but few files.
    """

    tip: str
    base: str | None = None
    out_axis: str | None = None
    posture: Mapping[str, float] = field(default_factory=dict)
    rotor_inertia: Mapping[str, float] = field(default_factory=dict)
    effort: Mapping[str, float] = field(default_factory=dict)
    damping: bool = True
    height: float | None = None
    up: str = "z"


class ReadArm(NamedTuple):
    """An arm as a robot's file has it.

    Attributes:
        tree: The robot.
        chain: Its joints in it.
        arm: The arm alone.
    """

    tree: RobotTree
    chain: Chain
    arm: ReducedArm


@dataclass(frozen=True)
class ImportedArm:
    """An arm, and where it comes from.

    Attributes:
        tree: The robot.
        chain: Its joints in it.
        arm: The arm alone.
        home: The posture to hold things in.
        payload: What it bears there at rest, centre of mass TEST_DISTANCE out, [kg].
        weakest: The joint that gives way first.
        empty_load: Largest part of a torque limit at home with an empty hand.
        X_WB: Where its base stands, turned so that the hand points along Wx.
    """

    tree: RobotTree
    chain: Chain
    arm: ReducedArm
    home: HomePosture
    payload: float
    weakest: str
    empty_load: float
    X_WB: RigidTransform

    @property
    def home_angles(self) -> dict[str, float]:
        """The home posture by joint, [rad]."""
        return dict(zip(self.arm.joint_names, self.home.q.tolist(), strict=True))


def read_arm(path: Path, options: ImportOptions) -> ReadArm:
    """Reads a robot's file and takes the arm out of it.

    Raises:
        BadValueError: The file, or an option, does not say what an arm needs; the message says what and where.
        ModelFileError: Drake cannot parse the file.
    """
    for option, axis in (("--out-axis", options.out_axis), ("--up", options.up)):
        if axis is not None and axis not in AXES:
            raise BadValueError(option, "", f"is {axis!r}, must be one of {', '.join(AXES)}")
    tree = build_tree(read_robot(path))
    chain = find_chain(tree, options.tip, options.base)
    check_posture(tree, options.posture)
    context, frozen = freeze(tree, chain, options.posture)
    names = [joint.name() for joint in chain.joints]
    effort = _spread("--effort", options.effort, names)
    arm = reduce_arm(tree, chain, context, frozen, out_axis=options.out_axis, effort=effort)
    if options.up != "z":
        arm = replace(arm, X_WB=turn_up(options.up) @ arm.X_WB)
    rotors = _spread("--rotor-inertia", options.rotor_inertia, names)
    return ReadArm(tree, chain, arm.changed(damping=options.damping, rotor_inertia=rotors))


def extract_arm(path: Path, options: ImportOptions) -> ImportedArm:
    """Reads a robot's file and makes an arm of it, with a posture to hold things in.

    Raises:
        BadValueError: The file, or an option, does not say what an arm needs; the message says what and where.
        ModelFileError: Drake cannot parse the file, or there is no posture to hold things in.
    """
    tree, chain, arm = read_arm(path, options)
    try:
        statics = build_statics(arm)
    except RuntimeError as error:  # values so large or small that the arm cannot be written with them
        raise ModelFileError(path, f"makes no arm that Drake takes: {error}") from error
    _check_mass_matrix(path, arm, statics)
    try:
        home = find_home(statics, arm, options.posture)
    except ModelFileError as error:
        raise ModelFileError(path, error.problem) from error
    payload, worst = statics.compute_payload(home.q)
    empty = float(np.max(np.abs(statics.compute_torques(home.q, 0.0)) / statics.efforts))
    X_WB = turn_base(arm.X_WB, statics.compute_hand(home.q)[:3, :3], options.height)
    return ImportedArm(tree, chain, arm, home, payload, arm.links[worst].joint, empty, X_WB)


def parse_spread(option: str, words: list[str], *, unit: str, may_be_zero: bool) -> dict[str, float]:
    """Parses ``0.1``, for every joint, under the empty name, or words such as ``elbow=0.1``.

    Args:
        option: The command-line option.
        words: Words that were given.
        unit: Unit of the values, in words.
        may_be_zero: True if a value may be 0.

    Raises:
        BadValueError: A word is neither, or negative.
    """
    for word in words:
        if "=" not in word and not _is_number(word):
            raise BadValueError(option, "", f"is {word!r}, must be a number or JOINT=VALUE")
    values = parse_values(option, [word if "=" in word else f"*={word}" for word in words])
    for name, value in values.items():
        if value < 0.0 or (value == 0.0 and not may_be_zero):
            bound = "at least 0" if may_be_zero else "more than 0"
            where = "" if name == "*" else f" for {name}"
            raise BadValueError(option, "", f"is {value:g}{where}, must be {bound} {unit}")
    return {"" if name == "*" else name: value for name, value in values.items()}


def _is_number(word: str) -> bool:
    try:
        return math.isfinite(float(word))
    except ValueError:
        return False


def build_statics(arm: ReducedArm) -> ArmStatics:
    """Builds the plant of an arm as it will be written, its base where the robot's file has it."""
    plant = MultibodyPlant(0.0)
    parser = Parser(plant)
    parser.SetStrictParsing()
    parser.AddModelsFromString(write_arm(arm, {}, "itself"), "sdf")
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName(BASE), arm.X_WB)
    plant.Finalize()
    joints = [plant.GetJointByName(name) for name in arm.joint_names]
    efforts = np.array([link.effort for link in arm.links])
    return ArmStatics(plant, plant.GetFrameByName("hand_grip"), joints, efforts)


def _spread(option: str, given: Mapping[str, float], names: Sequence[str]) -> dict[str, float]:
    """Values by joint, of what is given for joints by name and for every joint under the empty name.

    Raises:
        BadValueError: A name is none of the arm's joints.
    """
    unknown = [name for name in given if name and name not in names]
    if unknown:
        problem = f"names {unknown[0]!r}, which is no joint of the arm, must be one of {', '.join(names)}"
        raise BadValueError(option, "", problem)
    everywhere = dict.fromkeys(names, given[""]) if "" in given else {}
    return {**everywhere, **{name: value for name, value in given.items() if name}}


def _check_mass_matrix(path: Path, arm: ReducedArm, statics: ArmStatics) -> None:
    """Rejects an arm without mass, and one with a joint that moves no inertia.

    Raises:
        BadValueError: It is one.
    """
    if not arm.mass > 0.0:
        raise BadValueError(path, "", "has no mass for any link of the arm, must have inertias (<inertial>)")
    q = np.linspace(0.1, 1.0, len(arm.links))
    statics.plant.SetPositions(statics.context, q)
    M = statics.plant.CalcMassMatrix(statics.context)
    values, vectors = np.linalg.eigh(M)
    if not values[0] > _LEAST_EIGENVALUE * values[-1]:
        joint = arm.links[int(np.argmax(np.abs(vectors[:, 0])))].joint
        problem = "moves nothing that has inertia, must; a --rotor-inertia would give it some"
        raise BadValueError(path, f"joint {joint}", problem)
