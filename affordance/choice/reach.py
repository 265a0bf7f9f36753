"""Task of moving the free end F of a tool T along a path in the world frame W (paper, Simulation III)."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from affordance.arguments import check_kind
from affordance.arrays import Array
from affordance.choice.motion_cost import MotionCost, PlannedMotion, describe_limit, plan_motion
from affordance.control.path_following import PathFollowing
from affordance.control.task import Task
from affordance.control.timed_path import EASIER_PACES, EASIER_SIZES, TimedPath
from affordance.exceptions import AffordanceError, NoPlanError
from affordance.objects.tool import PosedShape, find_free_end
from affordance.plant.arm_model import ArmModel
from affordance.plant.chain_plant import build_chain
from affordance.plant.rank_loss import describe_rank_loss
from affordance.settings import Settings

# Number of evenly spaced postures of a motion at which the rank of the Jacobian is checked.
_NUM_CHECKED = 21


@dataclass(frozen=True)
class PathTask:
    """Task of following a path from a start posture."""

    path: TimedPath

    @property
    def duration(self) -> float:
        """Duration of the path, [s]."""
        return self.path.duration

    def list_easier(self) -> Iterator[tuple[Self, str]]:
        """Yields easier tasks, with mirrored, slower or smaller paths, and their descriptions."""
        for path, words in self.path.list_easier(EASIER_PACES, EASIER_SIZES):
            if words:
                yield replace(self, path=path), words

    def _plan(self, model: ArmModel, following: Task, settings: Settings) -> PlannedMotion:
        """Plans the motion.

        Raises:
            NoPlanError: The controller finds no plan. The error contains the nearest point of the path.
        """
        try:
            return plan_motion(model, following, duration=self.duration, settings=settings)
        except NoPlanError as found:
            raise NoPlanError(found.time, self.path.name_nearest_point(found.time)) from found

    def _describe_place(self, model: ArmModel, motion: PlannedMotion, row: int) -> str:
        """Describes a row of a motion by the nearest path point and the joint at a limit."""
        place = self.path.name_nearest_point(row * motion.control_period)
        return f"near {place}, {describe_limit(model.arm, motion, row)}"


@dataclass(frozen=True)
class Reach(PathTask):
    """Task of moving the free end F of a tool along a path.

    Example:
        >>> from affordance import MODELS, Reach, load_path
        >>> Reach(load_path(MODELS / "paths" / "reach.yaml")).path.duration
        2.0
    """

    def __post_init__(self) -> None:
        """Checks the path. A path that is not a TimedPath raises a BadArgumentError."""
        check_kind("path", self.path, TimedPath, "load_path(PATH) reads one")

    def begin(self, model: ArmModel, p_TF: Array) -> PathFollowing:
        """Builds the path-following task for one tool.

        Args:
            model: Model of the arm; its state is set to rest at the start of the task.
            p_TF: Position of the tool's free end, shape (3,), [m].

        Raises:
            AffordanceError: The start posture has an unknown joint, violates joint limits or is close to a
                singularity.
        """
        q_start = model.arm.find_posture(dict(self.path.start))
        if problem := describe_rank_loss(model, q_start, p_TF):
            raise AffordanceError(f"the start {problem}")
        model.set_posture(q_start)
        return PathFollowing(
            self.path.build_trajectory(),
            q_start=q_start,
            p_WFstart=model.compute_point_position(p_TF),
            p_TF=p_TF,
        )

    def build_cost(self, model: ArmModel, parts: Sequence[PosedShape], settings: Settings) -> MotionCost:
        """Plans the motion, which is the same for all inertias, and returns its cost as a function of inertia.

        Args:
            model: Model of the arm; its state is changed.
            parts: Parts of the tool, posed relative to the hand.
            settings: Settings of the controller.

        Raises:
            NoPlanError: The controller finds no plan.
            AffordanceError: The start posture has an unknown joint, violates joint limits or is close to a
                singularity.
        """
        return self.build_cost_of_end(model, find_free_end(parts), settings)

    def build_cost_of_end(self, model: ArmModel, p_TF: Array, settings: Settings) -> MotionCost:
        """Plans the motion for tools with the free end F at p_TF, (3,), [m] (``build_cost``)."""
        following = self.begin(model, p_TF)
        motion = self._plan(model, following, settings)
        places = build_chain(model.arm).compute_positions(motion.q, p_TF)
        asked = following.list_places([motion.control_period * k for k in range(len(motion.q))])
        errors = np.linalg.norm(places - asked, axis=1)
        reason = self.path.describe_error(float(errors.max()))
        if reason:
            reason = f"{reason}: {self._describe_place(model, motion, int(np.argmax(errors)))}"
        reason = reason or self._find_rank_loss(model, motion, p_TF)
        return MotionCost(model, motion, infeasible_reason=reason, measure=settings.cost_measure)

    def _find_rank_loss(self, model: ArmModel, motion: PlannedMotion, p_TF: Array) -> str:
        """Describes where a motion first comes too close to a singularity; empty if it does not."""
        for row in np.linspace(0, len(motion.q) - 1, _NUM_CHECKED).astype(int):
            if problem := describe_rank_loss(model, motion.q[row], p_TF):
                time = row * motion.control_period
                return f"near {self.path.name_nearest_point(time)}, at t = {time:.3g} s, {problem}"
        return ""
