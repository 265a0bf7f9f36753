"""The blows of simulation IV: planned and simulated with each grip, and where the cheaper grip is the other one."""

import dataclasses
import functools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.arm import ArmModel, load_arm
from affordance.blow import Blow, deal_blow
from affordance.experience import ExperienceConfig
from affordance.experiments.decisions import Choices, NovelObjects, plan_choices
from affordance.hammering_map import HammeringMap, find_crossovers, map_work
from affordance.nail import Nail
from affordance.optimal_swing import SwingComparison, compare_swings
from affordance.tasks.hammer import BlowEnergies, Hammer
from affordance.tools import Tool, list_densities

Array = NDArray[np.float64]

# A blow does what is asked if the peak of the nail's resistance is off by no more than this (issue 4; the formula by
# which blows are planned leaves aside what nail and contact take, docs/decisions/0013-nail.md).
FORCE_TOLERANCE = 0.15
# The map: from a little above the resistance of the set nail to a multiple of the demanded force, and over densities
# of the denser part from less than that of wood to that of lead, [kg/m^3].
_MAP_FORCES, _MAP_DENSITIES = 80, 60
_MAP_MIN_FORCE, _MAP_MAX_FORCE = 1.02, 2.0
_MAP_MIN_DENSITY, _MAP_MAX_DENSITY = 300.0, 11_340.0


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


@functools.lru_cache(maxsize=1)  # loading plans to refuse what cannot be dealt, running to choose
def build_choices(config: HammerConfig) -> Choices:
    """Plans the blows with each grip of each object."""
    return plan_choices(config.novel, config.task, config.experience.settings, config.experience.seed)


def get_energies(config: HammerConfig, tool: Tool) -> dict[str, BlowEnergies]:
    """The blows that were planned for each grip of one of the novel objects."""
    choices = build_choices(config)
    choice = choices.plain if tool is config.novel.plain else choices.headed
    found = {}
    for option, energies in zip(choice.options, choice.energies, strict=True):
        assert isinstance(energies, BlowEnergies)  # what a Hammer builds
        found[option.grip] = energies
    return found


@functools.lru_cache(maxsize=2)  # likewise: simulated when it is loaded, reported when it is run
def execute(config: HammerConfig, tool: Tool) -> dict[str, Blow]:
    """Simulates the blow under the true densities with each grip of a tool."""
    densities, settings = list_densities([tool]), config.experience.settings
    energies = get_energies(config, tool)
    return {grip.name: deal_blow(tool.hold_by(grip), energies[grip.name], densities, settings) for grip in tool.grips}


class Study(NamedTuple):
    """What is computed beside the choices.

    Attributes:
        executed: The blow with each grip of the plain object, under the true densities.
        executed_headed: The same for the headed object.
        crossovers: Forces at which both grips of the plain object cost the same, [N].
        checked: Blows on either side of the first of them, by force and grip; empty if there is none.
        yielding: The same blows on a nail of constant resistance, by grip.
        swings: What other swings to the same strike take, by grip.
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


def hold(tool: Tool) -> dict[str, Tool]:
    """The tool in each of its grips."""
    return {grip.name: tool.hold_by(grip) for grip in tool.grips}


def study(config: HammerConfig) -> Study:
    """Executes the blows, and those that show where the cheaper grip is the other one."""
    settings, task, plain = config.experience.settings, config.task, config.novel.plain
    energies, held, true = get_energies(config, plain), hold(plain), list_densities([plain])

    def deal(force: float | None = None, nail: Nail | None = None) -> dict[str, Blow]:
        return {
            grip: deal_blow(tool, energies[grip], true, settings, force=force, nail=nail)
            for grip, tool in held.items()
        }

    executed = execute(config, plain)
    model = ArmModel(load_arm(settings.arm))
    least, most = task.nail.stiffness * task.nail.depth_set, _MAP_MAX_FORCE * task.force
    forces = np.linspace(_MAP_MIN_FORCE * least, most, _MAP_FORCES)
    stronger = dataclasses.replace(task, force=most)
    up_to_most = {grip: stronger.build_energies(model, tool.components, settings) for grip, tool in held.items()}
    crossovers = find_crossovers(up_to_most, {grip: tool.parameters for grip, tool in held.items()}, forces)
    checked = {}
    if crossovers:
        # Half way, in proportion, to the least force and to the demanded one.
        for end in (least, task.force):
            force = float(np.sqrt(crossovers[0] * end))
            checked[force] = deal(force)
    # The mean of the skin friction over the demanded travel takes the same energy.
    mean = 0.5 * task.nail.stiffness * (task.nail.depth_set + task.nail.depth_demanded)
    swings = {
        grip: compare_swings(model, energies[grip].target, executed[grip].strike.swing, tool.parameters)
        for grip, tool in held.items()
    }
    densest = max(plain.components, key=lambda part: part.material.density).looks_like.colour
    densities = np.linspace(_MAP_MIN_DENSITY, _MAP_MAX_DENSITY, _MAP_DENSITIES)
    parameters = [
        np.array([tool.make_of({**true, densest: float(density)}).parameters for density in densities])
        for tool in held.values()
    ]
    return Study(
        executed,
        execute(config, config.novel.headed),
        crossovers,
        checked,
        deal(nail=dataclasses.replace(task.nail, yield_force=mean)),
        swings,
        map_work(list(up_to_most.values()), parameters, forces),
        densities,
    )
