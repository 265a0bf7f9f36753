"""Numbers of Simulation IV other than those of the choices, by grip."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.belief.material_memory import MaterialMemory
from affordance.choice.blow_cost import BlowCost
from affordance.choice.hammer import Hammer
from affordance.choice.inner_simulation import Choice
from affordance.choice.observed_options import list_options
from affordance.choice.ranking import NO_OPTION, Chosen, pick_cheapest
from affordance.experiments.shared.decisions import NUM_PRIOR_CHOICES
from affordance.experiments.shared.experience import ExperienceConfig
from affordance.objects.tool import Tool
from affordance.runs.random_streams import Stream
from affordance.settings import Settings
from affordance.simulation.blow import Blow
from affordance.vision.features import ComponentFeatures

_MEASURES: Mapping[str, Callable[[Blow], float]] = {
    "energy_true": lambda blow: blow.work,
    "energy_raising_true": lambda blow: blow.work_raising,
    "energy_without_raising_true": lambda blow: blow.work - blow.work_raising,
    "kinetic_energy_true": lambda blow: blow.kinetic_energy,
    "effort_true": lambda blow: blow.effort,
    "force_measured_N": lambda blow: blow.force,
    "contact_peak_N": lambda blow: float(blow.nail.contact.max()),
    "travel_m": lambda blow: blow.travel,
    "periods_limited": lambda blow: blow.record.counts.limited,
}
# Names of the numbers of blows.
OF_BLOWS = tuple(_MEASURES)


def measure_blows(blows: Mapping[str, Blow], suffix: str = "") -> dict[str, Any]:
    """Computes cost and outcome of blows, by grip."""
    return {
        name + suffix: {grip: measure(blow) for grip, blow in blows.items()} for name, measure in _MEASURES.items()
    }


def measure_demand(task: Hammer, tool: Tool, costs: Mapping[str, BlowCost]) -> dict[str, Any]:
    """Computes speed and energy of a tool's tip at the demanded force."""
    nail = task.nail
    pi = {grip: gripped.parameters[None] for grip, gripped in tool.list_gripped().items()}
    speeds = {grip: costs[grip].find_speed(pi[grip]) for grip in pi}
    slower = min(speeds.values())
    at_equal_speed = {grip: float(costs[grip].compute_at_speed(pi[grip], slower).work[0]) for grip in pi}
    return {
        "force_demanded_N": task.force,
        "tip_speed": {grip: float(speed[0]) for grip, speed in speeds.items()},
        "energy_planned": {grip: float(costs[grip].compute(pi[grip]).work[0]) for grip in pi},
        "energy_at_equal_tip_speed": at_equal_speed,
        # Energy to drive the nail from its set depth, and from the surface of the wood.
        "tip_energy": (task.force**2 - (nail.stiffness * nail.depth_set) ** 2) / (2.0 * nail.stiffness),
        "tip_energy_from_surface": task.force**2 / (2.0 * nail.stiffness),
    }


def count_light_ends(
    tool: Tool, costs: Mapping[str, BlowCost], experience: ExperienceConfig, settings: Settings
) -> float | None:
    """Computes the fraction of choices, under densities from the prior, that grip the less dense end.

    The true features are used, however features are observed, as the number characterises the task.
    """
    choice = Choice(list_options(tool, seed=experience.seed), list(costs.values()), settings)
    memory = MaterialMemory().add_colours(experience.colours, settings.prior)
    rng = np.random.default_rng([experience.seed, Stream.LIGHT_ENDS])
    rho = memory.belief.add_object_variation(settings.prior.deviation_sd).draw_samples(rng, NUM_PRIOR_CHOICES)
    chosen = pick_cheapest(choice.compute_costs(choice.compute_parameters(memory, rho)), rng)
    near, far = np.array([_order_colours(option.gripped, memory) for option in choice.options]).T
    return compute_share_of_light_ends(chosen, rho=rho, near=near, far=far)


def compute_share_of_light_ends(
    chosen: Chosen, *, rho: Array, near: NDArray[np.intp], far: NDArray[np.intp]
) -> float | None:
    """Computes the fraction of choices that put the less dense end into the hand.

    Args:
        chosen: Index of the option, or NO_OPTION, (S,).
        rho: Densities on which the choices are based, (S, M), [kg/m^3].
        near: Index of the density nearest to the hand, by option.
        far: Index of the density farthest from the hand, by option.

    Returns: Fraction of the choices made; None if no choice was made.
    """
    decided = np.flatnonzero(chosen != NO_OPTION)
    if not len(decided):
        return None
    option = chosen[decided]
    return float((rho[decided, near[option]] < rho[decided, far[option]]).mean())


def _order_colours(parts: Sequence[ComponentFeatures], memory: MaterialMemory) -> tuple[int, int]:
    """Returns the indices of the materials nearest to and farthest from the hand."""
    ordered = sorted(parts, key=lambda part: float(np.linalg.norm(part.X_TE[:3, 3])))
    near, far = (memory.colours.index(part.colour) for part in (ordered[0], ordered[-1]))
    return near, far
