"""Reading an SDF: what Drake needs of it, and what Drake leaves out."""

import math
from pathlib import Path
from typing import cast
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from affordance.exceptions import BadValueError
from affordance.robots.description import Description, Inertial, JointNotes, Mimic, Visual, as_triple
from affordance.robots.xml_reader import Numbers, find_text, name_of, remove_children

_DRAKE = "{http://drake.mit.edu}"
_NOT_OF_LINKS = ("visual", "collision", "sensor", "light", "audio_sink", "audio_source", "projector", "battery")
_NOT_OF_MODELS = ("plugin", "gripper", f"{_DRAKE}collision_filter_group")
_SIZES = {
    "box": ("size",),
    "cylinder": ("radius", "length"),
    "capsule": ("radius", "length"),
    "sphere": ("radius",),
    "ellipsoid": ("radii",),
}
_NO_POSE = (0.0,) * 6


def read_sdf(path: Path, root: Element) -> Description:
    """Reads an SDF.

    Raises:
        BadValueError: A value is not what it must be, or a name is given twice; the message says where.
    """
    if root.find(".//include") is not None:  # Drake would look for it anywhere, and on the network
        raise BadValueError(path, "include", "is not read here, must be written out")
    ElementTree.register_namespace("drake", _DRAKE.strip("{}"))
    numbers = Numbers(path)
    joints: dict[str, JointNotes] = {}
    inertials: dict[str, Inertial] = {}
    visuals: dict[str, tuple[Visual, ...]] = {}
    faults: dict[str, str] = {}
    for link in list(root.iter("link")):
        name = name_of(link, path)
        visuals[name] = tuple(
            visual for element in link.findall("visual") for visual in _read_visual(element, numbers, name)
        )
        inertial = link.find("inertial")
        if inertial is None:
            faults[name] = "has no <inertial>, for which SDF puts 1 kg"
            _put_nothing(ElementTree.SubElement(link, "inertial"))
        elif inertial.get("auto") is not None:
            faults[name] = 'has an <inertial auto="true">, must have its inertia written out'
            inertial.attrib.clear()
            _put_nothing(inertial)
        else:
            inertials[name] = _read_inertial(inertial, numbers, f"link {name}.inertial")
            if fault := inertials[name].find_fault():
                faults[name] = fault
                _put_nothing(inertial)
        remove_children(link, _NOT_OF_LINKS)
    for joint in list(root.iter("joint")):
        if not len(joint):
            continue  # one that a collision filter or the like refers to
        name = name_of(joint, path)
        if name in joints:
            raise BadValueError(path, f"joint {name}", "is there twice")
        joints[name] = _read_joint(joint, numbers, f"joint {name}")
        remove_children(joint, ("sensor", f"{_DRAKE}rotor_inertia", f"{_DRAKE}gear_ratio", f"{_DRAKE}mimic"))
        for axis in joint.findall("axis"):
            remove_children(axis, ("mimic",))
            dynamics = axis.find("dynamics")
            if dynamics is not None:
                remove_children(dynamics, ("friction", "spring_reference", "spring_stiffness"))
    for model in list(root.iter("model")):
        remove_children(model, _NOT_OF_MODELS)
    text = ElementTree.tostring(root, encoding="unicode")
    return Description(path, "sdf", text, joints, inertials, faults, visuals)


def _read_joint(joint: Element, numbers: Numbers, key: str) -> JointNotes:
    def take(path: str, default: float) -> float:
        return numbers.parse_one(find_text(joint, path), f"{key}.{path.replace('/', '.')}", default)

    effort = numbers.parse_bound(find_text(joint, "axis/limit/effort"), f"{key}.axis.limit.effort")
    if effort is not None and (effort < 0.0 or math.isinf(effort)):
        effort = None  # SDF's way to say that there is no limit
    mimic = joint.find("axis/mimic")
    if mimic is None:
        mimic = joint.find(f"{_DRAKE}mimic")
    follows = None
    if mimic is not None:
        follows = Mimic(
            mimic.get("joint", ""),
            numbers.parse_one(find_text(mimic, "multiplier") or mimic.get("multiplier"), f"{key}.mimic", 1.0),
            numbers.parse_one(find_text(mimic, "offset") or mimic.get("offset"), f"{key}.mimic", 0.0),
        )
    ratio = take(f"{_DRAKE}gear_ratio", 1.0)
    return JointNotes(
        kind=joint.get("type", ""),
        effort=effort,
        friction=take("axis/dynamics/friction", 0.0),
        stiffness=take("axis/dynamics/spring_stiffness", 0.0),
        mimic=follows,
        rotor_inertia=take(f"{_DRAKE}rotor_inertia", 0.0) * ratio**2,
    )


def _read_inertial(inertial: Element, numbers: Numbers, key: str) -> Inertial:
    pose = inertial.find("pose")
    elsewhere = pose is not None and (pose.get("relative_to") or pose.get("rotation_format") or pose.get("degrees"))
    values = numbers.parse(None if elsewhere or pose is None else pose.text, f"{key}.pose", 6, _NO_POSE)
    names = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    unit = (1.0, 1.0, 1.0, 0.0, 0.0, 0.0)  # what SDF puts for moments that are left out
    moments = tuple(
        numbers.parse_one(find_text(inertial, f"inertia/{name}"), f"{key}.inertia.{name}", default)
        for name, default in zip(names, unit, strict=True)
    )
    return Inertial(
        numbers.parse_one(find_text(inertial, "mass"), f"{key}.mass", 1.0),
        as_triple(list(values[:3])),
        as_triple(list(values[3:])),
        cast(tuple[float, float, float, float, float, float], moments),
        in_link=not elsewhere,
    )


def _put_nothing(inertial: Element) -> None:
    """Makes an inertial that of a body without mass."""
    for child in list(inertial):
        inertial.remove(child)
    ElementTree.SubElement(inertial, "mass").text = "0"
    inertia = ElementTree.SubElement(inertial, "inertia")
    for name in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz"):
        ElementTree.SubElement(inertia, name).text = "0"


def _read_visual(element: Element, numbers: Numbers, link: str) -> list[Visual]:
    geometry, key = element.find("geometry"), f"link {link}.visual"
    pose = element.find("pose")
    if geometry is None or not len(geometry):
        return []
    if pose is not None and (pose.get("relative_to") or pose.get("rotation_format") or pose.get("degrees")):
        return []
    values = numbers.parse(None if pose is None else pose.text, f"{key}.pose", 6, _NO_POSE)
    place, rpy = as_triple(list(values[:3])), as_triple(list(values[3:]))
    diffuse = find_text(element, "material/diffuse")
    words = len((diffuse or "").split())
    colour = numbers.parse(diffuse, f"{key}.material.diffuse", words, ()) if words in (3, 4) else None
    if colour is not None and len(colour) == 3:
        colour = (*colour, 1.0)
    shape = geometry[0]
    if shape.tag == "mesh":
        scale = numbers.parse(find_text(shape, "scale"), f"{key}.mesh.scale", 3, (1.0, 1.0, 1.0))
        return [Visual("mesh", scale, place, rpy, (find_text(shape, "uri") or "").strip(), colour)]
    if shape.tag not in _SIZES:
        return []
    sizes: tuple[float, ...] = ()
    for tag in _SIZES[shape.tag]:
        count = 3 if tag in ("size", "radii") else 1
        sizes += numbers.parse(find_text(shape, tag), f"{key}.{shape.tag}.{tag}", count, (0.01,) * count)
    return [Visual(shape.tag, sizes, place, rpy, "", colour)]
