"""Carrying: the grip follows a path in the world W, while the tool keeps its orientation."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from affordance.arrays import Array
from affordance.choice.motion_cost import MotionCost
from affordance.choice.reach import PathTask
from affordance.control.path_following import Carrying
from affordance.control.timed_path import PathEntry
from affordance.files.constraints import Within, check_fields
from affordance.objects.tool import PosedShape
from affordance.plant.arm_model import ArmModel
from affordance.plant.serial_chain import build_chain
from affordance.settings import Settings

_TILT = Within(1e-3, 1.5)


@dataclass(frozen=True)
class Carry(PathTask):
    """Task of following a path with the grip, the tool held as at the start, for any tool."""

    tilt: Annotated[float, _TILT] = 0.1  # largest admissible turn of the tool from its first orientation, [rad]

    def __post_init__(self) -> None:
        """Raises a BadArgumentError if the tilt is out of bounds."""
        check_fields(self)

    def begin(self, model: ArmModel) -> Carrying:
        """Builds the task of the controller, and sets the model to rest at its start.

        An arm that cannot take the start posture raises an AffordanceError.
        """
        q_start = model.arm.find_posture(dict(self.path.start))
        model.set_posture(q_start)
        X_WH: Array = model.compute_hand_pose().GetAsMatrix4()
        return Carrying(self.path.build_trajectory(), q_start=q_start, X_WHstart=X_WH)

    def build_cost(self, model: ArmModel, parts: Sequence[PosedShape], settings: Settings) -> MotionCost:
        """Plans the motion, the same for all tools, and returns its costs at any inertia.

        Without a start posture an AffordanceError is raised, without a plan of the controller a NoPlanError.
        """
        carrying = self.begin(model)
        motion = self._plan(model, carrying, settings)
        found_motion = build_chain(model.arm).compute_motion(motion.q, motion.v, motion.vdot)
        asked = np.array([carrying.compute_reference(motion.control_period * k)[0] for k in range(len(motion.q))])
        errors = np.linalg.norm(found_motion.p_WT - asked, axis=1)
        # The angle of a rotation by its trace; the first orientation is that of the first row.
        traces = np.einsum("ij,nij->n", found_motion.R_WT[0], found_motion.R_WT)
        tilts = np.arccos(np.clip(0.5 * (traces - 1.0), -1.0, 1.0))
        row, reason = int(np.argmax(errors)), self.path.describe_error(float(errors.max()))
        if not reason and tilts.max() > self.tilt:
            row = int(np.argmax(tilts))
            reason = f"turns the tool by {tilts.max():.3g} rad, must turn it by at most {self.tilt:g} rad"
        if reason:
            reason = f"{reason}: {self._describe_place(model, motion, row)}"
        return MotionCost(model, motion, infeasible_reason=reason, measure=settings.cost_measure)


class CarryEntry(PathEntry):
    """Carrying task as given in a file."""

    tilt: Annotated[
        float, _TILT, Field(description="Largest turn of the tool from its first orientation, [rad].")
    ] = 0.1

    def build_task(self) -> Carry:
        """Builds the carrying task."""
        return Carry(self.build(), self.tilt)
