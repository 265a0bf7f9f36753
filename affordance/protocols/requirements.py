"""Requirements of a protocol on its objects, checked before anything runs."""

import enum
import itertools
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from affordance.exceptions import BadValueError
from affordance.objects.colour import SAME_COLOUR, is_same_colour
from affordance.objects.tool import Tool

# Masses that differ by less than this fraction are equal up to rounding.
SAME_MASS = 1e-9
# Distance from which centres of mass count as different, [m].
_APART = 1e-3


class Requirement(enum.StrEnum):
    """Condition on objects; "the decoy" is the last of them."""

    DECOY_AFTER_TWO = "decoy after two"  # at least three objects, the last is the decoy
    TWO_AND_DECOY = "two and a decoy"  # three objects, the last is the decoy
    ONE_GRIP = "one grip"
    ONE_LOOK = "one look"
    COLOURS_DIFFER = "colours differ"
    HONEST_BEFORE_DECOY = "honest before the decoy"
    DECOY_LIGHTER = "decoy lighter than it looks"
    SAME_MASS = "same mass"
    DECOY_LOOKS_LIKE_FIRST = "decoy looks like the first"
    DECOY_MADE_LIKE_SECOND = "decoy made like the second"
    CENTRES_OF_MASS_DIFFER = "centres of mass differ"
    HONEST = "honest"
    TWO_GRIPS = "two grips"


def check_requirements(requirements: Sequence[Requirement], path: Path, tools: Sequence[Tool]) -> None:
    """Raises a BadValueError if the objects of a file do not meet a requirement."""
    for requirement in requirements:
        _CHECKS[requirement](path, tools)


def check_tools_are_honest(path: Path, tools: Sequence[Tool]) -> None:
    """Raises a BadValueError for a part that looks like another material than its own."""
    for tool in tools:
        for i, part in enumerate(tool.components):
            if part.looks_like != part.material:
                problem = f"is {part.looks_like.name!r}, must be what it is made of, {part.material.name!r}"
                raise BadValueError(path, f"tools: {tool.name}.components[{i}].looks_like", problem)


def _check_decoy_after_two(path: Path, tools: Sequence[Tool]) -> None:
    if len(tools) < 3:
        problem = f"has {len(tools)} entries, must have at least 3: two objects and the decoy"
        raise BadValueError(path, "tools", problem)


def _check_two_and_decoy(path: Path, tools: Sequence[Tool]) -> None:
    if len(tools) != 3:
        raise BadValueError(path, "tools", f"has {len(tools)} entries, must have 3: two objects and the decoy")


def _check_one_grip(path: Path, tools: Sequence[Tool]) -> None:
    for tool in tools:
        if tool.grips:
            names = ", ".join(grip.name for grip in tool.grips)
            raise BadValueError(path, f"tools: {tool.name}.grips", f"are {names}, must not be given here")


def _check_one_look(path: Path, tools: Sequence[Tool]) -> None:
    shown = {component.looks_like for tool in tools for component in tool.components}
    if len(shown) > 1:
        names = ", ".join(sorted(material.name for material in shown))
        raise BadValueError(path, "tools", f"look like {names}, must all look like one material")


def _check_colours_differ(path: Path, tools: Sequence[Tool]) -> None:
    shown = {part.looks_like.name: part.looks_like for tool in tools for part in tool.components}
    for one, other in itertools.combinations(shown.values(), 2):
        if is_same_colour(one.colour, other.colour):
            problem = f"show {one.name} and {other.name}, whose colours must differ by more than {SAME_COLOUR:.2g}"
            raise BadValueError(path, "tools", f"{problem} of full in some channel")


def _check_honest(path: Path, tools: Sequence[Tool]) -> None:
    """Checks that all objects but the last look like their own material; names the materials if all look alike."""
    *honest, _ = tools
    shown = {component.looks_like for tool in tools for component in tool.components}
    made = {component.material for tool in honest for component in tool.components}
    if len(shown) == 1 and made != shown:
        names = ", ".join(sorted(material.name for material in made))
        raise BadValueError(path, "tools", f"before the decoy are made of {names}, must be of the one they look like")
    check_tools_are_honest(path, honest)


def _check_decoy_lighter(path: Path, tools: Sequence[Tool]) -> None:
    decoy = tools[-1]
    looks_like = decoy.components[0].looks_like
    density = decoy.mass / sum(component.shape.volume for component in decoy.components)
    if density >= looks_like.density * (1.0 - 1e-9):  # equal up to rounding is not less
        problem = f"has a density of {density:g} kg/m^3, must be less than the {looks_like.density:g}"
        raise BadValueError(path, f"tools: {decoy.name}", f"{problem} of {looks_like.name}, which it looks like")


def _check_same_mass(path: Path, tools: Sequence[Tool]) -> None:
    first, *others = tools
    for tool in others:
        if abs(tool.mass - first.mass) > SAME_MASS * first.mass:
            problem = f"weighs {tool.mass:.9g} kg, must weigh the same as {first.name}, {first.mass:.9g} kg"
            raise BadValueError(path, f"tools: {tool.name}", problem)


def _check_decoy_looks(path: Path, tools: Sequence[Tool]) -> None:
    first, decoy = tools[0], tools[-1]
    if decoy.appearance != first.appearance:
        raise BadValueError(path, f"tools: {decoy.name}", f"looks unlike {first.name}, must look the same")


def _check_decoy_made(path: Path, tools: Sequence[Tool]) -> None:
    second, decoy = tools[1], tools[-1]
    if not np.allclose(decoy.parameters, second.parameters, rtol=SAME_MASS, atol=SAME_MASS):
        raise BadValueError(path, f"tools: {decoy.name}", f"is made unlike {second.name}, must have the same inertia")


def _check_centres(path: Path, tools: Sequence[Tool]) -> None:
    first, second = tools[:2]
    if np.linalg.norm(first.p_TTcm - second.p_TTcm) < _APART:
        problem = f"has its centre of mass within {_APART:g} m of that of {first.name}, must have it elsewhere"
        raise BadValueError(path, f"tools: {second.name}", problem)


def _check_two_grips(path: Path, tools: Sequence[Tool]) -> None:
    for tool in tools:
        if len(tool.grips) != 2:
            raise BadValueError(path, f"tools: {tool.name}.grips", f"has {len(tool.grips)} entries, must have 2")


_CHECKS: Mapping[Requirement, Callable[[Path, Sequence[Tool]], None]] = {
    Requirement.DECOY_AFTER_TWO: _check_decoy_after_two,
    Requirement.TWO_AND_DECOY: _check_two_and_decoy,
    Requirement.ONE_GRIP: _check_one_grip,
    Requirement.ONE_LOOK: _check_one_look,
    Requirement.COLOURS_DIFFER: _check_colours_differ,
    Requirement.HONEST_BEFORE_DECOY: _check_honest,
    Requirement.DECOY_LIGHTER: _check_decoy_lighter,
    Requirement.SAME_MASS: _check_same_mass,
    Requirement.DECOY_LOOKS_LIKE_FIRST: _check_decoy_looks,
    Requirement.DECOY_MADE_LIKE_SECOND: _check_decoy_made,
    Requirement.CENTRES_OF_MASS_DIFFER: _check_centres,
    Requirement.HONEST: check_tools_are_honest,
    Requirement.TWO_GRIPS: _check_two_grips,
}
