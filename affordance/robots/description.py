"""Contents of a robot's file beyond what Drake keeps of joints and links, for all file formats."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np
from pydrake.multibody.tree import RotationalInertia, SpatialInertia

# Moments and products of inertia, by their names in URDF and SDF.
MOMENTS = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
# Sizes of simple shapes, by their names in SDF.
SHAPES = {
    "box": ("size",),
    "cylinder": ("radius", "length"),
    "capsule": ("radius", "length"),
    "sphere": ("radius",),
    "ellipsoid": ("radii",),
}


class Mimic(NamedTuple):
    """Coupling of a joint to another: q = multiplier q_leader + offset."""

    leader: str
    multiplier: float
    offset: float


class JointNotes(NamedTuple):
    """Data of a joint in addition to axis, range, velocity limit and damping, which Drake keeps."""

    effort: float | None = None  # torque limit, [N m]; None where the file gives none
    friction: float = 0.0  # Coulomb friction, [N m]
    stiffness: float = 0.0  # stiffness of a spring in the joint, [N m/rad]
    mimic: Mimic | None = None  # coupling to another joint; None for none
    rotor_inertia: float = 0.0  # reflected inertia of rotor and gears at the joint, [kg m^2]
    fault: str = ""  # invalid limits, damping or axis, removed from the text that Drake parses; empty for none


def find_joint_fault(
    *,
    lower: float | None = None,
    upper: float | None = None,
    velocity: float | None = None,
    damping: float = 0.0,
    rotor_inertia: float = 0.0,
    axis: Sequence[float] = (0.0, 0.0, 1.0),
    unit: str = "rad",
) -> str:
    """Describes data that no joint can have, in SI units but for the angles' unit; empty for a valid joint.

    Some of it aborts Drake, wherever in the robot it is. Readers therefore remove it from the text that Drake parses,
    and it is reported only if it belongs to the arm.
    """
    if lower is not None and upper is not None and lower > upper:
        return f"has position limits from {lower:g} to {upper:g} {unit}, must be a range"
    if velocity is not None and velocity < 0.0:
        return f"has a velocity limit of {velocity:g} rad/s, must be more than 0"
    if damping < 0.0:
        return f"has a damping of {damping:g} N m s/rad, must be at least 0"
    if rotor_inertia < 0.0:
        return f"has a rotor inertia of {rotor_inertia:g} kg m^2, must be at least 0"
    if not any(axis):
        return "has an axis of zero length, must have a direction"
    return ""


class Inertial(NamedTuple):
    """Inertia of a link as written in a file."""

    mass: float  # [kg]
    place: tuple[float, ...]  # position of the centre of mass in the link's frame, (3,), [m]
    rpy: tuple[float, ...]  # roll, pitch and yaw of the axes that the moments refer to, (3,), [rad]
    moments: tuple[float, ...]  # Ixx, Iyy, Izz, Ixy, Ixz, Iyz about the centre of mass, (6,), [kg m^2]
    in_link: bool = True  # True if place and axes refer to the link's own frame; False where the file names another

    def find_fault(self) -> str:
        """Describes why no solid can have this inertia; empty if one can, by Drake's own check."""
        Ixx, Iyy, Izz, Ixy, Ixz, Iyz = self.moments
        if self.mass < 0.0 or (self.mass == 0.0 and any(self.moments)):
            return f"has a mass of {self.mass:g} kg with moments of inertia, must have more than 0"
        if self.mass == 0.0:
            return ""
        try:
            inertia = RotationalInertia(Ixx, Iyy, Izz, Ixy, Ixz, Iyz)
            SpatialInertia.MakeFromCentralInertia(self.mass, np.zeros(3), inertia)
        except (RuntimeError, ValueError):
            if not RotationalInertia(Ixx, Iyy, Izz).CouldBePhysicallyValid():
                return f"has an inertia no solid can have (Ixx, Iyy, Izz {Ixx:g}, {Iyy:g}, {Izz:g} kg m^2)"
            a, b, c = np.linalg.eigvalsh([[Ixx, Ixy, Ixz], [Ixy, Iyy, Iyz], [Ixz, Iyz, Izz]])
            return (
                f"has products of inertia no solid can have (Ixy, Ixz, Iyz {Ixy:g}, {Ixz:g}, {Iyz:g} kg m^2, which "
                f"make the principal moments {a:.4g}, {b:.4g}, {c:.4g}; none may be negative or exceed the sum of "
                "the others)"
            )
        return ""


class Visual(NamedTuple):
    """Shape that a file draws on a link."""

    shape: str  # ``mesh``, ``box``, ``cylinder``, ``sphere``, ``ellipsoid`` or ``capsule``
    # Scale of a mesh, edges of a box, radius and length of a cylinder or capsule, radii, [m].
    sizes: tuple[float, ...]
    place: tuple[float, ...]  # position in the link's frame, (3,), [m]
    rpy: tuple[float, ...]  # roll, pitch and yaw in the link's frame, (3,), [rad]
    mesh: str = ""  # name of the mesh in the file; empty for none
    colour: tuple[float, ...] | None = None  # red, green, blue, opacity; None where the file gives none


@dataclass
class Description:
    """Contents of a robot's file, which its reader fills in."""

    path: Path
    kind: str  # ``urdf``, ``sdf``, ``mjcf`` or ``directives``
    text: str = ""  # text that Drake parses, without elements that do not concern motion
    joints: dict[str, JointNotes] = field(default_factory=dict)  # data of joints, by name
    # Inertias of links, by name, where they are written out.
    inertials: dict[str, Inertial] = field(default_factory=dict)
    # Faults of link inertias that cannot be used, by link; those inertias are removed from the text.
    faults: dict[str, str] = field(default_factory=dict)
    visuals: dict[str, tuple[Visual, ...]] = field(default_factory=dict)  # shapes drawn, by link
    dropped: list[str] = field(default_factory=list)  # descriptions of omitted content, one sentence each
    undrawn: set[str] = field(default_factory=set)  # links with a shape in the file that is not imported
    frames: set[str] = field(default_factory=set)  # names of frames that are declared separately from links
    sources: tuple[Path, ...] = ()  # other files that are included

    def add_visuals(self, link: str, shapes: Sequence[Visual | None]) -> None:
        """Adds the shapes of a link; None stands for one that is not imported."""
        self.visuals[link] = tuple(shape for shape in shapes if shape is not None)
        if None in shapes:
            self.undrawn.add(link)

    def add_inertial(self, link: str, inertial: Inertial) -> bool:
        """Adds the inertia of a link; returns True if no solid can have it."""
        self.inertials[link] = inertial
        if fault := inertial.find_fault():
            self.faults[link] = fault
        return bool(fault)
