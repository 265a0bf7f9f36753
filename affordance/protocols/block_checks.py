"""Checks of a protocol's blocks against its objects."""

from collections.abc import Sequence
from pathlib import Path

from affordance.exceptions import BadValueError, describe_choice
from affordance.objects.inertia import DENSITY_MAX, DENSITY_MIN
from affordance.objects.tool import Tool
from affordance.protocols.block_entries import BlockEntry, GradualEntry
from affordance.protocols.object_entries import ProtocolObjects
from affordance.protocols.presentations import weigh


def check_blocks(path: Path, blocks: Sequence[BlockEntry], objects: ProtocolObjects) -> None:
    """Refuses blocks that contradict their objects.

    Raises:
        BadValueError: A group that comes first, or an object whose weight changes, is not among the objects of its
            block; or the weight never changes, or implies an impossible density.
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
