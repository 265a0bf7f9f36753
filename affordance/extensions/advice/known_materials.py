"""Initial beliefs about materials from handbook densities and weighings."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from affordance.belief.colour_recognition import find_colour_index
from affordance.belief.likelihood import Likelihood
from affordance.belief.material_memory import MaterialMemory
from affordance.belief.positive_normal import find_untruncated
from affordance.belief.prior import Prior
from affordance.choice.options import Option
from affordance.choice.weighed import WeighedObject, describe_weighings
from affordance.exceptions import BadArgumentError, describe_choice
from affordance.objects.colour import Colour
from affordance.objects.materials import Material
from affordance.objects.tool import Tool
from affordance.vision.prediction import measure_geometry

# Smallest standard deviation of a handbook density, [kg/m^3].
_CERTAIN_SD = 1e-3


class NamedBelief(NamedTuple):
    """Belief about the materials of tools, and the source of each belief."""

    memory: MaterialMemory
    known: tuple[str, ...]  # materials with a handbook density, in the order of the tools
    learned: tuple[str, ...]  # materials with evidence in the memory; some have a handbook density too
    unknown: tuple[str, ...]  # materials with the prior of an unknown material
    deviation: float  # coefficient of variation of an object's density about the mean of its material

    def list_sources(self) -> dict[str, Any]:
        """Builds the JSON content: names by source, and the coefficient of variation between objects."""
        names = {"known": list(self.known), "learned": list(self.learned), "unknown": list(self.unknown)}
        return {**names, "deviation": self.deviation}


def know_by_name(
    memory: MaterialMemory,
    tools: Iterable[Tool],
    materials: Mapping[str, Material],
    prior: Prior,
    names: Collection[str] | None = None,
) -> NamedBelief:
    """Sets the prior of the tools' materials to handbook densities.

    The material of a part is its apparent material if the handbook has it, otherwise its true material. Evidence in
    the memory is kept. If several materials share a colour, the prior has the moments of their mixture. If the
    learner has several kinds per colour, the memory does not change.

    Args:
        memory: Belief about materials.
        tools: Tools that contain the materials.
        materials: Handbook of materials, by name.
        prior: Prior of unknown materials that the memory was built with.
        names: Names of the materials to look up; None for all of them, an empty collection for none.

    Raises:
        BadArgumentError: A name is not among the materials.
    """
    for name in names or ():
        if name not in materials:
            raise BadArgumentError("names", "", describe_choice(name, materials))
    met: dict[str, Colour] = {}  # materials of the tools' parts by name, with the colour that is shown
    for part in (part for tool in tools for part in tool.components):
        look, own = part.looks_like, part.material
        named = look if look.name in materials or own.name not in materials else own
        met.setdefault(named.name, look.colour)
    wanted = [name for name in met if name in materials and (names is None or name in names)]
    if not memory.learner.is_exact:
        wanted = []
    learned = tuple(name for name, colour in met.items() if find_colour_index(memory.colours, colour) is not None)
    if wanted:
        memory = memory.add_colours([met[name] for name in wanted], prior)
        memory = _replace_prior(memory, [(met[name], materials[name]) for name in wanted], prior)
    unknown = tuple(name for name in met if name not in (*wanted, *learned))
    return NamedBelief(memory, tuple(wanted), learned, unknown, prior.deviation)


def _replace_prior(memory: MaterialMemory, known: Sequence[tuple[Colour, Material]], prior: Prior) -> MaterialMemory:
    """Sets the prior of colours to handbook densities, without changing the evidence."""
    by_column: dict[int, list[Material]] = {}
    for colour, material in known:
        column = find_colour_index(memory.colours, colour)
        assert column is not None  # it was added
        by_column.setdefault(column, []).append(material)
    size = len(memory.colours)
    precision, information = np.zeros((size, size)), np.zeros(size)
    for column, alike in by_column.items():
        densities = np.array([each.density for each in alike])
        variance = float(np.mean([max(each.density_sd, _CERTAIN_SD) ** 2 for each in alike]) + densities.var())
        # Handbook moments describe positive densities. The belief is the normal distribution that has these moments
        # after truncation at zero.
        ((mean,), (sd,)) = find_untruncated(densities.mean(keepdims=True), np.sqrt([variance]))
        precision[column, column] = 1.0 / sd**2 - 1.0 / prior.sd**2
        information[column] = mean / sd**2 - prior.mode / prior.sd**2
    return memory.set_prior(memory.prior.condition(Likelihood(precision, information, 0.0)))


def learn_weighings(memory: MaterialMemory, objects: Mapping[str, Option], prior: Prior) -> MaterialMemory:
    """Updates a memory with the weighings of objects.

    Args:
        memory: Belief about materials.
        objects: One option of each object, by name.
        prior: Prior of unknown materials.
    """
    for option in objects.values():
        if option.weighings:
            recollection = memory.recall([part.appearance for part in option.features], prior)
            geometry = measure_geometry(option.features, range(len(option.features)), len(option.features))
            weighed = WeighedObject(option.features, recollection.columns, geometry, option.weighings)
            count = len(recollection.colours)
            memory = recollection.memory.learn(describe_weighings(weighed, range(count)), prior.deviation).memory
    return memory
