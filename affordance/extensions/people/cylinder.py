"""Cylinder of a single material, as an object to be lifted."""

import numpy as np

from affordance.arguments import check_number
from affordance.exceptions import BadArgumentError
from affordance.objects.colour import COLOUR_FORM, is_colour, parse_colour
from affordance.objects.inertia import DENSITY_MAX, DENSITY_MIN
from affordance.objects.materials import Material
from affordance.objects.primitives import Cylinder
from affordance.objects.tool import Component, Tool


def cylinder(name: str, *, radius: float, height: float, mass: float, colour: str = "#8c8c8c") -> Tool:
    """Creates a cylinder of a single material, held at its middle; lengths in m, mass in kg.

    A size, mass or density out of bounds, or an invalid colour, raises a BadArgumentError.
    """
    solid = Cylinder(check_number("radius", radius, 1e-3, 0.5, "m"), check_number("height", height, 1e-3, 1.0, "m"))
    density = check_number("mass", mass, 1e-3, 100.0, "kg") / solid.volume
    check_number(f"density of {name}", density, DENSITY_MIN, DENSITY_MAX, "kg/m^3")
    if not is_colour(colour):
        raise BadArgumentError("colour", "", f"is {colour!r}, {COLOUR_FORM}")
    material = Material(name, parse_colour(colour), density, source="ours")
    return Tool(name, (Component(solid, np.eye(4), material, material),))
