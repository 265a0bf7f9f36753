"""Presentations of a protocol, drawn for each observer, and their layout, which all observers share."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.exceptions import BadValueError, describe_choice
from affordance.objects.inertia import DENSITY_MAX, DENSITY_MIN
from affordance.objects.tool import Tool
from affordance.protocols.block_entries import ActionEntry, BlockEntry, GradualEntry
from affordance.protocols.number_entries import OF_OBJECTS, Measure
from affordance.protocols.object_entries import ProtocolObjects

# Most presentations of a protocol: a hundred times those of Linear+ (Cesanek et al. 2021), an hour's work.
_MOST = 20_000
# Measures that need a simulated motion.
_OF_MOTION = frozenset(
    {
        *(Measure.DROP, Measure.LIFT, Measure.EXCURSION, Measure.EXCURSION_GRIP, Measure.EXCURSION_CENTRE_OF_MASS),
        *(Measure.DEVIATION, Measure.RISES, Measure.LOG_EVIDENCE),
        *(Measure.PERIODS_LIMITED, Measure.PERIODS_FAILED, Measure.SAMPLES_REJECTED),
    }
)
# Measures that need an object in the hand.
_OF_FEELING = frozenset({Measure.P_VALUE, Measure.OUTLIER})
# Measures that need a reach.
_OF_REACHES = frozenset({Measure.WORK, Measure.PATH_ERROR})
# Measures that need a simulation, whatever the action.
_OF_SIMULATION = frozenset({Measure.COM_ERROR, Measure.INERTIA_ERROR, Measure.DENSITIES})


@dataclass(frozen=True)
class Presentation:
    """Presentation of an object of a block, by their indices; a mass, [kg], replaces its own; cycles count from 1."""

    tool: int
    block: int
    mass: float | None = None
    cycle: int = 1


def count_presentations(block: BlockEntry, groups: Mapping[str, Sequence[int]]) -> int:
    """Counts the presentations of a block, the same for every observer; a choice presents nothing."""
    return 0 if block.do.choose is not None else len(groups[block.objects]) * block.repetitions * block.times


def draw_presentations(
    block: BlockEntry, index: int, objects: ProtocolObjects, rng: np.random.Generator, repeat: int
) -> list[Presentation]:
    """Draws the presentations of a block to an observer, whose number is a row of a Latin square."""
    group = list(objects.groups[block.objects])
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
    must change, and imply a possible density. All blocks together present at most _MOST objects.
    """
    if (count := sum(count_presentations(block, objects.groups) for block in blocks)) > _MOST:
        raise BadValueError(path, "blocks", f"present {count} objects in all, must present at most {_MOST}")
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


class Layout(NamedTuple):
    """Layout of the K measured presentations of a protocol: its blocks, and the index of the block of each, (K,)."""

    blocks: Sequence[BlockEntry]
    block: NDArray[np.intp]
    is_closed_form: bool

    def find_measured(self, measure: Measure) -> NDArray[np.bool_]:
        """Returns a mask of the presentations in which a measure is taken, (K,)."""
        if measure is Measure.STOPPED:
            taken = np.array([block.is_chosen for block in self.blocks])
        else:
            taken = np.array([is_measured_in(measure, block.do, self.is_closed_form) for block in self.blocks])
        found: NDArray[np.bool_] = taken[self.block]
        return found

    def list_measures(self) -> list[Measure]:
        """Lists the measures taken in at least one presentation, and the numbers of the objects."""
        return [each for each in Measure if each in OF_OBJECTS or self.find_measured(each).any()]


def lay_out(blocks: Sequence[BlockEntry], groups: Mapping[str, Sequence[int]], *, is_closed_form: bool) -> Layout:
    """Lays out the measured presentations of a protocol; blocks of choices present nothing."""
    counts = [count_presentations(block, groups) if block.measured else 0 for block in blocks]
    return Layout(tuple(blocks), np.repeat(np.arange(len(blocks)), counts), is_closed_form)


def is_measured_in(measure: Measure, action: ActionEntry, is_closed_form: bool) -> bool:
    """Returns whether a measure is taken in presentations with an action."""
    if measure is Measure.FORCE:
        return action.clamp is not None or (is_closed_form and action.look is not None)
    if measure in _OF_REACHES:
        return action.reach is not None
    if measure in _OF_FEELING:
        return action.look is None and action.choose is None
    if measure in _OF_MOTION:
        return not is_closed_form and action.look is None and action.choose is None
    if measure in _OF_SIMULATION:
        return not is_closed_form
    return True
