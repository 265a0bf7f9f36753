"""A trial in which a tool strikes a nail."""

from typing import Any, NamedTuple

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Context, EventStatus

from affordance.arrays import Array
from affordance.exceptions import StallError
from affordance.plant.nail import NailPlacement
from affordance.simulation.diagram import TrialDiagram

# A nail feels a tool from this force on, [N].
_TOUCH = 1.0


# A blow takes 1300 to 2430 steps from rest to rest (docs/decisions/0013-nail.md). After eighty times as many, in a
# minute or two, the integrator has stalled.
_MAX_STEPS = 200_000


class NailRecord(NamedTuple):
    """What happened to a nail, at every one of N steps of the integrator.

    Attributes:
        times: (N,), [s].
        travel: How far it was driven since it was set, (N,), [m].
        rate: (N,), [m/s].
        resistance: Of the wood against being driven in, (N,), [N].
        contact: Force of the tool on its head along the direction it is driven to, (N,), [N].
    """

    times: Array
    travel: Array
    rate: Array
    resistance: Array
    contact: Array

    @property
    def time_of_touch(self) -> float:
        """When the tool first touched it, [s]; the first of the times if it never did."""
        return float(self.times[np.argmax(self.contact > _TOUCH)])


class BlowMonitor:
    """A monitor of a blow: refuses one that stalls, and while it is asked to, stops where anything touches."""

    def __init__(self, plant: MultibodyPlant, tool_name: str) -> None:
        """Takes the plant that is simulated, and what to call the tool."""
        self.stops_at_touch = False
        self._plant = plant
        self._tool_name = tool_name
        self._num_steps = 0

    def __call__(self, context: Context) -> EventStatus:
        """Counts a step of the integrator.

        Raises:
            StallError: It is one too many.
        """
        self._num_steps += 1
        if self._num_steps > _MAX_STEPS:
            raise StallError(self._tool_name, context.get_time(), _MAX_STEPS, self._list_touches(context))
        if self.stops_at_touch and self._get_contacts(context).num_point_pair_contacts():
            return EventStatus.ReachedTermination(self._plant, "touch")
        return EventStatus.DidNothing()

    def _get_contacts(self, context: Context) -> Any:
        return self._plant.get_contact_results_output_port().Eval(self._plant.GetMyContextFromRoot(context))

    def _list_touches(self, context: Context) -> tuple[tuple[str, str], ...]:
        """Names the bodies that touch, in pairs."""
        contacts, get_body = self._get_contacts(context), self._plant.get_body
        pairs = [contacts.point_pair_contact_info(k) for k in range(contacts.num_point_pair_contacts())]
        return tuple((get_body(pair.bodyA_index()).name(), get_body(pair.bodyB_index()).name()) for pair in pairs)


def read_nail_record(trial: TrialDiagram, context: Context, placement: NailPlacement) -> NailRecord:
    """Reads out what happened to a nail, in the Context of a Diagram that was built with it."""
    logs = trial.nail_logs
    assert logs is not None  # the Diagram was built with a nail
    travel, rate = np.array(logs.state.FindLog(context).data())
    resistance = np.array(logs.resistance.FindLog(context).data())[0]
    acceleration = np.array(logs.acceleration.FindLog(context).data())[0]
    weight = placement.nail.mass * float(trial.chain.gravity_W @ placement.direction_W)
    contact = placement.nail.mass * acceleration + resistance - weight
    return NailRecord(np.array(logs.state.FindLog(context).sample_times()), travel, rate, resistance, contact)
