"""Reach: the free end of the tool follows a path in space."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from affordance.arrays import Array
from affordance.choice.motion_cost import MotionCost, plan_motion
from affordance.control.path_following import PathFollowing
from affordance.control.timed_path import TimedPath
from affordance.exceptions import NoPlanError
from affordance.objects.tool import PosedShape, find_free_end
from affordance.plant.arm_model import ArmModel
from affordance.plant.serial_chain import build_chain
from affordance.settings import Settings


@dataclass(frozen=True)
class Reach:
    """What is asked of any tool: to follow a path with its free end F, from where the home posture holds it."""

    path: TimedPath

    @property
    def duration(self) -> float:
        """How long it takes, [s]."""
        return self.path.duration

    def begin(self, model: ArmModel, p_TF: Array) -> "PathFollowing":
        """Makes the task for one tool.

        Args:
            model: The arm; its state is set to rest in the home posture.
            p_TF: The tool's free end, shape (3,), [m].
        """
        home = model.arm.home
        model.set_state(np.concatenate([home, np.zeros(len(home))]))
        return PathFollowing(self.path.build_trajectory(), model.compute_point_position(p_TF), p_TF, len(home))

    def build_cost(self, model: ArmModel, parts: Sequence[PosedShape], settings: Settings) -> MotionCost:
        """Plans the motion, which is the same whatever the tool weighs, and returns what it costs at any inertia.

        Args:
            model: The arm; its state is set.
            parts: What the tool is made of, posed relative to the hand.
            settings: Those of the controller.

        Raises:
            NoPlanError: The controller finds no plan.
        """
        p_TF = find_free_end(parts)
        following = self.begin(model, p_TF)
        try:
            motion = plan_motion(model, following, duration=self.duration, settings=settings)
        except NoPlanError as found:
            raise NoPlanError(found.time, self.path.name_nearest_point(found.time)) from found
        places = build_chain(model.arm).compute_positions(motion.q, p_TF)
        asked = following.list_places([motion.control_period * k for k in range(len(motion.q))])
        error = float(np.linalg.norm(places - asked, axis=1).max())
        return MotionCost(model, motion, infeasible_reason=self.path.describe_error(error))
