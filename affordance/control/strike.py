"""Striking task: the arm swings a tool, drives a nail, and returns to rest."""

import numpy as np

from affordance.arrays import Array
from affordance.control.problem import TerminalGoal
from affordance.control.swing import FOLLOW_THROUGH, Swing
from affordance.control.task import Task
from affordance.plant.arm_model import ArmModel
from affordance.plant.nail import NailPlacement

# Before a strike the horizon shrinks to this, [s]; then the last plan continues, because errors can no longer be
# corrected in so short a time: stretch responses of the arm that account for its dynamics begin after 45 to 105 ms
# (Pruszynski & Scott 2012, Experimental Brain Research 218:341-359, from memory).
SHORTEST_HORIZON = 0.06
# Time before and after the planned contact in which contact can occur, [s]; a belief that is wrong by half shifts it
# by less.
_MARGIN = 0.02


class Strike(Task):
    """Task of executing a swing and returning to rest.

    Until the strike, the goal is the swing's state at the end of the horizon, which never extends beyond the strike,
    where the swing ends. A swing has minimum acceleration between any two of its points, so a controller that
    minimises acceleration follows it. After the blow, the goal moves back from the end of the swing to its start,
    with minimum acceleration and in the same time as the swing.
    """

    def __init__(self, swing: Swing, placement: NailPlacement, control_period: float) -> None:
        """Stores the swing, the placement of the nail, and the control period, [s]."""
        self.swing = swing
        self.q_start = swing.q_start
        self.placement = placement
        self._control_period = control_period
        self._strike = round(swing.duration / control_period) * control_period
        self._turn = self._strike + round(FOLLOW_THROUGH / control_period) * control_period
        self._return = Swing(swing.q_end, swing.q_start, np.zeros_like(swing.v_end), swing.duration)
        self._identity = np.eye(len(swing.q_end))
        self._identity.setflags(write=False)

    @property
    def time_of_strike(self) -> float:
        """Planned time of the strike, [s]."""
        return self.swing.duration

    @property
    def contact(self) -> tuple[float, float]:
        """Interval in which the tool may touch the nail: start and end, [s]."""
        return self._strike - _MARGIN, self._turn + _MARGIN

    def compute_duration(self, horizon: float) -> float:
        """Computes the time until the arm is at rest again, [s]. The controller has the given horizon."""
        return self._turn + self.swing.duration + 2.0 * horizon

    def choose_horizon(self, time: float, longest: float) -> float:
        """Chooses a horizon that ends at the strike.

        The horizon is zero from shortly before the strike until the blow is over.
        """
        left = self._strike - time
        if left >= longest - 0.5 * self._control_period or time > self._turn - 0.5 * self._control_period:
            return longest
        return left if left > SHORTEST_HORIZON - 0.5 * self._control_period else 0.0

    def compute_goal(self, model: ArmModel, x: Array, time: float, horizon: float) -> TerminalGoal:
        """Computes the goal: the swing's or the return's state at the end of the horizon."""
        motion, since = (self.swing, 0.0) if time < self._strike else (self._return, self._turn)
        q, v, _ = motion.evaluate(np.array([min(time + horizon - since, motion.duration)]))
        return TerminalGoal(self._identity, q[0], self._identity, v[0])
