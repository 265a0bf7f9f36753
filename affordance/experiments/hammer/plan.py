"""Plan of Simulation IV that all observers share: blows planned with each grip, and simulated with contact."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

from affordance.choice.blow_cost import BlowCost
from affordance.choice.hammer import Hammer
from affordance.choice.inner_simulation import Choice
from affordance.exceptions import AffordanceError, BadValueError, SeeingError, UnavailableError, name_object
from affordance.experiments.hammer.off_axis import compute_blow_work
from affordance.experiments.shared.correct_grip import check_one_grip_is_cheaper, remove_errors
from affordance.experiments.shared.grip_choices import plan_choices
from affordance.experiments.shared.off_axis import measure_changes
from affordance.objects.tool import Tool, list_densities
from affordance.plant.load import load_arm
from affordance.runs.repeats import run_tasks
from affordance.settings import Settings
from affordance.simulation.blow import Blow, simulate_blow


class HammerPlan(NamedTuple):
    """Plan that all observers share.

    Attributes:
        choices: Choice of a grip by tool, with features as they are observed.
        costs: Planned blows for the true tools, by tool and grip.
        simulated: Simulated blows under the true densities, by tool and grip.
        off_axis: Largest relative change of the work if a part is shifted by 2 mm, by tool.
    """

    choices: Mapping[str, Choice]
    costs: Mapping[str, Mapping[str, BlowCost]]
    simulated: Mapping[str, Mapping[str, Blow]]
    off_axis: Mapping[str, float]


def plan_hammer(
    tools: Sequence[Tool], task: Hammer, settings: Settings, seed: int, path: Path, novel_file: Path, *, jobs: int
) -> HammerPlan:
    """Plans and simulates the blows.

    Args:
        tools: Novel tools; the first is the paper's.
        task: Task of the blow.
        settings: Settings of vision, arm and controller.
        seed: Root of the errors of observation.
        path: File of the nail, for errors.
        novel_file: File of the tools, for errors.
        jobs: Number of processes.

    Raises:
        BadValueError: A blow cannot be planned or carried out, or no grip is cheaper than the other.
        SeeingError: The features cannot be extracted from a picture of a tool.
    """
    exact = remove_errors(settings)
    try:
        choices = plan_choices(tools, task, settings, seed, jobs=jobs, description="hammer: plans")
        true_choices = choices
        if replace(settings, faults=exact.faults) != exact:
            true_choices = plan_choices(tools, task, exact, seed, jobs=jobs, description="hammer: plans, true")
    except (SeeingError, UnavailableError):  # not caused by the blow
        raise
    except AffordanceError as error:
        raise BadValueError(path, "blow", f"cannot be carried out: {error}") from error
    for choice in (*choices.values(), *true_choices.values()):
        for option, cost in zip(choice.options, choice.cost_models, strict=True):
            if cost.infeasible_reason:
                problem = f"cannot be carried out: {option.name}: {cost.infeasible_reason}"
                raise BadValueError(path, "blow", problem)
    costs = {name: list_blow_costs(choice) for name, choice in true_choices.items()}
    _check_feasible(path, tools, task, costs)
    held = {tool.name: tool.list_gripped() for tool in tools}
    tasks = [
        partial(simulate_blow, gripped, task, costs[tool.name][grip], list_densities([tool]), exact)
        for tool in tools
        for grip, gripped in held[tool.name].items()
    ]
    try:
        done = iter(run_tasks(tasks, jobs=jobs, description="hammer: blows"))
    except AffordanceError as error:
        raise BadValueError(path, "blow", f"cannot be carried out: {error}") from error
    simulated = {name: {grip: next(done) for grip in grips} for name, grips in held.items()}
    arm = load_arm(settings.arm)
    for tool in tools:
        for grip, blow in simulated[tool.name].items():
            if problem := blow.describe_force_error(task.force, arm):
                what = f"asks for {task.force:.0f} N, {name_object(tool.name)} by {grip}"
                raise BadValueError(path, "blow", f"{what} {problem}")
        check_one_grip_is_cheaper(novel_file, tool, [blow.work for blow in simulated[tool.name].values()])
    work = partial(compute_blow_work, task, exact, costs)
    off_axis = measure_changes(work, tools, jobs=jobs, description="hammer: parts moved")
    return HammerPlan(choices, costs, simulated, off_axis)


def list_blow_costs(choice: Choice) -> dict[str, BlowCost]:
    """Lists the blows that were planned for a choice, by grip."""
    found = {}
    for option, cost in zip(choice.options, choice.cost_models, strict=True):
        assert isinstance(cost, BlowCost)  # as built by a Hammer
        found[option.grip] = cost
    return found


def _check_feasible(
    path: Path, tools: Sequence[Tool], task: Hammer, costs: Mapping[str, Mapping[str, BlowCost]]
) -> None:
    """Refuses a nail that cannot be driven deep enough with some tool."""
    for tool in tools:
        for grip, gripped in tool.list_gripped().items():
            if reason := costs[tool.name][grip].explain_infeasibility(gripped.parameters):
                asked = f"is {task.nail.depth_demanded:g} m and asks for {task.force:.0f} N"
                problem = f"{asked}, for which with {name_object(tool.name)} by {grip} {reason}"
                raise BadValueError(path, "depth_demanded", f"{problem}; {_bound_depth(tools, task, costs)}")


def _bound_depth(tools: Sequence[Tool], task: Hammer, costs: Mapping[str, Mapping[str, BlowCost]]) -> str:
    """Describes the greatest depth to which a nail can be driven with every grip of every tool."""
    depth = min(
        costs[tool.name][grip].find_greatest_depth(gripped.parameters)
        for tool in tools
        for grip, gripped in tool.list_gripped().items()
    )
    floor = math.floor(1e4 * depth) / 1e4
    if floor <= task.nail.depth_set:
        return "no depth is within the joints' limits"
    return f"must be at most {floor:g} m"
