"""Loads an arm from its directives file, optionally with a tool in its hand and a nail."""

from functools import lru_cache
from pathlib import Path

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, ContactModel, MultibodyPlant
from pydrake.multibody.tree import Frame, RevoluteJoint, RigidBody, SpatialInertia
from pydrake.systems.framework import DiagramBuilder

from affordance.exceptions import BadValueError, ModelFileError
from affordance.files.bounded import check_yaml
from affordance.files.model_files import list_arm_files
from affordance.objects.drake_geometry import make_drawn_shape
from affordance.objects.inertia import spatial_inertia_from_parameters
from affordance.objects.tool import Tool
from affordance.plant.arm import ARM, Arm, JointLimits, attach_body
from affordance.plant.nail import STICTION_TOLERANCE, NailPlacement, add_nail

HAND_FRAME = "hand_grip"


def add_arm(
    builder: DiagramBuilder,
    directives: Path = ARM,
    tool: Tool | None = None,
    nail: NailPlacement | None = None,
) -> Arm:
    """Adds an arm to a builder as ``plant``, with a ``scene_graph`` if there is a tool or a nail.

    Args:
        builder: Builder of the Diagram.
        directives: Directives file of the arm.
        tool: Tool in the hand, with shapes and its default inertia; None for a payload without shape or mass.
        nail: Nail to be struck, if any.

    Raises:
        ModelFileError: The arm cannot be used.
    """
    if tool is None and nail is None:
        plant = MultibodyPlant(0.0)
        builder.AddNamedSystem("plant", plant)
    else:
        plant, _ = AddMultibodyPlantSceneGraph(builder, 0.0)
    return _finish_plant(plant, directives, tool, nail)


def load_arm(directives: Path = ARM) -> Arm:
    """Loads an arm without geometry, for internal models.

    The arm is cached as long as its files do not change, so each user must create its own Context.

    Raises:
        ModelFileError: The arm cannot be used.
    """
    stamps = [(file, file.stat()) for file in list_arm_files(directives)]
    return _load_arm(directives, tuple((file, stamp.st_mtime_ns, stamp.st_size) for file, stamp in stamps))


@lru_cache(maxsize=16)
def _load_arm(directives: Path, _: tuple[tuple[Path, int, int], ...]) -> Arm:
    """Loads an arm. The second argument makes the cache depend on the times and sizes of the files."""
    return _finish_plant(MultibodyPlant(0.0), directives, tool=None, nail=None)


def parse_arm(plant: MultibodyPlant, directives: Path) -> Frame:
    """Adds the arm of a directives file to a plant, and returns its hand frame H.

    Raises:
        ModelFileError: The file cannot be loaded, or has no hand frame.
    """
    parser = Parser(plant)
    parser.SetStrictParsing()  # otherwise Drake silently replaces a mass of nan with 1 kg
    package = directives.parent / "package.xml"
    try:
        if directives.suffix in (".yaml", ".yml"):
            check_yaml(directives)  # limits the file's size, because Drake's reader does not
        if package.exists():
            parser.package_map().AddPackageXml(str(package.resolve()))
        parser.AddModels(str(directives))
        return plant.GetFrameByName(HAND_FRAME)
    except BadValueError as error:
        raise ModelFileError(directives, error.problem) from error
    except RuntimeError as error:
        raise ModelFileError(directives, str(error)) from error


def attach_tool(plant: MultibodyPlant, hand: Frame, tool: Tool | None, name: str = "tool") -> RigidBody:
    """Welds a tool to the hand, with its inertia and, if the plant has geometry, its shapes."""
    inertia = SpatialInertia.Zero() if tool is None else spatial_inertia_from_parameters(tool.parameters)
    body = attach_body(plant, hand, inertia, name)
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
) -> Arm:
    hand = parse_arm(plant, directives)
    body = attach_tool(plant, hand, tool)
    if nail is not None and nail.face is not None:
        nail.face.add_to(plant, body, "tool_face")
    # The nail is added last so that the arm's joints come first in the plant's state.
    joint = None if nail is None else add_nail(plant, nail)
    plant.set_contact_model(ContactModel.kPoint)
    plant.Finalize()
    if nail is not None:
        plant.set_stiction_tolerance(STICTION_TOLERANCE)
    num_joints = plant.num_velocities() - (joint is not None)
    _check_fitness(plant, directives, num_joints)
    actuators = [plant.get_joint_actuator(index) for index in plant.GetJointActuatorIndices()]
    limits = JointLimits(
        plant.GetPositionLowerLimits()[:num_joints],
        plant.GetPositionUpperLimits()[:num_joints],
        plant.GetVelocityUpperLimits()[:num_joints],
        np.array([actuator.effort_limit() for actuator in actuators]),
    )
    home = plant.GetPositions(plant.CreateDefaultContext())[:num_joints]
    for actuator, angle, low, high, v_max in zip(actuators, home, *limits[:3], strict=True):
        name = actuator.joint().name()
        if not low <= angle <= high:
            problem = f"has {name} at {angle:g} rad in the home posture, must be from {low:g} to {high:g}"
            raise ModelFileError(directives, problem)
        if not v_max > 0.0:
            problem = f"has {name} with a velocity limit of {v_max:g} rad/s, must be more than 0"
            raise ModelFileError(directives, problem)
    for array in (home, *limits):
        array.setflags(write=False)
    return Arm(directives, plant, hand, body, home, limits, joint)


def _check_fitness(plant: MultibodyPlant, directives: Path, num_joints: int) -> None:
    """Checks that all joints are revolute and have one actuator each.

    Raises:
        ModelFileError: The arm does not meet these conditions.
    """
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
        problem = f"has no actuator for {', '.join(idle)}; in a URDF Drake creates one for each <transmission>"
        raise ModelFileError(directives, f"{problem}, in an SDF for each joint with an effort limit other than 0")
    if not names or len(driven) > len(names):
        raise ModelFileError(
            directives, f"has {len(names)} joints and {len(driven)} actuators, must have one for each"
        )
    if not np.allclose(plant.MakeActuationMatrix()[:num_joints], np.eye(num_joints)):
        raise ModelFileError(directives, "must list its actuators in the order of its joints")
