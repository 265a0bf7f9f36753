"""Changes masses and inertias as MuJoCo's compiler does: bounds, balancing, and scaling to a total mass."""

from collections.abc import Mapping
from typing import NamedTuple
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np

from affordance.arrays import build_symmetric, list_entries
from affordance.exceptions import BadValueError
from affordance.extensions.robots.description import Description, Inertial
from affordance.extensions.robots.tree import build_tree
from affordance.extensions.robots.xml_reader import Numbers


class MassSettings(NamedTuple):
    """Compiler attributes that change masses; see "compiler" in MuJoCo's XML reference."""

    bound_mass: float = 0.0  # least mass of a body, [kg]
    bound_inertia: float = 0.0  # least principal moment of a body, [kg m^2]
    balances: bool = False  # True to replace impossible principal moments with their mean
    total_mass: float = -1.0  # mass to which the model is scaled, [kg]; not scaled if not positive

    @classmethod
    def read(cls, compiler: Mapping[str, str], numbers: Numbers) -> "MassSettings":
        """Reads the settings from a compiler element's attributes."""

        def read_one(name: str, default: float) -> float:
            return numbers.parse_one(compiler.get(name), f"compiler.{name}", default)

        return cls(
            bound_mass=read_one("boundmass", 0.0),
            bound_inertia=read_one("boundinertia", 0.0),
            balances=compiler.get("balanceinertia") == "true",
            total_mass=read_one("settotalmass", -1.0),
        )


def compile_masses(robot: Description, root: Element, settings: MassSettings) -> None:
    """Changes masses and inertias of a robot, in text and data, as MuJoCo's compiler does.

    Bounds are applied first, then balancing, then the total mass. A total mass raises a BadValueError if the mass of
    a body is unknown.
    """
    if settings == MassSettings():
        return
    if settings.total_mass > 0.0 and robot.faults:
        link, fault = next(iter(robot.faults.items()))
        raise BadValueError(robot.path, "compiler.settotalmass", f"needs all masses, but link {link} {fault}")
    plant = build_tree(robot).plant
    found = {}
    for name in robot.visuals:
        if name in robot.faults:
            continue
        written = robot.mended.get(name)
        if written is not None and written[1].mass > 0.0:
            inertial = written[1]
        else:
            total = plant.GetBodyByName(name).default_spatial_inertia()
            p_com = total.get_com()
            central = total.Shift(p_com).CalcRotationalInertia() if total.get_mass() else None
            values = (0.0,) * 6
            if central is not None:
                values = (*central.get_moments().tolist(), *central.get_products().tolist())
            inertial = Inertial(float(total.get_mass()), tuple(p_com.tolist()), (0.0,) * 3, values)
        changed = _bound(inertial, settings)
        if not changed.find_fault():
            robot.mended.pop(name, None)
            found[name] = changed
        else:
            found[name] = changed.find_nearest()
    scale = 1.0
    if settings.total_mass > 0.0:
        scale = settings.total_mass / sum(each.mass for each in found.values())
    for body in root.iterfind("worldbody//body"):
        if (name := body.get("name", "")) in found:
            inertial = found[name]
            moments = tuple(scale * value for value in inertial.moments)
            robot.inertials[name] = inertial._replace(mass=scale * inertial.mass, moments=moments)
            write_inertial(body, robot.inertials[name])
            for geom in body.findall("geom"):
                body.remove(geom)
    robot.text = ElementTree.tostring(root, encoding="unicode")


def _bound(inertial: Inertial, settings: MassSettings) -> Inertial:
    """Applies bounds and balancing to one body."""
    principal, axes = np.linalg.eigh(build_symmetric(inertial.moments))
    bounded = np.maximum(principal, settings.bound_inertia)
    if settings.balances and (bounded.sum() - 2.0 * bounded < 0.0).any():
        bounded = np.full(3, bounded.mean())
    mass = max(inertial.mass, settings.bound_mass)
    if (bounded == principal).all():
        return inertial._replace(mass=mass)
    moments = axes @ np.diag(bounded) @ axes.T
    return inertial._replace(mass=mass, moments=tuple(list_entries(moments)))


def write_inertial(body: Element, inertial: Inertial) -> None:
    """Replaces the inertia of a body; axes that are turned from the body's are kept."""
    element = body.find("inertial")
    if not inertial.mass:
        if element is not None:
            body.remove(element)
        return
    if element is None:
        element = ElementTree.SubElement(body, "inertial")
    for name in ("diaginertia", "fullinertia"):
        element.attrib.pop(name, None)
    if inertial.in_link:
        turned = set(element.attrib) - {"pos", "mass"}
        for name in turned:
            del element.attrib[name]
        element.set("pos", " ".join(map(repr, inertial.place)))
    element.set("mass", repr(inertial.mass))
    has_products = any(inertial.moments[3:])
    values = inertial.moments if has_products else inertial.moments[:3]
    element.set("fullinertia" if has_products else "diaginertia", " ".join(map(repr, values)))
