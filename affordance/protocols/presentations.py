"""Presentations of a protocol: objects and their order for each observer, and whether they suit the blocks."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from affordance.exceptions import AffordanceError, BadValueError, describe_choice
from affordance.objects.inertia import DENSITY_MAX, DENSITY_MIN
from affordance.objects.tool import Tool
from affordance.protocols.block_entries import BlockEntry, GradualEntry
from affordance.protocols.object_entries import ProtocolObjects

# Largest number of presentations of a block: a hundred times those of Linear+ (Cesanek et al. 2021), an hour's work.
_MOST = 20_000


@dataclass(frozen=True)
class Presentation:
    """Presentation of an object of a block, by their indices; a mass, [kg], replaces its own; cycles count from 1."""

    tool: int
    block: int
    mass: float | None = None
    cycle: int = 1


def draw_presentations(
    block: BlockEntry, index: int, objects: ProtocolObjects, rng: np.random.Generator, repeat: int
) -> list[Presentation]:
    """Draws the presentations of a block, at most _MOST, to an observer, whose number is a row of a Latin square."""
    group = list(objects.groups[block.objects])
    count = len(group) * block.repetitions * block.times
    if count > _MOST:
        problem = f"presents {len(group)} objects {block.repetitions} times, {block.times} in a row: {count} in all"
        raise AffordanceError(f"blocks[{index}]: {problem}, must be at most {_MOST}")
    before = [] if block.first is None else list(objects.groups[block.first])
    others = [tool for tool in group if tool not in before]
    presentations = []
    for repetition in range(block.repetitions):
        row = [*before, *order_objects(others, block.order, rng, repeat + repetition)]
        for tool in row:
            mass = None
            if block.gradual is not None and objects.tools[tool].name == block.gradual.object:
                share = repetition / max(1, block.repetitions - 1)
                mass = block.gradual.mass_from + share * (block.gradual.mass_to - block.gradual.mass_from)
            presentations += [Presentation(tool, index, mass, repetition + 1)] * block.times
    return presentations


def weigh(tool: Tool, mass: float) -> Tool:
    """Returns the object with all its densities scaled to another mass, [kg]."""
    factor = mass / tool.mass
    made = [replace(part.material, density=factor * part.material.density) for part in tool.components]
    parts = [replace(part, material=material) for part, material in zip(tool.components, made, strict=True)]
    return replace(tool, components=tuple(parts))


def order_objects(tools: Sequence[int], order: str, rng: np.random.Generator, row: int) -> list[int]:
    """Orders objects for one repetition; row is the index of the row in a Latin square."""
    if order == "shuffled":
        return [tools[int(place)] for place in rng.permutation(len(tools))]
    if order == "latin square" and tools:  # all may come first
        return [tools[place] for place in build_row(len(tools), row % count_rows(len(tools)))]
    return list(tools)


def count_rows(count: int) -> int:
    """Counts the rows of the square for a number of objects: the same number if it is even, else twice as many."""
    return count if count % 2 == 0 else 2 * count


def build_row(count: int, row: int) -> list[int]:
    """Builds a row of a square: each object is equally often in each place, and after each other (Williams 1949)."""
    zigzag = [(place + 1) // 2 if place % 2 else (count - place // 2) % count for place in range(count)]
    places = [(place + row) % count for place in zigzag]
    return places if row < count else places[::-1]


def check_blocks(path: Path, blocks: Sequence[BlockEntry], objects: ProtocolObjects) -> None:
    """Refuses blocks that contradict their objects, with a BadValueError.

    A group that comes first, or an object whose weight changes, must be among the objects of its block; the weight
    must change, and imply a possible density.
    """
    for index, block in enumerate(blocks):
        if block.do.choose is not None:
            continue
        names = [objects.tools[tool].name for tool in objects.groups[block.objects]]
        for tool in objects.groups[block.first or block.objects]:
            if objects.tools[tool].name not in names:
                problem = f"is {block.first!r} with {objects.tools[tool].name!r}, which is not of {block.objects!r}"
                raise BadValueError(path, f"blocks[{index}].first", f"{problem} and so would never be presented")
        if block.gradual is not None:
            _check_gradual(path, f"blocks[{index}].gradual", block, block.gradual, names)
            for key, mass in (("mass_from", block.gradual.mass_from), ("mass_to", block.gradual.mass_to)):
                _check_density(path, f"blocks[{index}].gradual.{key}", objects.tools, block.gradual.object, mass)


def list_changed(blocks: Sequence[BlockEntry], objects: ProtocolObjects) -> list[Tool]:
    """Lists the objects whose weight changes, with their first and last weights."""
    changed = []
    for block in blocks:
        if block.gradual is not None:
            (tool,) = (each for each in objects.tools if each.name == block.gradual.object)
            changed += [weigh(tool, mass) for mass in (block.gradual.mass_from, block.gradual.mass_to)]
    return changed


def _check_gradual(path: Path, key: str, block: BlockEntry, gradual: GradualEntry, names: Sequence[str]) -> None:
    if gradual.object not in names:
        raise BadValueError(path, f"{key}.object", describe_choice(gradual.object, names))
    if block.repetitions < 2:
        problem = f"is {gradual.mass_to:g} kg in the last repetition, must have at least 2 repetitions to get there"
        raise BadValueError(path, f"{key}.mass_to", problem)


def _check_density(path: Path, key: str, tools: Sequence[Tool], name: str, mass: float) -> None:
    (tool,) = (each for each in tools if each.name == name)
    for part in weigh(tool, mass).components:
        if not DENSITY_MIN <= part.material.density <= DENSITY_MAX:
            problem = f"is {mass:g} kg, which makes a density of {part.material.density:.3g} kg/m^3"
            raise BadValueError(path, key, f"{problem}, must be from {DENSITY_MIN:g} to {DENSITY_MAX:g}")
