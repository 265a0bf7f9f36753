"""Plans blows of least work, for comparison with least angular acceleration.

The motion of least work depends on the tool's inertia, and a search takes seconds. Therefore one search is made for
one inertia, and the resulting motion is run slower or faster to strike at other speeds. The cost under a belief is
the cost of this motion, not that of the best motion for each inertia.
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

# Speeds of the motion relative to the result of the search: from a tap to what the lightest tool needs.
_PACES = np.geomspace(0.25, 2.0, 12)


def plan_least_work(planned: BlowCost, hammer: Hammer, model: ArmModel, pi: Array, settings: Settings) -> BlowCost:
    """Plans the demanded blow with least work, for a tool with parameters pi, (10,).

    The search starts from blows of least acceleration, and changes the model's state and payload.

    Raises:
        AffordanceError: No swing strikes as demanded, the search does not converge, or its motion exceeds the
            velocity limits at all speeds.
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
