"""Tasks planned with tools, kept in the process: the motion with a tool of the same form is planned once."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from affordance.arrays import Array
from affordance.choice.demand import Demand
from affordance.choice.inner_simulation import OptionCost, TaskCostModel
from affordance.choice.motion_cost import Costs
from affordance.exceptions import AffordanceError
from affordance.objects.tool import PosedShape
from affordance.plant.arm import Arm
from affordance.plant.arm_model import ArmModel
from affordance.settings import Settings

# Planned motions that are kept: those of a workshop's tools for a few tasks. One takes 0.1 MB, a blow's 2 MB.
_MOST_PLANS = 128


@dataclass(frozen=True)
class Impossible:
    """Cost of an option with which no motion could be planned: infinite, whatever the inertia.

    Attributes:
        infeasible_reason: Reason, in words.
        num_joints: Number of the arm's joints.
    """

    infeasible_reason: str
    num_joints: int

    @property
    def q_start(self) -> Array:
        """No joint angles, (0,)."""
        return np.zeros(0)

    def compute(self, pi: Array) -> Costs:
        """Returns infinite costs for parameters of shape (S, 10)."""
        nothing = np.full(len(pi), np.inf)
        return Costs(nothing, nothing, np.zeros(len(pi), dtype=bool), nothing)

    def compute_demand(self, pi: Array) -> Demand:
        """Returns infinite demands for parameters of shape (S, 10)."""
        nothing = np.full(len(pi), np.inf)
        return Demand(np.tile(nothing, (self.num_joints, 1)), nothing, nothing)


@dataclass(frozen=True)
class Work:
    """Task with a tool as gripped; equal for equal tasks, and parts of equal shapes, poses and striking faces."""

    key: tuple[object, ...]
    task: TaskCostModel = field(compare=False)
    parts: Sequence[PosedShape] = field(compare=False)

    @classmethod
    def of(cls, task: TaskCostModel, parts: Sequence[PosedShape]) -> "Work":
        """Builds it from a task and the parts of a tool, posed relative to the hand."""
        form = [
            (
                part.shape,
                part.X_TE.tobytes(),
                *((face.p_EQ.tobytes(), face.normal_E.tobytes()) for face in part.strikes),
            )
            for part in parts
        ]
        return cls((task, *form), task, parts)


@lru_cache(maxsize=_MOST_PLANS)
def plan_once(work: Work, settings: Settings, arm: Arm) -> OptionCost:
    """Plans a task with a tool; once in a process for the same task, form, settings and arm.

    Returns: Cost of the task; an ``Impossible`` one where nothing can be planned.
    """
    try:
        return work.task.build_cost(ArmModel(arm), work.parts, settings)
    except AffordanceError as error:
        return Impossible(str(error), arm.num_joints)
