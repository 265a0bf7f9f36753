"""Reads MJCF models after MuJoCo has compiled them.

MuJoCo resolves includes, default classes, orientations and masses. The text for Drake is written from the compiled
model. MJCF has no velocity limits.
"""

import importlib.util
import itertools
import warnings
from collections.abc import Container, Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RollPitchYaw, RotationMatrix

from affordance.arrays import Array, list_entries
from affordance.exceptions import BadValueError
from affordance.extensions.robots.description import (
    Description,
    Inertial,
    JointNotes,
    Mimic,
    Visual,
    read_gravity,
    remark_couplings,
)
from affordance.extensions.robots.xml_reader import read_xml
from affordance.files.bounded import MESH, check_size

# Deepest nesting of files: models are divided into robot, gripper and scene, so deeper nesting is a mistake.
_DEEPEST = 8
# Elements that MuJoCo replicates, and thereby a file's size. Sites are massless, and a few may be replicated.
_MULTIPLIED, _FEW = ("replicate", "composite", "flexcomp"), 1000
# First group of collision geoms, which MuJoCo hides by default.
_FIRST_HIDDEN_GROUP = 3
# Shapes to draw, by MuJoCo's geom type.
_SHAPES = {2: "sphere", 3: "capsule", 4: "ellipsoid", 5: "cylinder", 6: "box"}
_JOINTS = ("free", "ball", "slide", "hinge")  # by MuJoCo's joint type


def read_mjcf(path: Path, root: Element) -> Description:
    """Reads an MJCF model.

    A mesh file is needed only if it determines a mass. If it is missing, the inertia of its body is a fault.

    Raises:
        BadValueError: MuJoCo finds a fault, or an include is in another folder.
    """
    if importlib.util.find_spec("mujoco") is None:
        raise BadValueError(path, "", "is an MJCF, which needs pip install 'visual-inertial-affordances[mjcf]'")
    import mujoco  # an optional dependency

    robot = Description(path, "mjcf", sources=tuple(_list_includes(path, root)))
    try:
        spec: Any = mujoco.MjSpec.from_file(str(path))
        _name_all(spec)
        _remove_looks(spec, robot)
        with warnings.catch_warnings(record=True, action="always") as told:
            model: Any = spec.compile()
    except ValueError as error:
        raise BadValueError(path, "", f"is refused by MuJoCo: {' '.join(str(error).split())}") from error
    robot.remarks += [f"MuJoCo says: {each.message}" for each in told]
    read_gravity(robot, model.opt.gravity.tolist())
    efforts, follows = _read_efforts(model), _read_couplings(model)
    written = ElementTree.Element("mujoco", model="robot")
    ElementTree.SubElement(written, "compiler", angle="radian")
    elements = [ElementTree.SubElement(written, "worldbody")]
    for index in range(1, model.nbody):
        body = model.body(index)
        name, inertial = body.name, _read_inertial(body)
        element = ElementTree.SubElement(elements[model.body_parentid[index]], "body", name=name)
        elements.append(element)
        _place(element, body.pos, body.quat)
        if name not in robot.faults:
            robot.inertials[name] = inertial
            if (stated := _find_negative(spec, name, inertial)) is not None:
                robot.mended[name] = stated.find_fault(), stated
        if name not in robot.faults and inertial.mass:
            values = {"pos": inertial.place, "mass": (inertial.mass,), "fullinertia": inertial.moments}
            ElementTree.SubElement(element, "inertial", {key: _join(each) for key, each in values.items()})
        robot.add_visuals(name, [*_read_visuals(model, index), *([None] if name in robot.undrawn else [])])
        if carried := float(model.body_gravcomp[index]):
            robot.carried[name] = carried
        for k in range(int(body.jntadr[0]), int(body.jntadr[0]) + int(body.jntnum[0])):
            joint = model.joint(k)
            if _JOINTS[int(joint.type[0])] != "free":
                notes = _write_joint(element, joint)
                robot.joints[joint.name] = notes._replace(effort=efforts.get(k), mimic=follows.get(k))
    names = {*robot.visuals, *robot.joints}
    for site in (model.site(k) for k in range(model.nsite)):
        if site.name and (carrier := int(site.bodyid[0])):  # a massless body, so that it can be a tip
            unique = _find_unused(f"{site.name}_site" if site.name in names else site.name, names)
            names.add(unique)
            robot.sites[unique] = model.body(carrier).name
            _place(ElementTree.SubElement(elements[carrier], "body", name=unique), site.pos, site.quat)
    remark_couplings(robot)
    _remark_loops(robot, model)
    robot.dropped.append(
        "actuators, tendons, sensors and equalities, except for torque limits and couplings of joints"
    )
    if shifted := [joint.name for joint in map(model.joint, range(model.njnt)) if _find_reference(joint)]:
        zero = "angles are zero in the model's initial pose"
        robot.dropped.append(f"the reference angle of {', '.join(shifted)}: {zero}")
    robot.text = ElementTree.tostring(written, encoding="unicode")
    return robot


def _list_includes(path: Path, root: Element) -> Iterator[Path]:
    """Lists included files and models. Files outside the model's folder and deep nesting are rejected."""
    folder = path.parent.resolve()

    def walk(element: Element, named_in: Path, depth: int) -> Iterator[Path]:
        for tag in _MULTIPLIED:
            if not all(map(_is_few_sites, element.iter(tag))):
                problem = "is not supported, except for sites, must be expanded (as when MuJoCo saves a model)"
                raise BadValueError(named_in, tag, problem)
        for include in (*element.iter("include"), *element.iterfind(".//asset/model")):
            name = include.get("file", "")
            file = (folder / name).resolve()
            if not name or not file.is_relative_to(folder):
                problem = f"names {name!r}, must be a file in the model's own folder, {folder}"
                raise BadValueError(named_in, "include", problem)
            if depth == _DEEPEST:
                raise BadValueError(named_in, "include", f"nests deeper than {_DEEPEST} files")
            yield file
            yield from walk(read_xml(file), file, depth + 1)

    return walk(root, path, 0)


def _is_few_sites(element: Element) -> bool:
    """Returns True if an element replicates only a few sites."""
    count = element.get("count", "")
    few = count.isdecimal() and int(count) * len(element) <= _FEW
    return element.tag == "replicate" and few and {child.tag for child in element} == {"site"}


def _name_all(spec: Any) -> None:
    """Names all unnamed bodies and joints."""
    for kind, elements in (("body", spec.bodies[1:]), ("joint", spec.joints)):
        names = {each.name for each in elements}
        for each in elements:
            if not each.name:
                each.name = _find_unused(kind if kind == "body" else f"{each.parent.name}_joint", names)
                names.add(each.name)


def _find_unused(name: str, used: Container[str]) -> str:
    """Returns a name, with a number appended if it is already used."""
    candidates = (name if k == 1 else f"{name}_{k}" for k in itertools.count(1))
    return next(candidate for candidate in candidates if candidate not in used)


def _remove_looks(spec: Any, robot: Description) -> None:
    """Removes mesh and picture files that are only drawn, so that these files may be missing.

    A body with such a mesh is recorded as undrawn. If the file of a mesh that determines a mass is missing, the
    body's inertia is a fault, and MuJoCo gets a sphere instead.
    """
    import mujoco

    compiler, geoms = spec.compiler, mujoco.mjtGeom
    compiler.fusestatic = compiler.discardvisual = False  # these options would remove bodies and shapes
    files = {mesh.name or Path(mesh.file).stem: mesh.file for mesh in spec.meshes}
    needed = set()
    for geom in spec.geoms:
        geom.material = ""
        if not geom.meshname:
            continue
        body, name, is_mesh = geom.parent, geom.parent.name, geom.type == geoms.mjGEOM_MESH
        if is_mesh and geom.group < _FIRST_HIDDEN_GROUP:
            robot.undrawn.add(name)
        low, high = compiler.inertiagrouprange
        from_shapes = compiler.inertiafromgeom == mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE
        counts = (from_shapes or not body.explicitinertial) and low <= geom.group <= high
        decides = name != "world" and counts and (geom.density if np.isnan(geom.mass) else geom.mass) > 0.0
        file = files.get(geom.meshname, "")
        found = Path(spec.modelfiledir) / (spec.meshdir or "") / file
        is_there = not file or found.is_file()  # without a file, its points are in the model
        if is_there and (decides or not is_mesh):  # others are shapes fitted to a mesh
            if file:
                check_size(found, MESH)
            needed.add(geom.meshname)
            continue
        if decides:
            numbers = "MuJoCo's body_mass, body_ipos, body_iquat, body_inertia"
            why = f"derives its inertia from the mesh {geom.meshname}, whose file {found} is missing"
            robot.faults[name] = f"{why}; give it, or an <inertial> ({numbers})"
            if compiler.settotalmass > 0.0:
                raise BadValueError(robot.path, "compiler.settotalmass", f"needs all masses, but link {name} {why}")
        geom.type, geom.size, geom.meshname = geoms.mjGEOM_SPHERE, [0.01] * 3, ""
        geom.mass = 1.0 if decides else 0.0
    for each in [*spec.meshes, *spec.materials, *spec.textures, *spec.skins]:
        if getattr(each, "name", "") not in needed and Path(getattr(each, "file", "")).stem not in needed:
            spec.delete(each)


def _find_negative(spec: Any, name: str, compiled: Inertial) -> Inertial | None:
    """Finds a negative mass or moment of a body in the file, which MuJoCo would set to zero without a message."""
    import mujoco

    body = spec.body(name)
    from_shapes = spec.compiler.inertiafromgeom == mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE
    if from_shapes or not body.explicitinertial or min(body.mass, *body.inertia) >= 0.0:
        return None
    return compiled._replace(mass=float(body.mass), moments=(*map(float, body.inertia), 0.0, 0.0, 0.0))


def _read_inertial(body: Any) -> Inertial:
    """Reads the inertia of a compiled body, in the body's axes."""
    R = RotationMatrix(Quaternion(body.iquat / np.linalg.norm(body.iquat))).matrix()
    moments = tuple(list_entries(R @ np.diag(body.inertia) @ R.T))
    inertial = Inertial(float(body.mass[0]), tuple(body.ipos.tolist()), (0.0,) * 3, moments)
    return inertial.find_nearest() if inertial.find_fault() else inertial  # rounding, as with a thin rod


def _join(values: Any) -> str:
    return " ".join(repr(float(value)) for value in values)


def _place(element: Element, position: Array, quaternion: Array) -> None:
    """Writes a pose, except the identity."""
    if position.any():
        element.set("pos", _join(position))
    if quaternion[1:].any():
        element.set("quat", _join(quaternion))


def _find_reference(joint: Any) -> float:
    """Returns the position of a hinge or slide in the model's initial pose."""
    return float(joint.qpos0[0]) if len(joint.qpos0) == 1 else 0.0


def _write_joint(element: Element, joint: Any) -> JointNotes:
    """Writes a joint for Drake, with positions relative to the model's initial pose."""
    kind, reference, damping = _JOINTS[int(joint.type[0])], _find_reference(joint), float(joint.damping[0])
    written = ElementTree.SubElement(element, "joint", name=joint.name, type=kind, axis=_join(joint.axis))
    if joint.pos.any():
        written.set("pos", _join(joint.pos))
    if joint.limited[0] and kind != "ball":
        written.attrib.update(range=_join(joint.range - reference), limited="true")
    if damping > 0.0:
        written.set("damping", repr(damping))
    return JointNotes(
        friction=float(joint.frictionloss[0]),
        stiffness=float(joint.stiffness[0]),
        damping=min(damping, 0.0),
        rotor_inertia=float(joint.armature[0]),
    )


def _read_efforts(model: Any) -> dict[int, float]:
    """Computes the torque limit, [N m], of every limited joint, by index.

    The limit of an actuator is the smaller magnitude of the two ends of its force range, times its gear. If its force
    is proportional to its control, the control range limits it in the same way. The limits of all actuators of a
    joint are added, and the joint's own limit applies to their sum.
    """
    efforts: dict[int, float] = {}
    for k in range(model.nu):
        actuator, limits = model.actuator(k), [np.inf]
        if actuator.trntype[0] > 1:  # not JOINT or JOINTINPARENT
            continue
        if actuator.forcelimited[0]:
            limits.append(_find_weaker(actuator.forcerange))
        if actuator.ctrllimited[0] and actuator.gaintype[0] == 0 and actuator.biastype[0] == 0:  # fixed gain, no bias
            limits.append(abs(float(actuator.gainprm[0])) * _find_weaker(actuator.ctrlrange))
        if np.isfinite(min(limits)):
            joint = int(actuator.trnid[0])
            efforts[joint] = efforts.get(joint, 0.0) + abs(float(actuator.gear[0])) * min(limits)
    for k in range(model.njnt):
        if model.jnt_actfrclimited[k]:
            efforts[k] = min(efforts.get(k, np.inf), _find_weaker(model.jnt_actfrcrange[k]))
    return efforts


def _find_weaker(ends: Array) -> float:
    return float(np.abs(ends).min())


def _read_couplings(model: Any) -> dict[int, Mimic]:
    """Reads the active couplings of joints, by index. A coupling without a second joint fixes the first."""
    follows = {}
    for k in range(model.neq):
        if model.eq_active0[k] and model.eq_type[k] == 2:  # mjEQ_JOINT
            leader = int(model.eq_obj2id[k])
            offset, multiplier, *higher = model.eq_data[k, :5].tolist()
            name = model.joint(leader).name if leader >= 0 else ""
            follows[int(model.eq_obj1id[k])] = Mimic(name, multiplier, offset, tuple(higher))
    return follows


def _remark_loops(robot: Description, model: Any) -> None:
    """Adds remarks about removed constraints: tendons, and closed loops between two bodies."""
    for k in range(model.neq):
        if not model.eq_active0[k] or model.eq_type[k] > 1:  # neither mjEQ_CONNECT nor mjEQ_WELD
            continue
        ends = [int(model.eq_obj1id[k]), int(model.eq_obj2id[k])]
        if model.eq_objtype[k] == 6:  # mjOBJ_SITE
            ends = [int(model.site_bodyid[end]) for end in ends]
        one, other = (model.body(end).name if end > 0 else "the world" for end in ends)
        robot.remarks.append(
            f"body {one} is tied to {other} by <{('connect', 'weld')[model.eq_type[k]]}>; this loop is cut: a body "
            "that is not on the arm's chain is frozen in the model's initial pose"
        )
    if model.ntendon:
        robot.remarks.append(f"{model.ntendon} tendons are left out, with their springs, limits and actuators")


def _read_visuals(model: Any, index: int) -> Iterator[Visual]:
    """Reads the visible simple shapes of a body."""
    first = int(model.body_geomadr[index])
    for k in range(first, first + int(model.body_geomnum[index])):
        kind, size = _SHAPES.get(int(model.geom_type[k])), model.geom_size[k]
        if kind is None or model.geom_group[k] >= _FIRST_HIDDEN_GROUP or model.geom_dataid[k] >= 0:
            continue
        sizes = {"sphere": size[:1], "ellipsoid": size, "box": 2.0 * size}.get(kind, size[:2] * [1.0, 2.0])
        R = RotationMatrix(Quaternion(model.geom_quat[k] / np.linalg.norm(model.geom_quat[k])))
        rpy = tuple(RollPitchYaw(R).vector().tolist())
        yield Visual(kind, tuple(sizes.tolist()), tuple(model.geom_pos[k].tolist()), rpy)
