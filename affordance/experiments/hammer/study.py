"""Study of the blows with one tool: forces and densities at which the cheaper grip changes, and other swings."""

import logging
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.choice.blow_cost import BlowCost
from affordance.choice.hammer import Hammer
from affordance.choice.work_map import HammeringMap, find_crossovers, map_work, pick_forces_around
from affordance.control.optimal_swing import SwingComparison, compare_swings
from affordance.control.swing import Swing, Target
from affordance.exceptions import AffordanceError
from affordance.objects.tool import Tool, list_densities
from affordance.plant.arm import load_arm
from affordance.plant.arm_model import ArmModel
from affordance.runs.repeats import run_tasks
from affordance.settings import Settings
from affordance.simulation.blow import Blow, simulate_blow

_LOG = logging.getLogger(__name__)

# Range of the map: from just above the resistance of the set nail to a multiple of the demanded force, and densities
# of the denser part from below that of wood to that of lead, and a little beyond the true one, [kg/m^3].
_MAP_FORCES, _MAP_DENSITIES = 80, 60
_MAP_MIN_FORCE, _MAP_MAX_FORCE = 1.02, 2.0
_MAP_MIN_DENSITY, _MAP_MAX_DENSITY, _MAP_BEYOND = 300.0, 11_340.0, 1.1


class HammerStudy(NamedTuple):
    """Results of the study.

    Attributes:
        compared: Names of the two grips of least simulated work, which the crossovers and the figure compare.
        crossovers: Forces at which both of them cost the same, [N].
        checked: Blows on either side of the first crossover, by force and grip; forces at which one fails are
            omitted.
        yielding: Demanded blows on a nail of constant resistance, by grip; empty if one of them fails.
        swings: Costs of other swings to the same strike, by grip; empty if one of them is not found.
        map: Work over force and density of the denser part.
        densities: Densities of the map's rows, (R,), [kg/m^3].
    """

    compared: tuple[str, ...]
    crossovers: list[float]
    checked: Mapping[float, Mapping[str, Blow]]
    yielding: Mapping[str, Blow]
    swings: Mapping[str, SwingComparison]
    map: HammeringMap
    densities: Array


def study_blows(
    tool: Tool,
    task: Hammer,
    settings: Settings,
    costs: Mapping[str, BlowCost],
    simulated: Mapping[str, Blow],
    *,
    jobs: int,
) -> HammerStudy:
    """Studies the blows with one tool, in processes.

    Args:
        tool: Tool of the study.
        task: Task of the blow.
        settings: Settings of arm and controller, without errors.
        costs: Planned blows, by grip.
        simulated: Simulated blows, by grip.
        jobs: Number of processes.
    """
    held, true = tool.list_gripped(), list_densities([tool])
    least, most = task.nail.stiffness * task.nail.depth_set, _MAP_MAX_FORCE * task.force
    forces = np.linspace(_MAP_MIN_FORCE * least, most, _MAP_FORCES)
    stronger = replace(task, force=most)
    planned = run_tasks(
        [partial(_plan_blows, stronger, gripped, settings) for gripped in held.values()],
        jobs=jobs,
        description="hammer: forces",
    )
    up_to_most = dict(zip(held, planned, strict=True))
    cheapest = sorted(held, key=lambda grip: simulated[grip].work)[:2]
    compared = {grip: up_to_most[grip] for grip in held if grip in cheapest}
    crossovers = find_crossovers(compared, {grip: held[grip].parameters for grip in compared}, forces)
    around: tuple[float, ...] = ()
    if crossovers:
        exact = [held[grip].parameters[None] for grip in compared]
        around = pick_forces_around(
            crossovers,
            forces=forces,
            feasible=map_work(list(compared.values()), exact, forces).feasible.all(axis=(0, 1)),
            least=least,
            demanded=task.force,
        )
    # The mean of the skin friction over the demanded travel takes the same energy.
    mean = 0.5 * task.nail.stiffness * (task.nail.depth_set + task.nail.depth_demanded)
    nail = replace(task.nail, yield_force=mean)
    blows = [partial(_simulate, held[grip], task, costs[grip], true, settings, nail=nail) for grip in held]
    for force in around:
        able = costs if force <= task.force else up_to_most
        blows += [partial(_simulate, held[grip], task, able[grip], true, settings, force=force) for grip in held]
    done = iter(run_tasks(blows, jobs=jobs, description="hammer: crossover"))
    yielding, *dealt = (_keep_all({grip: next(done) for grip in held}) for _ in (nail, *around))
    checked = {force: pair for force, pair in zip(around, dealt, strict=True) if pair}
    swings = _compare_swings(held, costs, simulated, settings, jobs)
    densest = max(tool.components, key=lambda part: part.material.density)
    densities = list_densities_of_map(densest.material.density)
    parameters = [
        np.array(
            [
                each.with_densities({**true, densest.looks_like.colour: float(density)}).parameters
                for density in densities
            ]
        )
        for each in held.values()
    ]
    mapped = map_work(list(up_to_most.values()), parameters, forces)
    return HammerStudy(tuple(compared), crossovers, checked, yielding, swings, mapped, densities)


def list_densities_of_map(true: float) -> Array:
    """Returns the densities of the denser part over which the work is mapped, (R,), around the true one, [kg/m^3]."""
    least, most = min(_MAP_MIN_DENSITY, true / _MAP_BEYOND), max(_MAP_MAX_DENSITY, _MAP_BEYOND * true)
    return np.linspace(least, most, _MAP_DENSITIES)


def _simulate(*arguments: Any, **changes: Any) -> Blow | AffordanceError:
    """Simulates an additional blow; returns the error if it fails, as it may on a light arm."""
    try:
        return simulate_blow(*arguments, **changes)
    except AffordanceError as error:
        return error


def _keep_all(blows: Mapping[str, Blow | AffordanceError]) -> dict[str, Blow]:
    """Returns the blows by grip; empty if one of them failed."""
    for blow in blows.values():
        if isinstance(blow, AffordanceError):
            _LOG.warning("additional blows are left out of the study: %s", blow)
            return {}
    return {grip: blow for grip, blow in blows.items() if isinstance(blow, Blow)}


def _plan_blows(task: Hammer, gripped: Tool, settings: Settings) -> BlowCost:
    return task.build_cost(ArmModel(load_arm(settings.arm)), gripped.components, settings)


def _compare_swings(
    held: Mapping[str, Tool],
    costs: Mapping[str, BlowCost],
    simulated: Mapping[str, Blow],
    settings: Settings,
    jobs: int,
) -> dict[str, SwingComparison]:
    """Compares other swings to the same strikes, by grip; empty if one of them cannot be found."""
    tasks = [
        partial(_compare, settings, costs[grip].target, simulated[grip].strike.swing, gripped.parameters)
        for grip, gripped in held.items()
    ]
    try:
        return dict(zip(held, run_tasks(tasks, jobs=jobs, description="hammer: swings"), strict=True))
    except AffordanceError as error:
        _LOG.warning("other swings than ours are not compared: %s", error)
        return {}


def _compare(settings: Settings, target: Target, swing: Swing, pi: Array) -> SwingComparison:
    return compare_swings(ArmModel(load_arm(settings.arm)), target, swing, pi)
