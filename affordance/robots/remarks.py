"""Remarks on what a robot's file leaves out or contradicts, which whoever imports the robot should know of."""

from collections.abc import Sequence
from xml.etree.ElementTree import Element

import numpy as np

from affordance.exceptions import BadValueError
from affordance.robots.description import Description

# Gravity where robots work, [m/s^2], and the largest difference from its strength that no one remarks on.
EARTH, _NEAR = (0.0, 0.0, -9.81), 0.1

# What a format puts for a mass or an inertia that an inertial lacks.
_DEFAULTS = {"urdf": ("0 kg", "a point"), "sdf": ("1 kg", "moments of 1 kg m^2")}


def remark_missing(robot: Description, link: str, inertial: Element) -> None:
    """Remarks on an inertial without a mass, or without moments, and what stands for them in the file's format."""
    mass, moments = _DEFAULTS[robot.kind]
    if inertial.find("mass") is None:
        robot.remark(f"link {link}", f"has an <inertial> without <mass>, for which {robot.kind.upper()} puts {mass}")
    if inertial.find("inertia") is None and robot.inertials[link].mass:
        robot.remark(
            f"link {link}",
            f"has {robot.inertials[link].mass:g} kg and no <inertia>, for which {robot.kind.upper()} puts {moments}",
        )


def remark_couplings(robot: Description) -> None:
    """Remarks on joints that follow a joint which there is not, or follow each other in a ring."""

    def find_leader(name: str) -> str:
        """Finds the joint that a joint follows, of the same model in an SDF; empty for none."""
        mimic = robot.joints[name].mimic if name in robot.joints else None
        model, colons, _ = name.rpartition("::")
        return f"{model}{colons}{mimic.leader}" if mimic is not None and mimic.leader else ""

    for name in robot.joints:
        followed, leader = [name], find_leader(name)
        if leader and leader not in robot.joints:
            robot.remarks.append(f"joint {name} follows {leader}, which is no joint of the file: it is frozen alone")
            continue
        while leader and leader not in followed:
            followed.append(leader)
            leader = find_leader(leader)
        if leader == name == min(followed):  # once for a ring
            robot.remarks.append(
                f"joint {name} follows itself ({' follows '.join([*followed, name])}): it is frozen at its default"
            )


def read_gravity(robot: Description, gravity: Sequence[float]) -> None:
    """Finds which way is up in a file that gives gravity, [m/s^2], and remarks on one that differs from the earth's.

    Gravity along no axis of the file raises a BadValueError.
    """
    g = np.array(gravity)
    strength, largest = float(np.linalg.norm(g)), int(np.argmax(np.abs(g)))
    if abs(strength + EARTH[2]) > _NEAR:
        robot.remarks.append(f"the file's gravity is {strength:g} m/s^2; here it is {-EARTH[2]:g} m/s^2")
    if strength == 0.0:
        return
    if abs(g[largest]) < strength * (1.0 - 1e-6):
        problem = (
            f"is {' '.join(f'{each:g}' for each in gravity)}, must be along an axis; a mounting is not read here"
        )
        raise BadValueError(robot.path, "gravity", problem)
    robot.up = ("-" if g[largest] > 0.0 else "") + "xyz"[largest]
    if robot.up != "z":
        along = " ".join(f"{each:g}" for each in gravity)
        robot.remarks.append(f"the file's gravity is {along} m/s^2, so its axis {robot.up} is taken as up (--up)")
