"""Study of the blows with one tool: forces and densities at which the cheaper grip changes, and other swings."""

import logging
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.choice.blow_cost import BlowCost
from affordance.choice.hammer import Hammer
from affordance.choice.inner_simulation import Choice
from affordance.control.swing import Swing, Target
from affordance.exceptions import AffordanceError
from affordance.experiments.hammer import measure_blows
from affordance.experiments.shared.choice_task import ChoicePlan
from affordance.experiments.shared.choosing import ChoiceExperiment
from affordance.experiments.shared.decisions import remove_errors
from affordance.files.netcdf import LabelledArray, Trajectories, write_trajectories
from affordance.objects.tool import Tool, list_densities
from affordance.plant.arm_model import ArmModel
from affordance.plant.load import load_arm
from affordance.runs.repeats import run_tasks
from affordance.settings import Settings
from affordance.simulation.blow import Blow, simulate_blow
from studies.hammering.figure import draw_work_map
from studies.hammering.optimal_swing import SwingComparison, compare_swings
from studies.hammering.work_map import HammeringMap, find_crossovers, map_work, pick_forces_around
from studies.study import Findings

_LOG = logging.getLogger(__name__)

# Range of the map: from just above the resistance of the set nail to a multiple of the demanded force, and densities
# of the denser part from below that of wood to that of lead, and a little beyond the true one, [kg/m^3].
_MAP_FORCES, _MAP_DENSITIES = 80, 60
_MAP_MIN_FORCE, _MAP_MAX_FORCE = 1.02, 2.0
_MAP_MIN_DENSITY, _MAP_MAX_DENSITY, _MAP_BEYOND = 300.0, 11_340.0, 1.1


def list_blow_costs(choice: Choice) -> dict[str, BlowCost]:
    """Lists the blows that were planned for a choice, by grip."""
    found = {}
    for option, cost in zip(choice.options, choice.cost_models, strict=True):
        assert isinstance(cost, BlowCost)  # as built by a Hammer
        found[option.grip] = cost
    return found


class HammerStudy(NamedTuple):
    """Results of the study."""

    # Names of the two grips of least simulated work, which the crossovers and the figure compare.
    compared: tuple[str, ...]
    crossovers: list[float]  # forces at which both of them cost the same, [N]
    # Blows on either side of the first crossover, by force and grip; forces at which one fails are omitted.
    checked: Mapping[float, Mapping[str, Blow]]
    # Demanded blows on a nail of constant resistance, by grip; empty if one of them fails.
    yielding: Mapping[str, Blow]
    # Costs of other swings to the same strike, by grip; empty if one of them is not found.
    swings: Mapping[str, SwingComparison]
    map: HammeringMap  # work over force and density of the denser part
    densities: Array  # densities of the map's rows, (R,), [kg/m^3]


def study_blows(experiment: ChoiceExperiment, plan: ChoicePlan, *, jobs: int) -> HammerStudy:
    """Studies the blows with the first novel tool of an experiment, in processes."""
    tool, settings = experiment.novel[0], remove_errors(experiment.settings)
    task = experiment.task
    assert isinstance(task, Hammer)
    costs, simulated = plan.costs[tool.name], plan.simulated[tool.name]
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


def describe_blows(study: HammerStudy, experiment: ChoiceExperiment) -> Findings:
    """Lists numbers, figure and files of the study."""
    tool, task = experiment.novel[0], experiment.task
    assert isinstance(task, Hammer)
    numbers = {
        "force_demanded_N": task.force,
        **measure_crossovers(study.crossovers, study.checked, study.map.forces),
        "swings": {
            grip: {
                kind: {"energy": swing.work, "effort": swing.effort, "converged": swing.converged}
                for kind, swing in swings._asdict().items()
            }
            for grip, swings in study.swings.items()
        },
        "yielding_nail": {
            grip: {
                "travel_m": blow.travel,
                "force_measured_N": blow.force,
                "contact_peak_N": float(blow.nail.contact.max()),
            }
            for grip, blow in study.yielding.items()
        },
    }
    facts = {"tool": tool.name, "nail_stiffness": task.nail.stiffness, "depth_set": task.nail.depth_set}
    figures = {"map": partial(draw_work_map, study.map, study.densities, tool, task.force, study.compared)}
    return Findings(numbers, facts, figures, writers=(partial(_write_map, study, list(tool.list_gripped())),))


def _write_map(study: HammerStudy, grips: Sequence[str], folder: Path) -> None:
    axes = ("grip", "density", "force")
    variables = {
        "work": LabelledArray(axes, study.map.work, "J", "work of a blow"),
        "feasible": LabelledArray(axes, study.map.feasible, "1", "whether the blow is feasible"),
        "force": LabelledArray(("force",), study.map.forces, "N", "demanded peak of the nail's resistance"),
        "density": LabelledArray(("density",), study.densities, "kg/m^3", "density of the denser part"),
    }
    write_trajectories(folder / "map.nc", Trajectories(variables, {"grip": grips}))


def measure_crossovers(
    crossovers: Sequence[float], checked: Mapping[float, Mapping[str, Blow]], forces: Array
) -> dict[str, Any]:
    """Returns the planned forces at which the cheaper grip changes, and simulated blows on either side."""
    reason = None if crossovers else f"one grip is the cheaper one from {forces[0]:.0f} to {forces[-1]:.0f} N"
    return {
        "force_crossover_N": crossovers[0] if crossovers else None,
        "force_crossover_reason": reason,
        "force_crossovers_N": crossovers,
        "force_crossover_checked": [
            {"force_demanded_N": force, **measure_blows(blows)} for force, blows in checked.items()
        ],
    }
