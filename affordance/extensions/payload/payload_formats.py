"""Payload settings of robot controllers, and readers of files that contain one.

A controller takes the mass, the centre of mass p_FFcm in the flange frame F, and the moments about Fcm along F's
axes. ``payload_lines`` writes the lines that set them.
"""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, NamedTuple
from xml.etree.ElementTree import Element

import numpy as np
import scipy
from pydantic import ConfigDict, Field
from pydrake.multibody.tree import RotationalInertia

from affordance.arrays import Array, build_symmetric, list_entries
from affordance.exceptions import BadValueError
from affordance.files.bounded import SETTINGS, read_json, read_text, read_yaml
from affordance.files.constraints import StrPath, Vector, Within, check_path
from affordance.files.data_model import DataModel, check_content
from affordance.files.xml_file import read_xml
from affordance.objects.inertia import compute_point_parameters

type _Triple = tuple[float, float, float]
# Bounds of a payload's mass, [kg], of its centre of mass, [m], and of its moments, [kg m^2].
_MOST, _FAR = 1e3, 10.0
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_LIST = rf"\[\s*((?:{_NUMBER}\s*,\s*)*{_NUMBER})\s*\]"
# Lines of a URScript program. The newer call has moments; the older one may omit the centre of mass.
_URSCRIPT = re.compile(rf"set_(?:target_)?payload\(\s*({_NUMBER})\s*(?:,\s*{_LIST})?\s*(?:,\s*{_LIST})?")

_URSCRIPT_COG = re.compile(rf"set_payload_cog\(\s*{_LIST}")


class PayloadSetting(NamedTuple):
    """Payload setting of a controller, in a frame T: the flange, or the tip at which the payload was identified."""

    mass: float  # mass, [kg]
    centre_of_mass: Array  # centre of mass p_TTcm, shape (3,), [m]
    # Moments and products Ixx, Iyy, Izz, Ixy, Ixz, Iyz about Tcm, shape (6,), [kg m^2]; None if not set.
    inertia: Array | None = None
    is_centre_guessed: bool = False  # True if the centre of mass is the prior's, as the run did not show it

    @property
    def parameters(self) -> Array:
        """Ten inertial parameters about To, shape (10,); those of a point mass if no moments are set."""
        pi = self.mass * compute_point_parameters(self.centre_of_mass)
        if self.inertia is not None:
            pi[4:] += self.inertia
        return pi

    def express(self, X_FT: Array) -> "PayloadSetting":
        """Returns the same payload in another frame F, in which the pose of T is X_FT, shape (4, 4)."""
        R, p = X_FT[:3, :3], X_FT[:3, 3]
        moments = None if self.inertia is None else np.array(list_entries(R @ build_symmetric(self.inertia) @ R.T))
        return self._replace(centre_of_mass=p + R @ self.centre_of_mass, inertia=moments)


class PayloadEntry(DataModel):
    """Payload in YAML, with the three moments of inertia or with all six moments and products."""

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


class _EndEffectorEntry(DataModel):
    """End effector in JSON, such as the configuration of a Panda's hand; other keys do not concern the payload."""

    model_config = ConfigDict(extra="ignore")

    mass: Annotated[float, Within(0.0, _MOST)]
    centre: Annotated[_Triple, Vector(3, Within(-_FAR, _FAR))] = Field((0.0, 0.0, 0.0), alias="centerOfMass")
    inertia: Annotated[list[Annotated[float, Within(-_MOST, _MOST)]], Field(min_length=9, max_length=9)] | None = None


def read_payload(path: StrPath) -> PayloadSetting:
    """Reads the payload that is set on a controller, in the frame of the flange.

    Args:
        path: A YAML file with ``mass``, ``com`` and ``inertia``; the end effector of a Panda (.json); a program or
            log with a line ``set_target_payload(...)`` or ``set_payload(...)``, of which the last counts (.script,
            .urscript, .txt); or a URDF file with one ``<inertial>`` (.urdf, .xml, .xacro without macros).

    Raises:
        BadValueError: The file does not set a payload, or one of its values is wrong.
    """
    path = check_path("path", path)
    suffix = path.suffix.lower()
    if suffix in (".yaml", ".yml"):
        content = read_yaml(path)
    elif suffix == ".json":
        content = _read_end_effector(path)
    elif suffix in (".urdf", ".xml", ".xacro"):
        content = _read_inertial(path, read_xml(path, SETTINGS))
    elif suffix in (".script", ".urscript", ".txt"):
        content = _read_urscript(path, read_text(path, SETTINGS))
    else:
        known = ".yaml, .json, .script, .urscript, .txt, .urdf or .xml"
        raise BadValueError(path, "", f"has the unknown type {suffix or path.name!r}, must be {known}")
    entry = check_content(path, "", content, PayloadEntry)
    centre = np.array(entry.com, dtype=float)
    if entry.inertia is None:
        return PayloadSetting(entry.mass, centre)
    if len(entry.inertia) not in (3, 6):
        problem = f"has {len(entry.inertia)} numbers, must have 3 or 6: Ixx, Iyy, Izz, Ixy, Ixz, Iyz"
        raise BadValueError(path, "inertia", problem)
    inertia = np.array([*entry.inertia, 0.0, 0.0, 0.0][:6])
    if not (body := RotationalInertia(*inertia)).CouldBePhysicallyValid():
        moments = ", ".join(f"{value:.3g}" for value in body.CalcPrincipalMomentsOfInertia())
        problem = f"has principal moments {moments} kg m^2; none may be negative or exceed the sum of the others"
        raise BadValueError(path, "inertia", problem)
    return PayloadSetting(entry.mass, centre, inertia)


def _read_end_effector(path: Path) -> dict[str, Any]:
    """Reads the mapping that contains a mass, which may be nested one level down."""
    content = read_json(path)
    if isinstance(content, Mapping) and "mass" not in content:
        content = next((each for each in content.values() if isinstance(each, Mapping) and "mass" in each), content)
    hand = check_content(path, "", content, _EndEffectorEntry)
    moments = None if hand.inertia is None else list_entries(np.array(hand.inertia).reshape(3, 3).T)
    return {"mass": hand.mass, "com": list(hand.centre), "inertia": moments}


def _read_urscript(path: Path, text: str) -> dict[str, Any]:
    text = "\n".join(line.partition("#")[0] for line in text.splitlines())
    found = _URSCRIPT.findall(text)
    if not found:
        raise BadValueError(path, "", "has no line set_target_payload(mass, [x, y, z], [moments]) with plain numbers")
    mass, centre, moments = found[-1]
    if not centre and (alone := _URSCRIPT_COG.findall(text)):
        centre = alone[-1]
    place = [float(value) for value in centre.split(",")] if centre else [0.0, 0.0, 0.0]
    inertia = [float(value) for value in moments.split(",")] if moments else None
    if len(place) != 3 or (inertia is not None and len(inertia) != 6):
        raise BadValueError(path, "set_target_payload", "must have three coordinates and six moments, or none")
    return {"mass": float(mass), "com": place, "inertia": inertia}


def _read_inertial(path: Path, root: Element) -> dict[str, Any]:
    found = [root] if root.tag == "inertial" else list(root.iter("inertial"))
    if len(found) != 1:
        raise BadValueError(
            path, "inertial", f"appears {len(found)} times, must appear once: extract the payload's link"
        )
    mass, origin, inertia = (found[0].find(tag) for tag in ("mass", "origin", "inertia"))
    if mass is None:
        raise BadValueError(path, "inertial", "has no mass")
    rpy = _read_numbers(path, origin, "rpy", 3)
    content: dict[str, Any] = {
        "mass": _read_numbers(path, mass, "value", 1)[0],
        "com": _read_numbers(path, origin, "xyz", 3),
    }
    if inertia is not None:
        xx, xy, xz, yy, yz, zz = (
            _read_numbers(path, inertia, key, 1)[0] for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
        )
        R = scipy.spatial.transform.Rotation.from_euler("xyz", rpy).as_matrix()
        content["inertia"] = list_entries(R @ build_symmetric((xx, yy, zz, xy, xz, yz)) @ R.T)
    return content


def _read_numbers(path: Path, element: Element | None, key: str, count: int) -> list[float]:
    """Reads the numbers of an attribute; zeros if it is missing."""
    text = "" if element is None else element.get(key, "")
    try:
        values = [float(word) for word in text.split()] or [0.0] * count
    except ValueError:
        values = []
    if len(values) != count:
        raise BadValueError(path, key, f"is {text!r}, must be {count} numbers")
    return values
