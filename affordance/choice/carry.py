"""Tasks of carrying a tool along a path without rotation, and of holding it still."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from affordance.arrays import Array
from affordance.choice.motion_cost import MotionCost, PlannedMotion
from affordance.choice.reach import PathTask
from affordance.control.path_following import Carrying
from affordance.control.task import Start, StartEntry
from affordance.control.timed_path import PathEntry
from affordance.files.constraints import Within, check_fields
from affordance.files.data_model import DataModel
from affordance.objects.tool import PosedShape
from affordance.plant.arm_model import ArmModel
from affordance.plant.chain_plant import build_chain
from affordance.settings import Settings

_TILT = Within(1e-3, 1.5)


@dataclass(frozen=True)
class Carry(PathTask):
    """Task of moving the grip along a path in the world frame W without rotating the tool."""

    tilt: Annotated[float, _TILT] = 0.1  # largest allowed rotation of the tool from its initial orientation, [rad]

    def __post_init__(self) -> None:
        """Checks the tilt. A value out of bounds raises a BadArgumentError."""
        check_fields(self)

    def begin(self, model: ArmModel) -> Carrying:
        """Builds the controller's task, and sets the model to rest in the start posture.

        Raises:
            AffordanceError: The start posture has an unknown joint or violates joint limits.
        """
        q_start = model.arm.find_posture(dict(self.path.start))
        model.set_posture(q_start)
        X_WH: Array = model.compute_hand_pose().GetAsMatrix4()
        return Carrying(self.path.build_trajectory(), q_start=q_start, X_WHstart=X_WH)

    def build_cost(self, model: ArmModel, parts: Sequence[PosedShape], settings: Settings) -> MotionCost:
        """Plans the motion, which is the same for all tools, and returns its cost as a function of inertia.

        Raises:
            NoPlanError: The controller finds no plan.
            AffordanceError: The start posture has an unknown joint or violates joint limits.
        """
        carrying = self.begin(model)
        motion = self._plan(model, carrying, settings)
        found_motion = build_chain(model.arm).compute_motion(motion.q, motion.v, motion.vdot)
        asked = np.array([carrying.compute_reference(motion.control_period * k)[0] for k in range(len(motion.q))])
        errors = np.linalg.norm(found_motion.p_WT - asked, axis=1)
        # Rotation angles relative to the initial orientation follow from the trace of the relative rotation.
        traces = np.einsum("ij,nij->n", found_motion.R_WT[0], found_motion.R_WT)
        tilts = np.arccos(np.clip(0.5 * (traces - 1.0), -1.0, 1.0))
        row, reason = int(np.argmax(errors)), self.path.describe_error(float(errors.max()))
        if not reason and tilts.max() > self.tilt:
            row = int(np.argmax(tilts))
            reason = f"rotates the tool by {tilts.max():.3g} rad, must rotate it by at most {self.tilt:g} rad"
        if reason:
            reason = f"{reason}: {self._describe_place(model, motion, row)}"
        return MotionCost(model, motion, infeasible_reason=reason, measure=settings.cost_measure)


class CarryEntry(PathEntry):
    """Entry of a carrying task in a file."""

    tilt: Annotated[
        float, _TILT, Field(description="Largest rotation of the tool from its first orientation, [rad].")
    ] = 0.1

    def build_task(self) -> Carry:
        """Builds the carrying task."""
        return Carry(self.build(), self.tilt)


# Duration of a hold, from one control period to an hour, [s].
_DURATION = Within(0.05, 3600.0)


@dataclass(frozen=True)
class Keep:
    """Task of holding a tool still, which requires torque but no work."""

    duration: Annotated[float, _DURATION]  # [s]
    posture: Start = ()  # angles, [rad], of joints that are not at their home angles

    def __post_init__(self) -> None:
        """Checks the duration. A value out of bounds raises a BadArgumentError."""
        check_fields(self)

    def build_cost(self, model: ArmModel, parts: Sequence[PosedShape], settings: Settings) -> MotionCost:
        """Builds the cost of the hold as a function of inertia.

        Raises:
            AffordanceError: The posture has an unknown joint or violates joint limits.
        """
        q = model.arm.find_posture(dict(self.posture))
        still = np.zeros((1, len(q)))
        return MotionCost(model, PlannedMotion(self.duration, q[None], still, still), measure=settings.cost_measure)


class KeepEntry(DataModel):
    """Entry of a holding task in a file."""

    duration: Annotated[float, _DURATION, Field(description="Duration of the hold, [s].")]
    posture: StartEntry = Field(default_factory=dict)

    def build_task(self) -> Keep:
        """Builds the holding task."""
        return Keep(self.duration, tuple(self.posture.items()))
