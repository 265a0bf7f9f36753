"""The work of a blow with one tool whose inertia is known, without the table of all speeds."""

import numpy as np

from affordance.choice.blow_cost import AIM
from affordance.choice.hammer import Hammer, sample_swing
from affordance.choice.motion_cost import MotionCost
from affordance.control.swing import Swing, plan_swing
from affordance.objects.tool import Tool
from affordance.plant.arm import load_arm
from affordance.plant.arm_model import ArmModel
from affordance.plant.effective_mass import EffectiveMass
from affordance.settings import Settings

# The posture at the strike, and with it the mass, hardly depends on the speed: the second swing is within a hundredth
# of the speed of the first, and a third within a tenth of that.
_NUM_SWINGS = 3
# Tip speed to begin with, [m/s].
_FIRST_SPEED = 4.0


def compute_blow_work(task: Hammer, settings: Settings, held: Tool) -> float:
    """Plans the demanded blow with a tool that is gripped, and returns its work, [J].

    Raises:
        AffordanceError: No swing does it.
    """
    model = ArmModel(load_arm(settings.arm))
    target = task.find_target(model, held.components)
    speed = _FIRST_SPEED
    swing: Swing | None = None
    for _ in range(_NUM_SWINGS):
        swing = plan_swing(model, target, speed=speed, duration=task.duration, guess=swing)
        (mass,) = EffectiveMass(model, target.p_TS, target.direction_W, swing.q_end).compute(held.parameters[None])
        speed = float(task.nail.compute_tip_speed(np.array(AIM * task.force), mass))
    assert swing is not None  # there is at least one
    motion = sample_swing(swing, settings.control_period)
    return float(MotionCost(model, motion).compute(held.parameters[None]).work[0])
