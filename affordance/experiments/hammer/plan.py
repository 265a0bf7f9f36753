"""Planned blows: which of them are feasible, and the work of one with a tool of known inertia."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from affordance.choice.blow_cost import AIM, BlowCost
from affordance.choice.hammer import Hammer, find_swing, sample_swing
from affordance.choice.inner_simulation import Choice
from affordance.choice.motion_cost import MotionCost
from affordance.exceptions import BadValueError, name_object
from affordance.objects.tool import Tool
from affordance.plant.arm import load_arm
from affordance.plant.arm_model import ArmModel
from affordance.plant.effective_mass import EffectiveMass
from affordance.settings import Settings

# The posture at the strike, and with it the mass, hardly depends on the speed: the second swing is within a hundredth
# of the speed of the first, and a third within a tenth of that.
_NUM_SWINGS = 3


def compute_blow_work(
    task: Hammer, settings: Settings, costs: Mapping[str, Mapping[str, BlowCost]], held: Tool
) -> float:
    """Plans the demanded blow with a tool that is gripped, and returns its work, [J].

    Args:
        task: Task of the blow.
        settings: Settings of arm and controller.
        costs: Planned blows, by tool and grip; the search starts from the one for the tool of the same name.
        held: Tool, or a similar one, as it is gripped.

    Raises:
        AffordanceError: No swing reaches the demanded force.
    """
    model = ArmModel(load_arm(settings.arm))
    target = task.find_target(model, held.components)
    planned, pi = costs[held.name][held.grip], held.parameters[None]
    speed = float(planned.find_speed(pi)[0])
    swing = planned.pick_swing(speed)
    for _ in range(_NUM_SWINGS):
        swing = find_swing(model, target, task, speed, swing)
        (mass,) = EffectiveMass(model, target.p_TS, target.direction_W, swing.q_end).compute(pi)
        speed = float(task.nail.compute_tip_speed(np.array(AIM * task.force), mass))
    assert swing is not None  # there is at least one
    motion = sample_swing(swing, settings.control_period)
    return float(MotionCost(model, motion).compute(pi).work[0])


def list_blow_costs(choice: Choice) -> dict[str, BlowCost]:
    """Lists the blows that were planned for a choice, by grip."""
    found = {}
    for option, cost in zip(choice.options, choice.cost_models, strict=True):
        assert isinstance(cost, BlowCost)  # as built by a Hammer
        found[option.grip] = cost
    return found


def check_feasible(
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
