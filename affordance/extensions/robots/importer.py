"""Extracts an arm from a robot's file according to the import options, without writing files."""

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from pydrake.math import RotationMatrix

from affordance.arguments import check_number
from affordance.arrays import Array
from affordance.exceptions import BadValueError, ModelFileError
from affordance.extensions.robots.arm_file import RESERVED, turn_base
from affordance.extensions.robots.chain import choose_tip, find_chain
from affordance.extensions.robots.home import HomePosture, compute_tilt, find_home, plant_arm
from affordance.extensions.robots.plausibility import list_implausible
from affordance.extensions.robots.reader import read_robot
from affordance.extensions.robots.reduced_arm import ImportOptions as ImportOptions
from affordance.extensions.robots.reduced_arm import ReducedArm, reduce_arm
from affordance.extensions.robots.tree import build_tree, check_posture, freeze
from affordance.plant.arm_model import ArmModel

AXES = ("x", "y", "z", "-x", "-y", "-z")
# A mass matrix is singular if its smallest eigenvalue is below this fraction of the largest, for example if a
# massless link rotates about its own axis.
_LEAST_EIGENVALUE = 1e-12
# Sine of the angle between the hand's x and the vertical, 10 degrees, below which no roll turns the hand's z up.
_VERTICAL = 0.17
# A smaller roll is a rounding error, [rad].
_NO_ROLL = 1e-9


def read_arm(path: Path, options: ImportOptions) -> ReducedArm:
    """Extracts an arm from a robot's file without a home posture; see ``extract_arm``."""
    for option, axis in (("--out-axis", options.out_axis), ("--up", options.up)):
        if axis is not None and axis not in AXES:
            raise BadValueError(option, "", f"is {axis!r}, must be one of {', '.join(AXES)}")
    if options.roll is not None:
        check_number("--roll", options.roll, -2.0 * math.pi, 2.0 * math.pi, "rad")
    tree = build_tree(read_robot(path, options.xacro, options.packages))
    why_tip = ""
    if not options.tip:
        tip, why_tip = choose_tip(tree)
        options = replace(options, tip=tip)
    chain = find_chain(tree, options.tip, options.base)
    check_posture(tree, options.posture)
    context, frozen = freeze(tree, chain.joints, options.posture)
    return replace(reduce_arm(tree, chain, context, frozen, options), why_tip=why_tip)


def extract_arm(path: Path, options: ImportOptions) -> tuple[ReducedArm, HomePosture]:
    """Extracts an arm from a robot's file, with a home posture.

    The base is rotated so that the hand points along Wx at home. Without a given roll, the hand is rotated about its
    x so that its z is up at home. With a given roll, home postures with the hand's z up are preferred.

    Raises:
        BadValueError: The file or an option is invalid or incomplete; the message names fault and place.
        ModelFileError: Drake cannot parse the file, or no home posture was found.
    """
    arm = read_arm(path, options)
    if taken := [name for name in arm.joint_names if name in RESERVED]:
        raise BadValueError(path, f"joint {taken[0]}", "has a name that is reserved for the hand or the world")
    try:
        model = ArmModel(plant_arm(arm))
    except RuntimeError as error:  # values that are too large or small
        raise ModelFileError(path, f"gives an arm that Drake rejects: {error}") from error
    _check_mass_matrix(path, arm, model)
    try:
        home = find_home(model, options.posture, is_rolled=options.roll is not None)
    except ModelFileError as error:
        causes = [*([arm.chain.above] if arm.chain.above else []), *list_implausible(arm)]
        raise ModelFileError(path, "; ".join([error.problem, *causes])) from error
    model.set_posture(home.q)
    R_WH = model.compute_hand_pose().rotation().matrix()
    if options.roll is None:
        roll = compute_roll(R_WH)
        arm = arm.roll_hand(roll)
        R_WH = R_WH @ RotationMatrix.MakeXRotation(roll).matrix()
        home = home._replace(tilt=compute_tilt(R_WH))
    return replace(arm, X_WB=turn_base(arm.X_WB, R_WH, options.height)), home


def compute_roll(R_WH: Array) -> float:
    """Computes the rotation about the hand's x that turns its z up, [rad]; zero if x is vertical.

    With c and s the cosine and sine of the angle, the rotated z axis is c z - s y. It is highest if (c, s) is
    parallel to the heights of (z, -y).
    """
    y_up, z_up = R_WH[2, 1:]
    if np.hypot(y_up, z_up) < _VERTICAL:
        return 0.0
    roll = float(np.arctan2(-y_up, z_up))
    if abs(roll) < _NO_ROLL:
        return 0.0
    return np.pi if abs(roll) > np.pi - _NO_ROLL else roll


def parse_values(option: str, words: Sequence[str], *, unit: str = "", may_be_zero: bool = True) -> dict[str, float]:
    """Parses words such as ``elbow=0.3`` into a value for each joint.

    With a unit, a word can also be a number alone, which applies to every joint (the empty name). Values with a unit
    must be positive, or zero if ``may_be_zero``.

    Raises:
        BadValueError: A value is out of bounds, a word has another form, or a joint is named twice.
    """
    values: dict[str, float] = {}
    for word in words:
        name, equals, text = word.rpartition("=")
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        is_named = bool(equals) or not unit
        if not math.isfinite(value) or (is_named and not name):
            form = "JOINT=VALUE" if is_named else "a number or JOINT=VALUE"
            raise BadValueError(option, "", f"is {word!r}, must be {form}")
        if name in values:
            raise BadValueError(option, "", f"gives {name or '*'} twice")
        if unit and (value < 0.0 or (value == 0.0 and not may_be_zero)):
            bound = "at least 0" if may_be_zero else "more than 0"
            where = f" for {name}" if name else ""
            raise BadValueError(option, "", f"is {value:g}{where}, must be {bound} {unit}")
        values[name] = value
    return values


def _check_mass_matrix(path: Path, arm: ReducedArm, model: ArmModel) -> None:
    """Checks that every joint of an arm moves a body with inertia."""
    model.set_posture(np.linspace(0.1, 1.0, len(arm.links)))
    values, vectors = np.linalg.eigh(model.compute_mass_matrix())
    if not values[0] > _LEAST_EIGENVALUE * values[-1]:
        joint = arm.links[int(np.argmax(np.abs(vectors[:, 0])))].joint
        problem = "moves nothing that has inertia, must move some; --rotor-inertia gives it inertia"
        raise BadValueError(path, f"joint {joint}", problem)
