"""What a robot's file says of its joints and links beyond what Drake keeps, in whatever format it is written."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np
from pydrake.multibody.tree import RotationalInertia, SpatialInertia

from affordance.arrays import Array


class Mimic(NamedTuple):
    """A joint that follows another: q = multiplier q_leader + offset."""

    leader: str
    multiplier: float
    offset: float


class JointNotes(NamedTuple):
    """What a file says of a joint, besides axis, range, rate and damping, which Drake keeps.

    Attributes:
        kind: Its type, in the file's own word.
        effort: Largest torque, [N m]; None where the file says none.
        friction: Coulomb friction, [N m].
        stiffness: Of a spring in the joint, [N m/rad].
        mimic: Which joint it follows; None for none.
        rotor_inertia: Of rotor and gears as felt at the joint, [kg m^2].
        fault: Limits, damping or axis that no joint can have, left out of the text that Drake parses; empty for none.
    """

    kind: str
    effort: float | None = None
    friction: float = 0.0
    stiffness: float = 0.0
    mimic: Mimic | None = None
    rotor_inertia: float = 0.0
    fault: str = ""


class Inertial(NamedTuple):
    """Inertia of a link as a file writes it.

    Attributes:
        mass: [kg].
        place: Of the centre of mass in the link's frame, (3,), [m].
        rpy: Roll, pitch and yaw of the axes that the moments refer to, (3,), [rad].
        moments: Ixx, Iyy, Izz, Ixy, Ixz, Iyz about the centre of mass, (6,), [kg m^2].
        in_link: Whether place and axes are those of the link's own frame; false where the file names another.
    """

    mass: float
    place: tuple[float, float, float]
    rpy: tuple[float, float, float]
    moments: tuple[float, float, float, float, float, float]
    in_link: bool = True

    def find_fault(self) -> str:
        """Says why no solid can have this inertia; empty if one can, by Drake's own check."""
        Ixx, Iyy, Izz, *products = self.moments
        if self.mass < 0.0 or (self.mass == 0.0 and any(self.moments)):
            return f"has a mass of {self.mass:g} kg with moments of inertia, must have more than 0"
        if self.mass == 0.0:
            return ""
        try:
            inertia = RotationalInertia(Ixx, Iyy, Izz, *products)
            SpatialInertia.MakeFromCentralInertia(self.mass, np.zeros(3), inertia)
        except (RuntimeError, ValueError):
            return f"has {self._describe_impossible()}"
        return ""

    def _describe_impossible(self) -> str:
        """Names the moments that no solid can have, and the products where it is these that are at fault."""
        Ixx, Iyy, Izz, Ixy, Ixz, Iyz = self.moments
        if not RotationalInertia(Ixx, Iyy, Izz).CouldBePhysicallyValid():
            return f"an inertia no solid can have (Ixx, Iyy, Izz {Ixx:g}, {Iyy:g}, {Izz:g} kg m^2)"
        matrix = np.array([[Ixx, Ixy, Ixz], [Ixy, Iyy, Iyz], [Ixz, Iyz, Izz]])
        a, b, c = np.linalg.eigvalsh(matrix)
        return (
            f"products of inertia no solid can have (Ixy, Ixz, Iyz {Ixy:g}, {Ixz:g}, {Iyz:g} kg m^2, which make the "
            f"principal moments {a:.4g}, {b:.4g}, {c:.4g}; none may be negative or exceed the sum of the others)"
        )


class Visual(NamedTuple):
    """A shape that a file draws on a link.

    Attributes:
        shape: ``mesh``, ``box``, ``cylinder``, ``sphere``, ``ellipsoid`` or ``capsule``.
        sizes: Scale of a mesh, edges of a box, radius and length of a cylinder or capsule, radii, [m].
        place: In the link's frame, (3,), [m].
        rpy: Roll, pitch and yaw there, (3,), [rad].
        mesh: What the file calls the mesh; empty for none.
        colour: Red, green, blue, opacity; None where the file says none.
    """

    shape: str
    sizes: tuple[float, ...]
    place: tuple[float, float, float]
    rpy: tuple[float, float, float]
    mesh: str = ""
    colour: tuple[float, ...] | None = None


@dataclass(frozen=True)
class Description:
    """A robot's file, read.

    Attributes:
        path: The file.
        kind: ``urdf``, ``sdf`` or ``mjcf``.
        text: The same without what does not concern motion, as Drake parses it.
        joints: What it says of joints, by name.
        inertials: Inertias of links, by name, where they are written out.
        faults: Links whose inertia cannot be used, and why; their inertia is left out of the text.
        visuals: What it draws, by link.
        dropped: What was left out, a sentence each.
        undrawn: Links with a shape in the file that is not taken over.
        frames: Names of frames that are declared apart from links.
        sources: Other files that it includes.
    """

    path: Path
    kind: str
    text: str
    joints: Mapping[str, JointNotes]
    inertials: Mapping[str, Inertial]
    faults: Mapping[str, str]
    visuals: Mapping[str, tuple[Visual, ...]] = field(default_factory=dict)
    dropped: tuple[str, ...] = ()
    undrawn: frozenset[str] = frozenset()
    frames: frozenset[str] = frozenset()
    sources: tuple[Path, ...] = ()


def as_triple(values: Array | list[float]) -> tuple[float, float, float]:
    """Three numbers as a tuple."""
    x, y, z = (float(value) for value in values)
    return x, y, z
