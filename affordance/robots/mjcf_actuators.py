"""Torque limits of an MJCF model's joints, from its actuators; default classes must be written out before."""

import difflib
import math
from collections.abc import Collection, Iterator, Mapping
from xml.etree.ElementTree import Element

from affordance.exceptions import BadValueError
from affordance.robots.mjcf_expansion import ACTUATORS
from affordance.robots.xml_reader import Numbers

# Attributes that make an actuator's force depend on more than its control, so that the control range is no bound.
_FEEDBACK = ("kp", "kv")


def read_efforts(root: Element, numbers: Numbers) -> dict[str, float]:
    """Reads the torque limit of every joint whose actuators are limited, [N m].

    An actuator is limited by the weaker end of its force range and, where its force is a multiple of its control, by
    that of its control range, times its gear; the limits of all actuators of a joint add up.

    Raises:
        BadValueError: A range or gear is invalid.
    """
    efforts: dict[str, float] = {}
    for actuator, joint in _list_drives(root):
        key = f"actuator {actuator.get('name', joint)}"
        gear = abs(numbers.parse_one(_take_first(actuator.get("gear")), f"{key}.gear", 1.0))
        limits = [read_limit(actuator.attrib, "force", numbers, key)]
        gain = _find_gain(actuator, numbers, key)
        if gain is not None:
            limits.append(gain * read_limit(actuator.attrib, "ctrl", numbers, key))
        if math.isfinite(min(limits)):
            efforts[joint] = efforts.get(joint, 0.0) + gear * min(limits)
    return efforts


def check_drives(root: Element, joints: Collection[str], numbers: Numbers) -> None:
    """Makes sure that every actuator of a joint drives one that there is.

    Raises:
        BadValueError: One does not.
    """
    for actuator, joint in _list_drives(root):
        if joint not in joints:
            near = difflib.get_close_matches(joint, joints, n=1)
            hint = f"; did you mean {near[0]!r}?" if near else ""
            key = f"actuator {actuator.get('name', joint)}.joint"
            raise BadValueError(numbers.path, key, f"is {joint!r}, which is no joint of the file{hint}")


def _list_drives(root: Element) -> Iterator[tuple[Element, str]]:
    """Actuators of joints, with the name of the joint."""
    for actuator in root.iterfind("actuator/*"):
        joint = actuator.get("joint") or actuator.get("jointinparent")
        if actuator.tag in ACTUATORS and joint:
            yield actuator, joint


def read_limit(attributes: Mapping[str, str], name: str, numbers: Numbers, key: str) -> float:
    """Reads the limit of a range such as ``forcerange``, which ``forcelimited`` can switch off.

    Args:
        attributes: Attributes of the element.
        name: Name of the limited quantity, such as ``force``.
        numbers: Parser of the values.
        key: Place of the element in the file.

    Returns: Smaller magnitude of the range's two ends, infinite for no limit.

    Raises:
        BadValueError: The range is not two numbers in ascending order.
    """
    text = attributes.get(f"{name}range")
    low, high = numbers.parse(text, f"{key}.{name}range", 2, (0.0, 0.0))
    if low > high:
        raise BadValueError(numbers.path, f"{key}.{name}range", f"is from {low:g} to {high:g}, must rise")
    if low == high or attributes.get(f"{name}limited") == "false":
        return math.inf
    return min(abs(low), abs(high))


def _find_gain(actuator: Element, numbers: Numbers, key: str) -> float | None:
    """Computes force over control where the force is proportional to the control; None elsewhere."""
    if actuator.tag == "motor":
        return 1.0
    plain = (
        actuator.tag == "general"
        and actuator.get("gaintype", "fixed") == "fixed"
        and actuator.get("biastype", "none") == "none"
        and not any(name in actuator.attrib for name in _FEEDBACK)
    )
    if not plain:
        return None
    return abs(numbers.parse_one(_take_first(actuator.get("gainprm")), f"{key}.gainprm", 1.0))


def _take_first(text: str | None) -> str:
    return " ".join((text or "").split()[:1])
