"""Clamp that holds the hand in place with a stiff spring until it is released.

Drake's bushing element pulls the hand H to a frame fixed in W, with forces against displacement and torques against
rotation. The frame's pose, stiffness and damping are parameters of the plant's Context.
"""

from typing import Any

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import FixedOffsetFrame, Frame, LinearBushingRollPitchYaw
from pydrake.systems.framework import Context

from affordance.arrays import Array

# Stiffness of the virtual spring that held people's hands (Cesanek et al. 2021, eLife 10:e71627), [N/m].
STIFFNESS = 4000.0
# Critical damping for 2 kg, the effective mass at the hand of an outstretched arm with its load, so that the force
# settles within 0.1 s; the settled force does not depend on it, [N s/m].
_DAMPING = 180.0
# Rotation is resisted by the same spring and damper at a hand's breadth to either side. The published clamp exerted
# no moment, and its objects needed none; an object that is held by its end needs a supporting moment, [m^2].
_SQUARED_LEVER = 0.1**2


class Clamp:
    """Clamp of the hand."""

    def __init__(self, plant: MultibodyPlant, hand: Frame) -> None:
        """Adds an open clamp for a hand H to a plant that is not yet finalized."""
        self._hand = hand
        # Any: Drake's stubs name base classes only.
        anchor: Any = plant.AddFrame(FixedOffsetFrame("clamp", plant.world_frame(), RigidTransform()))
        self._anchor: FixedOffsetFrame = anchor
        none = np.zeros(3)
        bushing: Any = plant.AddForceElement(LinearBushingRollPitchYaw(anchor, hand, none, none, none, none))
        self._bushing: LinearBushingRollPitchYaw = bushing

    def close(self, plant_context: Context) -> None:
        """Closes the clamp at the hand's current pose."""
        self._anchor.SetPoseInParentFrame(plant_context, self._hand.CalcPoseInWorld(plant_context))
        self._set(plant_context, STIFFNESS, _DAMPING)

    def release(self, plant_context: Context) -> None:
        """Releases the hand."""
        self._set(plant_context, 0.0, 0.0)

    def compute_force(self, plant_context: Context) -> Array:
        """Computes the force of the hand on the clamp, expressed in W, shape (3,), [N]."""
        force = self._bushing.CalcBushingSpatialForceOnFrameA(plant_context)  # at the anchor, in its frame
        R_WA = self._anchor.CalcRotationMatrixInWorld(plant_context)
        on_clamp: Array = R_WA.matrix() @ force.translational()
        return on_clamp

    def _set(self, plant_context: Context, stiffness: float, damping: float) -> None:
        of_force, of_torque = np.ones(3), np.full(3, _SQUARED_LEVER)
        self._bushing.SetForceStiffnessConstants(plant_context, stiffness * of_force)
        self._bushing.SetForceDampingConstants(plant_context, damping * of_force)
        self._bushing.SetTorqueStiffnessConstants(plant_context, stiffness * of_torque)
        self._bushing.SetTorqueDampingConstants(plant_context, damping * of_torque)
