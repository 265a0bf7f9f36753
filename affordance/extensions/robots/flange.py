"""Flange frame F of an arm, in which its controller expects the payload, as the robot's file defines it.

This project's hand frame has its origin at the tip that the file defines but is rotated, so no controller knows it.
"""

import re
from pathlib import Path
from typing import NamedTuple
from xml.sax.saxutils import unescape

import numpy as np

from affordance.arrays import Array
from affordance.exceptions import BadValueError
from affordance.extensions.robots.recorded_arm import load_robot
from affordance.files.bounded import ROBOT, read_text
from affordance.plant.arm import ARM
from affordance.plant.load import HAND_FRAME
from affordance.plant.serial_chain import SerialChain

# Comment that the importer writes above an arm (arm.sdf.j2), with the robot's file and its tip.
_IMPORTED = re.compile(r"<!-- Made by affordance import-arm of .*, tip (.+)\. SI units\. -->")
_ALIKE = 1e-6  # largest distance between hand and tip at which they count as the same point, [m]


class Flange(NamedTuple):
    """Frame F in which a controller expects a payload."""

    name: str
    X_FT: Array  # pose of the tip T, to which the payload is fixed, in F, shape (4, 4)


def find_flange(robot: SerialChain, name: str = "", base: str | None = None) -> Flange | None:
    """Finds the flange of an arm: a named frame, or the tip of the robot's file.

    Args:
        robot: Arm up to the tip T.
        name: Frame of the file from which the arm was read, fixed to its tip; empty for the tip of the robot's file.
        base: Base with which the arm was read; None if none was named.

    Returns: The flange; None if the tip is the project's hand frame and the tip of the robot's file is unknown.

    Raises:
        BadValueError: The file has no such frame, or a joint moves the frame and the tip apart.
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

    Returns: Its name; empty if the arm lacks the frame, as imports by version 0.2 do; None if ``import_arm`` did not
        write the folder.
    """
    path = folder / "arm.sdf"
    imported = _IMPORTED.search(read_text(path, ROBOT)) if path.is_file() else None
    if imported is None:
        return None
    name = unescape(imported[1])
    if name == HAND_FRAME or not name.isprintable():
        return ""
    hand = load_robot(folder / ARM.name, HAND_FRAME)
    for written in (name, f"{name}_link"):  # the second if a joint has that name
        try:
            tip = load_robot(folder / ARM.name, written)
        except BadValueError:
            continue
        if tip.joint_names == hand.joint_names and np.allclose(tip.p_MT, hand.p_MT, rtol=0.0, atol=_ALIKE):
            return written
    return ""
