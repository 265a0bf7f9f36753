"""Reads MJCF (MuJoCo) models: what Drake parses, and what Drake ignores.

Drake parses bodies, joints, ranges and damping. This module reads included files, default classes, armature, torque
limits, friction, springs, couplings and gravity. MJCF has no velocity limits.
"""

import itertools
import math
from collections.abc import Container, Mapping
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from affordance.exceptions import BadValueError, describe_choice
from affordance.extensions.robots.description import (
    Description,
    Inertial,
    JointNotes,
    Mimic,
    Visual,
    find_joint_fault,
)
from affordance.extensions.robots.mjcf_expansion import (
    check_drives,
    expand_includes,
    read_efforts,
    read_limit,
    write_out_defaults,
)
from affordance.extensions.robots.mjcf_masses import MassSettings, compile_masses, write_inertial
from affordance.extensions.robots.remarks import EARTH, read_gravity, remark_couplings
from affordance.extensions.robots.xml_reader import Numbers, remove_children

# Attributes that rotate an element.
_TURNS = ("quat", "euler", "axisangle", "xyaxes", "zaxis")
_KEPT_SECTIONS = ("compiler", "worldbody")
# Attributes that are left for Drake, by element. Drake would warn of all others, which are read here.
_KEPT = {
    "compiler": ("angle", "eulerseq", "autolimits", "coordinate", "inertiafromgeom"),
    "body": ("name", "pos", *_TURNS),
    "joint": ("name", "type", "pos", "axis", "range", "limited", "damping"),
    "geom": ("name", "type", "size", "pos", "fromto", "mass", "density", *_TURNS),
}
# Geoms of this group and higher ones are collision shapes: MuJoCo hides them by default.
_FIRST_HIDDEN_GROUP = 3
# Units of angles in messages, by their names in the file.
_UNITS = {"radian": "rad", "degree": "degrees"}


def read_mjcf(path: Path, root: Element) -> Description:
    """Reads an MJCF model.

    Raises:
        BadValueError: A value is invalid, a name is used twice, or an included file cannot be used.
    """
    numbers, robot = Numbers(path), Description(path, "mjcf", sources=expand_includes(path, root))
    for tag in ("replicate", "attach", "frame"):
        if root.find(f".//{tag}") is not None:
            raise BadValueError(path, tag, "is not supported, must be expanded (as when MuJoCo saves a model)")
    write_out_defaults(path, root)
    efforts, follows = read_efforts(root, numbers), _read_mimics(root, numbers)
    compiler = {name: value for element in root.findall("compiler") for name, value in element.attrib.items()}
    unit = _read_unit(path, compiler)
    from_geometry = compiler.get("inertiafromgeom") == "true"
    groups = numbers.parse(compiler.get("inertiagrouprange"), "compiler.inertiagrouprange", 2, (0.0, 5.0))
    _read_gravity(robot, root, numbers)
    bodies = list(root.iterfind("worldbody//body"))
    names = _name_bodies(path, bodies)
    shifted, free_joints = list[str](), list[str]()
    for body in bodies:
        name = body.get("name", "")
        for free in [joint for joint in body if joint.tag == "freejoint" or joint.get("type") == "free"]:
            free_joints.append(free.get("name", ""))
            body.remove(free)
        for joint in body.findall("joint"):
            joint_name = joint.attrib.setdefault("name", _find_unused(f"{name}_joint", robot.joints))
            if joint_name in robot.joints:
                raise BadValueError(path, f"joint {joint_name}", "appears twice")
            shifted += [joint_name] if joint.get("ref") else []
            notes = _read_joint(joint, unit, numbers, f"joint {joint_name}")
            whole = read_limit(joint.attrib, "actuatorfrc", numbers, f"joint {joint_name}")  # on their sum
            effort = min(efforts.get(joint_name, math.inf), whole)
            robot.joints[joint_name] = notes._replace(
                effort=effort if math.isfinite(effort) else None, mimic=follows.get(joint_name)
            )
        robot.add_visuals(name, _read_visuals(body, numbers))
        if carried := numbers.parse_one(body.get("gravcomp"), f"body {name}.gravcomp", 0.0):
            robot.carried[name] = carried
        inertial = body.find("inertial")
        if inertial is not None and not from_geometry:
            nearest = robot.add_inertial(name, _read_inertial(inertial, numbers, f"body {name}.inertial"))
            if nearest is not None:
                write_inertial(body, nearest)
            remove_children(body, ("geom",))
        else:
            _remove_other_groups(body, groups, numbers)
            if why := _find_unreadable(body):
                numbers_of = "MuJoCo's body_mass, body_ipos, body_iquat, body_inertia"
                robot.faults[name] = f"derives its inertia from {why}, must have an <inertial> ({numbers_of})"
                remove_children(body, ("geom",))
        robot.sites |= dict.fromkeys(_make_sites_bodies(body, names), name)
        remove_children(body, ("camera", "light", "composite", "flexcomp", "plugin"))
    check_drives(root, [*robot.joints, *free_joints], numbers)
    remark_couplings(robot)
    _remark_loops(robot, root)
    robot.dropped = _list_dropped(root, shifted)
    for section in {child.tag for child in root} - {*_KEPT_SECTIONS}:
        remove_children(root, (section,))
    for world in root.findall("worldbody"):
        remove_children(world, ("geom", "light", "camera", "site"))
    for element in root.iter():
        for attribute in set(element.attrib) - set(_KEPT.get(element.tag, element.attrib)):
            del element.attrib[attribute]
    robot.text = ElementTree.tostring(root, encoding="unicode")
    compile_masses(robot, root, MassSettings.read(compiler, numbers))
    return robot


def _read_unit(path: Path, compiler: Mapping[str, str]) -> str:
    """Reads the unit of angles, as messages name it."""
    unit = compiler.get("angle", "degree")
    if unit not in _UNITS:
        raise BadValueError(path, "compiler.angle", describe_choice(unit, _UNITS))
    return _UNITS[unit]


def _read_gravity(robot: Description, root: Element, numbers: Numbers) -> None:
    """Reads which way is up, and adds a remark if gravity is not the earth's."""
    written = [element.get("gravity") for element in root.findall("option") if element.get("gravity")]
    read_gravity(robot, numbers.parse(written[-1] if written else None, "option.gravity", 3, EARTH))


def _name_bodies(path: Path, bodies: list[Element]) -> set[str]:
    """Gives names to bodies without one; returns the names of all bodies."""
    names: set[str] = set()
    for body in bodies:
        name = body.get("name")
        if name in names:
            raise BadValueError(path, f"body {name}", "appears twice")
        names |= {name} if name else set()
    for body in bodies:
        if not body.get("name"):
            body.set("name", _find_unused("body", names))
            names.add(body.get("name", ""))
    return names


def _find_unused(name: str, used: Container[str]) -> str:
    """Returns the name, with a number appended if it is already used."""
    candidates = (name if k == 1 else f"{name}_{k}" for k in itertools.count(1))
    return next(candidate for candidate in candidates if candidate not in used)


def _read_joint(joint: Element, unit: str, numbers: Numbers, key: str) -> JointNotes:
    """Reads a joint, and removes the limits from its element that Drake must not see."""

    def take(name: str) -> float:
        return numbers.parse_one(joint.get(name), f"{key}.{name}", 0.0)

    low, high = numbers.parse(joint.get("range"), f"{key}.range", 2, (0.0, 0.0))
    axis = numbers.parse(joint.get("axis"), f"{key}.axis", 3, (0.0, 0.0, 1.0))
    damping, armature, ref = take("damping"), take("armature"), take("ref")
    fault = find_joint_fault(lower=low, upper=high, axis=axis, unit=unit)
    limited = joint.attrib.pop("limited", "auto") != "false" and low < high
    for name in ("range", "ref", *(("axis",) if fault else ()), *(("damping",) if fault or damping < 0.0 else ())):
        joint.attrib.pop(name, None)
    if limited:  # Drake's angles are relative to the model's initial pose
        joint.attrib.update(range=f"{low - ref!r} {high - ref!r}", limited="true")
    return JointNotes(
        friction=take("frictionloss"),
        stiffness=take("stiffness"),
        damping=min(damping, 0.0),
        rotor_inertia=armature,
        fault=fault,
    )


def _list_dropped(root: Element, shifted: list[str]) -> list[str]:
    """Lists the parts of the model that are not imported."""
    sections = sorted({child.tag for child in root} - {*_KEPT_SECTIONS})
    said = []
    if sections:
        said.append(f"sections {', '.join(sections)} of the file, except for joints' torque limits and couplings")
    if shifted:
        said.append(f"the reference angle of {', '.join(shifted)}: angles are zero in the model's initial pose")
    return said


def _read_mimics(root: Element, numbers: Numbers) -> dict[str, Mimic]:
    """Reads the active couplings of joints; if a coupling has no second joint, it fixes the first."""
    follows = {}
    for element in root.iterfind("equality/joint"):
        if element.get("active") != "false":
            words = (element.get("polycoef") or "0 1 0 0 0").split()
            offset, multiplier, *higher = numbers.parse(
                " ".join(words), "equality.joint.polycoef", max(2, min(len(words), 5)), ()
            )
            leader = element.get("joint2", "")
            follows[element.get("joint1", "")] = Mimic(leader, multiplier, offset, tuple(higher))
    return follows


def _remark_loops(robot: Description, root: Element) -> None:
    """Adds remarks on constraints that are removed: loop closures between two bodies, and tendons."""
    for tag in ("connect", "weld"):
        for element in root.iterfind(f"equality/{tag}"):
            if element.get("active") == "false":
                continue
            names = [element.get(f"body{k}") or robot.sites.get(element.get(f"site{k}", "")) for k in (1, 2)]
            one, other = (name or "the world" for name in names)
            robot.remarks.append(
                f"body {one} is tied to {other} by <{tag}>; this loop is cut: a body that is not on the arm's "
                "chain is frozen in the model's initial pose"
            )
    if tendons := len(root.findall("tendon/*")):
        robot.remarks.append(f"{tendons} tendons are left out, with their springs, limits and actuators")


def _read_inertial(inertial: Element, numbers: Numbers, key: str) -> Inertial:
    """Reads an inertial; if its axes are turned from the body's, it is only checked, and Drake transforms it."""
    turned = any(map(inertial.get, _TURNS))
    place = numbers.parse(inertial.get("pos"), f"{key}.pos", 3, (0.0,) * 3)
    if inertial.get("fullinertia"):
        moments = numbers.parse(inertial.get("fullinertia"), f"{key}.fullinertia", 6, (0.0,) * 6)
    else:
        moments = (*numbers.parse(inertial.get("diaginertia"), f"{key}.diaginertia", 3, (0.0,) * 3), 0.0, 0.0, 0.0)
    mass = numbers.parse_one(inertial.get("mass"), f"{key}.mass", 0.0)
    return Inertial(mass, place, (0.0, 0.0, 0.0), moments, in_link=not turned)


def _remove_other_groups(body: Element, groups: tuple[float, ...], numbers: Numbers) -> None:
    """Removes the shapes of groups that MuJoCo ignores when it derives a body's mass."""
    for geom in body.findall("geom"):
        if not groups[0] <= numbers.parse_one(geom.get("group"), "geom.group", 0.0) <= groups[1]:
            body.remove(geom)


def _find_unreadable(body: Element) -> str:
    """Describes a shape that contributes to a body's mass but is not supported; empty if there is none."""
    for geom in body.findall("geom"):
        if geom.get("mass") == "0" or geom.get("density") == "0":
            continue
        if geom.get("mesh"):
            return f"the mesh {geom.get('mesh')}"
        if geom.get("shellinertia") == "true":
            return "a shell"
    return ""


def _make_sites_bodies(body: Element, names: set[str]) -> list[str]:
    """Replaces a body's sites with massless bodies, which can be tips, and returns their names.

    A site that has the name of a body gets the suffix ``_site``.
    """
    made = []
    for site in body.findall("site"):
        if name := site.get("name"):
            unique = _find_unused(f"{name}_site", names) if name in names else name
            names.add(unique)
            place = {str(key): site.attrib[key] for key in ("pos", *_TURNS) if key in site.attrib}
            ElementTree.SubElement(body, "body", {**place, "name": unique})
            made.append(unique)
        body.remove(site)
    return made


def _read_visuals(body: Element, numbers: Numbers) -> list[Visual | None]:
    """Reads a body's simple shapes that are drawn; None stands for a mesh or a rotated shape."""
    drawn = list[Visual | None]()
    for geom in body.findall("geom"):
        kind, words = geom.get("type", "sphere"), geom.get("size", "").split()
        turned = any(name in geom.attrib for name in (*_TURNS, "fromto"))
        counts = {"sphere": 1, "ellipsoid": 3, "box": 3, "capsule": 2, "cylinder": 2}
        if turned or kind not in counts or len(words) < counts[kind]:
            group = numbers.parse_one(geom.get("group"), "geom.group", 0.0)
            drawn += [None] if group < _FIRST_HIDDEN_GROUP else []
            continue
        count = counts[kind]
        half = numbers.parse(" ".join(words[:count]), "geom.size", count, ())
        sizes = {"box": tuple(2.0 * value for value in half), "sphere": half, "ellipsoid": half}
        place = numbers.parse(geom.get("pos"), "geom.pos", 3, (0.0,) * 3)
        drawn.append(Visual(kind, sizes.get(kind, (half[0], 2.0 * half[-1])), place, (0.0, 0.0, 0.0)))
    return drawn
