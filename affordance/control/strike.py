"""Strike: the arm swings the tool at a nail, lets it do its work, and comes back to rest."""

import numpy as np

from affordance.arrays import Array
from affordance.control.problem import TerminalGoal
from affordance.control.swing import FOLLOW_THROUGH, Swing
from affordance.plant.arm_model import ArmModel
from affordance.plant.nail import NailPlacement

# Before a strike the horizon shrinks to this; then the plan it ends with goes on, for what happens in so short a time
# cannot be corrected any more: stretch responses of the arm that know of its dynamics begin after 45 to 105 ms
# (Pruszynski & Scott 2012, Experimental Brain Research 218:341-359, from memory), [s].
SHORTEST_HORIZON = 0.06
# How long before and after the planned strike the contact may take place: a belief that is wrong by half shifts it by
# less, [s].
_MARGIN = 0.02


class Strike:
    """The task of carrying out a swing.

    Until the strike the goal is where the swing is at the horizon's end, which is never beyond the strike: there is
    no swing there. A swing has minimum acceleration between any two of its points, so a controller that plans by
    minimum acceleration follows it. After the blow the goal moves along the motion of minimum acceleration, as slow
    as the swing, from where the swing ended to where it began.
    """

    def __init__(self, swing: Swing, placement: NailPlacement, control_period: float) -> None:
        """Takes the swing, the nail, and the controller's tick, [s]."""
        self.swing = swing
        self.placement = placement
        self._control_period = control_period
        self._strike = round(swing.duration / control_period) * control_period
        self._turn = self._strike + round(FOLLOW_THROUGH / control_period) * control_period
        self._return = Swing(swing.q_end, swing.q_start, np.zeros_like(swing.v_end), swing.duration)
        self._identity = np.eye(len(swing.q_end))
        self._identity.setflags(write=False)

    @property
    def q_start(self) -> Array:
        """Joint angles in which the swing begins, shape (num_joints,), [rad]."""
        return self.swing.q_start

    @property
    def time_of_strike(self) -> float:
        """When the tool is to meet the nail, [s]."""
        return self.swing.duration

    @property
    def contact(self) -> tuple[float, float]:
        """From when to when the tool may touch the nail, [s]."""
        return self._strike - _MARGIN, self._turn + _MARGIN

    def compute_duration(self, horizon: float) -> float:
        """Until the arm is at rest again, for a controller of a certain horizon, [s]."""
        return self._turn + self.swing.duration + 2.0 * horizon

    def choose_horizon(self, time: float, longest: float) -> float:
        """Ends it at the strike; zero from shortly before the strike until the blow is done."""
        left = self._strike - time
        if left >= longest - 0.5 * self._control_period or time > self._turn - 0.5 * self._control_period:
            return longest
        return left if left > SHORTEST_HORIZON - 0.5 * self._control_period else 0.0

    def compute_goal(self, model: ArmModel, x: Array, time: float, horizon: float) -> TerminalGoal:
        """Asks for the point of the swing, or of the way back, at the horizon's end."""
        motion, since = (self.swing, 0.0) if time < self._strike else (self._return, self._turn)
        q, v, _ = motion.evaluate(np.array([min(time + horizon - since, motion.duration)]))
        return TerminalGoal(self._identity, q[0], self._identity, v[0])
