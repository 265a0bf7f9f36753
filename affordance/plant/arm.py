"""Plant of an arm with the tool in its hand, and the same arm as an internal model.

Frames, here and everywhere: W the world, H the hand (where it grips, Hx pointing out of it), T the tool (coincides
with H while held), E a component of the tool, B any body, Bcm its centre of mass. Any serial arm can be used that a
directives file describes (see models/arm.dmd.yaml), with any number of joints.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, ContactModel, MultibodyPlant
from pydrake.multibody.tree import (
    Frame,
    Joint,
    RevoluteJoint,
    RigidBody,
    SpatialInertia,
)
from pydrake.systems.framework import Context, DiagramBuilder

from affordance.arrays import Array
from affordance.exceptions import AffordanceError, BadValueError, ModelFileError, describe_choice
from affordance.files.model_files import list_arm_files
from affordance.files.model_folder import MODELS
from affordance.files.yaml_reader import check_yaml
from affordance.objects.drake_geometry import make_drawn_shape
from affordance.objects.inertia import spatial_inertia_from_parameters
from affordance.objects.tool import Tool
from affordance.plant.clamp import Clamp
from affordance.plant.limits import JointLimits
from affordance.plant.nail import STICTION_TOLERANCE, NailPlacement, add_nail

ARM = MODELS / "arm.dmd.yaml"
HAND_FRAME = "hand_grip"


@dataclass(frozen=True)
class Arm:
    """Finalized plant of an arm that holds a tool, with the handles needed to use it.

    Attributes:
        source: File that describes the arm.
        plant: Continuous plant; its Context carries the tool's inertia as parameters.
        hand: Frame H of the hand.
        tool: Body T of the tool, welded to H.
        home: Joint angles of the holding posture, shape (num_joints,), [rad].
        limits: Joint limits.
        nail: Joint along which a nail slides, whose position and rate follow the arm's in the plant's state; None
            without a nail.
        clamp: Clamp for the hand; None without a clamp.
    """

    source: Path
    plant: MultibodyPlant
    hand: Frame
    tool: RigidBody
    home: Array
    limits: JointLimits
    nail: Joint | None = None
    clamp: Clamp | None = None

    @property
    def num_joints(self) -> int:
        """Number of the arm's joints, each with one degree of freedom and one actuator."""
        return len(self.home)

    @property
    def joint_names(self) -> list[str]:
        """Names of the joints, in the order of q."""
        return [self.plant.get_joint_actuator(index).joint().name() for index in self.plant.GetJointActuatorIndices()]

    def shrink_limits(self, margin: float, q_start: Array) -> JointLimits:
        """Returns the limits, angles narrowed by a margin, [rad], but not beyond the start, (num_joints,)."""
        return self.limits._replace(
            q_lower=np.minimum(q_start, self.limits.q_lower + margin),
            q_upper=np.maximum(q_start, self.limits.q_upper - margin),
        )

    def find_posture(self, angles: Mapping[str, float]) -> Array:
        """Returns the joint angles of a posture, shape (num_joints,), [rad].

        Args:
            angles: Angles by joint, [rad], of the joints that are not in the home posture.

        Raises:
            AffordanceError: There is no such joint, or its limits exclude the angle.
        """
        q, names = np.array(self.home), self.joint_names
        for name, angle in angles.items():
            if name not in names:
                raise AffordanceError(describe_choice(name, names))
            index = names.index(name)
            low, high = self.limits.q_lower[index], self.limits.q_upper[index]
            if not low <= angle <= high:
                raise AffordanceError(f"puts {name} at {angle:g} rad, must be from {low:.7g} to {high:.7g} rad")
            q[index] = angle
        return q

    def set_posture(self, plant_context: Context, q: Array) -> None:
        """Sets the joint angles q, shape (num_joints,), [rad], and leaves a nail and all rates unchanged."""
        positions = self.plant.GetPositions(plant_context)
        positions[: self.num_joints] = q
        self.plant.SetPositions(plant_context, positions)

    def set_payload(self, plant_context: Context, pi: Array) -> None:
        """Sets the tool's ten inertial parameters about To, expressed in T, shape (10,)."""
        self.tool.SetSpatialInertiaInBodyFrame(plant_context, spatial_inertia_from_parameters(pi))


def add_arm(
    builder: DiagramBuilder,
    directives: Path = ARM,
    tool: Tool | None = None,
    nail: NailPlacement | None = None,
    *,
    has_clamp: bool = False,
) -> Arm:
    """Adds an arm, with tool and nail if given, to a builder.

    Args:
        builder: Builder that receives the system ``plant`` and, where there are shapes, ``scene_graph``.
        directives: Drake model directives of the arm.
        tool: Tool that gives shapes and the default inertia; None for a payload without shape, initially massless.
        nail: Nail and its placement; None for no nail.
        has_clamp: True to add an open clamp for the hand.

    Raises:
        ModelFileError: The file cannot be loaded, or describes an unsuitable arm.
    """
    if tool is None and nail is None:
        plant = MultibodyPlant(0.0)
        builder.AddNamedSystem("plant", plant)
    else:
        plant, _ = AddMultibodyPlantSceneGraph(builder, 0.0)
    return _finish_plant(plant, directives, tool, nail, has_clamp=has_clamp)


def load_arm(directives: Path = ARM) -> Arm:
    """Loads an arm without geometry, for use as an internal model.

    The same instance is returned as long as the arm's files do not change: users must create Contexts of their own.

    Raises:
        ModelFileError: The file cannot be loaded, or describes an unsuitable arm.
    """
    stamps = [(file, file.stat()) for file in list_arm_files(directives)]
    return _load_arm(directives, tuple((file, stamp.st_mtime_ns, stamp.st_size) for file, stamp in stamps))


@lru_cache(maxsize=16)
def _load_arm(directives: Path, _: tuple[tuple[Path, int, int], ...]) -> Arm:
    """Loads an arm whose files have the given times and sizes."""
    return _finish_plant(MultibodyPlant(0.0), directives, tool=None, nail=None)


def parse_arm(plant: MultibodyPlant, directives: Path) -> Frame:
    """Adds the arm of a directives file to a plant.

    Returns: Frame H of the hand.

    Raises:
        ModelFileError: The file cannot be loaded or has no frame for the hand.
    """
    parser = Parser(plant)
    parser.SetStrictParsing()  # or a mass of nan would quietly become one of 1 kg
    package = directives.parent / "package.xml"
    try:
        if directives.suffix in (".yaml", ".yml"):
            check_yaml(directives)  # which Drake's reader does not bound
        if package.exists():
            parser.package_map().AddPackageXml(str(package))
        parser.AddModels(str(directives))
        return plant.GetFrameByName(HAND_FRAME)
    except BadValueError as error:
        raise ModelFileError(directives, error.problem) from error
    except RuntimeError as error:
        raise ModelFileError(directives, str(error)) from error


def attach_tool(plant: MultibodyPlant, hand: Frame, tool: Tool | None, name: str = "tool") -> RigidBody:
    """Welds a body to the hand, with the tool's inertia and, if the plant has geometry, its appearance."""
    inertia = SpatialInertia.Zero() if tool is None else spatial_inertia_from_parameters(tool.parameters)
    body = plant.AddRigidBody(name, plant.AddModelInstance(name), inertia)
    plant.WeldFrames(hand, body.body_frame())
    if tool is not None and plant.geometry_source_is_registered():
        for i, component in enumerate(tool.components):
            X_TE = RigidTransform(component.X_TE)
            drawn = make_drawn_shape(component.shape)
            colour = np.array([*component.looks_like.colour, 1.0])
            plant.RegisterVisualGeometry(body, X_TE, drawn, f"{name}_visual_{i}", colour)
    return body


def _finish_plant(
    plant: MultibodyPlant,
    directives: Path,
    tool: Tool | None,
    nail: NailPlacement | None,
    *,
    has_clamp: bool = False,
) -> Arm:
    hand = parse_arm(plant, directives)
    body = attach_tool(plant, hand, tool)
    clamp = Clamp(plant, hand) if has_clamp else None
    if nail is not None and nail.face is not None:
        nail.face.add_to(plant, body, "tool_face")
    # The nail is added last, so that the arm's joints come first in the plant's state.
    joint = None if nail is None else add_nail(plant, nail)
    plant.set_contact_model(ContactModel.kPoint)
    plant.Finalize()
    if nail is not None:
        plant.set_stiction_tolerance(STICTION_TOLERANCE)
    num_joints = plant.num_velocities() - (joint is not None)
    _check_fitness(plant, directives, num_joints)
    tau_max = np.array([plant.get_joint_actuator(index).effort_limit() for index in plant.GetJointActuatorIndices()])
    limits = JointLimits(
        plant.GetPositionLowerLimits()[:num_joints],
        plant.GetPositionUpperLimits()[:num_joints],
        plant.GetVelocityUpperLimits()[:num_joints],
        tau_max,
    )
    home = plant.GetPositions(plant.CreateDefaultContext())[:num_joints]
    for index, joint_of in enumerate(plant.GetJointActuatorIndices()):
        name = plant.get_joint_actuator(joint_of).joint().name()
        low, high = limits.q_lower[index], limits.q_upper[index]
        if not low <= home[index] <= high:
            problem = f"has {name} at {home[index]:g} rad in the home posture, must be from {low:g} to {high:g}"
            raise ModelFileError(directives, problem)
        if not limits.v_max[index] > 0.0:
            problem = f"has {name} with a velocity limit of {limits.v_max[index]:g} rad/s, must be more than 0"
            raise ModelFileError(directives, problem)
    for array in (home, *limits):
        array.setflags(write=False)
    return Arm(directives, plant, hand, body, home, limits, joint, clamp)


def _check_fitness(plant: MultibodyPlant, directives: Path, num_joints: int) -> None:
    """Rejects arms whose joints are not revolute, or do not have one actuator each."""
    moving = [plant.get_joint(index) for index in plant.GetJointIndices()]
    # The nail's joint comes last.
    joints = [joint for joint in moving if joint.num_velocities() and joint.velocity_start() < num_joints]
    for joint in joints:
        if joint.child_body().is_floating_base_body():
            problem = f"leaves {joint.child_body().name()} floating, must weld it to the world with add_weld"
            raise ModelFileError(directives, problem)
        if joint.type_name() != RevoluteJoint.kTypeName:
            problem = f"has {joint.name()} of type {joint.type_name()}, must be {RevoluteJoint.kTypeName}"
            raise ModelFileError(directives, problem)
    driven = [plant.get_joint_actuator(index).joint().name() for index in plant.GetJointActuatorIndices()]
    names = [joint.name() for joint in joints]
    idle = [name for name in names if name not in driven]
    if idle:
        problem = f"has no actuator for {', '.join(idle)}; in a URDF Drake makes one of every <transmission>"
        raise ModelFileError(directives, f"{problem}, in an SDF of every joint with an effort limit other than 0")
    if not names or len(driven) > len(names):
        raise ModelFileError(
            directives, f"has {len(names)} joints and {len(driven)} actuators, must have one for each"
        )
    if not np.allclose(plant.MakeActuationMatrix()[:num_joints], np.eye(num_joints)):
        raise ModelFileError(directives, "must list its actuators in the order of its joints")
