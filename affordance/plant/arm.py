"""Arm with a tool in its hand: its Drake plant, joint limits and postures.

Frames in all modules are W (world), H (hand, where it grips; Hx points out of the hand), T (tool; coincides with H
while the tool is held), E (component of the tool), B (any body) and Bcm (its centre of mass). Any serial arm can be
used, with any number of joints, if a directives file describes it (see models/arm.dmd.yaml).
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, Joint, RigidBody, SpatialInertia
from pydrake.systems.framework import Context

from affordance.arrays import Array
from affordance.exceptions import AffordanceError, describe_choice, show_text
from affordance.files.model_folder import MODELS
from affordance.objects.inertia import spatial_inertia_from_parameters

ARM = MODELS / "arm.dmd.yaml"
# Digest that ends the folder name of a cached import (robots/kept.py).
_DIGEST = re.compile("-[0-9a-f]{12}$")


def name_robot(source: Path, tip: str = "") -> str:
    """Returns a robot's name for display.

    The name is taken from the model folder, or from the file and its tip. The digest of a cached import is omitted,
    so the import has the same name as its file. The paper's arm is called "the paper's arm".
    """
    source = source.resolve()
    if source == ARM.resolve():
        return "the paper's arm"
    if source.name == ARM.name:
        return show_text(_DIGEST.sub("", source.parent.name))
    # robots/kept.py gives the folder the same name.
    name = f"{source.stem}-{tip}".replace("/", "_") if tip else source.stem
    return show_text(name)


class JointLimits(NamedTuple):
    """Joint limits, each of shape (num_joints,). A missing limit is infinite."""

    q_lower: Array  # [rad]
    q_upper: Array  # [rad]
    v_max: Array  # on |v|, [rad/s]
    tau_max: Array  # on |tau|, [N m]

    def compute_loads(self, tau: Array) -> Array:
        """Divides joint torques, (..., num_joints), [N m], by the effort limits. Above 1 is an overload."""
        loads: Array = np.abs(tau) / self.tau_max
        return loads


class Overload(NamedTuple):
    """Joint whose torque exceeds its effort limit."""

    joint: str
    torque: float  # [N m]
    bound: float  # effort limit, [N m]


@dataclass(frozen=True, eq=False)
class Arm:
    """Finalized plant of an arm with an object in its hand."""

    source: Path  # file that describes the arm
    plant: MultibodyPlant  # continuous plant; the tool's inertia is a parameter of its Context
    hand: Frame  # frame H of the hand
    tool: RigidBody  # body T of the tool, welded to H
    home: Array  # joint angles of the home posture, shape (num_joints,), [rad]
    limits: JointLimits
    # Joint along which a nail slides; its position and rate come after the arm's in the plant's state.
    nail: Joint | None = None

    @property
    def num_joints(self) -> int:
        """Number of joints. Each has one degree of freedom and one actuator."""
        return len(self.home)

    @property
    def joint_names(self) -> list[str]:
        """Names of the joints, in the order of q."""
        return [self.plant.get_joint_actuator(index).joint().name() for index in self.plant.GetJointActuatorIndices()]

    def shrink_limits(self, margin: float, q_start: Array) -> JointLimits:
        """Narrows the position limits of all joints at both ends.

        Args:
            margin: Reduction at each end, [rad].
            q_start: Joint angles that always remain within the limits, (num_joints,), [rad].
        """
        return self.limits._replace(
            q_lower=np.minimum(q_start, self.limits.q_lower + margin),
            q_upper=np.maximum(q_start, self.limits.q_upper - margin),
        )

    def find_overloads(self, tau: Array) -> list[Overload]:
        """Lists the joints with torques tau, (num_joints,), [N m], above their effort limits, from base to hand."""
        found = zip(self.joint_names, np.abs(tau).tolist(), self.limits.tau_max.tolist(), strict=True)
        return [
            Overload(*each) for each, load in zip(found, self.limits.compute_loads(tau), strict=True) if load > 1.0
        ]

    def find_posture(self, angles: Mapping[str, float]) -> Array:
        """Returns the home posture, (num_joints,), [rad], with some joint angles replaced.

        Args:
            angles: New angles by joint name, [rad].

        Raises:
            AffordanceError: A joint is unknown, or an angle exceeds its limits.
        """
        q, names = np.array(self.home), self.joint_names
        for name, angle in angles.items():
            if name not in names:
                raise AffordanceError(describe_choice(name, names))
            index = names.index(name)
            low, high = self.limits.q_lower[index], self.limits.q_upper[index]
            if not low <= angle <= high:
                raise AffordanceError(f"sets {name} to {angle:g} rad, must be from {low:.7g} to {high:.7g} rad")
            q[index] = angle
        return q

    def set_posture(self, plant_context: Context, q: Array) -> None:
        """Sets the joint angles q, shape (num_joints,), [rad]. The nail and all velocities are unchanged."""
        positions = self.plant.GetPositions(plant_context)
        positions[: self.num_joints] = q
        self.plant.SetPositions(plant_context, positions)

    def set_payload(self, plant_context: Context, pi: Array) -> None:
        """Sets the tool's ten inertial parameters about To, expressed in T, shape (10,)."""
        self.tool.SetSpatialInertiaInBodyFrame(plant_context, spatial_inertia_from_parameters(pi))


def attach_body(plant: MultibodyPlant, hand: Frame, inertia: SpatialInertia, name: str = "tool") -> RigidBody:
    """Adds a body with spatial inertia M_TTo_T in a new model instance, and welds it to the hand."""
    body = plant.AddRigidBody(name, plant.AddModelInstance(name), inertia)
    plant.WeldFrames(hand, body.body_frame())
    return body
