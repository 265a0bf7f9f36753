"""Task of striking a nail with a tool and returning to rest."""

import numpy as np

from affordance.arrays import Array
from affordance.control.problem import TerminalGoal
from affordance.control.swing import FOLLOW_THROUGH, Swing
from affordance.control.task import Task
from affordance.plant.arm_model import ArmModel
from affordance.plant.nail import NailPlacement

# Shortest horizon before a strike, [s]. After that, the last plan continues, because the time is too short for
# corrections: stretch responses that account for the dynamics of the human arm begin after 45 to 105 ms (Pruszynski &
# Scott 2012, Experimental Brain Research 218:341-359, from memory).
SHORTEST_HORIZON = 0.06
# Time before and after the planned contact in which contact can occur, [s]. If the believed inertia is wrong by half,
# the contact shifts by less.
_MARGIN = 0.02


class Strike(Task):
    """Task of executing a swing and returning to rest.

    Before the strike, the goal is the state of the swing at the end of the horizon, which does not extend beyond the
    strike. A swing has minimum acceleration between any two of its points, so a controller that minimises
    acceleration follows it. After the blow, the goal returns to the start of the swing with minimum acceleration, in
    the same time.
    """

    def __init__(self, swing: Swing, placement: NailPlacement, control_period: float) -> None:
        """Stores the swing and the placement of the nail, with the control period, [s]."""
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
        """Start and end of the interval in which the tool can touch the nail, [s]."""
        return self._strike - _MARGIN, self._turn + _MARGIN

    def compute_duration(self, horizon: float) -> float:
        """Computes the time until the arm is at rest again, [s], for a controller with the given horizon, [s]."""
        return self._turn + self.swing.duration + 2.0 * horizon

    def choose_horizon(self, time: float, longest: float) -> float:
        """Returns a horizon that ends at the strike, or zero from shortly before it until the blow ends."""
        left = self._strike - time
        if left >= longest - 0.5 * self._control_period or time > self._turn - 0.5 * self._control_period:
            return longest
        return left if left > SHORTEST_HORIZON - 0.5 * self._control_period else 0.0

    def compute_goal(self, model: ArmModel, x: Array, time: float, horizon: float) -> TerminalGoal:
        """Computes the goal: the state of the swing or of the return at the end of the horizon."""
        motion, since = (self.swing, 0.0) if time < self._strike else (self._return, self._turn)
        q, v, _ = motion.evaluate(np.array([min(time + horizon - since, motion.duration)]))
        return TerminalGoal(self._identity, q[0], self._identity, v[0])
