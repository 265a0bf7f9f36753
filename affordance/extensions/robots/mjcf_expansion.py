"""Expands an MJCF model: included files, default classes, and torque limits implied by actuators.

A class inherits from the class that contains it. All actuators of a class share one set of attributes, whatever their
tags. An element's class is its own ``class``, or else the nearest ``childclass`` above it, or else the main class.
"""

import math
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from xml.etree.ElementTree import Element

from affordance.exceptions import BadValueError, describe_choice, suggest
from affordance.extensions.robots.xml_reader import Numbers, read_xml

# Deepest nesting of files: models are split into robot, gripper and scene, so deeper nesting is a mistake.
_DEEPEST = 8
_MAIN = "main"
# Tags that all set attributes of the same default actuator.
ACTUATORS = (
    "general",
    "motor",
    "position",
    "velocity",
    "intvelocity",
    "damper",
    "cylinder",
    "muscle",
    "adhesion",
    "dcmotor",
)
_ACTUATOR = "actuator"
# Elements of a body that get the attributes of their class; other elements are not read.
_OF_BODIES = ("joint", "geom", "site")

type _Attributes = dict[str, dict[str, str]]
# Attributes with which an actuator's force depends on more than its control, so the control range does not bound it.
_FEEDBACK = ("kp", "kv")


def expand_includes(path: Path, root: Element) -> tuple[Path, ...]:
    """Replaces every ``<include>`` with the contents of its file; returns the included files.

    A file that is outside the model's folder, cannot be read, or is included twice or nested too deeply raises a
    BadValueError.
    """
    folder, found = path.parent.resolve(), list[Path]()

    def expand(element: Element, named_in: Path, depth: int) -> None:
        for child in list(element):
            if child.tag != "include":
                expand(child, named_in, depth)
                continue
            name = child.get("file", "")
            file = (folder / name).resolve()
            if not name or not file.is_relative_to(folder):
                problem = f"names {name!r}, must be a file in the model's own folder, {folder}; MuJoCo "
                problem += "can save a whole model as one file (mj_saveLastXML)"
                raise BadValueError(named_in, "include", problem)
            if file in found or file == path.resolve():
                raise BadValueError(named_in, "include", f"names {name!r} a second time, must include a file once")
            if depth == _DEEPEST:
                raise BadValueError(named_in, "include", f"nests deeper than {_DEEPEST} files")
            found.append(file)
            content = read_xml(file)
            if content.tag not in ("mujoco", "mujocoinclude"):
                raise BadValueError(file, "", f"is of <{content.tag}>, must be of <mujoco> or <mujocoinclude>")
            expand(content, file, depth + 1)
            place = list(element).index(child)
            element[place : place + 1] = list(content)

    expand(root, path, 0)
    return tuple(found)


def write_out_defaults(path: Path, root: Element) -> None:
    """Copies attributes of default classes to their elements; an unknown class raises a BadValueError."""
    classes = _read_classes(root)

    def find_class(element: Element, attribute: str, inherited: str) -> str:
        name = element.attrib.pop(attribute, inherited)
        if name not in classes:
            key = f"{element.tag} {element.get('name', '')}".rstrip()
            raise BadValueError(path, f"{key}.{attribute}", describe_choice(name, classes))
        return name

    def fill(element: Element, inherited: str, kind: str) -> None:
        given = classes[find_class(element, "class", inherited)].get(kind, {})
        element.attrib.update({**given, **element.attrib})

    def descend(body: Element, inherited: str) -> None:
        class_name = find_class(body, "childclass", inherited)
        for child in body:
            if child.tag == "body":
                descend(child, class_name)
            elif child.tag in _OF_BODIES:
                fill(child, class_name, child.tag)

    for world in root.findall("worldbody"):
        descend(world, _MAIN)
    for element in root.iterfind("actuator/*"):
        fill(element, _MAIN, _ACTUATOR)
    for element in root.findall("default"):
        root.remove(element)


def _read_classes(root: Element) -> dict[str, _Attributes]:
    """Reads attributes by class and kind of element, including those inherited from parent classes."""
    found: dict[str, _Attributes] = {_MAIN: {}}

    def add(element: Element, inherited: _Attributes) -> None:
        own = {kind: dict(attributes) for kind, attributes in inherited.items()}
        for child in element:
            if child.tag != "default":
                kind = _ACTUATOR if child.tag in ACTUATORS else child.tag
                own.setdefault(kind, {}).update(child.attrib)
        found[element.get("class", _MAIN)] = own
        for child in element.findall("default"):
            add(child, own)

    for element in root.findall("default"):
        add(element, found[_MAIN])
    return found


def read_efforts(root: Element, numbers: Numbers) -> dict[str, float]:
    """Computes the torque limit, [N m], of every joint whose actuators are limited.

    An actuator's limit is the smaller magnitude of the two ends of its force range, times its gear. If its force is
    proportional to its control, the control range limits it likewise. The limits of all actuators of a joint add up.
    An invalid range or gear raises a BadValueError.
    """
    efforts: dict[str, float] = {}
    for actuator, joint in _list_drives(root):
        key = f"actuator {actuator.get('name', joint)}"
        gear = abs(numbers.parse_one(_take_first(actuator.get("gear")), f"{key}.gear", 1.0))
        limits = [read_limit(actuator.attrib, "force", numbers, key)]
        gain = _compute_gain(actuator, numbers, key)
        if gain is not None:
            limits.append(gain * read_limit(actuator.attrib, "ctrl", numbers, key))
        if math.isfinite(min(limits)):
            efforts[joint] = efforts.get(joint, 0.0) + gear * min(limits)
    return efforts


def check_drives(root: Element, joints: Collection[str], numbers: Numbers) -> None:
    """Raises a BadValueError if an actuator drives a joint that is not in the file."""
    for actuator, joint in _list_drives(root):
        if joint not in joints:
            problem = f"is {joint!r}, which is not a joint of the file{suggest(joint, joints)}"
            raise BadValueError(numbers.path, f"actuator {actuator.get('name', joint)}.joint", problem)


def _list_drives(root: Element) -> Iterator[tuple[Element, str]]:
    """Lists the actuators that drive joints, each with the joint's name."""
    for actuator in root.iterfind("actuator/*"):
        joint = actuator.get("joint") or actuator.get("jointinparent")
        if actuator.tag in ACTUATORS and joint:
            yield actuator, joint


def read_limit(attributes: Mapping[str, str], name: str, numbers: Numbers, key: str) -> float:
    """Reads a limit from a range attribute, for example ``forcerange`` if the name is ``force``.

    Returns: Smaller magnitude of the range's two ends; infinite without a limit, or if it is switched off, as by
        ``forcelimited``. A falling range raises a BadValueError.
    """
    text = attributes.get(f"{name}range")
    low, high = numbers.parse(text, f"{key}.{name}range", 2, (0.0, 0.0))
    if low > high:
        raise BadValueError(numbers.path, f"{key}.{name}range", f"is from {low:g} to {high:g}, must rise")
    if low == high or attributes.get(f"{name}limited") == "false":
        return math.inf
    return min(abs(low), abs(high))


def _compute_gain(actuator: Element, numbers: Numbers, key: str) -> float | None:
    """Computes the gain of an actuator, force per control; None if the force is not proportional to the control."""
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
