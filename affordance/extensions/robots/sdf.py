"""Reads SDF files, including contents that Drake ignores."""

import math
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from affordance.exceptions import BadValueError
from affordance.extensions.robots.description import (
    EARTH,
    MOMENTS,
    Description,
    Inertial,
    JointNotes,
    Mimic,
    Visual,
    find_joint_fault,
    read_gravity,
    remark_couplings,
    remark_missing,
)
from affordance.extensions.robots.xml_reader import Numbers, find_text, list_new, name_of, remove_children

_DRAKE = "{drake}"
_ACCELERATION = f"{_DRAKE}acceleration"
_NOT_OF_LINKS = ("visual", "collision", "sensor", "light", "audio_sink", "audio_source", "projector", "battery")
_NOT_OF_MODELS = ("plugin", "gripper", f"{_DRAKE}collision_filter_group")
_NO_PLACE = (0.0, 0.0, 0.0)


def read_sdf(path: Path, root: Element) -> Description:
    """Reads an SDF file.

    Raises:
        BadValueError: A value is invalid, or a name is used twice.
    """
    if root.find(".//include") is not None:  # Drake would search many folders, and the network
        raise BadValueError(path, "include", "is not supported, must be expanded")
    ElementTree.register_namespace("drake", "drake")
    numbers, robot = Numbers(path), Description(path, "sdf")
    for scope, model in _list_models(root, path):
        for link, name, key in list_new(model.findall("link"), path, robot.visuals, scope):
            robot.add_visuals(name, [_read_visual(each, numbers, key) for each in link.findall("visual")])
            inertial = link.find("inertial")
            if inertial is None:
                robot.faults[name] = "has no <inertial>, for which SDF's default is 1 kg"
                _put_nothing(ElementTree.SubElement(link, "inertial"))
            elif inertial.get("auto") is not None:
                robot.faults[name] = 'has an <inertial auto="true">, must have its inertia written out'
                inertial.attrib.clear()
                _put_nothing(inertial)
            else:
                nearest = robot.add_inertial(name, _read_inertial(inertial, numbers, f"{key}.inertial"))
                remark_missing(robot, name, inertial)
                if nearest is not None:
                    _write_moments(inertial, nearest)
            remove_children(link, _NOT_OF_LINKS)
        for joint, name, key in list_new(model.findall("joint"), path, robot.joints, scope):
            robot.joints[name] = _read_joint(joint, numbers, key)
            remove_children(joint, ("sensor", f"{_DRAKE}rotor_inertia", f"{_DRAKE}gear_ratio", f"{_DRAKE}mimic"))
            for axis in joint.findall("axis"):
                remove_children(axis, ("mimic",))
                dynamics = axis.find("dynamics")
                if dynamics is not None:
                    remove_children(dynamics, ("friction", "spring_reference", "spring_stiffness"))
                    if robot.joints[name].damping < 0.0:
                        remove_children(dynamics, ("damping",))
        robot.frames |= {f"{scope}{frame.get('name', '')}" for frame in model.findall("frame")}
        remove_children(model, _NOT_OF_MODELS)
    remark_couplings(robot)
    gravity = find_text(root, "world/gravity")
    if gravity is not None:
        read_gravity(robot, numbers.parse(gravity, "world.gravity", 3, EARTH))
    robot.text = ElementTree.tostring(root, encoding="unicode")
    return robot


def _list_models(element: Element, path: Path, scope: str = "") -> Iterator[tuple[str, Element]]:
    """Lists all models with the prefix of their names, such as ``outer::inner::``."""
    for child in element:
        if child.tag == "model":
            own = f"{scope}{name_of(child, path)}::"
            yield own, child
            yield from _list_models(child, path, own)
        elif child.tag == "world":
            yield from _list_models(child, path)


def _read_joint(joint: Element, numbers: Numbers, key: str) -> JointNotes:
    """Reads a joint. Limits that Drake cannot use are removed from the XML element."""

    def take(path: str, default: float) -> float:
        return numbers.parse_one(find_text(joint, path), f"{key}.{path.replace('/', '.')}", default)

    def take_bound(name: str) -> float | None:
        return numbers.parse_bound(find_text(joint, f"axis/limit/{name}"), f"{key}.axis.limit.{name}")

    effort, velocity = (
        None if bound is None or bound < 0.0 or math.isinf(bound) else bound  # negative values mean unlimited in SDF
        for bound in (take_bound("effort"), take_bound("velocity"))
    )
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
    for limit in joint.findall("axis/limit"):
        acceleration = numbers.parse_bound(find_text(limit, _ACCELERATION), f"{key}.axis.limit.acceleration")
        if acceleration is not None and not 0.0 < acceleration < math.inf:
            remove_children(limit, (_ACCELERATION,))
    lower, upper = take_bound("lower"), take_bound("upper")
    if joint.get("type") == "continuous":  # unlimited even if limits are given; Drake would require a range
        lower, upper = None, None
        for limit in joint.findall("axis/limit"):
            remove_children(limit, ("lower", "upper"))
    ratio, rotor = take(f"{_DRAKE}gear_ratio", 1.0), take(f"{_DRAKE}rotor_inertia", 0.0)
    axis = numbers.parse(find_text(joint, "axis/xyz"), f"{key}.axis.xyz", 3, (0.0, 0.0, 1.0))
    damping = take("axis/dynamics/damping", 0.0)
    fault = find_joint_fault(lower=lower, upper=upper, axis=axis)
    notes = JointNotes(
        effort=effort,
        velocity=0.0 if velocity == 0.0 else None,
        damping=min(damping, 0.0),
        friction=take("axis/dynamics/friction", 0.0),
        stiffness=take("axis/dynamics/spring_stiffness", 0.0),
        mimic=follows,
        rotor_inertia=rotor * ratio**2,
        fault=fault,
    )
    for element in joint.findall("axis") if fault else ():
        remove_children(element, ("limit", "dynamics", "xyz"))
        ElementTree.SubElement(element, "xyz").text = "0 0 1"
    return notes


def _read_inertial(inertial: Element, numbers: Numbers, key: str) -> Inertial:
    pose = _read_pose(inertial, numbers, key)
    place, rpy = pose or (_NO_PLACE, _NO_PLACE)
    unit = (1.0, 1.0, 1.0, 0.0, 0.0, 0.0)  # SDF's defaults for missing moments
    moments = tuple(
        numbers.parse_one(find_text(inertial, f"inertia/{name}"), f"{key}.inertia.{name}", default)
        for name, default in zip(MOMENTS, unit, strict=True)
    )
    mass = numbers.parse_one(find_text(inertial, "mass"), f"{key}.mass", 1.0)
    return Inertial(mass, place, rpy, moments, in_link=pose is not None)


def _read_pose(element: Element, numbers: Numbers, key: str) -> tuple[tuple[float, ...], tuple[float, ...]] | None:
    """Reads position and roll, pitch, yaw in the link's frame. Returns None for other frames and formats."""
    pose = element.find("pose")
    if pose is None:
        return _NO_PLACE, _NO_PLACE
    if pose.get("relative_to") or pose.get("rotation_format") or pose.get("degrees"):
        return None
    values = numbers.parse(pose.text, f"{key}.pose", 6, (*_NO_PLACE, *_NO_PLACE))
    return values[:3], values[3:]


def _put_nothing(inertial: Element) -> None:
    """Replaces an inertial with that of a massless body."""
    remove_children(inertial, {child.tag for child in inertial})
    _write_moments(inertial, Inertial(0.0, _NO_PLACE, _NO_PLACE, (0.0,) * 6))


def _write_moments(inertial: Element, values: Inertial) -> None:
    """Replaces the mass and moments of an inertial, and keeps its pose."""
    remove_children(inertial, ("mass", "inertia"))
    ElementTree.SubElement(inertial, "mass").text = repr(values.mass)
    inertia = ElementTree.SubElement(inertial, "inertia")
    for name, value in zip(MOMENTS, values.moments, strict=True):
        ElementTree.SubElement(inertia, name).text = repr(value)


def _read_visual(element: Element, numbers: Numbers, key: str) -> Visual | None:
    """Reads a shape. Returns None if it cannot be imported."""
    geometry, key = element.find("geometry"), f"{key}.visual"
    if geometry is None or not len(geometry) or (pose := _read_pose(element, numbers, key)) is None:
        return None
    diffuse = find_text(element, "material/diffuse")
    words = len((diffuse or "").split())
    colour = numbers.parse(diffuse, f"{key}.material.diffuse", words, ()) if words in (3, 4) else None
    if colour is not None and len(colour) == 3:
        colour = (*colour, 1.0)
    shape, (place, rpy) = geometry[0], pose
    sizes = numbers.parse_sizes(shape.tag, lambda name: find_text(shape, name), key)
    return Visual(shape.tag, sizes, place, rpy, (find_text(shape, "uri") or "").strip(), colour) if sizes else None
