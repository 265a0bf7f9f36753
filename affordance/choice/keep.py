"""Holding still: the arm holds the tool in one posture for some time."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from affordance.choice.motion_cost import MotionCost, PlannedMotion
from affordance.control.start_posture import Start, StartEntry
from affordance.files.constraints import Within, check_fields
from affordance.files.data_model import DataModel
from affordance.objects.tool import PosedShape
from affordance.plant.arm_model import ArmModel
from affordance.settings import Settings

# Duration of a hold, from one control period to an hour, [s].
_DURATION = Within(0.05, 3600.0)


@dataclass(frozen=True)
class Keep:
    """Task, for any tool, of holding it still, which takes torque but no work."""

    duration: Annotated[float, _DURATION]  # [s]
    posture: Start = ()  # angles, [rad], of the joints that differ from the arm's home posture

    def __post_init__(self) -> None:
        """Raises a BadArgumentError if the duration is out of bounds."""
        check_fields(self)

    def build_cost(self, model: ArmModel, parts: Sequence[PosedShape], settings: Settings) -> MotionCost:
        """Builds the costs of the hold; raises an AffordanceError if the arm cannot take the posture."""
        q = model.arm.find_posture(dict(self.posture))
        still = np.zeros((1, len(q)))
        return MotionCost(model, PlannedMotion(self.duration, q[None], still, still), measure=settings.cost_measure)


class KeepEntry(DataModel):
    """Entry of a hold in a file."""

    duration: Annotated[float, _DURATION, Field(description="Duration of the hold, [s].")]
    posture: StartEntry = Field(default_factory=dict)

    def build_task(self) -> Keep:
        """Builds the task of holding still."""
        return Keep(self.duration, tuple(self.posture.items()))
