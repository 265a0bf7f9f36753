"""Reads payload settings of robot controllers, and formats them for several makers.

A controller needs the mass, the centre of mass p_FFcm in the flange frame F, and the moments about Fcm along F's
axes. Each line uses the maker's units and order, according to the documents below. No line was tested on a
controller, and other versions may differ:

- Universal Robots: URScript manual (SW 10.6), set_target_payload: moments about the centre of mass, along the axes of
  the flange; kg, m, kg m^2, and a transition time, s.
- Franka: libfranka, franka::Robot::setLoad: in the flange frame, matrix in column-major order; kg, m, kg m^2.
- UFACTORY: xArm-Python-SDK, doc/api/xarm_api.md, set_tcp_load: kg, mm; no moments.
- Doosan: Doosan Robotics API manual, set_workpiece_weight: kg, mm, and the frame; no moments.
- KUKA: units and axes as in operating instructions MA KR IONTEC V4 (2021), "Load center of gravity and mass moment of
  inertia": kg, mm, deg about z, the new y, the new x, and kg m^2 about principal axes; the syntax of $LOAD is that of
  System Variables for KSS 8.1 to 8.4.
- ROS 2: ur_msgs/srv/SetPayload with mass and center_of_gravity (its newest version has geometry_msgs/Inertia and a
  transition time instead), franka_msgs/srv/SetLoad of franka_ros2; kg, m, kg m^2.
"""

from typing import Annotated, NamedTuple

import numpy as np
import scipy
from pydantic import Field
from pydrake.multibody.tree import RotationalInertia

from affordance.arrays import Array, build_symmetric, list_entries
from affordance.exceptions import BadValueError, show_value
from affordance.files.constraints import Name, StrPath, Vector, Within, check_path
from affordance.files.data_model import DataModel, load_model
from affordance.objects.inertia import compute_point_parameters

type _Triple = tuple[float, float, float]
# Bounds of a payload's mass, [kg], of its centre of mass, [m], and of its moments, [kg m^2].
_MOST, _FAR = 1e3, 10.0
_MOMENTS = 9  # number of decimals of moments, [kg m^2]
_TRANSITION = 0.5  # time over which a UR controller blends in the new payload, so that the arm does not jerk, [s]


class PayloadSetting(NamedTuple):
    """Payload setting of a controller in a frame T, which is the flange or the tip link."""

    mass: float  # mass, [kg]
    centre_of_mass: Array  # centre of mass p_TTcm, shape (3,), [m]
    # Moments and products Ixx, Iyy, Izz, Ixy, Ixz, Iyz about Tcm, shape (6,), [kg m^2]; None if not set.
    inertia: Array | None = None
    is_centre_guessed: bool = False  # True if the centre of mass is the prior mean, because the run did not reveal it
    frame: str = ""  # name of T; empty if not named

    @property
    def parameters(self) -> Array:
        """Ten inertial parameters about To, shape (10,). Without moments, a point mass is assumed."""
        pi = self.mass * compute_point_parameters(self.centre_of_mass)
        if self.inertia is not None:
            pi[4:] += self.inertia
        return pi

    def express(self, X_FT: Array) -> "PayloadSetting":
        """Expresses the payload in another frame F, given the pose X_FT, shape (4, 4)."""
        R, p = X_FT[:3, :3], X_FT[:3, 3]
        moments = None if self.inertia is None else np.array(list_entries(R @ build_symmetric(self.inertia) @ R.T))
        return self._replace(centre_of_mass=p + R @ self.centre_of_mass, inertia=moments)


class PayloadEntry(DataModel):
    """Payload in a YAML file, with three moments of inertia, or all six moments and products of inertia."""

    mass: Annotated[float, Within(0.0, _MOST), Field(description="Mass, [kg].")]
    com: Annotated[
        _Triple, Vector(3, Within(-_FAR, _FAR)), Field(description="Centre of mass in the flange, [m].")
    ] = (
        0.0,
        0.0,
        0.0,
    )
    inertia: Annotated[
        Annotated[list[Annotated[float, Within(-_MOST, _MOST)]], Field(min_length=3, max_length=6)] | None,
        Field(description="Ixx, Iyy, Izz and optionally Ixy, Ixz, Iyz, about the centre of mass, [kg m^2]."),
    ] = None
    frame: Annotated[Name | None, Field(description="Frame of the payload; the flange if not named.")] = None


def read_payload(path: StrPath) -> PayloadSetting:
    """Reads a controller's payload setting, in the flange frame, from YAML.

    Raises:
        BadValueError: The file does not set a payload, or one of its values is wrong.
    """
    path = check_path("path", path)
    entry = load_model(path, PayloadEntry)
    centre = np.array(entry.com, dtype=float)
    if entry.inertia is None:
        return PayloadSetting(entry.mass, centre, frame=entry.frame or "")
    if len(entry.inertia) not in (3, 6):
        problem = f"has {len(entry.inertia)} numbers, must have 3 or 6: Ixx, Iyy, Izz, Ixy, Ixz, Iyz"
        raise BadValueError(path, "inertia", problem)
    inertia = np.array([*entry.inertia, 0.0, 0.0, 0.0][:6])
    if not (body := RotationalInertia(*inertia)).CouldBePhysicallyValid():
        moments = ", ".join(f"{value:.3g}" for value in body.CalcPrincipalMomentsOfInertia())
        problem = f"has principal moments {moments} kg m^2; none may be negative or exceed the sum of the others"
        raise BadValueError(path, "inertia", problem)
    return PayloadSetting(entry.mass, centre, inertia, frame=entry.frame or "")


def format_payload(payload: PayloadSetting, frame: str) -> dict[str, str]:
    """Formats the lines that set a payload, for each maker.

    Each line names the frame and the quantities that were not identified. Moments that were not identified are set to
    those of a point mass if the line needs them.
    """
    m, centre = payload.mass, payload.centre_of_mass
    matrix = np.zeros((3, 3)) if payload.inertia is None else build_symmetric(payload.inertia)
    xx, yy, zz, xy, xz, yz = list_entries(matrix)
    # The frame's name may come from an untrusted file. In Python's notation it cannot end a line or a comment.
    mark = f"in the frame {show_value(frame)}{'; centre of mass not seen' if payload.is_centre_guessed else ''}"
    point = mark if payload.inertia is not None else f"{mark}; moments not seen: a point mass"
    mass, metres, millimetres = f"{m:.4f}", _list(centre, 5), _list(1e3 * centre, 2)
    six, nine = _list((xx, yy, zz, xy, xz, yz), _MOMENTS), _list(matrix.T.ravel(), _MOMENTS)
    x, y, z = (show_number(value, 5) for value in centre)
    of_ur = "/io_and_status_controller/set_payload ur_msgs/srv/SetPayload"
    of_franka = "/service_server/set_load franka_msgs/srv/SetLoad"
    return {
        "Universal Robots (URScript)": f"set_target_payload({mass}, [{metres}], [{six}], {_TRANSITION:g})  # {point}",
        "Franka (libfranka)": f"robot.setLoad({mass}, {{{{{metres}}}}}, {{{{{nine}}}}});  // {point}",
        "UFACTORY xArm (Python)": f"arm.set_tcp_load({mass}, [{millimetres}])  # mm, {mark}",
        "Doosan (DRL)": f"set_workpiece_weight({mass}, [{millimetres}], DR_FLANGE, DR_REPLACE)  # mm, {mark}",
        "KUKA (KRL)": f"{_format_krl(mass, millimetres, matrix)}  ; mm, deg, {point}",
        "ROS 2 (ur_robot_driver)": (
            f"ros2 service call {of_ur} '{{mass: {mass}, center_of_gravity: {{x: {x}, y: {y}, z: {z}}}}}'  # {mark}"
        ),
        "ROS 2 (franka_ros2)": (
            f"ros2 service call {of_franka} '{{mass: {mass}, center_of_mass: [{metres}], load_inertia: [{nine}]}}'"
            f"  # {point}"
        ),
        "URDF": (
            f'<inertial><mass value="{mass}"/><origin xyz="{x} {y} {z}"/>'
            f'<inertia ixx="{xx:.6g}" iyy="{yy:.6g}" izz="{zz:.6g}" ixy="{xy:.6g}" ixz="{xz:.6g}" iyz="{yz:.6g}"/>'
            f"</inertial>  <!-- {point.replace('--', '- -')} -->"
        ),
        "Drake (Python)": (
            f"SpatialInertia.MakeFromCentralInertia({m:.6g}, [{metres}], RotationalInertia("
            f"{xx:.6g}, {yy:.6g}, {zz:.6g}, {xy:.6g}, {xz:.6g}, {yz:.6g}))  # {point}"
        ),
    }


def show_number(value: float, digits: int) -> str:
    """Formats a number with at most ``digits`` decimals, without an exponent. Zero is 0."""
    text = f"{value:.{digits}f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


def _list(values: Array | tuple[float, ...], digits: int) -> str:
    return ", ".join(show_number(float(value), digits) for value in values)


def _format_krl(mass: str, millimetres: str, matrix: Array) -> str:
    """Formats a value of KUKA's $LOAD with principal moments and the angles of their axes.

    The angles A, B, C are rotations about z, the new y, and the new x.
    """
    moments, axes = np.linalg.eigh(matrix)
    axes = axes * np.linalg.det(axes)  # right-handed
    angles = scipy.spatial.transform.Rotation.from_matrix(axes).as_euler("ZYX", degrees=True)
    turned = angles if moments.any() else np.zeros(3)
    place, turn, about = (
        ",".join(f"{name} {value}" for name, value in zip(names, values, strict=True))
        for names, values in (
            ("XYZ", millimetres.split(", ")),
            ("ABC", [show_number(float(angle), 2) for angle in turned]),
            ("XYZ", [show_number(float(moment), _MOMENTS) for moment in moments]),
        )
    )
    return f"$LOAD={{M {mass},CM {{{place},{turn}}},J {{{about}}}}}"
