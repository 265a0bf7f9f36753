"""Expansion of an MJCF model: included files, default classes, and the torque limits that its actuators imply.

A class inherits from the class it is nested in, and all actuators of a class share one set of attributes, whatever
their tags. The class of an element is its own, otherwise the nearest ``childclass`` above it, otherwise the main one.
"""

import math
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from xml.etree.ElementTree import Element

from affordance.exceptions import BadValueError, describe_choice, suggest
from affordance.robots.xml_reader import Numbers, read_xml

# Deepest nesting of files; models are split by robot, gripper and scene, so deeper nesting is a mistake.
_DEEPEST = 8
_MAIN = "main"
# Tags that all set the attributes of the same default actuator.
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
# Elements of a body whose attributes are written out; no others are read here.
_OF_BODIES = ("joint", "geom", "site")

type _Attributes = dict[str, dict[str, str]]
# Attributes that make an actuator's force depend on more than its control, so that the control range is no bound.
_FEEDBACK = ("kp", "kv")


def expand_includes(path: Path, root: Element) -> tuple[Path, ...]:
    """Replaces every ``<include>`` by the contents of the file, in the model's folder or below; returns these files.

    A file that is elsewhere, cannot be read, is included twice or nested too deeply raises a BadValueError.
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
                problem += "writes all of a model into one file (mj_saveLastXML)"
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
    """Gives elements the attributes of their classes, and removes these; an unknown class raises a BadValueError."""
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
    """Reads the torque limit of every joint whose actuators are limited, [N m].

    An actuator is limited by the weaker end of its force range and, where its force is a multiple of its control, by
    that of its control range, times its gear; the limits of all actuators of a joint add up. An invalid range or gear
    raises a BadValueError.
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
    """Raises a BadValueError for an actuator that drives a joint which there is not."""
    for actuator, joint in _list_drives(root):
        if joint not in joints:
            problem = f"is {joint!r}, which is not a joint of the file{suggest(joint, joints)}"
            raise BadValueError(numbers.path, f"actuator {actuator.get('name', joint)}.joint", problem)


def _list_drives(root: Element) -> Iterator[tuple[Element, str]]:
    """Actuators of joints, with the name of the joint."""
    for actuator in root.iterfind("actuator/*"):
        joint = actuator.get("joint") or actuator.get("jointinparent")
        if actuator.tag in ACTUATORS and joint:
            yield actuator, joint


def read_limit(attributes: Mapping[str, str], name: str, numbers: Numbers, key: str) -> float:
    """Reads the limit of a range such as ``forcerange``, of ``force``, which ``forcelimited`` can switch off.

    Returns: Smaller magnitude of the range's two ends, infinite for no limit; a falling range raises a BadValueError.
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
