"""Accuracy of learned densities if a camera sees objects in wrong sizes.

All parts of an object look larger, or all look smaller, by the same fraction, as for a camera with a wrong scale. The
fraction is fixed for all holds, or drawn uniformly up to a limit. Identification assumes its default size error.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from tqdm import tqdm

from affordance.belief.material_memory import MaterialMemory
from affordance.files.model_folder import MODELS
from affordance.identification.evidence.payload_likelihood import PayloadLikelihood
from affordance.identification.identify import see_tool
from affordance.identification.posterior.part_posterior import NotTheSeenObjectError, infer_parts
from affordance.identification.posterior.payload_belief import SURPRISE
from affordance.objects.inertia import build_inertia_map
from affordance.objects.load import load_tools
from affordance.objects.materials import load_materials
from affordance.objects.tool import Tool
from studies.recorded.simulated_truths import MATERIAL_PRIOR, World

# Fractions by which sizes are wrong, in per cent.
_WRONG = (0, 10, 20)
_UP_TO = 20  # limit of the drawn fractions, in per cent
_SIZE_ERROR = 0.2  # default of --size-error
_TOOLS = ("novel", "com", "weight", "uncommon")


def measure_seen_sizes(world: World, *, num_draws: int, seed: int) -> dict[str, float]:
    """Measures how often the 90 % interval of a learned density contains the truth, for each size error, [%].

    The key ``up_to_20`` is for errors drawn uniformly up to 20 %.
    """
    materials = load_materials(MODELS / "materials.yaml")
    tools = [tool for name in _TOOLS for tool in load_tools(MODELS / "tools" / f"{name}.yaml", materials)]
    # Tools that are decoys are left out: they would teach a wrong density whatever their size.
    honest = [tool for tool in tools if all(part.material == part.looks_like for part in tool.components)]
    errors: dict[str, Callable[[np.random.Generator], float]] = {
        str(wrong): partial(lambda wrong, rng: wrong * rng.choice([-1.0, 1.0]), wrong) for wrong in _WRONG
    }
    errors[f"up_to_{_UP_TO}"] = lambda rng: rng.uniform(-_UP_TO, _UP_TO)
    coverage = {}
    for name, draw in errors.items():
        rng, inside = np.random.default_rng((seed, 4)), []
        for _ in tqdm(range(num_draws), desc=f"sizes off by {name} %", unit="object", disable=None):
            tool = honest[rng.integers(len(honest))]
            inside += _teach(world, tool, _resize(tool, 1.0 + 0.01 * draw(rng)), rng)
        coverage[name] = float(np.mean(inside))
    return coverage


def _teach(world: World, tool: Tool, looks: Tool, rng: np.random.Generator) -> list[bool]:
    """Returns for each material whether its interval contains the true density; empty if nothing was learned."""
    parts = tool.components
    densities = np.array([part.material.density for part in parts])
    Phi = build_inertia_map([p.shape for p in parts], [p.X_TE for p in parts], range(len(parts)), len(parts))
    likelihood: PayloadLikelihood = world.hold(Phi @ densities, rng)
    settings = world.settings
    try:
        found = infer_parts(
            likelihood,
            see_tool(looks, MaterialMemory(), MATERIAL_PRIOR, _SIZE_ERROR).place(np.eye(4)),
            deviation=MATERIAL_PRIOR.deviation,
            unseen_share=settings.unseen_share,
            rng=rng,
            num_samples=settings.num_samples,
        )
    except NotTheSeenObjectError:
        return []
    if found.p_value < SURPRISE:
        return []
    memory = found.belief.memory
    low, high = memory.belief.compute_percentiles([0.05, 0.95])
    true = {part.looks_like.colour: part.material.density for part in parts}
    return [bool(low[i] <= true[colour] <= high[i]) for i, colour in enumerate(memory.colours)]


def _resize(tool: Tool, factor: float) -> Tool:
    """Returns the tool with every part scaled by a factor about the part's centre."""
    resized = [replace(p, shape=p.shape.with_sizes(factor * p.shape.sizes)) for p in tool.components]
    return replace(tool, components=tuple(resized))
