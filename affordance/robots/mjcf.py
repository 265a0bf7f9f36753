"""Reading an MJCF (MuJoCo) model: what Drake needs of it, and what Drake leaves out.

Drake reads bodies, joints, ranges and damping with their default classes. Armature, limits of torque, friction and
springs are read here, with the same classes; MJCF knows no velocity limit.
"""

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import cast
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from affordance.exceptions import BadValueError
from affordance.robots.description import Description, Inertial, JointNotes, Mimic, Visual, as_triple
from affordance.robots.xml_reader import Numbers, remove_children

# Of what acts on joints; what acts on tendons, bodies and sites is no actuator of one joint.
_ACTUATORS = ("motor", "general", "position", "velocity", "intvelocity", "damper", "cylinder", "muscle", "adhesion")
_MAIN = "main"
_OF_SITES = ("name", "pos", "quat", "euler", "axisangle")
_KEPT_SECTIONS = ("compiler", "default", "worldbody", "option")
_Classes = Mapping[str, Mapping[str, Mapping[str, str]]]


def read_mjcf(path: Path, root: Element) -> Description:
    """Reads an MJCF model.

    Raises:
        BadValueError: A value is not what it must be, or a body's inertia would have to come from a mesh.
    """
    for tag in ("include", "replicate", "attach", "frame"):
        if root.find(f".//{tag}") is not None:
            raise BadValueError(path, tag, "is not read here, must be written out (MuJoCo saves a model so)")
    numbers = Numbers(path)
    classes = _read_classes(root)
    limits, follows = _read_efforts(root, classes, numbers), _read_mimics(root, numbers)
    joints: dict[str, JointNotes] = {}
    inertials: dict[str, Inertial] = {}
    faults: dict[str, str] = {}
    visuals: dict[str, tuple[Visual, ...]] = {}
    from_geometry = root.find("compiler[@inertiafromgeom='true']") is not None
    for body, class_name in _list_bodies(root):
        name = body.get("name", "")
        for joint in body.findall("joint"):
            attributes = {**classes.get(joint.get("class", class_name), {}).get("joint", {}), **joint.attrib}
            joint_name = attributes.get("name", "")
            effort = _weaker(attributes.get("actuatorfrcrange"), numbers, f"joint {joint_name}.actuatorfrcrange")
            joints[joint_name] = JointNotes(
                kind=attributes.get("type", "hinge"),
                effort=limits.get(joint_name) if effort is None else effort,
                friction=_take(attributes, "frictionloss", numbers, joint_name),
                stiffness=_take(attributes, "stiffness", numbers, joint_name),
                mimic=follows.get(joint_name),
                rotor_inertia=_take(attributes, "armature", numbers, joint_name),
            )
        visuals[name] = tuple(_read_visuals(body, classes, class_name, numbers))
        inertial = body.find("inertial")
        if inertial is not None and not from_geometry:
            read = _read_inertial(inertial, numbers, f"body {name}.inertial")
            if read is not None:
                inertials[name] = read
                if fault := read.find_fault():
                    faults[name] = fault
                    body.remove(inertial)
            remove_children(body, ("geom",))
        elif mesh := _find_mesh(body, classes, class_name):
            faults[name] = f"takes its inertia from the mesh {mesh}, must have an <inertial>"
            remove_children(body, ("geom",))
        _make_sites_bodies(body)
        for free in [joint for joint in body if joint.tag == "freejoint" or joint.get("type") == "free"]:
            body.remove(free)
        remove_children(body, ("camera", "light", "composite", "flexcomp", "plugin"))
    sections = sorted({child.tag for child in root} - {*_KEPT_SECTIONS})
    for section in sections:
        remove_children(root, (section,))
    for world in root.findall("worldbody"):
        remove_children(world, ("geom", "light", "camera", "site"))
    dropped = (f"sections {', '.join(sections)} of the file, but for torques and couplings of joints",)
    text = ElementTree.tostring(root, encoding="unicode")
    return Description(path, "mjcf", text, joints, inertials, faults, visuals, dropped if sections else ())


def _take(attributes: Mapping[str, str], name: str, numbers: Numbers, joint: str) -> float:
    return numbers.parse_one(attributes.get(name), f"joint {joint}.{name}", 0.0)


def _read_classes(root: Element) -> dict[str, dict[str, dict[str, str]]]:
    """Attributes that default classes give to elements, by class and tag; those of a class's parents included."""
    found: dict[str, dict[str, dict[str, str]]] = {_MAIN: {}}

    def add(element: Element, inherited: dict[str, dict[str, str]]) -> None:
        own = {tag: dict(attributes) for tag, attributes in inherited.items()}
        for child in element:
            if child.tag != "default":
                own.setdefault(child.tag, {}).update(child.attrib)
        found[element.get("class", _MAIN)] = own
        for child in element.findall("default"):
            add(child, own)

    for element in root.findall("default"):
        add(element, found[_MAIN])
    return found


def _list_bodies(root: Element) -> Iterator[tuple[Element, str]]:
    """All bodies, each with the default class of what it holds."""

    def descend(element: Element, class_name: str) -> Iterator[tuple[Element, str]]:
        for body in list(element.findall("body")):
            own = body.get("childclass", class_name)
            yield from descend(body, own)
            yield body, own

    for world in root.findall("worldbody"):
        yield from descend(world, world.get("childclass", _MAIN))


def _read_efforts(root: Element, classes: _Classes, numbers: Numbers) -> dict[str, float]:
    """Largest torques of joints, from what drives them, [N m]."""
    efforts: dict[str, float] = {}
    for actuator in root.iterfind("actuator/*"):
        if actuator.tag not in _ACTUATORS or not actuator.get("joint"):
            continue
        attributes = {**classes.get(actuator.get("class", _MAIN), {}).get(actuator.tag, {}), **actuator.attrib}
        key = f"actuator {attributes.get('name', attributes['joint'])}"
        words = (attributes.get("gear") or "1").split()[:1]
        gear = abs(numbers.parse_one(" ".join(words), f"{key}.gear", 1.0))
        limit = _weaker(attributes.get("forcerange"), numbers, f"{key}.forcerange")
        if limit is None and actuator.tag == "motor":  # whose control is its force
            limit = _weaker(attributes.get("ctrlrange"), numbers, f"{key}.ctrlrange")
        if limit is not None:
            efforts[attributes["joint"]] = efforts.get(attributes["joint"], 0.0) + limit * gear
    return efforts


def _read_mimics(root: Element, numbers: Numbers) -> dict[str, Mimic]:
    """Couplings of joints, the linear part of their polynomials."""
    follows = {}
    for element in root.iterfind("equality/joint"):
        words = (element.get("polycoef") or "0 1 0 0 0").split()
        offset, multiplier = numbers.parse(" ".join(words[:2]), "equality.joint.polycoef", 2, (0.0, 1.0))
        follows[element.get("joint1", "")] = Mimic(element.get("joint2", ""), multiplier, offset)
    return follows


def _weaker(text: str | None, numbers: Numbers, key: str) -> float | None:
    """The smaller size of a range's two ends; None for no range."""
    if text is None:
        return None
    low, high = numbers.parse(text, key, 2, (-math.inf, math.inf))
    return min(abs(low), abs(high))


def _read_inertial(inertial: Element, numbers: Numbers, key: str) -> Inertial | None:
    """An inertial whose axes are the body's; those of others are Drake's to turn, and only checked."""
    turned = any(inertial.get(name) for name in ("quat", "euler", "axisangle", "xyaxes", "zaxis"))
    place = numbers.parse(inertial.get("pos"), f"{key}.pos", 3, (0.0,) * 3)
    if inertial.get("fullinertia"):
        moments = numbers.parse(inertial.get("fullinertia"), f"{key}.fullinertia", 6, (0.0,) * 6)
    else:
        moments = (*numbers.parse(inertial.get("diaginertia"), f"{key}.diaginertia", 3, (0.0,) * 3), 0.0, 0.0, 0.0)
    mass = numbers.parse_one(inertial.get("mass"), f"{key}.mass", 0.0)
    values = cast(tuple[float, float, float, float, float, float], moments)
    return Inertial(mass, as_triple(list(place)), (0.0, 0.0, 0.0), values, in_link=not turned)


def _find_mesh(body: Element, classes: _Classes, class_name: str) -> str:
    """A mesh that gives a body its mass; empty for none."""
    for geom in body.findall("geom"):
        attributes = {**classes.get(geom.get("class", class_name), {}).get("geom", {}), **geom.attrib}
        if attributes.get("mesh") and attributes.get("mass") != "0":
            return attributes["mesh"]
    return ""


def _make_sites_bodies(body: Element) -> None:
    """Makes bodies without mass of a body's sites, so that they can be named as tip."""
    for site in body.findall("site"):
        if site.get("name"):
            place = {str(key): site.attrib[key] for key in _OF_SITES if key in site.attrib}
            ElementTree.SubElement(body, "body", place)
        body.remove(site)


def _read_visuals(body: Element, classes: _Classes, class_name: str, numbers: Numbers) -> Iterator[Visual]:
    """Spheres, ellipsoids, boxes, capsules and cylinders that a body is drawn with, unless they are turned."""
    for geom in body.findall("geom"):
        attributes = {**classes.get(geom.get("class", class_name), {}).get("geom", {}), **geom.attrib}
        kind, words = attributes.get("type", "sphere"), attributes.get("size", "").split()
        turned = any(name in attributes for name in ("quat", "euler", "axisangle", "xyaxes", "zaxis", "fromto"))
        counts = {"sphere": 1, "ellipsoid": 3, "box": 3, "capsule": 2, "cylinder": 2}
        if turned or kind not in counts or len(words) < counts[kind]:
            continue
        count = counts[kind]
        half = numbers.parse(" ".join(words[:count]), "geom.size", count, ())
        sizes = {"box": tuple(2.0 * value for value in half), "sphere": half, "ellipsoid": half}
        place = as_triple(list(numbers.parse(attributes.get("pos"), "geom.pos", 3, (0.0,) * 3)))
        yield Visual(kind, sizes.get(kind, (half[0], 2.0 * half[-1])), place, (0.0, 0.0, 0.0))
