"""Compares the predicted information of holds for a learner with kinds with the information that it then gains."""

from dataclasses import replace
from typing import Any

import numpy as np

from affordance.belief.material_memory import MaterialMemory
from affordance.belief.material_memory import start_memory as start_learner
from affordance.objects.primitives import Cylinder
from affordance.objects.tool import Tool
from studies.active import world as worlds

_NUM_SAMPLES, _HOLDS = 4000, 100
_DECOY, _ROD, _NEW = "rod of oak that looks like cast steel", "rod of cast steel", "longer rod of cast steel"


def compare_information(holds: int = _HOLDS) -> dict[str, Any]:
    """Compares predicted with gained information, [nat], after two rods of cast steel and a similar decoy.

    Returns:
        ``kinds``: ``promised`` and ``gained`` (mean over several holds) for each object; and ``kinds_worst``, the
        largest difference.
    """
    whole = worlds.build_workshop(("reach",))
    rod, oak = whole.candidates[_ROD], whole.candidates["bar of oak"].components[0].material
    decoy = _stretch(rod, 0.8, _DECOY)
    decoy = replace(decoy, components=tuple(replace(part, material=oak) for part in decoy.components))
    tools = [rod, _stretch(rod, 1.2, "another rod"), decoy, _stretch(rod, 1.4, _NEW)]
    workshop = whole._replace(candidates={tool.name: tool for tool in tools})
    memory = worlds.start_memory(workshop, start_learner("kinds_map"))
    for number, tool in enumerate([*tools[:2], decoy]):
        memory, _ = _learn(workshop, tool, memory, number)
    names = [rod.name, decoy.name, _NEW]
    advice = worlds.advise(workshop, memory, names, num_samples=_NUM_SAMPLES)
    promised = {each.name: each.information for each in advice.ranked}
    gained = {
        name: float(np.mean([_learn(workshop, workshop.candidates[name], memory, 10 + n)[1] for n in range(holds)]))
        for name in names
    }
    worst = max(abs(promised[name] - gained[name]) for name in gained)
    return {"kinds": {"promised": promised, "gained": gained}, "kinds_worst": worst}


def _learn(
    workshop: worlds.Workshop, tool: Tool, memory: MaterialMemory, number: int
) -> tuple[MaterialMemory, float]:
    """Updates on a hold; returns the memory, and the information gained about common kinds if beliefs were normal."""
    rng = np.random.default_rng([number, 1])
    deviation = workshop.settings.prior.deviation
    true = {
        part.looks_like.colour: part.material.density * (1.0 + deviation * rng.standard_normal())
        for part in tool.components
    }
    after, _ = worlds.learn(workshop, tool.name, true, memory, (number, 2))
    return after, 0.5 * float(_measure(memory) - _measure(after))


def _measure(memory: MaterialMemory) -> float:
    return float(np.linalg.slogdet(memory.belief.covariance)[1])


def _stretch(tool: Tool, factor: float, name: str) -> Tool:
    """Returns a rod whose length is multiplied by a factor, which makes it a different object."""
    (part,) = tool.components
    assert isinstance(part.shape, Cylinder)
    longer = replace(part.shape, length=factor * part.shape.length)
    return replace(tool, name=name, components=(replace(part, shape=longer),))
