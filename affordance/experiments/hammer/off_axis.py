"""Work of a blow with one tool of known inertia, without the table of all speeds."""

from collections.abc import Mapping

import numpy as np

from affordance.choice.blow_cost import AIM, BlowCost
from affordance.choice.hammer import Hammer, find_swing, sample_swing
from affordance.choice.motion_cost import MotionCost
from affordance.objects.tool import Tool
from affordance.plant.arm_model import ArmModel
from affordance.plant.effective_mass import EffectiveMass
from affordance.plant.load import load_arm
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
