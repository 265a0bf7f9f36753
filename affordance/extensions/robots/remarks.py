"""Remarks for the user on omissions and contradictions in a robot's file."""

from collections.abc import Sequence
from xml.etree.ElementTree import Element

import numpy as np

from affordance.exceptions import BadValueError
from affordance.extensions.robots.description import Description

# Gravity on earth, [m/s^2], and the largest deviation of its magnitude that causes no remark.
EARTH, _NEAR = (0.0, 0.0, -9.81), 0.1

# Default mass and inertia of an <inertial> without them, by format.
_DEFAULTS = {"urdf": ("0 kg", "a point"), "sdf": ("1 kg", "moments of 1 kg m^2")}


def remark_missing(robot: Description, link: str, inertial: Element) -> None:
    """Adds remarks on an inertial without mass or moments, with the defaults of the file's format."""
    mass, moments = _DEFAULTS[robot.kind]
    if inertial.find("mass") is None:
        robot.remark(f"link {link}", f"has an <inertial> without <mass>; {robot.kind.upper()}'s default is {mass}")
    if inertial.find("inertia") is None and robot.inertials[link].mass:
        robot.remark(
            f"link {link}",
            f"has {robot.inertials[link].mass:g} kg and no <inertia>; {robot.kind.upper()}'s default is {moments}",
        )


def remark_couplings(robot: Description) -> None:
    """Adds remarks on joints that follow a joint that does not exist, or follow each other in a cycle."""

    def find_leader(name: str) -> str:
        """Returns the joint that a joint follows, in an SDF within the same model; empty if there is none."""
        mimic = robot.joints[name].mimic if name in robot.joints else None
        model, colons, _ = name.rpartition("::")
        return f"{model}{colons}{mimic.leader}" if mimic is not None and mimic.leader else ""

    for name in robot.joints:
        followed, leader = [name], find_leader(name)
        if leader and leader not in robot.joints:
            robot.remarks.append(f"joint {name} follows {leader}, which is not in the file: it is frozen by itself")
            continue
        while leader and leader not in followed:
            followed.append(leader)
            leader = find_leader(leader)
        if leader == name == min(followed):  # one remark per cycle
            robot.remarks.append(
                f"joint {name} follows itself ({' follows '.join([*followed, name])}): it is frozen at its default"
            )


def read_gravity(robot: Description, gravity: Sequence[float]) -> None:
    """Sets the up axis from a file's gravity, [m/s^2]; adds a remark if this is not the earth's.

    Gravity that is not along an axis raises a BadValueError.
    """
    g = np.array(gravity)
    strength, largest = float(np.linalg.norm(g)), int(np.argmax(np.abs(g)))
    if abs(strength + EARTH[2]) > _NEAR:
        robot.remarks.append(f"the file's gravity is {strength:g} m/s^2, but {-EARTH[2]:g} m/s^2 is used")
    if strength == 0.0:
        return
    if abs(g[largest]) < strength * (1.0 - 1e-6):
        problem = (
            f"is {' '.join(f'{each:g}' for each in gravity)}, must be along an axis; tilted mounts are not supported"
        )
        raise BadValueError(robot.path, "gravity", problem)
    robot.up = ("-" if g[largest] > 0.0 else "") + "xyz"[largest]
    if robot.up != "z":
        along = " ".join(f"{each:g}" for each in gravity)
        robot.remarks.append(f"the file's gravity is {along} m/s^2, so its axis {robot.up} points up (--up)")
