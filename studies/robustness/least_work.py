"""Blows that minimise work, for comparison with blows that minimise angular acceleration.

The optimal motion depends on the inertia of the tool, and a search takes seconds. Therefore the motion is optimised
for one inertia, and scaled in time to strike at other speeds. The cost for other inertias is the cost of this motion.
"""

from dataclasses import replace

import numpy as np

from affordance.arrays import Array
from affordance.choice.blow_cost import BlowCost
from affordance.choice.hammer import Hammer, plan_strike
from affordance.choice.motion_cost import MotionCost, PlannedMotion
from affordance.control.swing import Swing
from affordance.exceptions import AffordanceError
from affordance.plant.arm_model import ArmModel
from affordance.plant.contact import EffectiveMass
from affordance.settings import Settings
from studies.robustness.optimal_swing import OptimalSwing, SwingSearch

# Speeds relative to the optimised motion, from a light tap to the speed that the lightest tool requires.
_PACES = np.geomspace(0.25, 2.0, 12)


def plan_least_work(planned: BlowCost, hammer: Hammer, model: ArmModel, pi: Array, settings: Settings) -> BlowCost:
    """Plans a blow that minimises work.

    Args:
        planned: Blows that minimise acceleration, for the initial guess.
        hammer: Required blow.
        model: Model of the arm, whose state and payload are changed.
        pi: Inertial parameters of the tool, (10,).
        settings: Settings.

    Raises:
        AffordanceError: No swing strikes as required, the search does not converge, or the motion exceeds velocity
            limits at all speeds.
    """
    swing = plan_strike(planned, hammer, model, pi, settings).swing
    try:
        found = SwingSearch(model, planned.target, swing, pi).find_least_work()
    except AffordanceError as error:
        raise AffordanceError(f"the search for least work does not converge: {error}") from error
    if not found.converged:
        raise AffordanceError("the search for least work does not converge")
    peak = np.abs(found.v).max(axis=0)
    paces = [float(pace) for pace in _PACES if (pace * peak <= model.arm.limits.v_max).all()]
    if not paces:
        raise AffordanceError("the motion of least work exceeds the joints' limits at all speeds")
    q_end, v_end = found.q[-1], found.v[-1]
    model.set_state(np.concatenate([q_end, np.zeros(len(q_end))]))
    target = planned.target
    speed = float(target.direction_W @ model.compute_point_jacobian(target.p_TS) @ v_end)
    mass = EffectiveMass(model, target.p_TS, target.direction_W, q_end)
    return replace(
        planned,
        swings=tuple(Swing(swing.q_start, q_end, pace * v_end, swing.duration / pace) for pace in paces),
        speeds=speed * np.array(paces),
        masses=(mass,) * len(paces),
        motions=tuple(MotionCost(model, _run_at(found, pace), measure=settings.cost_measure) for pace in paces),
    )


def _run_at(found: OptimalSwing, pace: float) -> PlannedMotion:
    period = float(found.times[1] - found.times[0]) / pace
    v = pace * found.v
    return PlannedMotion(period, found.q[:-1], v[:-1], np.diff(v, axis=0) / period)
