"""Ranks tools and the ends to hold them by: before any experience, after it, and with one density for everything.

Options are ranked by the expected cost of a task. Before experience, any material may have any density. After it, the
belief is what was learned from holding objects. An observer with one density for everything only knows shapes.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from affordance.belief.material_memory import MaterialMemory
from affordance.choice.inner_simulation import Choice, TaskCostModel, plan_choice
from affordance.choice.motion_cost import Costs
from affordance.choice.options import Option
from affordance.choice.picking import pick_cheapest
from affordance.choice.ranking import Ranking, rank_options
from affordance.objects.colour import Colour
from affordance.objects.materials import Material
from affordance.settings import Settings

# Names of the beliefs.
BEFORE, AFTER, ONE_DENSITY, TRUE = "before", "after", "one_density", "true"
NUM_SAMPLES = 4000


def build_beliefs(
    materials: Mapping[str, Material], experience: MaterialMemory, settings: Settings
) -> dict[str, MaterialMemory]:
    """Builds the memories before and after experience, with one density for everything, and with all densities known.

    The one density is the mode of the prior.
    """
    colours: list[Colour] = list(dict.fromkeys(material.colour for material in materials.values()))
    return {
        BEFORE: MaterialMemory().add_colours(colours, settings.prior),
        AFTER: experience.add_colours(colours, settings.prior),
        ONE_DENSITY: MaterialMemory.from_densities(dict.fromkeys(colours, settings.prior.mode)),
        TRUE: MaterialMemory.from_densities({each.colour: each.density for each in materials.values()}),
    }


def rank_grips(
    options: Sequence[Option],
    task: TaskCostModel,
    beliefs: Mapping[str, MaterialMemory],
    settings: Settings,
    *,
    seed: int,
    num_samples: int = NUM_SAMPLES,
) -> dict[str, Ranking]:
    """Ranks options under each belief, and also among the grips of each tool; motions are planned once.

    Raises:
        AffordanceError: An option cannot be planned.
    """
    choice = plan_choice(options, task, settings)
    return {
        name: _rank_within_tools(choice, memory, np.random.default_rng([seed, *name.encode()]), num_samples)
        for name, memory in beliefs.items()
    }


def _rank_within_tools(choice: Choice, memory: MaterialMemory, rng: np.random.Generator, num_samples: int) -> Ranking:
    """Ranks the options of a choice, and finds how probably each option is the cheapest of its tool."""
    ranking = rank_options(choice, memory, rng, num_samples)
    costs = choice.compute_costs(choice.draw_parameters(memory, rng, num_samples))
    names = [option.object_name for option in choice.options]
    shares: dict[str, float] = {}
    for tool in dict.fromkeys(names):
        own = [index for index, name in enumerate(names) if name == tool]
        of_tool = Costs(costs.work[own], costs.effort[own], costs.feasible[own], costs.cost[own])
        picked = pick_cheapest(of_tool, rng)
        shares |= {choice.options[index].name: float((picked == place).mean()) for place, index in enumerate(own)}
    ranked = tuple(entry._replace(p_best_of_tool=shares[entry.option.name]) for entry in ranking.ranked)
    return ranking._replace(ranked=ranked)
