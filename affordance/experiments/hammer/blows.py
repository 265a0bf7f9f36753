"""The blows of simulation IV: planned and simulated with each grip, and where the cheaper grip is the other one."""

import dataclasses
import functools
import logging
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.choice.hammer import BlowCost, Hammer
from affordance.control.optimal_swing import SwingComparison, compare_swings
from affordance.exceptions import AffordanceError
from affordance.experiments.hammer.work_map import HammeringMap, find_crossovers, map_work, pick_forces_beside
from affordance.experiments.shared import correct_grip as right_grip
from affordance.experiments.shared.correct_grip import remove_errors
from affordance.experiments.shared.decisions import Choices, plan_choice, plan_choices
from affordance.experiments.shared.experience import ExperienceConfig
from affordance.experiments.shared.novel_objects import NovelObjects, hold
from affordance.objects.colour import Colour
from affordance.objects.tool import Tool, list_densities
from affordance.plant.arm import load_arm
from affordance.plant.arm_model import ArmModel
from affordance.plant.nail import Nail
from affordance.settings import Settings
from affordance.simulation.blow import Blow, simulate_blow

_LOG = logging.getLogger(__name__)


# A blow does what is asked if the peak of the nail's resistance is off by no more than this (issue 4; the formula by
# which blows are planned leaves aside what nail and contact take, docs/decisions/0013-nail.md).
FORCE_TOLERANCE = 0.15
# The map: from a little above the resistance of the set nail to a multiple of the demanded force, and over densities
# of the denser part from less than that of wood to that of lead, and beyond what it is by a little, [kg/m^3].
_MAP_FORCES, _MAP_DENSITIES = 80, 60
_MAP_MIN_FORCE, _MAP_MAX_FORCE = 1.02, 2.0
_MAP_MIN_DENSITY, _MAP_MAX_DENSITY, _MAP_BEYOND = 300.0, 11_340.0, 1.1


@dataclass(frozen=True)
class HammerConfig:
    """What is run.

    Attributes:
        experience: The objects that are held, and how they are learned.
        novel: The objects that are chosen about.
        task: The blow.
    """

    experience: ExperienceConfig
    novel: NovelObjects
    task: Hammer


def build_choices(config: HammerConfig) -> Choices:
    """Plans the blows with each grip of each object, as observers see it."""
    return plan_choices(config.novel, config.task, config.experience.settings, config.experience.seed)


def get_costs(config: HammerConfig, tool: Tool) -> dict[str, BlowCost]:
    """Plans the blows with each grip of a tool as it is, however observers see it."""
    choice = plan_choice(tool, config.task, remove_errors(config.experience.settings), config.experience.seed)
    found = {}
    for option, costs in zip(choice.options, choice.cost_models, strict=True):
        assert isinstance(costs, BlowCost)  # what a Hammer builds
        found[option.grip] = costs
    return found


def execute(config: HammerConfig, tool: Tool) -> dict[str, Blow]:
    """Simulates the blow under the true densities with each grip of a tool.

    Raises:
        AffordanceError: A blow cannot be dealt, or its simulation stalls.
    """
    experience = right_grip.remove_errors_of(config.experience)
    return _execute(dataclasses.replace(config, experience=experience), tool)


@functools.lru_cache(maxsize=2)  # simulated to refuse what cannot be dealt, reported when it is run
def _execute(config: HammerConfig, tool: Tool) -> dict[str, Blow]:
    return _deal(config, tool, get_costs(config, tool))


def _deal(
    config: HammerConfig,
    tool: Tool,
    costs: Mapping[str, BlowCost],
    *,
    force: float | None = None,
    nail: Nail | None = None,
) -> dict[str, Blow]:
    """Deals the blows that were planned for each grip, or those of another force or on another nail."""

    def strike(held: Tool, densities: Mapping[Colour, float], settings: Settings) -> Blow:
        return simulate_blow(held, costs[held.grip], densities, settings, force=force, nail=nail)

    return right_grip.execute(tool, config.experience.settings, strike)


def check_first_crossover(
    config: HammerConfig, crossovers: list[float], *, up_to_most: Mapping[str, BlowCost], forces: Array
) -> dict[float, dict[str, Blow]]:
    """Deals blows with each grip of the plain object on either side of the first of some crossovers.

    Args:
        config: What is run.
        crossovers: Forces at which both grips cost the same, rising, at least one, [N].
        up_to_most: Blows of up to the largest of the forces, by grip.
        forces: Where they were looked for, rising, [N].

    Returns: The blows by force and grip.
    """
    task, plain = config.task, config.novel.plain
    true = [tool.parameters[None] for tool in hold(plain).values()]
    beside = pick_forces_beside(
        crossovers,
        forces=forces,
        feasible=map_work(list(up_to_most.values()), true, forces).feasible.all(axis=(0, 1)),
        least=task.nail.stiffness * task.nail.depth_set,
        demanded=task.force,
    )
    costs = get_costs(config, plain)
    return {
        force: _deal(config, plain, costs if force <= task.force else up_to_most, force=force) for force in beside
    }


def list_densities_of_map(true: float) -> Array:
    """Densities of the denser part over which the work is mapped, (R,), around the true one, [kg/m^3]."""
    least, most = min(_MAP_MIN_DENSITY, true / _MAP_BEYOND), max(_MAP_MAX_DENSITY, _MAP_BEYOND * true)
    return np.linspace(least, most, _MAP_DENSITIES)


class Study(NamedTuple):
    """What is computed beside the choices.

    Attributes:
        executed: The blow with each grip of the plain object, under the true densities.
        executed_headed: The same for the headed object.
        crossovers: Forces at which both grips of the plain object cost the same, [N].
        checked: Blows on either side of the first of them, by force and grip; empty if there is none.
        yielding: The same blows on a nail of constant resistance, by grip.
        swings: What other swings to the same strike take, by grip; empty if there is none for one of them.
        map: Work over force and density of the denser part.
        densities: Of the map's rows, (R,), [kg/m^3].
    """

    executed: Mapping[str, Blow]
    executed_headed: Mapping[str, Blow]
    crossovers: list[float]
    checked: Mapping[float, Mapping[str, Blow]]
    yielding: Mapping[str, Blow]
    swings: Mapping[str, SwingComparison]
    map: HammeringMap
    densities: Array


def study(config: HammerConfig) -> Study:
    """Executes the blows, and those that show where the cheaper grip is the other one."""
    settings, task, plain = config.experience.settings, config.task, config.novel.plain
    costs, held, true = get_costs(config, plain), hold(plain), list_densities([plain])
    executed = execute(config, plain)
    model = ArmModel(load_arm(settings.arm))
    least, most = task.nail.stiffness * task.nail.depth_set, _MAP_MAX_FORCE * task.force
    forces = np.linspace(_MAP_MIN_FORCE * least, most, _MAP_FORCES)
    stronger = dataclasses.replace(task, force=most)
    up_to_most = {grip: stronger.build_cost(model, tool.components, settings) for grip, tool in held.items()}
    crossovers = find_crossovers(up_to_most, {grip: tool.parameters for grip, tool in held.items()}, forces)
    checked: dict[float, dict[str, Blow]] = {}
    if crossovers:
        checked = check_first_crossover(config, crossovers, up_to_most=up_to_most, forces=forces)
    # The mean of the skin friction over the demanded travel takes the same energy.
    mean = 0.5 * task.nail.stiffness * (task.nail.depth_set + task.nail.depth_demanded)
    swings: dict[str, SwingComparison] = {}
    try:
        for grip, tool in held.items():
            swings[grip] = compare_swings(model, costs[grip].target, executed[grip].strike.swing, tool.parameters)
    except AffordanceError as error:
        _LOG.warning("other swings than ours are not compared: %s", error)
        swings = {}
    densest = max(plain.components, key=lambda part: part.material.density)
    densities = list_densities_of_map(densest.material.density)
    parameters = [
        np.array(
            [
                tool.with_densities({**true, densest.looks_like.colour: float(density)}).parameters
                for density in densities
            ]
        )
        for tool in held.values()
    ]
    return Study(
        executed,
        execute(config, config.novel.headed),
        crossovers,
        checked,
        _deal(config, plain, costs, nail=dataclasses.replace(task.nail, yield_force=mean)),
        swings,
        map_work(list(up_to_most.values()), parameters, forces),
        densities,
    )
