"""Plans and simulates blows on a nail for each grip of each tool."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from affordance.choice.blow_cost import AIM, BlowCost
from affordance.choice.hammer import Hammer, find_swing, sample_swing
from affordance.choice.inner_simulation import Choice
from affordance.choice.motion_cost import MotionCost
from affordance.exceptions import BadValueError, name_object
from affordance.experiments.shared.grips import (
    blame,
    plan_grips,
    remove_errors,
)
from affordance.experiments.shared.observers import Setup
from affordance.objects.tool import Tool, list_densities
from affordance.plant.arm_model import ArmModel
from affordance.plant.contact import EffectiveMass
from affordance.plant.load import load_arm
from affordance.runs.repeats import run_tasks
from affordance.settings import Settings
from affordance.simulation.blow import Blow, simulate_blow

FAILURE = "cannot be carried out"
# Number of iterations: the effective mass at the strike determines the required tip speed, and the speed determines
# the swing. The posture at the strike hardly depends on the speed, so the second speed is within 1 % of the first,
# and the third within 0.1 %.
SWINGS = 3


def plan_blows(
    setup: Setup, tools: Sequence[Tool], task: Hammer, file: Path
) -> tuple[dict[str, Choice], Mapping[str, Mapping[str, BlowCost]], dict[str, dict[str, Blow]]]:
    """Plans and simulates the blow for each grip of each tool.

    Blows are planned for the observed tools and for the true tools. They are simulated with contact and the true
    densities.

    Args:
        setup: Setup of the experiment.
        tools: Tools with their grips.
        task: Hammering task.
        file: File of the task, for error messages.

    Returns:
        Choices by tool, costs of the true tools by tool and grip, and simulated blows by tool and grip.

    Raises:
        BadValueError: The nail cannot be driven with one of the grips.
    """
    settings, exact = setup.settings, remove_errors(setup.settings)
    choices = _plan(setup, tools, task, settings, file, "hammer: plans")
    true = choices
    if replace(settings, faults=exact.faults) != exact:
        true = _plan(setup, tools, task, exact, file, "hammer: plans, true")
    costs: dict[str, dict[str, Any]] = {
        name: {option.grip: cost for option, cost in zip(choice.options, choice.cost_models, strict=True)}
        for name, choice in true.items()
    }
    check_depth(file, tools, task, costs)
    held = [(tool, grip, each) for tool in tools for grip, each in tool.list_gripped().items()]
    strikes = [
        partial(simulate_blow, each, task, costs[tool.name][grip], list_densities([tool]), exact)
        for tool, grip, each in held
    ]
    with blame(file, "blow", FAILURE):
        simulated = run_tasks(strikes, jobs=setup.jobs, description="hammer: blows")
    blows: dict[str, dict[str, Blow]] = {tool.name: {} for tool in tools}
    for (tool, grip, _), blow in zip(held, simulated, strict=True):
        if problem := blow.describe_force_error(task.force, load_arm(settings.arm)):
            asked = f"asks for {task.force:.0f} N, {name_object(tool.name)} by {grip} {problem}"
            raise BadValueError(file, "blow", asked)
        blows[tool.name][grip] = blow
    return choices, costs, blows


def _plan(
    setup: Setup, tools: Sequence[Tool], task: Hammer, settings: Settings, file: Path, description: str
) -> dict[str, Choice]:
    """Plans the blow for each grip.

    Raises:
        BadValueError: No swing delivers the blow with one of the grips.
    """
    with blame(file, "blow", FAILURE):
        choices = plan_grips(tools, task, settings, seed=setup.seed, jobs=setup.jobs, description=description)
    for choice in choices.values():
        for option, cost in zip(choice.options, choice.cost_models, strict=True):
            if cost.infeasible_reason:
                raise BadValueError(file, "blow", f"{FAILURE}: {option.name}: {cost.infeasible_reason}")
    return choices


def check_depth(file: Path, tools: Sequence[Tool], task: Hammer, costs: Mapping[str, Mapping[str, BlowCost]]) -> None:
    """Checks that each tool can drive the nail to the demanded depth with each grip.

    Raises:
        BadValueError: A tool cannot drive the nail to this depth.
    """
    held = {(tool.name, grip): each for tool in tools for grip, each in tool.list_gripped().items()}
    for (name, grip), gripped in held.items():
        if reason := costs[name][grip].explain_infeasibility(gripped.parameters):
            depth = min(costs[one][by].find_greatest_depth(each.parameters) for (one, by), each in held.items())
            floor = math.floor(1e4 * depth) / 1e4
            bound = f"must be at most {floor:g} m"
            if floor <= task.nail.depth_set:
                bound = "no depth is within the joints' limits"
            asked = f"is {task.nail.depth_demanded:g} m and asks for {task.force:.0f} N"
            problem = f"{asked}, for which with {name_object(name)} by {grip} {reason}; {bound}"
            raise BadValueError(file, "depth_demanded", problem)


def compute_work(task: Hammer, settings: Settings, costs: Mapping[str, Mapping[str, BlowCost]], held: Tool) -> float:
    """Computes the absolute work of the demanded blow with a gripped tool of known densities, [J].

    Args:
        task: Hammering task.
        settings: Settings of the controller.
        costs: Planned swings by tool and grip, from which the search starts.
        held: Gripped tool.
    """
    model = ArmModel(load_arm(settings.arm))
    target = task.find_target(model, held.components)
    planned, pi = costs[held.name][held.grip], held.parameters[None]
    speed = float(planned.compute_speed(pi)[0])
    swing = planned.pick_swing(speed)
    for _ in range(SWINGS):
        swing = find_swing(model, target, task, speed, swing)
        (mass,) = EffectiveMass(model, target.p_TS, target.direction_W, swing.q_end).compute(pi)
        speed = float(task.nail.compute_tip_speed(np.array(AIM * task.force), mass))
    assert swing is not None  # because SWINGS > 0
    return float(MotionCost(model, sample_swing(swing, settings.control_period)).compute(pi).work[0])
