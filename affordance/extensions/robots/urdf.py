"""Reads URDF files, including contents that Drake ignores."""

import math
from collections.abc import Collection
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from affordance.exceptions import BadValueError, describe_choice, suggest
from affordance.extensions.robots.description import (
    MOMENTS,
    Description,
    Inertial,
    JointNotes,
    Mimic,
    Visual,
    build_pose,
    find_joint_fault,
    remark_couplings,
    remark_missing,
)
from affordance.extensions.robots.xml_reader import Numbers, get_attribute, list_new, remove_children

_KINDS = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")
_WORLD = "world"  # exists even if the file has no such link
_NO_PLACE = (0.0, 0.0, 0.0)
_BOUNDS = ("lower", "upper", "velocity")
# Names of acceleration limits: in URDF 1.2, which ROS 2 reads, and in Drake.
_ACCELERATION, _OF_DRAKE = ("acceleration", "deceleration"), "drake:acceleration"
# Elements that may occur once in a link, inertial or joint. If an element is repeated, the first is used.
_SINGLE = ("inertial", "parent", "child", "origin", "axis", "limit", "dynamics", "mimic", "mass", "inertia")


def read_urdf(path: Path, root: Element) -> Description:
    """Reads a URDF file.

    Raises:
        BadValueError: A value is invalid, or a name is used twice.
    """
    numbers, robot = Numbers(path), Description(path, "urdf")
    connected: dict[frozenset[str], str] = {}
    colours = _read_colours(root, numbers)
    others = {child.tag for child in root if child.tag not in ("link", "joint", "material")}
    for link, name, key in list_new(root.findall("link"), path, robot.visuals):
        robot.add_visuals(name, [_read_visual(each, numbers, key, colours) for each in link.findall("visual")])
        remove_children(link, ("visual", "collision"))
        for attribute in set(link.attrib) - {"name"}:  # from an earlier version of URDF
            del link.attrib[attribute]
        _keep_first(robot, link, key)
        inertial = link.find("inertial")
        if inertial is not None:
            _keep_first(robot, inertial, key)
            nearest = robot.add_inertial(name, _read_inertial(inertial, numbers, f"{key}.inertial"))
            remark_missing(robot, name, inertial)
            if nearest is not None:
                _write_inertial(link, inertial, nearest)
    for joint, name, key in list_new(root.findall("joint"), path, robot.joints):
        _keep_first(robot, joint, key)
        pair = _read_connection(joint, path, key, robot.visuals)
        if (other := connected.setdefault(pair, name)) != name:
            problem = f"connects {' and '.join(sorted(pair))}, as joint {other} does, must be the only one"
            raise BadValueError(path, key, problem)
        robot.joints[name] = _read_joint(joint, numbers, key)
        if joint.get("type") == "fixed":
            parent, child = (get_attribute(joint.find(end), "link") or "" for end in ("parent", "child"))
            robot.fixed[child] = name, parent, build_pose(*_read_pose(joint, numbers, key))
        if joint.get("type") == "floating":
            robot.floating[get_attribute(joint.find("child"), "link") or ""] = name
        remove_children(joint, ("mimic", "safety_controller", "calibration"))
        dynamics = joint.find("dynamics")
        if dynamics is not None:
            for attribute in set(dynamics.attrib) - {"damping"}:
                del dynamics.attrib[attribute]
    remark_couplings(robot)
    remove_children(root, {child.tag for child in root} - {"link", "joint"})
    if others:
        robot.dropped.append(f"elements {', '.join(sorted(others))} of the file, which do not affect motion")
    root.attrib.setdefault("name", path.stem)  # Drake requires a name
    robot.text = ElementTree.tostring(root, encoding="unicode")
    return robot


def _read_connection(joint: Element, path: Path, key: str, links: Collection[str]) -> frozenset[str]:
    """Reads the names of the two links that a joint connects."""
    kind = joint.get("type", "")
    if kind not in _KINDS:
        raise BadValueError(path, f"{key}.type", describe_choice(kind, _KINDS))
    ends = {end: get_attribute(joint.find(end), "link") or "" for end in ("parent", "child")}
    for end, link in ends.items():
        if link not in links and link != _WORLD:
            problem = f"is {link!r}, which is not a link of the file{suggest(link, links)}"
            raise BadValueError(path, f"{key}.{end}.link", problem)
    if ends["parent"] == ends["child"]:
        raise BadValueError(path, key, f"connects the link {ends['parent']} to itself, must connect two")
    return frozenset(ends.values())


def _read_joint(joint: Element, numbers: Numbers, key: str) -> JointNotes:
    """Reads a joint. Limits that Drake cannot use are removed from the XML element."""
    if joint.get("type") == "fixed":  # its other data do not matter
        remove_children(joint, ("limit", "axis", "dynamics", "mimic"))
    limit, dynamics, mimic = joint.find("limit"), joint.find("dynamics"), joint.find("mimic")
    axis, kind = joint.find("axis"), joint.get("type", "")
    follows = None
    if mimic is not None:
        follows = Mimic(
            mimic.get("joint", ""),
            numbers.parse_one(mimic.get("multiplier"), f"{key}.mimic.multiplier", 1.0),
            numbers.parse_one(mimic.get("offset"), f"{key}.mimic.offset", 0.0),
        )
    _read_pose(joint, numbers, key)  # only checks that it is numeric; Drake reads it
    bounds = {name: numbers.parse_bound(get_attribute(limit, name), f"{key}.limit.{name}") for name in _BOUNDS}
    if kind == "continuous":  # unlimited even with a limit element
        bounds.update(lower=None, upper=None)
    elif bounds["lower"] is not None or bounds["upper"] is not None:
        bounds.update(lower=bounds["lower"] or 0.0, upper=bounds["upper"] or 0.0)  # URDF's default bound
    damping = numbers.parse_one(get_attribute(dynamics, "damping"), f"{key}.dynamics.damping", 0.0)
    direction = numbers.parse(get_attribute(axis, "xyz"), f"{key}.axis.xyz", 3, (1.0, 0.0, 0.0))
    lower, upper, velocity = (bounds[name] for name in _BOUNDS)
    fault = find_joint_fault(lower=lower, upper=upper, axis=direction)
    is_limited = velocity is None or velocity > 0.0
    effort = numbers.parse_bound(get_attribute(limit, "effort"), f"{key}.limit.effort")
    if limit is not None:
        _keep_acceleration(limit, numbers, key)
        limit.attrib.pop("effort", None)  # kept in the notes
        for name, value in bounds.items():
            limit.attrib.pop(name, None)
            if value is not None and math.isfinite(value) and not fault and (name != "velocity" or is_limited):
                limit.set(name, repr(value))
    if fault:
        remove_children(joint, ("axis", "dynamics"))
    if damping < 0.0:
        remove_children(joint, ("dynamics",))
    return JointNotes(
        effort=None if effort is None or math.isinf(effort) else effort,
        velocity=None if is_limited else velocity,
        damping=min(damping, 0.0),
        friction=numbers.parse_one(get_attribute(dynamics, "friction"), f"{key}.dynamics.friction", 0.0),
        mimic=follows,
        fault=fault,
        has_range=kind != "revolute" or lower is not None,
    )


def _keep_acceleration(limit: Element, numbers: Numbers, key: str) -> None:
    """Writes the lowest acceleration limit of a joint for Drake. A limit of 0 or less is no limit."""
    names = [name for name in limit.attrib if name in _ACCELERATION or name.endswith("}acceleration")]
    values = [numbers.parse_bound(limit.attrib.pop(name), f"{key}.limit.acceleration") for name in names]
    if found := [value for value in values if value is not None and 0.0 < value < math.inf]:
        limit.set(_OF_DRAKE, repr(min(found)))


def _read_pose(element: Element, numbers: Numbers, key: str) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Reads the position and roll, pitch, yaw of an element."""
    origin = element.find("origin")
    xyz, rpy = (
        numbers.parse(get_attribute(origin, name), f"{key}.origin.{name}", 3, _NO_PLACE) for name in ("xyz", "rpy")
    )
    return xyz, rpy


def _keep_first(robot: Description, element: Element, key: str) -> None:
    """Removes repetitions of unique elements, with a remark on each."""
    for tag in _SINGLE:
        if len(found := element.findall(tag)) > 1:
            robot.remark(key, f"has {len(found)} <{tag}> elements, of which the first is used")
            for other in found[1:]:
                element.remove(other)


def _write_inertial(link: Element, inertial: Element, nearest: Inertial) -> None:
    """Replaces the moments of an inertial. An inertial without mass is removed.

    Otherwise Drake would replace the massless inertial with a sphere.
    """
    if not nearest.mass:
        link.remove(inertial)
        return
    moments = inertial.find("inertia")
    assert moments is not None  # an inertial without moments is possible
    moments.attrib.update(zip(MOMENTS, map(repr, nearest.moments), strict=True))


def _read_inertial(inertial: Element, numbers: Numbers, key: str) -> Inertial:
    moments, (place, rpy) = inertial.find("inertia"), _read_pose(inertial, numbers, key)
    values = tuple(numbers.parse_one(get_attribute(moments, name), f"{key}.inertia.{name}", 0.0) for name in MOMENTS)
    mass = numbers.parse_one(get_attribute(inertial.find("mass"), "value"), f"{key}.mass", 0.0)
    return Inertial(mass, place, rpy, values)


def _read_colours(root: Element, numbers: Numbers) -> dict[str, tuple[float, ...]]:
    """Reads the colours of the named materials of a file."""
    colours = {}
    for material in root.iter("material"):
        rgba = get_attribute(material.find("color"), "rgba")
        if rgba and material.get("name"):
            colours[material.get("name", "")] = numbers.parse(rgba, "material.color.rgba", 4, ())
    return colours


def _read_visual(
    element: Element, numbers: Numbers, key: str, colours: dict[str, tuple[float, ...]]
) -> Visual | None:
    """Reads a shape. Returns None if it cannot be imported."""
    geometry, key = element.find("geometry"), f"{key}.visual"
    if geometry is None or not len(geometry):
        return None
    shape = geometry[0]
    place, rpy = _read_pose(element, numbers, key)
    material = element.find("material")
    colour = colours.get(get_attribute(material, "name") or "")
    if material is not None and material.find("color") is not None:
        colour = numbers.parse(get_attribute(material.find("color"), "rgba"), f"{key}.color", 4, (0.7,) * 3 + (1.0,))
    sizes = () if shape.tag == "ellipsoid" else numbers.parse_sizes(shape.tag, shape.get, key)  # not in URDF
    if not sizes:
        return None
    named = get_attribute(material, "name") or ""
    return Visual(shape.tag, sizes, place, rpy, shape.get("filename", ""), colour, named)
