"""Extraction of an arm from a robot's file, with a home posture; nothing is written here."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydrake.math import RigidTransform

from affordance.exceptions import BadValueError, ModelFileError
from affordance.robots.arm_file import turn_base
from affordance.robots.chain import find_chain
from affordance.robots.frozen import check_posture, freeze, parse_values
from affordance.robots.home import ArmStatics, HomePosture, find_home
from affordance.robots.reader import read_robot
from affordance.robots.reduced_arm import ImportOptions as ImportOptions
from affordance.robots.reduced_arm import ReducedArm, reduce_arm
from affordance.robots.tree import build_tree

AXES = ("x", "y", "z", "-x", "-y", "-z")
# A mass matrix is singular if its least eigenvalue is less than this fraction of the largest, as where a massless
# link turns about its own axis.
_LEAST_EIGENVALUE = 1e-12


@dataclass(frozen=True)
class ImportedArm:
    """Imported arm with its home posture, and the pose of its base, turned so that the hand points along Wx."""

    arm: ReducedArm
    home: HomePosture
    X_WB: RigidTransform
    options: ImportOptions

    @property
    def home_angles(self) -> dict[str, float]:
        """Home posture by joint, [rad]."""
        return dict(zip(self.arm.joint_names, self.home.q.tolist(), strict=True))


def read_arm(path: Path, options: ImportOptions) -> ReducedArm:
    """Reads a robot's file and extracts the arm without a home posture; see ``extract_arm``."""
    for option, axis in (("--out-axis", options.out_axis), ("--up", options.up)):
        if axis is not None and axis not in AXES:
            raise BadValueError(option, "", f"is {axis!r}, must be one of {', '.join(AXES)}")
    tree = build_tree(read_robot(path))
    chain = find_chain(tree, options.tip, options.base)
    check_posture(tree, options.posture)
    context, frozen = freeze(tree, chain, options.posture)
    return reduce_arm(tree, chain, context, frozen, options)


def extract_arm(path: Path, options: ImportOptions) -> ImportedArm:
    """Reads a robot's file and extracts the arm, with a home posture.

    Raises:
        BadValueError: The file or an option is invalid or incomplete; the message says what and where.
        ModelFileError: Drake cannot parse the file, or no home posture was found.
    """
    arm = read_arm(path, options)
    try:
        statics = ArmStatics(arm)
    except RuntimeError as error:  # values too large or small for a valid arm
        raise ModelFileError(path, f"makes no arm that Drake takes: {error}") from error
    _check_mass_matrix(path, arm, statics)
    try:
        home = find_home(statics, options.posture)
    except ModelFileError as error:
        raise ModelFileError(path, error.problem) from error
    X_WB = turn_base(arm.X_WB, statics.compute_hand(home.q)[:3, :3], options.height)
    return ImportedArm(arm, home, X_WB, options)


def parse_spread(option: str, words: list[str], *, unit: str, may_be_zero: bool) -> dict[str, float]:
    """Parses ``0.1``, which applies to every joint (the empty name), or words such as ``elbow=0.1``.

    Another form, a negative value, or zero where it is not allowed, raises a BadValueError with the unit.
    """
    values = parse_values(option, words, may_be_all=True)
    for name, value in values.items():
        if value < 0.0 or (value == 0.0 and not may_be_zero):
            bound = "at least 0" if may_be_zero else "more than 0"
            where = f" for {name}" if name else ""
            raise BadValueError(option, "", f"is {value:g}{where}, must be {bound} {unit}")
    return values


def _check_mass_matrix(path: Path, arm: ReducedArm, statics: ArmStatics) -> None:
    """Rejects an arm without mass, and one with a joint that moves no inertia."""
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
