"""Stores contents of a robot's file that Drake discards, in the same form for all formats."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple
from xml.etree.ElementTree import Element

import numpy as np
from pydrake.math import RollPitchYaw
from pydrake.multibody.tree import RotationalInertia, SpatialInertia

from affordance.arrays import Array, build_symmetric, list_entries
from affordance.exceptions import BadValueError

# Names of moments and products of inertia in URDF and SDF.
MOMENTS = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
# Names of the sizes of simple shapes in SDF.
SHAPES = {
    "box": ("size",),
    "cylinder": ("radius", "length"),
    "capsule": ("radius", "length"),
    "sphere": ("radius",),
    "ellipsoid": ("radii",),
}
# Gravity on Earth, [m/s^2], and the largest deviation of its magnitude that is accepted without a remark.
EARTH, _NEAR = (0.0, 0.0, -9.81), 0.1
# Default mass and inertia of an incomplete <inertial>, for each format.
_DEFAULTS = {"urdf": ("0 kg", "a point"), "sdf": ("1 kg", "moments of 1 kg m^2")}


def build_pose(place: Sequence[float], rpy: Sequence[float]) -> Array:
    """Builds a pose, (4, 4), from a position, [m], and roll, pitch and yaw, [rad]."""
    X = np.eye(4)
    X[:3, :3] = RollPitchYaw(np.array(rpy)).ToRotationMatrix().matrix()
    X[:3, 3] = place
    return X


class Mimic(NamedTuple):
    """Coupling of a joint to a leader: q = multiplier q_leader + offset, plus higher powers."""

    leader: str  # name of the leader; empty if the joint is fixed at the offset
    multiplier: float
    offset: float
    higher: tuple[float, ...] = ()  # coefficients of the second and higher powers of q_leader in an MJCF

    def compute(self, q_leader: float) -> float:
        """Computes the joint's position from the leader's position, [rad] or [m]."""
        coefficients = (self.offset, self.multiplier, *self.higher)
        return sum(each * q_leader**power for power, each in enumerate(coefficients))


class JointNotes(NamedTuple):
    """Data of a joint that Drake does not store. Drake stores axis, range, velocity limit and damping.

    Impossible velocity limits, dampings and rotor inertias are stored only here, because options may replace them.
    """

    effort: float | None = None  # torque limit, [N m]; None if the file has none
    velocity: float | None = None  # velocity limit of 0 or less, [rad/s]; None for a valid limit, which Drake keeps
    damping: float = 0.0  # negative damping, [N m s/rad]; 0 for a valid damping, which Drake keeps
    friction: float = 0.0  # Coulomb friction, [N m]
    stiffness: float = 0.0  # stiffness of a spring in the joint, [N m/rad]
    mimic: Mimic | None = None  # coupling to another joint, if any
    rotor_inertia: float = 0.0  # reflected inertia of rotor and gears at the joint, [kg m^2]
    fault: str = ""  # message about invalid position limits or axis, which Drake does not get; empty if valid
    has_range: bool = True  # False if position limits are missing although the joint's type requires them


def find_joint_fault(
    *,
    lower: float | None = None,
    upper: float | None = None,
    axis: Sequence[float] = (0.0, 0.0, 1.0),
) -> str:
    """Describes an impossible range or axis of a joint. Empty if both are valid.

    Some faults make Drake abort even if the joint is not part of the arm. Readers therefore remove them from the text
    for Drake, and report them only for joints of the arm.
    """
    if lower is not None and upper is not None and lower > upper:
        return f"has position limits from {lower:g} to {upper:g} rad, must be a range"
    if not any(axis):
        return "has an axis of zero length, must have a direction"
    return ""


class Inertial(NamedTuple):
    """Inertia of a link as written in a file."""

    mass: float  # [kg]
    place: tuple[float, ...]  # position of the centre of mass in the link's frame, (3,), [m]
    rpy: tuple[float, ...]  # roll, pitch and yaw of the axes of the moments, (3,), [rad]
    moments: tuple[float, ...]  # Ixx, Iyy, Izz, Ixy, Ixz, Iyz about the centre of mass, (6,), [kg m^2]
    in_link: bool = True  # True if place and axes are in the link's own frame

    def find_fault(self) -> str:
        """Explains why no solid can have this inertia. Empty if Drake's check accepts it."""
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
            a, b, c = np.linalg.eigvalsh(build_symmetric(self.moments))
            return (
                f"has products of inertia no solid can have (Ixy, Ixz, Iyz {Ixy:g}, {Ixz:g}, {Iyz:g} kg m^2, which "
                f"make the principal moments {a:.4g}, {b:.4g}, {c:.4g}; none may be negative or exceed the sum of "
                "the others)"
            )
        return ""

    def find_nearest(self) -> "Inertial":
        """Computes the nearest physically possible inertia, in least squares of moments and products.

        The second moments of a solid with density rho, S = integral of rho x x', are positive semidefinite, and its
        moments of inertia are I = tr(S) 1 - S. I and S have the same principal axes. In these axes, |dI|^2 = |ds|^2 +
        (sum of ds)^2 is minimised subject to s >= 0. Without a mass, all moments become zero.
        """
        from scipy.optimize import nnls  # slow to import and rarely needed

        if self.mass <= 0.0:
            return Inertial(0.0, self.place, self.rpy, (0.0,) * 6, self.in_link)
        principal, axes = np.linalg.eigh(build_symmetric(self.moments))
        root = np.linalg.cholesky(np.eye(3) + np.ones((3, 3))).T
        s, _ = nnls(root, root @ (0.5 * principal.sum() - principal))
        moments = axes @ np.diag(s.sum() - s) @ axes.T
        return self._replace(moments=tuple(list_entries(moments)))


class Visual(NamedTuple):
    """Visual shape of a link in a robot's file."""

    shape: str  # ``mesh``, ``box``, ``cylinder``, ``sphere``, ``ellipsoid`` or ``capsule``
    # Scale of a mesh, [1]; edges of a box; radius and length of a cylinder or capsule; radius or radii, [m].
    sizes: tuple[float, ...]
    place: tuple[float, ...]  # position in the link's frame, (3,), [m]
    rpy: tuple[float, ...]  # roll, pitch and yaw in the link's frame, (3,), [rad]
    mesh: str = ""  # name of the mesh in the file; empty for other shapes
    colour: tuple[float, ...] | None = None  # red, green, blue, opacity; None if not given
    material: str = ""  # name of its material in the file; empty if not given


@dataclass
class Description:
    """Contents of a robot's file, filled in by the reader of its format."""

    path: Path
    kind: str  # ``urdf``, ``sdf``, ``mjcf`` or ``directives``
    text: str = ""  # text for Drake, without elements that do not affect motion
    joints: dict[str, JointNotes] = field(default_factory=dict)  # data for each joint name
    # Inertias that the file gives explicitly, for each link.
    inertials: dict[str, Inertial] = field(default_factory=dict)
    # Reasons why the inertia of a link is missing or unusable. ``text`` has no inertia for these links.
    faults: dict[str, str] = field(default_factory=dict)
    # Impossible inertias in the file, with their faults, for each link. ``text`` and ``inertials`` contain the
    # nearest possible inertias instead.
    mended: dict[str, tuple[str, Inertial]] = field(default_factory=dict)
    # Surprising contents of the file, and of single links or joints, which are reported to users.
    remarks: list[str] = field(default_factory=list)
    remarks_of: dict[str, list[str]] = field(default_factory=dict)
    carried: dict[str, float] = field(default_factory=dict)  # compensated fraction of each link's weight
    # Fixed joints of a URDF by child link: name, parent link, and pose in it, (4, 4).
    fixed: dict[str, tuple[str, str, Array]] = field(default_factory=dict)
    floating: dict[str, str] = field(default_factory=dict)  # floating joint of each child link; Drake leaves it out
    sites: dict[str, str] = field(default_factory=dict)  # link that carries each site, which is represented by a link
    up: str | None = None  # axis of the root that points up, if the file specifies gravity
    visuals: dict[str, tuple[Visual, ...]] = field(default_factory=dict)  # shapes to draw, for each link
    dropped: list[str] = field(default_factory=list)  # omitted contents, one sentence each
    undrawn: set[str] = field(default_factory=set)  # links with a shape in the file that is not imported
    frames: set[str] = field(default_factory=set)  # names of frames that are declared in addition to links
    sources: tuple[Path, ...] = ()  # files that the file includes

    def add_visuals(self, link: str, shapes: Sequence[Visual | None]) -> None:
        """Adds the shapes of a link. None represents a shape that is not imported."""
        self.visuals[link] = tuple(shape for shape in shapes if shape is not None)
        if None in shapes:
            self.undrawn.add(link)

    def add_inertial(self, link: str, inertial: Inertial) -> Inertial | None:
        """Adds the inertia of a link.

        Returns: The nearest possible inertia if this inertia is impossible, otherwise None.
        """
        self.inertials[link] = inertial
        fault = inertial.find_fault()
        if not fault:
            return None
        self.mended[link] = fault, inertial
        self.inertials[link] = inertial.find_nearest()
        return self.inertials[link]

    def remark(self, element: str, remark: str) -> None:
        """Adds a remark about a link or joint, given by its key in the file."""
        self.remarks_of.setdefault(element, []).append(remark)


def remark_missing(robot: Description, link: str, inertial: Element) -> None:
    """Adds remarks about an inertial without mass or moments, with the default values of the file's format."""
    mass, moments = _DEFAULTS[robot.kind]
    if inertial.find("mass") is None:
        robot.remark(f"link {link}", f"has an <inertial> without <mass>; {robot.kind.upper()}'s default is {mass}")
    if inertial.find("inertia") is None and robot.inertials[link].mass:
        robot.remark(
            f"link {link}",
            f"has {robot.inertials[link].mass:g} kg and no <inertia>; {robot.kind.upper()}'s default is {moments}",
        )


def remark_couplings(robot: Description) -> None:
    """Adds remarks about joints that follow a missing joint or form a cycle."""

    def find_leader(name: str) -> str:
        """Returns the leader of a joint, in an SDF from the same model. Empty without a leader."""
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
    """Sets the upward axis from a file's gravity, [m/s^2], with a remark if the magnitude is not the Earth's.

    Raises:
        BadValueError: Gravity is not along an axis.
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
