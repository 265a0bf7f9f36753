"""Requirements of a protocol on its objects, checked before anything runs."""

import enum
import itertools
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np

from affordance.exceptions import BadValueError
from affordance.objects.colour import SAME_COLOUR, is_same_colour
from affordance.objects.materials import Material
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
        for key, problem in _list_faults(requirement, tools):
            raise BadValueError(path, f"tools{key}", problem)


def _list_faults(requirement: Requirement, tools: Sequence[Tool]) -> Iterator[tuple[str, str]]:
    """Lists violations of a requirement, each with its key below ``tools`` and the problem."""
    match requirement:
        case Requirement.DECOY_AFTER_TWO if len(tools) < 3:
            yield "", f"has {len(tools)} entries, must have at least 3: two objects and the decoy"
        case Requirement.TWO_AND_DECOY if len(tools) != 3:
            yield "", f"has {len(tools)} entries, must have 3: two objects and the decoy"
        case Requirement.ONE_GRIP:
            for tool in tools:
                if tool.grips:
                    names = ", ".join(grip.name for grip in tool.grips)
                    yield f": {tool.name}.grips", f"are {names}, must not be given here"
        case Requirement.TWO_GRIPS:
            for tool in tools:
                if len(tool.grips) != 2:
                    yield f": {tool.name}.grips", f"has {len(tool.grips)} entries, must have 2"
        case Requirement.ONE_LOOK if len(shown := _list_looks(tools)) > 1:
            yield (
                "",
                f"look like {_join_names(shown)}, must all look like one material (a decoy by its looks_like)",
            )
        case Requirement.COLOURS_DIFFER:
            for one, other in itertools.combinations({each.name: each for each in _list_looks(tools)}.values(), 2):
                if is_same_colour(one.colour, other.colour):
                    problem = f"show {one.name} and {other.name}, whose colours must differ by more than"
                    yield "", f"{problem} {SAME_COLOUR:.2g} of full in some channel"
        case Requirement.HONEST_BEFORE_DECOY:
            made = {part.material for tool in tools[:-1] for part in tool.components}
            if len(shown := _list_looks(tools)) == 1 and made != {*shown}:
                yield "", f"before the decoy are made of {_join_names(made)}, must be of the one they look like"
            yield from _list_faults(Requirement.HONEST, tools[:-1])
        case Requirement.HONEST:
            for tool in tools:
                for i, part in enumerate(tool.components):
                    if part.looks_like != part.material:
                        problem = f"is {part.looks_like.name!r}, must be what it is made of, {part.material.name!r}"
                        yield f": {tool.name}.components[{i}].looks_like", problem
        case Requirement.DECOY_LIGHTER:
            decoy = tools[-1]
            looks_like = decoy.components[0].looks_like
            density = decoy.mass / sum(component.shape.volume for component in decoy.components)
            if density >= looks_like.density * (1.0 - 1e-9):  # equal up to rounding is not less
                problem = f"has a density of {density:g} kg/m^3, must be less than the {looks_like.density:g}"
                yield f": {decoy.name}", f"{problem} of {looks_like.name}, which it looks like"
        case Requirement.SAME_MASS:
            first = tools[0]
            for tool in tools[1:]:
                if abs(tool.mass - first.mass) > SAME_MASS * first.mass:
                    problem = f"weighs {tool.mass:.9g} kg, must weigh the same as {first.name}, {first.mass:.9g} kg"
                    yield f": {tool.name}", problem
        case Requirement.DECOY_LOOKS_LIKE_FIRST if tools[-1].appearance != tools[0].appearance:
            yield f": {tools[-1].name}", f"looks unlike {tools[0].name}, must look the same"
        case Requirement.DECOY_MADE_LIKE_SECOND:
            second, decoy = tools[1], tools[-1]
            if not np.allclose(decoy.parameters, second.parameters, rtol=SAME_MASS, atol=SAME_MASS):
                yield f": {decoy.name}", f"is made unlike {second.name}, must have the same inertia"
        case Requirement.CENTRES_OF_MASS_DIFFER:
            first, second = tools[:2]
            if np.linalg.norm(first.p_TTcm - second.p_TTcm) < _APART:
                problem = (
                    f"has its centre of mass within {_APART:g} m of that of {first.name}, must have it elsewhere"
                )
                yield f": {second.name}", problem


def _list_looks(tools: Sequence[Tool]) -> list[Material]:
    return list(dict.fromkeys(part.looks_like for tool in tools for part in tool.components))


def _join_names(materials: Iterable[Material]) -> str:
    return ", ".join(sorted(material.name for material in materials))
